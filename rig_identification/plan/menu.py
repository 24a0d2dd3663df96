"""What may be recorded: releases, shakes at several frequencies in several planes, sweeps, known masses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig_identification.model.modes import natural_modes
from rig_identification.model.motion import rig_model
from rig_identification.plan.means import SHAKER, Means
from rig_identification.recording import Dummy
from rig_identification.rig import Rig
from rig_identification.simulate import AtRest, Multisine, Pulled, RunSpec, StaticSpec, UnbalancedMass
from rig_identification.simulate.start import rest_state

Array = NDArray[np.float64]

#: Headings of pulls aside, degrees from body x, and how far off the centre of mass each acts, in parts of the
#: hinges' extent: pulls off the centre turn the body as well.
PULLS = ((0.0, 0.0, 0.3), (90.0, 0.3, 0.0), (45.0, 0.3, -0.3), (0.0, 0.0, 0.5), (135.0, -0.3, -0.3))
#: s in which a motor comes to its speed.
RAMP = 3.0
#: Shakes stay by this factor away from a natural frequency, where an undamped model has no bound.
BESIDE = 1.25
#: Mass of a known mass, as a share of the body's (the thesis' dummies), and its places between the hinges.
DUMMY, PLACES = 0.04, ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.3, 0.3))


@dataclass(frozen=True)
class Item:
    """One thing to record: a run of one block, or a recording at rest."""

    name: str
    text: str  # what to do, for a person
    run: RunSpec | None = None
    static: StaticSpec | None = None

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return self.run.duration if self.run is not None else self.static.duration if self.static else 0.0

    def lasting(self, blocks: int) -> Item:
        """The same run, so many blocks long; a sweep becomes as much slower."""
        if self.run is None:
            return self
        force, duration = self.run.force, blocks * self.run.duration
        if isinstance(force, UnbalancedMass) and force.ramp >= self.run.duration:
            force = replace(force, ramp=duration)
        return replace(self, run=replace(self.run, duration=duration, force=force))


def menu(rig: Rig, elements: Array, means: Means) -> tuple[Item, ...]:
    """Everything that may be recorded, as strong as the means allow at most; limits.py weakens it."""
    runs = (*_releases(rig, elements, means), *_shakes(rig, elements, means))
    return (bare(means), *runs, *_known_masses(rig, elements, means))


def bare(means: Means) -> Item:
    """The body at rest, with nothing on it."""
    static = StaticSpec("static_bare", means.rest)
    return Item("static_bare", f"at rest, {means.rest:g} s", static=static)


def _releases(rig: Rig, elements: Array, means: Means) -> Iterator[Item]:
    weight = float(elements[0]) * rig.gravity
    extent = np.ptp(np.array([cable.body_point for cable in rig.cables]), axis=0)
    for i, (degrees, along_x, along_y) in enumerate(PULLS, start=1):
        heading = np.radians(degrees)
        force = means.pull * weight * np.array([np.cos(heading), np.sin(heading), 0.0])
        aside = np.array([along_x, along_y, 0.0]) * extent
        place = ", ".join(f"{v:.2f}" for v in elements[1:4] + aside)
        text = f"pull aside at ({place}) m, {degrees:g}° from body x towards y, and let go"
        name = f"release_{i}"
        yield Item(name, text, RunSpec(name, means.block, Pulled(force, elements[1:4] + aside)))


def _shakes(rig: Rig, elements: Array, means: Means) -> Iterator[Item]:
    if rig.exciter is None:
        return
    force = means.force * float(elements[0]) * rig.gravity
    for plane in ("xy", "xz", "yz"):
        for frequency in frequencies(rig, elements, means):
            motor = UnbalancedMass(force / (2.0 * np.pi * frequency) ** 2, frequency, plane, RAMP)
            name = f"shake_{plane}_{frequency:.2f}Hz"
            text = f"exciter in its {plane} plane at {frequency:.2f} Hz, from rest"
            yield Item(name, text, RunSpec(name, means.block, AtRest(), motor))
        sweep = UnbalancedMass(
            force / (2.0 * np.pi * means.highest) ** 2, means.highest, plane, ramp=means.block
        )
        name = f"sweep_{plane}"
        text = f"exciter in its {plane} plane, speeding up to {means.highest:.2f} Hz all the time, from rest"
        yield Item(name, text, RunSpec(name, means.block, AtRest(), sweep))
    if means.exciter == SHAKER:
        lines = frequencies(rig, elements, means)
        name, text = "multisine", "exciter with a sum of sines along its three axes, from rest"
        yield Item(name, text, RunSpec(name, means.block, AtRest(), Multisine(force, lines, RAMP)))


def frequencies(rig: Rig, elements: Array, means: Means) -> tuple[float, ...]:
    """Hz: below, between and above the frequencies at which the body swings by itself; the highest one."""
    model = rig_model(rig, elements)
    swings = [m.frequency for m in natural_modes(model, rest_state(model)) if m.frequency > 0.05]
    if not swings:
        return (0.5 * means.highest, means.highest)
    between = [float(np.sqrt(a * b)) for a, b in pairwise(swings)]
    asked = [swings[0] / 1.6, *between, 1.5 * swings[-1], means.highest]
    clear = [f for f in asked if f <= means.highest and all(max(f / s, s / f) > BESIDE for s in swings)]
    # Frequencies within a tenth of each other tell the same
    apart: list[float] = []
    for f in sorted(clear or [means.highest]):
        if not apart or f > 1.1 * apart[-1]:
            apart.append(round(f, 2))
    return tuple(apart)


def _known_masses(rig: Rig, elements: Array, means: Means) -> Iterator[Item]:
    """At rest with a known mass on the body; only load cells and inclinometer feel it."""
    if means.rates.tension <= 0.0 and (rig.inclinometer is None or means.rates.inclinometer <= 0.0):
        return
    hinges = np.array([cable.body_point for cable in rig.cables])
    mass = float(f"{DUMMY * elements[0]:.2g}")
    for i, (x, y) in enumerate(PLACES, start=1):
        place = np.round(hinges.min(axis=0) + np.array([x, y, 0.5]) * np.ptp(hinges, axis=0), 3)
        name = f"static_dummy_{i}"
        text = f"at rest with {mass:g} kg at ({', '.join(f'{v:g}' for v in place)}) m, {means.rest:g} s"
        yield Item(name, text, static=StaticSpec(name, means.rest, Dummy(mass, place)))


def usual(rig: Rig, elements: Array, means: Means) -> tuple[Item, ...]:
    """What is recorded without a plan: rest without and with a known mass, and a release that is shaken."""
    weight = float(elements[0]) * rig.gravity
    hinges = np.array([cable.body_point for cable in rig.cables])
    pull = means.pull * weight * np.array([np.cos(0.9), np.sin(0.9), 0.0])
    motor = None
    if rig.exciter is not None:
        lines = frequencies(rig, elements, means)
        speed = lines[len(lines) // 2]
        motor = UnbalancedMass(means.force * weight / (2.0 * np.pi * speed) ** 2, speed, "xy", RAMP)
    start = Pulled(pull, elements[1:4] + 0.15 * np.ptp(hinges, axis=0))
    run = RunSpec("usual", means.block, start, motor)
    masses = [item for item in _known_masses(rig, elements, means) if item.name.endswith(str(len(PLACES)))]
    return (bare(means), *masses, Item("usual", "released and shaken at one speed", run))
