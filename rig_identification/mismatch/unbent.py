"""From where nothing is bent: rig and devices as described, whatever the ideal model made of them.

A model that lacks much bends everything to swallow it. About such a fit first order may promise nothing of
what is wrong, for a level that is off by many tolerances is spread over a dozen hinges by then; and descent
from there, with the right effect in the model, may end in another valley. So where very much is left
hypotheses are screened about the same body in the rig as described as well, and fitted from there and from
where the ideal model's own fit began.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.growing import settled_starts
from rig_identification.estimate.launch import launch_states
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, excess
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.screen import Promise
from rig_identification.mismatch.trial import Trial, attempt

#: Promises that are tried, of each screening.
MOST = 4
#: Share of what is left by which fits from two starts differ at most where a third one finds nothing new.
ALIKE = 0.05


def as_described(problem: Problem, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Parameters of the same body, and of all that an effect added, in a rig as it is described."""
    bent = [i for i, q in enumerate(problem.bench.parameters.free, start=INERTIAL) if q.bounded]
    theta = theta.copy()
    theta[bent] = 0.0
    return theta


def unbent(problem: Problem, evaluation: Evaluation) -> Evaluation | None:
    """About the same body, and all that an effect added, in a rig as it is described."""
    point = replace(evaluation.point, theta=as_described(problem, evaluation.point.theta))
    return evaluate(problem, replace(point, starts=settled_starts(problem, point)))


def at_first(problem: Problem, evaluation: Evaluation, theta: NDArray[np.float64]) -> Evaluation | None:
    """About ``theta``, where the ideal model's fit began."""
    guesses = evaluation.point.rest_guesses
    rest = (*guesses, *evaluation.point.starts)[0]
    starts = launch_states(problem.bench, problem.runs, theta, rest)
    return evaluate(problem, Point(theta, starts, guesses))


def likely(*screened: list[Promise]) -> list[Promise]:
    """Of promises, best first, those that are tried, in turn: fits that take a second or two."""
    soon = [[p for p in promises if not p.candidate.slow][:MOST] for promises in screened]
    return [p for turn in zip_longest(*soon) for p in turn if p is not None]


def best_of(
    problem: Problem, starts: list[Evaluation], promise: Promise, budget: Budget
) -> tuple[Trial | None, bool]:
    """The likelier first fit of a promise from either start, and whether all of them come to the same."""
    tried = [attempt(problem, start, promise, budget) for start in starts]
    fits = [t for t in tried if t is not None]
    left = [excess(t.evaluation) for t in fits]
    alike = len(fits) > 1 and len(fits) == len(tried) and max(left) <= (1.0 + ALIKE) * min(left)
    return max(fits, key=lambda t: t.evidence, default=None), alike
