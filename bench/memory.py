"""Does a rig's memory stay honest, and does it see a hinge that moved? On the pairs of `bench.several`.

One session teaches, another one of the same rig recalls: once in another pose, once in the same pose with
another body. A hinge that moved: the memory is given one hinge at the ceiling 2 mm beside where the first
session has it, to a side that is drawn; that is as if it had moved in between. What ten sessions would teach
is told to first order: the same recordings ten times, as far as the covariance goes.

    python -m bench.several --pairs 60
    python -m bench.memory
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.several import FIRST, OTHER, SECOND, percent, result_of, share
from rig_identification.result import ELEMENTS
from rig_identification.several.compare import LEVEL
from rig_identification.several.memory import Memory, learned, recalled
from rig_identification.several.ties import Sharing

HERE = Path(__file__).parent
MOVED = 0.002  # m
SESSIONS = 10
RIG = Sharing(rigs=("rig",))
#: So rare that nothing is said to have moved.
NEVER = 1e-12


def with_hinge_beside(memory: Memory, cable: str, side: np.ndarray) -> Memory:
    """The memory with a hinge at the ceiling elsewhere. side: (3,) m."""
    off = {f"{cable}.ceiling_point.{a}": s for a, s in zip("xyz", side, strict=True)}
    doubts = tuple(replace(d, at=d.at - off.get(d.name, 0.0) / d.prior_std) for d in memory.doubts)
    return replace(memory, doubts=doubts)


def score(entries: list[dict[str, Any]], teacher: str, pupil: str) -> dict[str, Any]:
    """How honest and how narrow, and how often something is said to have moved."""
    rng = np.random.default_rng(53)
    error, one, ten, alarms, found, named = [], [], [], [], [], []
    for entry in entries:
        first, second = (result_of(n, entry["sessions"][n]) for n in (teacher, pupil))
        alone = np.sqrt(np.diag(second.estimate.covariance))
        memory = learned([first], RIG)
        total = recalled(second, memory, RIG)
        std = np.sqrt(np.diag(total.covariance))
        error.append((total.values - np.array(entry["sessions"][pupil]["truth"])) / std)
        one.append(std / alone)
        many = learned([first] * SESSIONS, Sharing(rigs=("rig",) * SESSIONS), NEVER)
        ten.append(np.sqrt(np.diag(recalled(second, many, RIG).covariance)) / alone)
        both = learned([second], RIG, before=memory).moved
        alarms += [float(any(m.session == n for m in both)) for n in (teacher, pupil)]
        side = rng.standard_normal(3)
        cable = f"cable_{rng.integers(1, 4)}"
        beside = with_hinge_beside(memory, cable, MOVED * side / np.linalg.norm(side))
        parts = [m.part for m in learned([second], RIG, before=beside).moved if m.session == pupil]
        found.append(float(bool(parts)))
        named.append(float(any(part.startswith(cable + ".") for part in parts)))
    z = np.array(error)
    return {
        "coverage": share(np.abs(z) <= 1.959964),
        "rms_error_in_std": float(np.sqrt(np.mean(z**2))),
        "std_over_alone": {n: float(np.median(np.array(one)[:, k])) for k, n in enumerate(ELEMENTS)},
        "std_over_alone_after_ten": {
            n: float(np.median(np.array(ten)[:, k])) for k, n in enumerate(ELEMENTS)
        },
        "false_alarms": share(np.array(alarms)),
        "moved_found": share(np.array(found)),
        "moved_cable_named": share(np.array(named)),
    }


def as_markdown(told: dict[str, Any]) -> str:
    """The figures as a page."""
    poses = [told["another_pose"], told["same_pose"]]
    rows = (
        ("95 % intervals of recalled sessions that hold", "coverage"),
        (f"an alarm and nothing moved, level {100 * LEVEL:g} %", "false_alarms"),
        (f"a hinge at the ceiling moved by {1e3 * MOVED:g} mm: an alarm", "moved_found"),
        ("... that names a part of that cable", "moved_cable_named"),
    )
    lines = [
        "# Rig memory",
        "",
        f"Made by `python -m bench.memory` of the {told['pairs']} pairs of [several sessions](several.md).",
        "One session teaches, another one of the same rig recalls. In brackets: 95 % interval of a share.",
        "",
        "| what | another pose, same body | same pose, another body |",
        "| --- | --- | --- |",
        *(f"| {what} | " + " | ".join(percent(pose[key]) for pose in poses) + " |" for what, key in rows),
        "| error, rms in its std | " + " | ".join(f"{pose['rms_error_in_std']:.2f}" for pose in poses) + " |",
        "",
        "Std over that of the session alone, median. After ten sessions: to first order, without new noise.",
        "",
        "| | " + " | ".join(ELEMENTS) + " |",
        "| --- |" + " --- |" * len(ELEMENTS),
    ]
    for pose, name in zip(poses, ("another pose", "same pose"), strict=True):
        for count, key in (("one", "std_over_alone"), ("ten", "std_over_alone_after_ten")):
            ratios = " | ".join(f"{pose[key][n]:.2f}" for n in ELEMENTS)
            lines.append(f"| {name}, after {count} | {ratios} |")
    return "\n".join([*lines, "", f"Fingerprint of the code: {told['code']}", ""])


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: read the pairs, write the figures."""
    parser = argparse.ArgumentParser(prog="python -m bench.memory", description=__doc__.partition("\n")[0])
    parser.add_argument("--log", type=Path, default=HERE / "several.jsonl", help="pairs of bench.several")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of memory.json and memory.md")
    options = parser.parse_args(arguments)
    entries = [json.loads(line) for line in options.log.read_text().splitlines()]
    entries.sort(key=lambda e: e["pair"])
    told = {
        "pairs": len(entries),
        "code": entries[0]["code"],
        "another_pose": score(entries, FIRST, SECOND),
        "same_pose": score(entries, SECOND, OTHER),
    }
    (options.out / "memory.json").write_text(json.dumps(told, indent=1) + "\n")
    (options.out / "memory.md").write_text(as_markdown(told))
    print(as_markdown(told))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
