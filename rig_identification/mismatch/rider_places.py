"""Riders at every place: a scan over frequencies, and a finer one in frequency and damping.

A tank at the end of a vehicle feels another acceleration than one in its middle: a scan that lets riders feel
the middle's found a part of 16 kg only with a negative mass (bench/concealed/sealed_run_10, 10834). The first
scan goes over frequencies a twentieth apart and one damping. Half a minute of a liquid that swings freely
tells its frequency to less than a percent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.verdict import FALSE_ALARM
from rig_identification.mismatch.beyond import Beyond, Columns
from rig_identification.mismatch.places import TERMS, Best, best_place, lines, monomials, multiplied
from rig_identification.mismatch.response import whitened_response
from rig_identification.mismatch.riders import (
    DAMPING,
    DIRECTIONS,
    FREQUENCIES,
    GYRATION,
    MASS_STD,
    TURNING_NUMBERS,
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
#: Steps (tangent of the angle) by which lines between the axes are tried: a grid first.
LINES = (1.0, 0.4, 0.4, 0.2, 0.1, 0.1)
#: Axis along which a rider travels, that along which it feels what drives this, and how much of that counts.
Ways = tuple[tuple[str, str, float], ...]


@dataclass(frozen=True)
class Ridden:
    """A rider where it explains most."""

    swing: Swing
    damping: float  # ratio
    best: (
        Best  # kg, at a place in units of ``spread_of`` from the middle; kg m^2 about each axis that it turns
    )
    columns: Columns
    runs: list[Array]  # (m, TERMS + turning) its columns in every run

    @property
    def weights(self) -> Array:
        """(TERMS + turning,) of the columns."""
        amounts = self.best.amounts
        return np.concatenate([amounts[0] * monomials(self.best.place), amounts[1:]])


def scanned(problem: Problem, beyond: Beyond, mass: float) -> Iterator[Ridden]:
    """Every swing where it explains most, as far as any mass of it promises something. mass: kg, of the body.

    A few frequencies at once: all of them together would fill the memory.
    """
    for first in range(0, len(FREQUENCIES), AT_ONCE):
        frequencies = FREQUENCIES[first : first + AT_ONCE]
        alone = {axis: _responses(problem, beyond, _along(axis), frequencies, (DAMPING,)) for axis in AXES}
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
    alone = {axis: _responses(problem, beyond, _along(axis), SPARSE, (DAMPING,)) for axis in AXES}
    columns = {axis: beyond.of(responses) for axis, responses in alone.items()}

    def of(chosen: dict[str, int]) -> Ridden | None:
        parts = {a: slice(TERMS * k, TERMS * (k + 1)) for a, k in chosen.items()}
        found = [columns[a].part(part) for a, part in parts.items()]
        both = Columns.mixed(found, [1.0] * len(found))
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


def along_a_line(
    problem: Problem, beyond: Beyond, frequency: float, damping: float, mass: float
) -> tuple[Ridden, Array] | None:
    """A part that moves along one line between the axes, and its line (3,), a unit vector.

    Its travel along a line n is driven by what it feels along n, and acts along n: its response is the sum
    of n_i n_j times that of a rider that travels along axis i, driven by axis j. So six responses tell those
    along all lines. frequency: Hz, and damping: ratio, near which it is looked for; mass: kg, of the body.
    """
    found = _best_line(problem, beyond, frequency, damping, mass)
    if found is None:
        return None
    nearer = finer(problem, beyond, found[0].swing, mass, found[1])
    if nearer is None or nearer.best.gain <= found[0].best.gain:
        return found
    again = _best_line(problem, beyond, nearer.swing.frequency, nearer.damping, mass)
    return found if again is None else max(found, again, key=lambda f: f[0].best.gain)


def _best_line(
    problem: Problem, beyond: Beyond, frequency: float, damping: float, mass: float
) -> tuple[Ridden, Array] | None:
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    crossed: list[Ways] = [
        ((AXES[i], AXES[j], 1.0), (AXES[j], AXES[i], 1.0))[: 1 + (i != j)] for i, j in pairs
    ]
    responses = [_responses(problem, beyond, ways, (frequency,), (damping,)) for ways in crossed]
    columns = [beyond.of(r) for r in responses]

    def of(line: Array) -> Ridden | None:
        parts = [line[i] * line[j] for i, j in pairs]
        both = Columns.mixed(columns, parts)
        own = [
            np.sum([w * r[k] for w, r in zip(parts, responses, strict=True)], axis=0)
            for k in range(len(beyond.full.runs))
        ]
        swing = Swing(AXES[int(np.argmax(np.abs(line)))], frequency, tilted=True)
        return _ridden(swing, damping, 0, both, own, mass)

    best: tuple[Ridden, Array] | None = None
    for step in LINES:
        center = None if best is None else best[1]
        for line in _lines_about(center, step):
            found = of(line)
            if found is not None and (best is None or found.best.gain > best[0].best.gain):
                best = found, line
    return best


def _lines_about(center: Array | None, step: float) -> list[Array]:
    """Unit vectors (3,): about ``center`` by steps to either side, or all of a grid, one of each line."""
    if center is None:
        grid = np.array([v for v in product((-1.0, 0.0, 1.0), repeat=3) if v > (0.0, 0.0, 0.0)])
        return [np.asarray(v / np.linalg.norm(v)) for v in grid]
    sides = np.linalg.svd(center[None])[2][1:]
    moved = [center + step * (a * sides[0] + b * sides[1]) for a, b in product((-1, 0, 1), repeat=2)]
    return [np.asarray(v / np.linalg.norm(v)) for v in moved]


def turning_too(problem: Problem, beyond: Beyond, ridden: Ridden, mass: float) -> Ridden | None:
    """A part on springs that turns on them as well, at the place that explains most then.

    A part that is no point and is taken for one is put where its arm does what its turning does, metres off.
    One axis after the other, from the one that explains most; None where none explains any more. mass: kg, of
    the body.
    """
    own = ridden.runs or columns_of(problem, beyond, ridden)
    wrenches = _turning_wrenches(problem, beyond.full, SPARSE, ridden.damping)
    rows = [
        np.hstack([mine, whitened_response(run, wrenches[i], smooth=True)])
        for i, (run, mine) in enumerate(zip(beyond.full.runs, own, strict=True))
    ]
    every = beyond.of(rows)
    information = every.information(rows)
    reach = GYRATION * float(np.max(extent(problem.bench.rig)))
    precision = np.array([1.0, *[reach**-4] * len(AXES)]) / (MASS_STD * mass) ** 2

    def of(turning: list[int]) -> Best | None:
        matrix = np.zeros((1 + len(turning), TERMS, 1 + len(turning), TERMS))
        right = np.zeros((1 + len(turning), TERMS))
        chosen = [np.arange(TERMS), *(np.array([TERMS + k]) for k in turning)]
        for i, a in enumerate(chosen):
            right[i, : a.size] = every.right[a]
            for j, b in enumerate(chosen):
                matrix[i, : a.size, j, : b.size] = information[np.ix_(a, b)]
        count = 1 + len(turning)
        return best_place(matrix, right, precision[:count], count, 1.0, REACH)

    def gain(turning: list[int]) -> float:
        found = of(turning)
        return -np.inf if found is None else found.gain

    chosen = _axis_by_axis(len(SPARSE), set(), gain, ridden.best.gain)
    best = of(chosen) if chosen else None
    if best is None or not np.all(best.amounts > 0.0):
        return None
    order = np.argsort(chosen)
    columns = np.concatenate([np.arange(TERMS), TERMS + np.array(chosen)[order]])
    turning = tuple((AXES[k // len(SPARSE)], SPARSE[k % len(SPARSE)]) for k in sorted(chosen))
    return replace(
        ridden,
        swing=replace(ridden.swing, turning=turning),
        best=replace(best, amounts=np.concatenate([best.amounts[:1], best.amounts[1:][order]])),
        columns=Columns(every.seen[:, columns], every.solved[:, columns], every.right[columns]),
        runs=[row[:, columns] for row in rows],
    )


def _axis_by_axis(each: int, known: set[int], gain: Callable[[list[int]], float], before: float) -> list[int]:
    """Columns of a turning part, one of each axis that it turns about, as far as each explains some.

    Column k is of axis k // each, at one of ``each`` frequencies. One axis after the other, but those known,
    from the one that explains most. gain: of columns, nats; before: of none.
    """
    needed = 0.5 * float(chi2.isf(FALSE_ALARM / (len(AXES) * each), TURNING_NUMBERS))
    chosen: list[int] = []
    while left := [
        k for k in range(len(AXES) * each) if k // each not in known | {c // each for c in chosen}
    ]:
        most, best = max((gain([*chosen, k]), k) for k in left)
        if most - before < needed:
            break
        chosen.append(best)
        before = most
    return chosen


def other_ways(
    problem: Problem, beyond: Beyond, known: str, amount: float, at: Array
) -> dict[str, tuple[float, float]]:
    """Hz with which a part that moves along ``known`` moves along others as well, and nats that explains.

    amount: kg, at the place ``at`` (3,) m: both as fitted along the axis that is known. By axis; of an axis
    along which it is fixed no frequency explains anything.
    """
    u = (at - middle_of(problem.bench.rig)) / spread_of(problem)
    weights = amount * monomials(u)
    out = {}
    for axis in AXES:
        if axis in known:
            continue
        responses = _responses(problem, beyond, _along(axis), FREQUENCIES, (DAMPING,))
        found, gains = beyond.of(responses), np.zeros(len(FREQUENCIES))
        for k in range(len(FREQUENCIES)):
            columns, own = _one_of(found, responses, k)
            information = columns.information(own)
            gains[k] = columns.right @ weights - 0.5 * weights @ information @ weights
        best = int(np.argmax(gains))
        if gains[best] > 0.0:
            out[axis] = FREQUENCIES[best], float(gains[best])
    return out


@dataclass(frozen=True)
class Turned:
    """How a part that moves on springs turns on them as well, and what that explains."""

    gain: float  # nats
    frequency: dict[str, float]  # Hz, by axis, in the order of AXES
    inertia: dict[str, float]  # kg m^2 about its own centre, by axis


def turning_ways(problem: Problem, beyond: Beyond, damping: float, known: str) -> Turned:
    """About which axes but those ``known`` a part turns, and how fast, as far as each explains some.

    One axis after the other, from the one that explains most by itself. damping: ratio.
    """
    each = len(FREQUENCIES)
    wrenches = _turning_wrenches(problem, beyond.full, FREQUENCIES, damping)
    responses = [whitened_response(run, wrenches[i], smooth=True) for i, run in enumerate(beyond.full.runs)]
    found = beyond.of(responses)
    information, right = found.information(responses), found.right

    def of(columns: list[int]) -> tuple[float, Array]:
        amounts: Array = np.asarray(np.linalg.solve(information[np.ix_(columns, columns)], right[columns]))
        return (0.5 * float(amounts @ right[columns]) if np.all(amounts > 0.0) else 0.0), amounts

    chosen = _axis_by_axis(each, {AXES.index(a) for a in known}, lambda columns: of(columns)[0], 0.0)
    gain, amounts = of(chosen) if chosen else (0.0, np.zeros(0))
    ways = sorted(zip(chosen, amounts, strict=True))
    return Turned(
        gain,
        {AXES[k // each]: FREQUENCIES[k % each] for k, _ in ways},
        {AXES[k // each]: float(amount) for k, amount in ways},
    )


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
        np.array([1.0 / (MASS_STD * mass) ** 2]),
        1,
        1.0,
        REACH,
    )
    return None if best is None else Ridden(swing, damping, best, columns, [o.copy() for o in own])


def columns_of(problem: Problem, beyond: Beyond, ridden: Ridden) -> list[Array]:
    """(m, TERMS) what a rider's kilogram does to every run's samples, by place."""
    swing = ridden.swing
    return _responses(problem, beyond, _along(swing.directions), (swing.frequency,), (ridden.damping,))


def finer(
    problem: Problem, beyond: Beyond, swing: Swing, mass: float, line: Array | None = None
) -> Ridden | None:
    """The best frequency, damping and place near those of ``swing``; None where no mass promises anything.

    mass: kg, of the body. line: (3,) unit vector of a part that moves between the axes, with its frequency.
    """
    best: Ridden | None = None
    ways = _along(swing.directions) if line is None else _between(line)
    for factors in (COARSE, FINE):
        center = swing if best is None else best.swing
        for found in _around(problem, beyond, center, ways, factors, mass):
            if best is None or found.best.gain > best.best.gain:
                best = found
    return best


def _around(
    problem: Problem, beyond: Beyond, center: Swing, ways: Ways, factors: Sequence[float], mass: float
) -> Iterator[Ridden]:
    """Swings at ``factors`` of a frequency, damped in every way: all at once, which reads a Jacobian once."""
    frequencies = [center.frequency * factor for factor in factors]
    responses = _responses(problem, beyond, ways, frequencies, DAMPINGS)
    found = beyond.of(responses)
    for k, (frequency, damping) in enumerate(product(frequencies, DAMPINGS)):
        tried = replace(center, frequency=frequency)
        ridden = _ridden(tried, damping, k, found, responses, mass)
        if ridden is not None:
            yield ridden


def spread_of(problem: Problem) -> float:
    """m: unit in which places are given from the middle."""
    return 0.5 * float(np.max(extent(problem.bench.rig)))


def _along(directions: str) -> Ways:
    """Each of the axes along which a part moves answers what it feels along itself."""
    return tuple((axis, axis, 1.0) for axis in DIRECTIONS[directions])


def _between(line: Array) -> Ways:
    """A part that moves along a line (3,), a unit vector, answers what it feels along that."""
    return tuple((a, b, float(line[i] * line[j])) for i, a in enumerate(AXES) for j, b in enumerate(AXES))


def _responses(
    problem: Problem,
    beyond: Beyond,
    ways: Ways,
    frequencies: Sequence[float],
    dampings: Sequence[float],
) -> list[Array]:
    """(m, TERMS F D) what a kilogram of every rider does to every run's samples, by place."""
    full = beyond.full
    wrenches = _wrenches(problem, full, ways, list(product(frequencies, dampings)))
    return [whitened_response(run, wrenches[i], smooth=True) for i, run in enumerate(full.runs)]


def _wrenches(
    problem: Problem, evaluation: Evaluation, ways: Ways, kinds: list[tuple[float, float]]
) -> dict[int, Array]:
    """(N, 6, TERMS K) wrench per kilogram, by place, for each run of the problem.

    kinds: frequency (Hz) and damping ratio of every rider.
    """
    model = problem.bench.parameters.model
    first = layout.effects_offset(model.cables) + place.REFERENCE_ROTATION
    down = model.physics[first : first + 9].reshape(3, 3).T @ model.physics[:3]
    at = lines(1, middle_of(problem.bench.rig), spread_of(problem))[0]

    def of(raw: Array, step: float) -> Array:
        felt = _felt(raw, at)
        tilted = raw[0, layout.OUT_GRAVITY : layout.OUT_GRAVITY + 3] - down
        wrench = np.zeros((raw.shape[0], 6, TERMS * len(kinds)))
        for k, (frequency, damping) in enumerate(kinds):
            mine = wrench[:, :, TERMS * k : TERMS * (k + 1)]
            for moving, driving, share in ways:
                along = AXES.index(moving), AXES.index(driving)
                _swing_along(mine, along, share, felt, down, tilted, at, frequency, damping, step)
        return wrench

    return _of_runs(problem, evaluation, of)


def _turning_wrenches(
    problem: Problem, evaluation: Evaluation, frequencies: Sequence[float], damping: float
) -> dict[int, Array]:
    """(N, 6, 3 F) wrench per kg m^2 turning about each axis at each of F frequencies (Hz), for each run."""

    def of(raw: Array, step: float) -> Array:
        wrench = np.zeros((raw.shape[0], 6, len(AXES) * len(frequencies)))
        for k, (i, frequency) in enumerate(product(range(len(AXES)), frequencies)):
            alpha = raw[:, layout.OUT_ANGULAR_ACCELERATION + i, None]
            wrench[:, 3 + i, k] = travel_along(alpha, 0.0, frequency, damping, step)[1][:, 0]
        return wrench

    return _of_runs(problem, evaluation, of)


def _of_runs(
    problem: Problem, evaluation: Evaluation, of: Callable[[Array, float], Array]
) -> dict[int, Array]:
    """Wrenches (N, 6, C) of each run of the problem, as ``of`` tells them of a recording's whole motion.

    of: of raw outputs (N, o), ``step`` s apart.
    """
    out: dict[int, Array] = {}
    for which in pieces_of(problem).values():
        raw = np.concatenate(
            [evaluation.runs[i].motion.outputs[: None if i == which[-1] else -1] for i in which]
        )
        wrench = of(raw, problem.runs[which[0]].grid.step)
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
    """Travel q (N, c) and less its acceleration (N, c) of a massless rider, by place.

    force (N, c): specific force along the rider's axis plus gravity of the rest pose. tilted: gravity at the
    first node less that of the rest pose, along the axis: before that node the rider hangs in it.
    """
    omega = 2.0 * np.pi * frequency
    numerator, denominator = filters(frequency, step, damping)
    away, before = force.copy(), np.zeros(force.shape[1])
    # Displaced by its weight before the start: the deviation from there starts from zero
    away[:, 0] += tilted
    before[0] = tilted / omega**2
    q = np.asarray(lfilter(numerator, denominator, away, axis=0)) + before
    rate = np.gradient(q, step, axis=0)
    return q, force + 2.0 * damping * omega * rate + omega**2 * q


def _swing_along(
    out: Array,
    along: tuple[int, int],
    share: float,
    felt: Array,
    down: Array,
    tilted: Array,
    at: Array,
    frequency: float,
    damping: float,
    step: float,
) -> None:
    """Add to ``out`` (N, 6, TERMS) the wrench of a swinging kilogram less a fixed one's.

    along: axis along which it travels, and that along which it feels what drives the travel; share: how much
    of that counts.
    """
    i, driving = along
    force = share * felt[:, driving]
    force[:, 0] += share * down[driving]
    q, push = travel_along(force, share * float(tilted[driving]), frequency, damping, step)
    j, k = (i + 1) % 3, (i + 2) % 3
    out[:, i, :4] += push
    # at x push and q x felt, of vectors along axis i
    out[:, 3 + j] += multiplied(push, at[k]) + multiplied(q, felt[:, k])
    out[:, 3 + k] -= multiplied(push, at[j]) + multiplied(q, felt[:, j])
