"""Effects of a lab's own: one file each, outside of this package, and treated like any other effect.

A file in the folder that ``--effects DIR`` or the environment variable ``RIG_IDENTIFICATION_EFFECTS``
names defines ``EFFECT``, an :class:`OwnEffect`: a wrench that depends on where the body is, how it is
turned and how it moves, its numbers with what is believed of them, and what a person is told. It is
simulated, searched, fitted and told. docs/how-to/own-effect.md shows one.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from rig_identification.errors import InputError
from rig_identification.rig import Rig

VARIABLE = "RIG_IDENTIFICATION_EFFECTS"
#: Effects that are used at once, and numbers that each may have.
MOST_EFFECTS, MOST_NUMBERS = 3, 8


@dataclass(frozen=True)
class Number:
    """One number of an effect, zero where the effect is not there."""

    name: str  # in result.json, and behind a dot in ``simulate --effect NAME.number=value``
    unit: str
    #: Std of what is believed of it, in its unit: what such rigs can plausibly show. A function of the
    #: rig's description and the body's mass (kg) where it depends on them.
    std: float | Callable[[Rig, float], float]
    nominal: float = 0.0  # where a fit starts; of an amount 0: without the effect

    def believed(self, rig: Rig, mass: float) -> float:
        """Its std for a rig and a body of ``mass`` kg."""
        return float(self.std(rig, mass) if callable(self.std) else self.std)


@dataclass(frozen=True)
class OwnEffect:
    """A wrench on the body, and what to say of it.

    ``wrench(q, x, R, out)`` adds to ``out`` (6,) force (N) and moment (N m) about the body's datum, in
    body axes. ``q`` holds the numbers in their order. ``x`` (12,) holds the datum's place in the world (m),
    three entries that are not to be used, its velocity in the world (m/s) and the body's angular rate in
    body axes (rad/s). ``R`` (3, 3) turns body axes into the world's. numba compiles it for real and for
    complex numbers, whose imaginary parts carry derivatives: write it without ``abs``, and compare
    ``.real`` parts only.
    """

    name: str  # a word of its own
    numbers: tuple[Number, ...]  # first the amount; it cannot be negative
    wrench: Callable[..., None]
    sentence: str  # with {value}: the amount with its interval and unit
    advice: str  # what to do about it
    experiment: str = ""  # what would tell it from its rivals


def own_effects() -> tuple[OwnEffect, ...]:
    """Effects of the folder that is named, none where none is. Raises InputError where a file is none."""
    return _effects_in(os.environ.get(VARIABLE, ""))


@lru_cache(maxsize=8)
def _effects_in(folder: str) -> tuple[OwnEffect, ...]:
    if not folder:
        return ()
    path = Path(folder)
    if not path.is_dir():
        raise InputError(f"{folder}: is no folder; --effects takes a folder with one Python file an effect")
    found = tuple(_effect(file) for file in sorted(path.glob("*.py")))
    if len(found) > MOST_EFFECTS:
        raise InputError(f"{folder}: holds {len(found)} effects; at most {MOST_EFFECTS} can be used at once")
    return found


def _effect(file: Path) -> OwnEffect:
    spec = importlib.util.spec_from_file_location(f"own_effect_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"{file}: cannot be read: {type(error).__name__}: {error}") from error
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, OwnEffect):
        raise InputError(f"{file}: defines no EFFECT; set it to a rig_identification.own.OwnEffect")
    if not 1 <= len(effect.numbers) <= MOST_NUMBERS:
        raise InputError(
            f"{file}: {effect.name} has {len(effect.numbers)} numbers; 1 to {MOST_NUMBERS} can be"
        )
    return effect
