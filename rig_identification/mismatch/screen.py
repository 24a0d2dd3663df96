"""All hypotheses at once, to first order: which would explain most of what is left?

The model is linearised once with every candidate's parameters among its columns. Freeing or
adding a set S of parameters then promises a gain in log posterior of
    1/2 g^T (F + P_S)^-1 g   less the same without S
(a score test, Rao 1948, with priors; F: Fisher information, g: gradient, P_S: prior
precisions with S's wide ones). It costs one small linear solve a candidate. Riders, of which
many frequencies and directions are tried, add columns of their own (response.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.parameters import AXES, INERTIAL
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.estimate.stretching import STIFFNESS
from rig_identification.estimate.verdict import FALSE_ALARM
from rig_identification.mismatch.beyond import Beyond, Columns
from rig_identification.mismatch.boxed import Boxed, probed_of
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.in_motion import unearned_of
from rig_identification.mismatch.rider_places import (
    Ridden,
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
from rig_identification.mismatch.supports import (
    cable_elasticity,
    ceiling_candidate,
    gives_way,
    largest_compliance,
    stiffnesses,
    taut_cables,
    yielding_like,
)
from rig_identification.mismatch.tethers import placed_tethers
from rig_identification.model import layout
from rig_identification.model.motion import State

Array = NDArray[np.float64]

#: Share of a promise that is seen at the nearest of the scanned frequencies and at their damping: measured,
#: half.
COARSE = 0.5
#: Share of the best promise down to which a scanned swing keeps its columns, which fill the memory: of
#: another one they are computed again where it is asked for.
KEPT = 0.5
#: Share of what is promised that first order is right within.
AS_MUCH = 0.5
#: How far a line may lean where it is fitted first, of its own axis' part: to first order it knows no end.
LEANING = 1.0
#: Share of the best promise of an effect that another one of the same has to come to, to be fitted as well.
ELSEWHERE = 0.8


@dataclass(frozen=True)
class Promise:
    """What one candidate would gain, to first order."""

    candidate: Candidate
    gain: float  # nats
    values: dict[str, float]  # its parameters, in their own units
    charge: float | None = None  # nats that evidence charges it for what it could have explained, if known
    elsewhere: tuple[Promise, ...] = ()  # about as much of the same, at other numbers


def with_reference(problem: Problem, rest: State) -> Problem:
    """The problem with the rest pose written where effects that know one look for it."""
    parameters = problem.bench.parameters
    model = parameters.model.referred(rest)
    return replace(problem, bench=replace(problem.bench, parameters=replace(parameters, model=model)))


def extended(problem: Problem, candidates: tuple[Candidate, ...]) -> Problem:
    """The same problem with the parameters of ``candidates`` free, and what they change in its model."""
    parameters = problem.bench.parameters
    for candidate in candidates:
        model, own = candidate.built(parameters.model)
        parameters = replace(parameters, model=model).having(own)
    return replace(problem, bench=replace(problem.bench, parameters=parameters))


def carried(problem: Problem, other: Problem, point: Point) -> Point:
    """A point of ``other`` said in the parameters of ``problem``."""
    theta = problem.bench.parameters.converted(point.theta, other.bench.parameters)
    return replace(point, theta=theta)


def adding(problem: Problem, candidates: list[Candidate]) -> Problem:
    """The problem with what candidates add free, each with its own prior; what they only free stays."""
    have = {p.name for p in problem.bench.parameters.free}
    parameters = problem.bench.parameters
    for candidate in candidates:
        model, own = candidate.built(parameters.model)
        new = tuple(p for p in own if p.name not in have)
        have |= {p.name for p in new}
        parameters = replace(parameters, model=model).having(new)
    return replace(problem, bench=replace(problem.bench, parameters=parameters))


def screen(
    problem: Problem, evaluation: Evaluation, candidates: list[Candidate], mass: float
) -> list[Promise]:
    """Promises of all candidates, and of riders and supports, about ``evaluation``, best first.

    mass: kg, of the body.
    """
    rig, model = problem.bench.rig, problem.bench.parameters.model
    axes = () if gives_way(model) else range(3)
    probes = [ceiling_candidate(rig, model, mass, a, probe=True) for a in axes]
    # Beside a wrench they are begun whatever they promise (search/expand.py)
    taut = taut_cables(rig, model, mass) if problem.discrepancy is None else []
    opened = opened_with(problem, evaluation, [*candidates, *probes, *taut])
    if opened is None:
        return []
    wide, beyond, boxed = opened
    full = beyond.full
    out = [promise_of(wide, beyond, boxed, c) for c in (*candidates, *taut)]
    for probe in (promise_of(wide, beyond, boxed, c) for c in probes):
        out += _supports(problem, mass, probe)
    placed = [
        Promise(hose, gain, values) for hose, gain, values in placed_tethers(wide, full, beyond, candidates)
    ]
    instead = {p.candidate.label for p in placed}
    out = [*(p for p in out if p.candidate.label not in instead), *placed]
    out += _riders(problem, beyond, mass, len(candidates))
    return sorted(out, key=lambda promise: -promise.gain)


def opened_with(
    problem: Problem, evaluation: Evaluation, candidates: list[Candidate]
) -> tuple[Problem, Beyond, Boxed] | None:
    """The problem with what candidates add among its unknowns, and all that is free without it.

    None where the model cannot be evaluated with them.
    """
    wide = adding(problem, candidates)
    point = carried(wide, problem, evaluation.point)
    full = evaluate(wide, point)
    if full is None:
        return None
    added = {q.name for q in wide.bench.parameters.free} - {q.name for q in problem.bench.parameters.free}
    probed = wide.bench.parameters.model.states - problem.bench.parameters.model.states
    base = free_without(wide, point, full, added, probed)
    asked = {q.name for c in candidates for q in c.parameters}
    return wide, Beyond(full, base, wide.bench.parameters.size), Boxed(wide, full, added, probed, asked)


def free_without(
    wide: Problem, point: Point, full: Evaluation, added: set[str], probed: int
) -> NDArray[np.int64]:
    """Unknowns that are free without any candidate. added: candidates' names; probed: states of probes."""
    at_bound = np.zeros(full.information.shape[0], dtype=bool)
    for i, q in enumerate(wide.bench.parameters.free, start=INERTIAL):
        if q.name in added:
            at_bound[i] = True
        elif q.bounded and abs(point.theta[i]) > wide.bound - 1e-6:
            # Pressed against its bound: it moves only where it is freed
            at_bound[i] = point.theta[i] * full.gradient[i] > 0.0
    at_bound[probed_of(full, wide.bench.parameters.size, probed)] = True
    return np.flatnonzero(~at_bound)


def promise_of(wide: Problem, beyond: Beyond, boxed: Boxed, candidate: Candidate) -> Promise:
    """What one of the candidates promises that a problem was opened with."""
    free = {q.name: q for q in wide.bench.parameters.free}
    step = boxed.step(candidate.parameters, candidate.positive)
    values = {q.name: free[q.name].value(z) for q, z in zip(candidate.parameters, step.values, strict=True)}
    return Promise(candidate, step.gain, values, charge=_charge(wide, beyond, candidate))


def _charge(wide: Problem, beyond: Beyond, candidate: Candidate) -> float | None:
    """Half the log of how much sharper than its prior a candidate's parameters are known (Laplace).

    What is only freed is known anyway: half the log of how much wider its prior becomes than what is known.
    None where some of its parameters are free already and others are not.
    """
    own = np.array([wide.bench.parameters.index_of(q.name) for q in candidate.parameters])
    open_ = np.isin(own, beyond.base)
    if open_.any() != open_.all() or (open_.any() and not candidate.doubted):
        return None
    believed = beyond.left_of(own) if open_.any() else beyond.within(own)
    (sign, after), before = np.linalg.slogdet(believed), 0.0
    if candidate.doubted:
        free, one = wide.bench.parameters.free, np.eye(own.size)
        wider = np.array(
            [
                q.prior_std / free[i - INERTIAL].prior_std
                for q, i in zip(candidate.parameters, own, strict=True)
            ]
        )
        before = float(after)
        sign, after = np.linalg.slogdet(np.outer(wider, wider) * (believed - one) + one)
    return 0.5 * float(after - before) if sign > 0 else None


def _supports(problem: Problem, mass: float, probe: Promise) -> list[Promise]:
    """What a ceiling's probe promises of a ceiling, and the vertical one of cables that stretch."""
    rig, model = problem.bench.rig, problem.bench.parameters.model
    name, compliance = next(iter(probe.values.items()))
    if compliance <= 0.0:
        return []
    compliance = min(compliance, largest_compliance(rig, mass))
    axis = "xyz".index(name[-1])
    out = [Promise(ceiling_candidate(rig, model, mass, axis), probe.gain, probe.values)]
    if axis == 2:
        stiffness = yielding_like(rig, model, compliance)
        elasticity = cable_elasticity(rig, model, mass)
        # A ceiling's probe says how much they yield where all carry alike
        also = tuple(Promise(elasticity, probe.gain, {STIFFNESS: s}) for s in stiffnesses(rig, mass))
        out.append(Promise(elasticity, probe.gain, {STIFFNESS: stiffness}, elsewhere=also))
    return out


def _riders(problem: Problem, beyond: Beyond, mass: float, count: int) -> list[Promise]:
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
    if problem.discrepancy is not None and "sprung_mass.mass" not in taken:
        bodies = _bodies_on_springs(problem, beyond, mass, found)
    best = [_best_swings(problem, beyond, swings, mass) for swings in found.values()]
    best.sort(key=lambda peaks: -peaks[0].gain)
    all_ways = [_ridden_promise(problem, beyond, every, mass) for every in bodies]
    # Only what may come to be the best of them, and beyond chance
    least = COARSE * max([least, *(peaks[0].gain for peaks in best)])
    return [
        *(
            _with_elsewhere([_best_near(problem, beyond, p, mass) if p.gain > least else p for p in peaks])
            for peaks in best
        ),
        *all_ways,
    ]


def _bodies_on_springs(
    problem: Problem, beyond: Beyond, mass: float, found: dict[tuple[str, str], list[Ridden]]
) -> list[Ridden]:
    """A part that moves along all axes, and parts that turn beside moving along all or along one of them.

    found: swings along each direction that were scanned. mass: kg, of the body.
    """
    along = [r for (effect, _), swings in found.items() if effect == "sprung_mass" for r in swings]
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
    effect = coarse.candidate.effect
    frequency = next(p.nominal for p in coarse.candidate.parameters if p.name == f"{effect}.frequency")
    axis = coarse.candidate.where["axis"]
    found = finer(problem, beyond, Swing("xy" if axis is None else str(axis), frequency), mass)
    if found is None:
        return []
    return [_ridden_promise(problem, beyond, found, mass)]


def _ridden_promise(problem: Problem, beyond: Beyond, found: Ridden, mass: float) -> Promise:
    """What a scanned rider promises; near the noise, what of it a motion accounts for."""
    best, gain = found.best, found.best.gain
    if misfit(beyond.full) < NEAR_SQUARE:
        runs = found.runs or columns_of(problem, beyond, found)
        gain -= _unearned(problem, beyond, found.columns, found.weights, runs)
    at = middle_of(problem.bench.rig) + spread_of(problem) * best.place
    candidate, values = rider_candidate(problem, found.swing, mass, float(best.amounts[0]), at)
    more = further_ways if found.swing.effect == "sprung_mass" else springs_instead
    candidate = replace(candidate, between=partial(more, found.swing, mass))
    for (a, _), inertia in zip(found.swing.turning, best.amounts[1:], strict=True):
        values[f"{found.swing.effect}.inertia.{a}"] = float(inertia)
        values[f"{found.swing.effect}.turning_damping_ratio.{a}"] = found.damping
    return Promise(candidate, gain, values | {f"{found.swing.effect}.damping_ratio": found.damping})


def further_ways(
    swing: Swing, mass: float, problem: Problem, evaluation: Evaluation
) -> list[tuple[Candidate, dict[str, float]]]:
    """A fitted part on springs, moving along further axes or a line between them, or turning.

    What promises more comes first.

    mass: kg, of the body. One that promises less than a half of the other is not asked before the other, but
    for a line: how far it leans first order knows least of all.
    """
    effect, known = swing.effect, swing.directions
    values = problem.bench.parameters.named(evaluation.point.theta)
    first = next(q.index for q in problem.bench.parameters.free if q.name == f"{effect}.mass") - layout.MASS
    leaning = Candidate(effect, tilt(effect, known, first), "", "", {})
    tilts = [leaning] if len(known) == 1 and not swing.tilted else []
    opened = opened_with(problem, evaluation, tilts) if values[f"{effect}.mass"] > 0.0 else None
    if opened is None:
        return []
    amount, at = values[f"{effect}.mass"], np.array([values[f"{effect}.position.{a}"] for a in AXES])
    have = {a: values[f"{effect}.frequency.{a}" if swing.along else f"{effect}.frequency"] for a in known}
    turning = {a: values[f"{effect}.turning_frequency.{a}"] for a, _ in swing.turning}
    damping = values[f"{effect}.damping_ratio"]
    asked: list[tuple[float, Swing, dict[str, float]]] = []
    for promise in (promise_of(*opened, c) for c in tilts):
        leans = {name: float(np.clip(v, -LEANING, LEANING)) for name, v in promise.values.items()}
        length = lean(leans, effect)
        own = {f"{effect}.frequency": have[known] * length, f"{effect}.damping_ratio": damping / length}
        moving = replace(swing, turning=tuple(turning.items()), tilted=True)
        asked.append((promise.gain, moving, leans | own))
    # Along a line between axes it moves along all of them
    ways = {} if swing.tilted else other_ways(problem, opened[1], known, amount, at)
    if ways:
        frequencies = {a: ways[a][0] if a in ways else have[a] for a in AXES if a in ways or a in have}
        along = tuple(frequencies.values())
        moving = Swing("".join(frequencies), min(along), along, tuple(turning.items()))
        asked.append((sum(gain for _, gain in ways.values()), moving, {}))
    turned = turning_ways(problem, opened[1], damping, "".join(turning))
    if turned.inertia:
        about = turning | turned.frequency
        moving = replace(swing, turning=tuple((a, about[a]) for a in AXES if a in about))
        moving = replace(
            moving, **({"along": tuple(have.values())} if swing.along else {"frequency": have[known]})
        )
        inertias = {f"{effect}.inertia.{a}": inertia for a, inertia in turned.inertia.items()}
        dampings = {f"{effect}.turning_damping_ratio.{a}": damping for a in turned.inertia}
        asked.append((turned.gain, moving, inertias | dampings))
    most = max((gain for gain, _, _ in asked), default=0.0)
    kept = {q.name: values[q.name] for q in problem.bench.parameters.free if q.name.startswith(f"{effect}.")}
    out = []
    for gain, moving, own in sorted(asked, key=lambda a: -a[0]):
        if gain >= AS_MUCH * most or (moving.tilted and not swing.tilted):
            candidate, start = rider_candidate(problem, moving, mass, amount, at)
            candidate = replace(candidate, between=partial(further_ways, moving, mass))
            names = {q.name for q in candidate.parameters}
            start |= {name: value for name, value in kept.items() if name in names}
            out.append((candidate, start | own))
    return out


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
    if opened is None or "sprung_mass.mass" in values:
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


def _solve(information: Array, gradient: Array) -> Array:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information * np.outer(scale, scale)
    return np.asarray(scale * np.linalg.lstsq(scaled, scale * gradient, rcond=1e-13)[0])


def _gain(information: Array, gradient: Array, index: NDArray[np.int64]) -> float:
    return 0.5 * float(_solve(information[np.ix_(index, index)], gradient[index]) @ gradient[index])
