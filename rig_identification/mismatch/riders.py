"""Masses that ride on the body: liquid in a tank, a part on springs. What is loose: see loose.py.

Which frequency and direction a rider has is scanned to first order in its mass: a massless
passenger's travel follows from the fitted motion alone, and the wrench by which a kilogram of it
would differ from a kilogram fixed to the body is linear in its mass m and in m times its place.
    q'' + 2 zeta w q' + w^2 q = -d . (f_a + g_rest),   f_a: specific force at the place
    F = -m d q'',   M = m a x (-d q'') - m (d q) x f
(effects/internal.py, for small q and slow turning.) A part that is no point turns on its springs as well: of
its own inertia I about a body axis e
    theta'' + 2 zeta w theta' + w^2 theta = -e . alpha,   M = -I e theta''
(effects/turning.py, to first order), linear in I.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import AXES, Parameter
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.stretching import STIFFNESS
from rig_identification.mismatch.candidate import LIGHT, Candidate, Told
from rig_identification.mismatch.supports import cable_elasticity, ceiling_candidate, yielding_like
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import RigModel
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Frequencies (Hz) at which a rider is looked for, and the damping ratio it is looked for with. Its resonance
#: is 2 DAMPING of its frequency wide; none lies farther than half of that from one of these. At twice the
#: spacing a liquid that hardly loses any swing promised a quarter of what it promises at its own frequency.
DAMPING = 0.03
FREQUENCIES = tuple(float(f) for f in np.geomspace(0.3, 9.0, 71))
#: Directions of a part on springs, and of a liquid's surface: it swings to all sides.
DIRECTIONS = {"x": ("x",), "y": ("y",), "z": ("z",), "xy": ("x", "y")}


@dataclass(frozen=True)
class Swing:
    """One scanned rider."""

    directions: str  # key of DIRECTIONS, or several axes of which each has its own frequency
    frequency: float  # Hz, the lowest
    along: tuple[float, ...] = ()  # Hz, of each axis where they differ
    turning: tuple[tuple[str, float], ...] = ()  # axes that it turns about as well, and Hz about each
    tilted: bool = False  # whether its one line lies between axes

    @property
    def effect(self) -> str:
        """Word of the recording contract."""
        return "liquid_slosh" if self.directions == "xy" and not self.along else "sprung_mass"


#: Swings that are tried; neighbours tell much the same, and count once.
SWINGS = tuple(Swing(d, f) for d in DIRECTIONS for f in FREQUENCIES[::2])
#: Numbers of a rider: mass, place, frequency, damping; of each axis that it turns about: inertia, frequency.
NUMBERS, TURNING_NUMBERS = 6, 2
#: Std of a rider's mass in parts of the body's.
MASS_STD = 0.05
#: Radius of gyration of a part in parts of the longest distance between two hinges, as that of a body in
#: search/levels.py; std of its inertia's logarithm: three of them reach from a motor to all of a car but its
#: frame; and of a product of inertia in parts of the usual moment.
GYRATION, INERTIA_STD, PRODUCT_STD = 0.3, 1.5, 1.0


def middle_of(rig: Rig) -> Array:
    """(3,) m: where a rider is looked for, about the middle of a body that hangs below its hinges."""
    size = extent(rig)
    points = np.array([c.body_point for c in rig.cables])
    return np.asarray(np.mean(points, axis=0) - [0.0, 0.0, 0.35 * size[2] + 0.15 * float(np.max(size))])


def filters(frequency: float, step: float, damping: float = DAMPING) -> tuple[Array, Array]:
    """Discrete filter from specific force along d to the travel q, its input linear between nodes."""
    omega = 2.0 * np.pi * frequency
    system = ([-1.0], [1.0, 2.0 * damping * omega, omega**2])
    numerator, denominator, _ = cont2discrete(system, step, method="foh")
    return np.atleast_2d(numerator)[0], np.asarray(denominator)


def pieces_of(problem: Problem) -> dict[str, list[int]]:
    """Runs of a problem by recording, in order of time."""
    groups: dict[str, list[int]] = {}
    for i, run in enumerate(problem.runs):
        groups.setdefault(run.recording.name, []).append(i)
    return {name: sorted(which, key=lambda i: problem.runs[i].offset) for name, which in groups.items()}


def _ringing_like(
    problem: Problem, swing: Swing, mass: float
) -> tuple[tuple[Candidate, dict[str, float]], ...]:
    """What rings with the body at the frequency of a part on springs, and where its fit starts.

    A light ceiling has a compliance c = 1/(m w^2) under the body's mass m; n cables of length L that bounce
    so have E A = L/(n c). mass: kg, of the body.
    """
    rig, model = problem.bench.rig, problem.bench.parameters.model
    ceiling = ceiling_candidate(rig, model, mass, AXES.index(swing.directions))
    compliance = 1.0 / (mass * (2.0 * np.pi * swing.frequency) ** 2)
    sinking = (ceiling, {f"ceiling.compliance.{swing.directions}": compliance})
    if swing.directions != "z":
        return (sinking,)
    stretching = cable_elasticity(rig, model, mass)
    return sinking, (stretching, {STIFFNESS: yielding_like(rig, model, compliance)})


def tilt(effect: str, axis: str, first: int) -> tuple[Parameter, ...]:
    """How far the line of a part that moves along ``axis`` leans towards the other two, in parts of that.

    first: entry of the rider's block. Its travel is along (1, u, v), whose length L = (1 + u^2 + v^2)^1/2 is
    not one: of a travel q it goes L q, so that it swings at 1/L of its frequency's number, damped by L times
    its damping's (:func:`_along_line`).
    """
    return tuple(
        Parameter(f"{effect}.direction.{a}", "1", 0.0, 1.0, "physics", first + layout.AXIS + i, bounded=False)
        for i, a in enumerate(AXES)
        if a != axis
    )


def lean(*parts: float) -> float:
    """Length of a line's direction that leans by ``parts``, as :func:`tilt` has them."""
    return math.hypot(1.0, *parts)


def _along_line(found: Estimates, effect: str, axis: str) -> Told:
    """Frequency, damping and direction of a part whose line leans."""
    others = [a for a in AXES if a != axis]
    names = [f"{effect}.direction.{a}" for a in others]

    def told(of: Callable[..., float], unit: str, *number: str) -> tuple[float, float, str]:
        """What follows from a number of the part, if any is named, and from how its line leans."""
        return *found.following(of, *(f"{effect}.{n}" for n in number), *names), unit

    out: Told = {
        "frequency": told(lambda f, u, v: f / lean(u, v), "Hz", "frequency"),
        "damping_ratio": told(lambda z, u, v: z * lean(u, v), "1", "damping_ratio"),
        f"direction_{axis}": told(lambda u, v: 1.0 / lean(u, v), "1"),
    }
    for k, a in enumerate(others):
        out[f"direction_{a}"] = told(lambda u, v, k=k: (u, v)[k] / lean(u, v), "1")
    return out


def _turning(
    effect: str, swing: Swing, mass: float, size: float, first: int
) -> tuple[Array, tuple[Parameter, ...]]:
    """Blocks of the axes that a rider turns about, behind those of its directions, and their parameters.

    mass: kg, size: m, of the body. first: entry of the rider's first block.
    """
    turning = [(AXES.index(a), f) for a, f in swing.turning]
    blocks, parameters = np.zeros((len(turning), layout.INTERNAL_SIZE)), []
    usual = MASS_STD * mass * (GYRATION * size) ** 2
    for row, (i, frequency) in enumerate(turning):
        block, a = blocks[row], AXES[i]
        block[layout.KIND], block[layout.AXIS + i] = layout.TURNING, 1.0
        block[layout.INERTIA + i], block[layout.FREQUENCY] = usual, frequency
        block[layout.DAMPING_RATIO] = DAMPING
        o = first + layout.INTERNAL_SIZE * (len(swing.directions) + row)
        numbers = [
            (f"inertia.{a}", "kg m^2", usual, INERTIA_STD, layout.INERTIA + i, True),
            (f"turning_frequency.{a}", "Hz", frequency, 0.3, layout.FREQUENCY, True),
            (f"turning_damping_ratio.{a}", "1", DAMPING, 1.0, layout.DAMPING_RATIO, True),
        ]
        numbers += [
            (f"inertia.{AXES[k]}{a}", "kg m^2", 0.0, PRODUCT_STD * usual, layout.INERTIA + k, False)
            for k, _ in turning[:row]
        ]
        parameters += [
            Parameter(
                f"{effect}.{name}", unit, nominal, std, "physics", o + entry, bounded=False, ratio=ratio
            )
            for name, unit, nominal, std, entry, ratio in numbers
        ]
    return blocks, tuple(parameters)


def rider_candidate(
    problem: Problem, swing: Swing, mass: float, found: float, at: Array
) -> tuple[Candidate, dict[str, float]]:
    """The hypothesis of a rider, and where its fit starts.

    mass: kg, of the body. found: kg, at (3,) m: what screening made of the rider.
    """
    size = float(np.max(extent(problem.bench.rig)))
    effect, liquid = swing.effect, swing.effect == "liquid_slosh"
    axes = tuple(swing.directions)
    middle = middle_of(problem.bench.rig)

    frequencies = {"frequency": swing.frequency}
    if swing.along:
        frequencies = {f"frequency.{a}": f for a, f in zip(axes, swing.along, strict=True)}

    def build(model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        turns, its_own = _turning(
            effect, swing, mass, size, place.internal_block(model.cables, model.internal)
        )
        blocks = np.zeros((len(axes), layout.INTERNAL_SIZE))
        for row, axis in enumerate(axes):
            blocks[row, layout.AXIS + AXES.index(axis)] = 1.0
        blocks[0, layout.POINT : layout.POINT + 3] = middle
        blocks[0, layout.FREQUENCY], blocks[0, layout.DAMPING_RATIO] = swing.frequency, DAMPING
        blocks[0, layout.PENDULUM] = float(liquid)
        blocks[: len(swing.along), layout.FREQUENCY] = swing.along
        o = place.internal_block(model.cables, model.internal)

        def number(name: str, unit: str, nominal: float, std: float, entry: int, ratio: bool) -> Parameter:
            return Parameter(
                f"{effect}.{name}", unit, nominal, std, "physics", o + entry, bounded=False, ratio=ratio
            )

        parameters = (
            number("mass", "kg", 0.0, MASS_STD * mass, layout.MASS, False),
            *(
                number(f"position.{a}", "m", float(middle[i]), 0.5 * size, layout.POINT + i, False)
                for i, a in enumerate(AXES)
            ),
            *(
                number(name, "Hz", nominal, 0.3, layout.INTERNAL_SIZE * k + layout.FREQUENCY, True)
                for k, (name, nominal) in enumerate(frequencies.items())
            ),
            number("damping_ratio", "1", DAMPING, 1.0, layout.DAMPING_RATIO, True),
            *(tilt(effect, axes[0], o) if swing.tilted else ()),
        )
        return model.with_internal(np.concatenate([blocks, turns])), parameters + its_own

    def told(found: Estimates) -> Told:
        out: Told = {"mass": (*found.of(f"{effect}.mass"), "kg")}
        swings = {name.replace(".", "_"): (*found.of(f"{effect}.{name}"), "Hz") for name in frequencies}
        if swing.along:
            out["frequency"] = min(swings.values())
        out |= swings | {"damping_ratio": (*found.of(f"{effect}.damping_ratio"), "1")}
        if swing.tilted:
            out |= _along_line(found, effect, axes[0])
        for a, _ in swing.turning:
            out[f"inertia_{a}"] = (*found.of(f"{effect}.inertia.{a}"), "kg m^2")
            out[f"turning_frequency_{a}"] = (*found.of(f"{effect}.turning_frequency.{a}"), "Hz")
        return out | {f"position_{a}": (*found.of(f"{effect}.position.{a}"), "m") for a in AXES}

    ways = f"a line near {axes[0]}" if swing.tilted else ", ".join(axes)
    if swing.turning:
        ways += f" and turns about {', '.join(a for a, _ in swing.turning)}"
    thing, advice = {
        "liquid_slosh": (
            "A liquid swings in a tank:",
            "Fill the tank to the brim or empty it.",
        ),
        "sprung_mass": (
            f"A part moves on springs along {ways}:",
            "Block the springs or take the part off.",
        ),
    }[effect]
    candidate = Candidate(
        effect,
        build(problem.bench.parameters.model)[1],
        f"{thing} {{value}} of it.",
        advice,
        {"channel": None, "axis": swing.directions if len(axes) == 1 and not swing.tilted else None},
        positive=1,
        tell=told,
        build=build,
        ordinary={f"{effect}.mass": LIGHT * mass},
        twins=() if len(axes) > 1 or swing.turning or swing.tilted else _ringing_like(problem, swing, mass),
    )
    values = {f"{effect}.mass": found}
    values |= {f"{effect}.position.{a}": float(at[i]) for i, a in enumerate(AXES)}
    return candidate, values
