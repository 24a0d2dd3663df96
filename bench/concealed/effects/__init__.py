"""Effects, one a file: :data:`CATALOGUE` holds the contract's table, :data:`OUTSIDE` what is not in it."""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np

from bench.concealed.effects.base import Effect
from bench.concealed.scene import Scene

CLEAN_SHARE, PAIR_SHARE, OUTSIDE_SHARE = 1 / 3, 0.1, 0.15


def _collect() -> dict[str, type[Effect]]:
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return {e.name: e for e in sorted(Effect.__subclasses__(), key=lambda e: e.name) if not e.form}


_ALL = _collect()
CATALOGUE = {name: effect for name, effect in _ALL.items() if not effect.outside}
#: What the second engine has.
SECOND = frozenset(name for name, effect in _ALL.items() if effect.in_second())
OUTSIDE = {name: effect for name, effect in _ALL.items() if effect.outside}


def choose(rng: np.random.Generator, kind: str) -> list[type[Effect]]:
    """The effects that ``kind`` asks for.

    ``kind``: "clean", "single", "pair", "outside", "random", an effect's name, or several joined by "+".
    """
    names = _names(rng, kind)
    unknown = [n for n in names if n not in _ALL]
    if unknown:
        raise ValueError(f"no effect {unknown[0]!r}: choose from {', '.join(_ALL)}")
    return [_ALL[n] for n in names]


def draw_effects(
    rng: np.random.Generator,
    chosen: list[type[Effect]],
    scene: Scene,
    size: float | None,
    labs: bool = False,
) -> list[Effect]:
    """The chosen effects, of random place and, if ``size`` is None, of random size.

    ``labs``: sizes and forms as labs have them.
    """
    sizes = [float(rng.uniform()) if size is None else size for _ in chosen]
    return [(e.draw_lab if labs else e.draw)(rng, scene, s) for e, s in zip(chosen, sizes, strict=True)]


def _names(rng: np.random.Generator, kind: str) -> list[str]:
    if kind == "random":
        shares = [CLEAN_SHARE, PAIR_SHARE, OUTSIDE_SHARE]
        kind = str(rng.choice(["clean", "pair", "outside", "single"], p=[*shares, 1.0 - sum(shares)]))
    if kind == "clean":
        return []
    if kind == "single":
        return [str(rng.choice(list(CATALOGUE)))]
    if kind == "outside":
        return [str(rng.choice(list(OUTSIDE)))]
    if kind == "pair":
        return draw_pair(rng)
    return kind.split("+")


def draw_pair(rng: np.random.Generator) -> list[str]:
    """Two of the table that can be in one mechanism."""
    while True:
        pair = [str(n) for n in rng.choice(list(CATALOGUE), 2, replace=False)]
        if sum(CATALOGUE[n].own_cables for n in pair) < 2 and "cable_slack" not in pair:
            return pair
