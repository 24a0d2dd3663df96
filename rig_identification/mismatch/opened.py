"""A problem with what hypotheses add among its unknowns, and what each promises by itself.

The score test of screen.py, one hypothesis at a time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.boxed import Boxed, probed_of
from rig_identification.mismatch.candidate import Candidate
from rig_identification.model.motion import State

Array = NDArray[np.float64]


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
