"""All hypotheses at once, to first order: which would explain most of what is left?

The model is linearised once with every candidate's parameters among its columns. Freeing or
adding a set S of parameters then promises a gain in log posterior of
    1/2 g^T (F + P_S)^-1 g   less the same without S
(a score test, Rao 1948, with priors; F: Fisher information, g: gradient, P_S: prior
precisions with S's wide ones). It costs one small linear solve a candidate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import INERTIAL, Parameter
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.mismatch.candidate import Candidate
from rig_identification.model.effects import place
from rig_identification.model.layout import effects_offset
from rig_identification.model.motion import State

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Promise:
    """What one candidate would gain, to first order."""

    candidate: Candidate
    gain: float  # nats
    values: dict[str, float]  # its parameters, in their own units


def with_reference(problem: Problem, rest: State) -> Problem:
    """The problem with the rest pose written where effects that know one look for it."""
    parameters = problem.bench.parameters
    physics = parameters.model.physics.copy()
    block = effects_offset(parameters.model.cables)
    physics[block + place.REFERENCE_POSITION : block + place.REFERENCE_POSITION + 3] = rest.position
    physics[block + place.REFERENCE_ROTATION : block + place.REFERENCE_ROTATION + 9] = (
        rest.R_world_body.ravel()
    )
    model = parameters.model.with_physics(physics)
    return replace(problem, bench=replace(problem.bench, parameters=replace(parameters, model=model)))


def extended(problem: Problem, parameters: tuple[Parameter, ...]) -> Problem:
    """The same problem with further parameters free."""
    bench = replace(problem.bench, parameters=problem.bench.parameters.having(parameters))
    return replace(problem, bench=bench)


def carried(problem: Problem, other: Problem, point: Point) -> Point:
    """A point of ``other`` said in the parameters of ``problem``."""
    theta = problem.bench.parameters.converted(point.theta, other.bench.parameters)
    return replace(point, theta=theta)


def _all_parameters(candidates: list[Candidate], problem: Problem) -> tuple[Parameter, ...]:
    have = {p.name for p in problem.bench.parameters.free}
    new: dict[str, Parameter] = {}
    for candidate in candidates:
        for p in candidate.parameters:
            if p.name not in have:
                new[p.name] = p
    return tuple(new.values())


def screen(problem: Problem, evaluation: Evaluation, candidates: list[Candidate]) -> list[Promise]:
    """Promises of all candidates about ``evaluation``, best first."""
    wide = extended(problem, _all_parameters(candidates, problem))
    point = carried(wide, problem, evaluation.point)
    full = evaluate(wide, point)
    if full is None:
        return []
    free = wide.bench.parameters.free
    added = {q.name for q in free} - {q.name for q in problem.bench.parameters.free}
    column = {q.name: INERTIAL + i for i, q in enumerate(free)}
    theta = point.theta
    at_bound = np.zeros(full.information.shape[0], dtype=bool)
    for i, q in enumerate(free, start=INERTIAL):
        if q.name in added:
            at_bound[i] = True
        elif q.bounded and abs(theta[i]) > problem.bound - 1e-6:
            # Pressed against its bound: it moves only where it is freed
            at_bound[i] = theta[i] * full.gradient[i] > 0.0
    base = np.flatnonzero(~at_bound)
    out = []
    plain = _gain(full.information, full.gradient, base)
    for candidate in candidates:
        information, gradient = full.information.copy(), full.gradient.copy()
        chosen, scale = [], {}
        for q in candidate.parameters:
            i = column[q.name]
            chosen.append(i)
            own = free[i - INERTIAL]
            ratio = own.prior_std / q.prior_std
            # Replace the prior: precision 1 in the old units becomes ratio^2
            information[i, i] += ratio**2 - 1.0
            gradient[i] += theta[i] * (1.0 - ratio**2)
            scale[q.name] = own
        index = np.unique(np.concatenate([base, np.array(chosen, dtype=base.dtype)]))
        step = np.zeros(information.shape[0])
        step[index] = _solve(information[np.ix_(index, index)], gradient[index])
        gain = 0.5 * float(step[index] @ gradient[index]) - plain
        values = {
            name: own.nominal + own.prior_std * float(theta[column[name]] + step[column[name]])
            for name, own in scale.items()
        }
        out.append(Promise(candidate, gain, values))
    return sorted(out, key=lambda promise: -promise.gain)


def _solve(information: Array, gradient: Array) -> Array:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information * np.outer(scale, scale)
    return np.asarray(scale * np.linalg.lstsq(scaled, scale * gradient, rcond=1e-13)[0])


def _gain(information: Array, gradient: Array, index: NDArray[np.int64]) -> float:
    return 0.5 * float(_solve(information[np.ix_(index, index)], gradient[index]) @ gradient[index])
