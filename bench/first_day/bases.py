"""The clean sessions that faults are put into: three kinds of rig."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from bench.concealed.draw import CASES, draw_scene
from bench.first_day.sessions import DURATION, FIRST_SEED, Kept, kept, make, rig_kind

#: Four splayed cables with an inclinometer; three cables; a few kilograms under motion capture.
FAMILIES = ("four", "three", "small")


def family(seed: int) -> str:
    """Which of the families a seed's clean session belongs to."""
    if rig_kind(seed) == "small":
        return "small"
    return "four" if draw_scene(seed, DURATION).geometry_name in CASES else "three"


def bases(cache: Path, sets: int = 1) -> list[tuple[str, Kept]]:
    """Label and session, ``sets`` of each family, made where the cache lacks them."""
    found: dict[str, list[Kept]] = {name: [] for name in FAMILIES}
    for seed in count(FIRST_SEED):
        wanted = found[family(seed)]
        if len(wanted) < sets:
            make(cache, seed, ("clean",))
            one = kept(cache, "clean", seed)
            if one is not None:
                wanted.append(one)
        if all(len(ones) == sets for ones in found.values()):
            break
    return [(f"{name}_{one.name}", one) for name in FAMILIES for one in found[name]]
