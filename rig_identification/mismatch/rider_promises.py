"""What masses that ride on the body promise, and their closer descriptions from a fit.

rider_places.py scans them; here the best become hypotheses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.verdict import FALSE_ALARM
from rig_identification.mismatch.beyond import Beyond, Columns
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.in_motion import unearned_of
from rig_identification.mismatch.opened import Promise, opened_with, promise_of
from rig_identification.mismatch.rider_places import (
    Ridden,
    along_a_line,
    columns_of,
    finer,
    on_springs_all_ways,
    other_ways,
    scanned,
    spread_of,
    turning_too,
    turning_ways,
)
from rig_identification.mismatch.riders import (
    NUMBERS,
    SWINGS,
    Swing,
    lean,
    middle_of,
    rider_candidate,
    tilt,
)
from rig_identification.model import layout

Array = NDArray[np.float64]

#: Share of a promise that is seen at the nearest of the scanned frequencies and at their damping: measured,
#: half.
COARSE = 0.5
#: Share of the best promise down to which a scanned swing keeps its columns, which fill the memory: of
#: another one they are computed again where it is asked for.
KEPT = 0.5
#: Share of what is promised that first order is right within.
AS_MUCH = 0.5
#: Word of the recording contract, and numbers by which a line leans.
SPRUNG, LEANS = "sprung_mass", 2
#: How far a line may lean where it is fitted first, of its own axis' part: to first order it knows no end.
LEANING = 1.0
#: Share of the best promise of an effect that another one of the same has to come to, to be fitted as well.
ELSEWHERE = 0.8


def rider_promises(problem: Problem, beyond: Beyond, mass: float, count: int) -> list[Promise]:
    """The best swing of each direction, of effects that are not in the model already.

    count: of other hypotheses. A swing is looked at more finely where that may make it stand out of chance.
    """
    least = 0.5 * float(chi2.isf(FALSE_ALARM / (count + len(SWINGS)), NUMBERS))
    taken = {p.name for p in problem.bench.parameters.free}
    found: dict[tuple[str, str], list[Ridden]] = {}
    for ridden in scanned(problem, beyond, mass):
        effect = ridden.swing.effect
        # A second one of an effect would write its numbers over the first one's
        if f"{effect}.mass" not in taken:
            swings = found.setdefault((effect, ridden.swing.directions), [])
            most = max([ridden.best.gain, *(r.best.gain for r in swings)])
            swings.append(ridden if ridden.best.gain > KEPT * most else replace(ridden, runs=[]))
    bodies = []
    if problem.discrepancy is not None and f"{SPRUNG}.mass" not in taken:
        bodies = _bodies_on_springs(problem, beyond, mass, found)
    best = [_best_swings(problem, beyond, swings, mass) for swings in found.values()]
    best.sort(key=lambda peaks: -peaks[0].gain)
    all_ways = [_ridden_promise(problem, beyond, every, mass) for every in bodies]
    # Only what may come to be the best of them, and beyond chance
    least = COARSE * max([least, *(peaks[0].gain for peaks in best)])
    near = [
        _with_elsewhere([_best_near(problem, beyond, p, mass) if p.gain > least else p for p in peaks])
        for peaks in best
    ]
    return [*near, *_between_axes(problem, beyond, [p for p in near if p.gain > least], mass), *all_ways]


def _between_axes(problem: Problem, beyond: Beyond, along: list[Promise], mass: float) -> list[Promise]:
    """A part on springs along a line between the axes, where that promises more than along the best of them.

    along: promises of riders; the line is looked for at the frequency and damping of the best of one axis.
    """
    axes = [p for p in along if p.candidate.where["axis"] is not None]
    if not axes:
        return []
    best = max(axes, key=lambda p: p.gain)
    found = along_a_line(problem, beyond, _frequency(best), best.values[f"{SPRUNG}.damping_ratio"], mass)
    if found is None:
        return []
    ridden, line = found
    needed = 0.5 * float(chi2.isf(FALSE_ALARM, LEANS))
    axis = AXES.index(ridden.swing.directions)
    leans = {f"{SPRUNG}.direction.{a}": float(line[i] / line[axis]) for i, a in enumerate(AXES) if i != axis}
    length = lean(*leans.values())
    # A number of its own for the frequency: that along the axis (riders.tilt)
    ridden = replace(ridden, swing=replace(ridden.swing, frequency=length * ridden.swing.frequency))
    promise = _ridden_promise(problem, beyond, ridden, mass)
    if promise.gain < max(p.gain for p in along) + needed:
        return []
    leans[f"{SPRUNG}.damping_ratio"] = ridden.damping / length
    return [replace(promise, values=promise.values | leans)]


def _bodies_on_springs(
    problem: Problem, beyond: Beyond, mass: float, found: dict[tuple[str, str], list[Ridden]]
) -> list[Ridden]:
    """A part that moves along all axes, and parts that turn beside moving along all or along one of them.

    found: swings along each direction that were scanned. mass: kg, of the body.
    """
    along = [r for (effect, _), swings in found.items() if effect == SPRUNG for r in swings]
    every = on_springs_all_ways(problem, beyond, mass)
    parts = [every] if every is not None else []
    parts += [max(along, key=lambda r: r.best.gain)] if along else []
    turning = [turning_too(problem, beyond, part, mass) for part in parts]
    return [*parts[: every is not None], *(t for t in turning if t is not None)]


def _best_swings(problem: Problem, beyond: Beyond, swings: list[Ridden], mass: float) -> list[Promise]:
    """Of one kind's swings, by frequency, the promises of the best and of the next peak (:func:`_peaks`)."""
    gains = np.array([ridden.best.gain for ridden in swings])
    promises: dict[int, Promise] = {}
    most = 0.0
    for k in np.argsort(-gains):
        if most > 0.0 and gains[k] < ELSEWHERE * most:
            # A motion accounts for no more than that
            break
        promises[int(k)] = _ridden_promise(problem, beyond, swings[k], mass)
        most = max(most, promises[int(k)].gain)
    for k, promise in promises.items():
        gains[k] = promise.gain
    return [promises[k] for k in _peaks(gains)]


def _peaks(gains: Array) -> list[int]:
    """Of promised gains, by frequency, where the best is, and the best other peak that comes close to it.

    One run shakes a liquid at few frequencies: a lighter one near one of them is alike to a heavier one near
    another to first order, and their fits differ by far (bench/concealed/sealed_run_19, 12853). What lies
    beyond a valley comes first: a part so softly sprung that it stays where it is promises the same at every
    frequency below the motion's, and a dent in that is no other place (sealed_run_21, 13230).
    """
    edged = np.array([-np.inf, *gains, -np.inf])
    high = np.flatnonzero((edged[1:-1] >= edged[:-2]) & (edged[1:-1] > edged[2:]))
    first, *others = sorted((int(k) for k in high), key=lambda k: -gains[k])

    def near(k: int) -> bool:
        return bool(np.min(gains[min(first, k) : max(first, k) + 1]) > ELSEWHERE * gains[k])

    close = sorted((k for k in others if gains[k] > ELSEWHERE * gains[first]), key=near)
    return [first, *close[:1]]


def _best_near(problem: Problem, beyond: Beyond, peak: Promise, mass: float) -> Promise:
    return max([peak, *_finer(problem, beyond, peak, mass)], key=lambda p: p.gain)


def _with_elsewhere(peaks: list[Promise]) -> Promise:
    peaks = sorted(peaks, key=lambda p: -p.gain)
    return replace(peaks[0], elsewhere=tuple(peaks[1:]))


def _finer(problem: Problem, beyond: Beyond, coarse: Promise, mass: float) -> list[Promise]:
    """A rider's promise at its best frequency, damping and place."""
    axis = coarse.candidate.where["axis"]
    found = finer(problem, beyond, Swing("xy" if axis is None else str(axis), _frequency(coarse)), mass)
    if found is None:
        return []
    return [_ridden_promise(problem, beyond, found, mass)]


def _frequency(promise: Promise) -> float:
    """Hz of a rider that has one frequency."""
    name = f"{promise.candidate.effect}.frequency"
    return next(p.nominal for p in promise.candidate.parameters if p.name == name)


def _ridden_promise(problem: Problem, beyond: Beyond, found: Ridden, mass: float) -> Promise:
    """What a scanned rider promises; near the noise, what of it a motion accounts for."""
    best, gain = found.best, found.best.gain
    if misfit(beyond.full) < NEAR_SQUARE:
        runs = found.runs or columns_of(problem, beyond, found)
        gain -= _unearned(problem, beyond, found.columns, found.weights, runs)
    at = middle_of(problem.bench.rig) + spread_of(problem) * best.place
    candidate, values = rider_candidate(problem, found.swing, mass, float(best.amounts[0]), at)
    more = further_ways if found.swing.effect == SPRUNG else springs_instead
    candidate = replace(candidate, between=partial(more, found.swing, mass))
    for (a, _), inertia in zip(found.swing.turning, best.amounts[1:], strict=True):
        values[f"{found.swing.effect}.inertia.{a}"] = float(inertia)
        values[f"{found.swing.effect}.turning_damping_ratio.{a}"] = found.damping
    return Promise(candidate, gain, values | {f"{found.swing.effect}.damping_ratio": found.damping})


def further_ways(
    swing: Swing, mass: float, problem: Problem, evaluation: Evaluation
) -> list[tuple[Candidate, dict[str, float]]]:
    """A fitted part on springs, moving along further axes or a line between them, or turning.

    What promises more comes first. One that promises less than a half of another is not asked before that,
    but for a line: of how far it leans first order knows least. mass: kg, of the body.
    """
    fitted = _Fitted.of(swing, problem, evaluation)
    tilts = [] if swing.tilted or len(swing.directions) > 1 else [fitted.leaning]
    opened = opened_with(problem, evaluation, tilts) if fitted.mass > 0.0 else None
    if opened is None:
        return []
    asked = [fitted.along_a_line(promise_of(*opened, c)) for c in tilts]
    # Along a line between axes it moves along all of them
    asked += [] if swing.tilted else fitted.along_more(problem, opened[1])
    asked += fitted.turning(problem, opened[1])
    most = max((way.gain for way in asked), default=0.0)
    out = []
    for way in sorted(asked, key=lambda way: -way.gain):
        if way.gain >= AS_MUCH * most or (way.swing.tilted and not swing.tilted):
            candidate, start = rider_candidate(problem, way.swing, mass, fitted.mass, fitted.at)
            candidate = replace(candidate, between=partial(further_ways, way.swing, mass))
            names = {q.name for q in candidate.parameters}
            kept = {name: value for name, value in fitted.values.items() if name in names}
            out.append((candidate, start | kept | way.values))
    return out


@dataclass(frozen=True)
class _Way:
    """A closer description of a fitted part, what it promises, and where it starts elsewhere than the fit."""

    gain: float  # nats
    swing: Swing
    values: dict[str, float]


@dataclass(frozen=True)
class _Fitted:
    """A part on springs as it was fitted."""

    swing: Swing
    values: dict[str, float]  # its numbers, in their own units
    leaning: Candidate  # its line, were it to lean

    @classmethod
    def of(cls, swing: Swing, problem: Problem, evaluation: Evaluation) -> _Fitted:
        """The part that swings so in a fit."""
        parameters, effect = problem.bench.parameters, swing.effect
        named = parameters.named(evaluation.point.theta)
        values = {name: v for name, v in named.items() if name.startswith(f"{effect}.")}
        first = next(q.index for q in parameters.free if q.name == f"{effect}.mass") - layout.MASS
        leaning = Candidate(effect, tilt(effect, swing.directions[0], first), "", "", {})
        return cls(swing, values, leaning)

    def number(self, name: str) -> float:
        """One of its numbers."""
        return self.values[f"{self.swing.effect}.{name}"]

    @property
    def mass(self) -> float:
        """Kg."""
        return self.number("mass")

    @property
    def at(self) -> Array:
        """(3,) m, its place."""
        return np.array([self.number(f"position.{a}") for a in AXES])

    @property
    def frequencies(self) -> dict[str, float]:
        """Hz, of each axis along which it moves."""
        own = "frequency.{}" if self.swing.along else "frequency"
        return {a: self.number(own.format(a)) for a in self.swing.directions}

    @property
    def turns(self) -> dict[str, float]:
        """Hz, of each axis that it turns about."""
        return {a: self.number(f"turning_frequency.{a}") for a, _ in self.swing.turning}

    def along_a_line(self, promise: Promise) -> _Way:
        """Its one line leans, as that promises."""
        effect = self.swing.effect
        leans = {name: float(np.clip(v, -LEANING, LEANING)) for name, v in promise.values.items()}
        length = lean(*leans.values())
        (frequency,) = self.frequencies.values()
        leans[f"{effect}.frequency"] = frequency * length
        leans[f"{effect}.damping_ratio"] = self.number("damping_ratio") / length
        return _Way(promise.gain, replace(self.swing, turning=tuple(self.turns.items()), tilted=True), leans)

    def along_more(self, problem: Problem, beyond: Beyond) -> list[_Way]:
        """It moves along further axes; none where none explains any."""
        ways = other_ways(problem, beyond, self.swing.directions, self.mass, self.at)
        if not ways:
            return []
        every = self.frequencies | {a: f for a, (f, _) in ways.items()}
        along = {a: every[a] for a in AXES if a in every}
        moving = Swing("".join(along), min(along.values()), tuple(along.values()), tuple(self.turns.items()))
        return [_Way(sum(gain for _, gain in ways.values()), moving, {})]

    def turning(self, problem: Problem, beyond: Beyond) -> list[_Way]:
        """It turns about further axes; none where none explains any."""
        damping, effect = self.number("damping_ratio"), self.swing.effect
        turned = turning_ways(problem, beyond, damping, "".join(self.turns))
        if not turned.inertia:
            return []
        about, have = self.turns | turned.frequency, tuple(self.frequencies.values())
        moving = replace(self.swing, turning=tuple((a, about[a]) for a in AXES if a in about))
        moving = replace(moving, along=have) if self.swing.along else replace(moving, frequency=have[0])
        inertias = {f"{effect}.inertia.{a}": inertia for a, inertia in turned.inertia.items()}
        dampings = {f"{effect}.turning_damping_ratio.{a}": damping for a in turned.inertia}
        return [_Way(turned.gain, moving, inertias | dampings)]


def springs_instead(
    swing: Swing, mass: float, problem: Problem, evaluation: Evaluation
) -> list[tuple[Candidate, dict[str, float]]]:
    """A fitted liquid as a part on springs, along the vertical too where that explains some.

    Both swing along two axes, and to first order alike. A part on springs need not move as freely along both,
    and does not rise as it swings. mass: kg, of the body.
    """
    values = problem.bench.parameters.named(evaluation.point.theta)
    amount, frequency = values[f"{swing.effect}.mass"], values[f"{swing.effect}.frequency"]
    opened = opened_with(problem, evaluation, []) if amount > 0.0 else None
    if opened is None or f"{SPRUNG}.mass" in values:
        return []
    at = np.array([values[f"{swing.effect}.position.{a}"] for a in AXES])
    ways = other_ways(problem, opened[1], swing.directions, amount, at)
    along = dict.fromkeys(swing.directions, frequency) | {a: f for a, (f, _) in ways.items()}
    moving = Swing("".join(along), min(along.values()), tuple(along.values()))
    candidate, start = rider_candidate(problem, moving, mass, amount, at)
    damping = values[f"{swing.effect}.damping_ratio"]
    candidate = replace(candidate, between=partial(further_ways, moving, mass))
    return [(candidate, start | {f"{moving.effect}.damping_ratio": damping})]


def _unearned(problem: Problem, beyond: Beyond, columns: Columns, amounts: Array, runs: list[Array]) -> float:
    """What of a gain near the noise no motion accounts for."""
    residuals = beyond.residuals(columns, amounts, runs)
    return unearned_of(problem, beyond.full, beyond.full.runs, residuals)
