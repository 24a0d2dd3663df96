"""Riders at every place: a scan over frequencies, and a finer one in frequency and damping.

A tank at the end of a vehicle feels another acceleration than one in its middle: a scan that lets riders feel
the middle's found a part of 16 kg only with a negative mass (bench/concealed/sealed_run_10, 10834). The first
scan goes over frequencies a twentieth apart and one damping. Half a minute of a liquid that swings freely
tells its frequency to less than a percent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.beyond import Beyond, Columns
from rig_identification.mismatch.places import TERMS, Best, best_place, lines, monomials, multiplied
from rig_identification.mismatch.response import whitened_response
from rig_identification.mismatch.riders import (
    DAMPING,
    DIRECTIONS,
    FREQUENCIES,
    Swing,
    filters,
    middle_of,
    pieces_of,
)
from rig_identification.model import layout
from rig_identification.model.effects import place

Array = NDArray[np.float64]

#: Factors on the frequency, coarse and then fine, and damping ratios that are tried.
COARSE = (0.975, 1.0, 1.025)
FINE = tuple(float(f) for f in np.geomspace(0.9875, 1.0125, 5))
DAMPINGS = (0.006, 0.03, 0.12)
#: Frequencies that are tried at once, and those of a part that moves along all axes.
AT_ONCE, SPARSE = 12, FREQUENCIES[::2]
#: Places lie within so much of ``spread_of`` about the middle.
REACH = 1.2


@dataclass(frozen=True)
class Ridden:
    """A rider where it explains most."""

    swing: Swing
    damping: float  # ratio
    best: Best  # kg, at a place in units of ``spread_of`` from the middle
    columns: Columns
    runs: list[Array]  # (m, TERMS) its columns in every run


def scanned(problem: Problem, beyond: Beyond, mass: float) -> Iterator[Ridden]:
    """Every swing where it explains most, as far as any mass of it promises something. mass: kg, of the body.

    A few frequencies at once: all of them together would fill the memory.
    """
    for first in range(0, len(FREQUENCIES), AT_ONCE):
        frequencies = FREQUENCIES[first : first + AT_ONCE]
        alone = {axis: _responses(problem, beyond, axis, frequencies, (DAMPING,)) for axis in AXES}
        for directions, axes in DIRECTIONS.items():
            responses = alone[axes[0]]
            for axis in axes[1:]:
                responses = [a + b for a, b in zip(responses, alone[axis], strict=True)]
            found = beyond.of(responses)
            for k, frequency in enumerate(frequencies):
                ridden = _ridden(Swing(directions, frequency), DAMPING, k, found, responses, mass)
                if ridden is not None:
                    yield ridden


def on_springs_all_ways(problem: Problem, beyond: Beyond, mass: float) -> Ridden | None:
    """A part on springs that moves along all three axes, each with the frequency that explains most.

    One frequency after the other, from the axis that explains most by itself. mass: kg, of the body.
    """
    alone = {axis: _responses(problem, beyond, axis, SPARSE, (DAMPING,)) for axis in AXES}
    columns = {axis: beyond.of(responses) for axis, responses in alone.items()}

    def of(chosen: dict[str, int]) -> Ridden | None:
        parts = {a: slice(TERMS * k, TERMS * (k + 1)) for a, k in chosen.items()}
        found = [columns[a].part(part) for a, part in parts.items()]
        both = Columns(
            np.sum([c.seen for c in found], axis=0),
            np.sum([c.solved for c in found], axis=0),
            np.sum([c.right for c in found], axis=0),
        )
        responses = [
            np.sum([alone[a][i][:, part] for a, part in parts.items()], axis=0)
            for i in range(len(beyond.full.runs))
        ]
        along = tuple(SPARSE[chosen.get(a, 0)] for a in AXES)
        swing = Swing("".join(AXES), min(SPARSE[k] for k in chosen.values()), along)
        return _ridden(swing, DAMPING, 0, both, responses, mass)

    chosen: dict[str, int] = {}
    best: Ridden | None = None
    for _ in AXES:
        tried = [
            (of(chosen | {axis: k}), axis, k)
            for axis in AXES
            if axis not in chosen
            for k in range(len(SPARSE))
        ]
        likely = [(found.best.gain, axis, k) for found, axis, k in tried if found is not None]
        if not likely:
            return None
        _, axis, k = max(likely)
        chosen[axis] = k
        best = next(found for found, a, i in tried if (a, i) == (axis, k))
    return best


def other_ways(problem: Problem, beyond: Beyond, known: str, amount: float, at: Array) -> dict[str, float]:
    """Hz, by axis, with which a part that moves along ``known`` moves along others, where that explains some.

    amount: kg, at the place ``at`` (3,) m: both as fitted along the axis that is known. Of an axis along
    which it is fixed no frequency explains anything.
    """
    u = (at - middle_of(problem.bench.rig)) / spread_of(problem)
    weights = amount * monomials(u)
    out = {}
    for axis in AXES:
        if axis in known:
            continue
        responses = _responses(problem, beyond, axis, FREQUENCIES, (DAMPING,))
        found, gains = beyond.of(responses), np.zeros(len(FREQUENCIES))
        for k in range(len(FREQUENCIES)):
            columns, own = _one_of(found, responses, k)
            information = columns.information(own)
            gains[k] = columns.right @ weights - 0.5 * weights @ information @ weights
        if np.max(gains) > 0.0:
            out[axis] = FREQUENCIES[int(np.argmax(gains))]
    return out


def _one_of(found: Columns, responses: list[Array], k: int) -> tuple[Columns, list[Array]]:
    """The ``k``-th of several swings' columns, and what they are in every run."""
    chosen = slice(TERMS * k, TERMS * (k + 1))
    return found.part(chosen), [r[:, chosen] for r in responses]


def _ridden(
    swing: Swing, damping: float, k: int, found: Columns, responses: list[Array], mass: float
) -> Ridden | None:
    """The best place of the ``k``-th of several swings in the columns ``found``, which are ``responses``."""
    columns, own = _one_of(found, responses, k)
    best = best_place(
        columns.information(own).reshape(1, TERMS, 1, TERMS),
        columns.right.reshape(1, TERMS),
        np.array([1.0 / (0.05 * mass) ** 2]),
        1,
        1.0,
        REACH,
    )
    return None if best is None else Ridden(swing, damping, best, columns, [o.copy() for o in own])


def columns_of(problem: Problem, beyond: Beyond, ridden: Ridden) -> list[Array]:
    """(m, TERMS) what a rider's kilogram does to every run's samples, by place."""
    swing = ridden.swing
    return _responses(problem, beyond, swing.directions, (swing.frequency,), (ridden.damping,))


def finer(problem: Problem, beyond: Beyond, swing: Swing, mass: float) -> Ridden | None:
    """The best frequency, damping and place near those of ``swing``; None where no mass promises anything.

    mass: kg, of the body.
    """
    best: Ridden | None = None
    for factors in (COARSE, FINE):
        center = swing if best is None else best.swing
        for found in _around(problem, beyond, center, factors, mass):
            if best is None or found.best.gain > best.best.gain:
                best = found
    return best


def _around(
    problem: Problem, beyond: Beyond, center: Swing, factors: Sequence[float], mass: float
) -> Iterator[Ridden]:
    """Swings at ``factors`` of a frequency, damped in every way: all at once, which reads a Jacobian once."""
    frequencies = [center.frequency * factor for factor in factors]
    responses = _responses(problem, beyond, center.directions, frequencies, DAMPINGS)
    found = beyond.of(responses)
    for k, (frequency, damping) in enumerate(product(frequencies, DAMPINGS)):
        tried = replace(center, frequency=frequency)
        ridden = _ridden(tried, damping, k, found, responses, mass)
        if ridden is not None:
            yield ridden


def spread_of(problem: Problem) -> float:
    """m: unit in which places are given from the middle."""
    return 0.5 * float(np.max(extent(problem.bench.rig)))


def _responses(
    problem: Problem,
    beyond: Beyond,
    directions: str,
    frequencies: Sequence[float],
    dampings: Sequence[float],
) -> list[Array]:
    """(m, TERMS F D) what a kilogram of every rider does to every run's samples, by place."""
    full = beyond.full
    wrenches = _wrenches(problem, full, directions, list(product(frequencies, dampings)))
    return [whitened_response(run, wrenches[i], smooth=True) for i, run in enumerate(full.runs)]


def _wrenches(
    problem: Problem, evaluation: Evaluation, directions: str, kinds: list[tuple[float, float]]
) -> dict[int, Array]:
    """(N, 6, TERMS K) wrench per kilogram, by place, for each run of the problem.

    kinds: frequency (Hz) and damping ratio of every rider.
    """
    model = problem.bench.parameters.model
    first = layout.effects_offset(model.cables) + place.REFERENCE_ROTATION
    down = model.physics[first : first + 9].reshape(3, 3).T @ model.physics[:3]
    at = lines(1, middle_of(problem.bench.rig), spread_of(problem))[0]
    out: dict[int, Array] = {}
    for which in pieces_of(problem).values():
        raw = np.concatenate(
            [evaluation.runs[i].motion.outputs[: None if i == which[-1] else -1] for i in which]
        )
        step = problem.runs[which[0]].grid.step
        felt = _felt(raw, at)
        tilted = raw[0, layout.OUT_GRAVITY : layout.OUT_GRAVITY + 3] - down
        wrench = np.zeros((raw.shape[0], 6, TERMS * len(kinds)))
        for k, (frequency, damping) in enumerate(kinds):
            mine = wrench[:, :, TERMS * k : TERMS * (k + 1)]
            for axis in DIRECTIONS[directions]:
                _swing_along(mine, AXES.index(axis), felt, down, tilted, at, frequency, damping, step)
        start = 0
        for i in which:
            nodes = problem.runs[i].grid.nodes
            out[i] = wrench[start : start + nodes]
            start += nodes - 1
    return out


def _felt(raw: Array, at: Array) -> Array:
    """(N, 3, 4) specific force at the place ``at`` (3, 4), body axes."""
    f = raw[:, layout.OUT_SPECIFIC_FORCE : layout.OUT_SPECIFIC_FORCE + 3]
    w = raw[:, layout.OUT_RATE : layout.OUT_RATE + 3, None]
    alpha = raw[:, layout.OUT_ANGULAR_ACCELERATION : layout.OUT_ANGULAR_ACCELERATION + 3, None]
    everywhere = np.broadcast_to(at, (raw.shape[0], 3, 4))
    felt = np.cross(alpha, everywhere, axis=1) + np.cross(w, np.cross(w, everywhere, axis=1), axis=1)
    felt[..., 0] += f
    return np.asarray(felt)


def travel_along(
    force: Array, tilted: float, frequency: float, damping: float, step: float
) -> tuple[Array, Array]:
    """Travel q (N, 4) and less its acceleration (N, 4) of a massless rider, by place.

    force (N, 4): specific force along the rider's axis plus gravity of the rest pose. tilted: gravity at the
    first node less that of the rest pose, along the axis: before that node the rider hangs in it.
    """
    omega = 2.0 * np.pi * frequency
    numerator, denominator = filters(frequency, step, damping)
    away, before = force.copy(), np.zeros(4)
    # Displaced by its weight before the start: the deviation from there starts from zero
    away[:, 0] += tilted
    before[0] = tilted / omega**2
    q = np.asarray(lfilter(numerator, denominator, away, axis=0)) + before
    rate = np.gradient(q, step, axis=0)
    return q, force + 2.0 * damping * omega * rate + omega**2 * q


def _swing_along(
    out: Array,
    i: int,
    felt: Array,
    down: Array,
    tilted: Array,
    at: Array,
    frequency: float,
    damping: float,
    step: float,
) -> None:
    """Add to ``out`` (N, 6, TERMS) a swinging kilogram's wrench along axis ``i`` less a fixed one's."""
    force = felt[:, i].copy()
    force[:, 0] += down[i]
    q, push = travel_along(force, float(tilted[i]), frequency, damping, step)
    j, k = (i + 1) % 3, (i + 2) % 3
    out[:, i, :4] += push
    # at x push and q x felt, of vectors along axis i
    out[:, 3 + j] += multiplied(push, at[k]) + multiplied(q, felt[:, k])
    out[:, 3 + k] -= multiplied(push, at[j]) + multiplied(q, felt[:, j])
