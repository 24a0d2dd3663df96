"""A model fitted with its discrepancy as a random wrench, level by level, down to what the evidence asks for.

At a strong wrench the residuals are innovations about a motion that follows the data: nearly linear in all
parameters, so that Gauss and Newton's steps find their valley from anywhere. The evidence then tells how weak
the wrench may be. Where it asks for none the model explains the fitted runs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.solve import (
    Evaluation,
    Point,
    Problem,
    evaluate,
    left_to_go,
    moved_by,
    promised_by,
    solve,
    still_promised,
)
from rig_identification.mismatch.trial import log_evidence
from rig_identification.search.levels import ALONE, at_level
from rig_identification.search.path import beside, followed, found_from

#: Gain (nats) that a step has to promise: less does not tell models apart.
WORTH = 2.0
#: Level at which a first guess begins: an order of magnitude from what most recordings ask for.
MIDDLE = 3
#: Steps at each level on the way down, and where the way ends.
PASSING, STAYING = 2, 6
#: Parts of a step that are tried where all of it does not pay.
SHORTER = (1.0, 0.3, 0.1)
#: How far (nats) the cost may rise in a step: relinearised, it is another one by about as much.
JITTER = 1.0
#: Mean square residual from which a motion is lost: a wrench half a decade too weak multiplies it by ten.
LOST = 30.0
#: Share of what a step promises that it gains at least: first order is right within a factor of two.
REACHED = 0.5
#: Steps of the fit of a model alone.
ALONE_STEPS = 20


@dataclass(frozen=True)
class Rung:
    """A model fitted at one level of its discrepancy."""

    problem: Problem  # with the discrepancy
    evaluation: Evaluation
    level: int

    @property
    def evidence(self) -> float:
        """Log marginal likelihood less a constant."""
        return log_evidence(self.evaluation)

    @property
    def within_reach(self) -> float:
        """Evidence, and what a full step still promises of it: fits of few steps are compared by both."""
        return self.evidence + max(0.0, still_promised(self.problem, self.evaluation))

    @property
    def alone(self) -> bool:
        """Whether the model needs no wrench beside it."""
        return self.level == ALONE

    @property
    def model(self) -> Problem:
        """The problem without the discrepancy."""
        return replace(self.problem, discrepancy=None)


def begun(problem: Problem, point: Point) -> Rung | None:
    """A model at its own level, from a first guess; None where not even the strongest wrench follows."""
    for level in (MIDDLE, 0):
        found = found_from(_at(problem, point, level), point)
        rung = None if found is None else walked_down(problem, found, level)
        if rung is not None and (level == 0 or misfit(rung.evaluation) < LOST):
            # At the strongest wrench what is left lies in a device that no force accounts for
            return rung if rung.level > level else climbed(rung)
    return None


def climbed(rung: Rung) -> Rung:
    """A model at the level that the evidence asks for, of its own and stronger ones."""
    best = rung
    for level in reversed(range(rung.level)):
        point = best.evaluation.point
        stronger = fitted_at(best.model, replace(point, latents=()), level, PASSING)
        if stronger is None or stronger.evidence < best.evidence:
            break
        best = stronger
    return best


def walked_down(problem: Problem, point: Point, level: int) -> Rung | None:
    """The model at the level that the evidence asks for, from ``level`` on; None where it cannot be fitted.

    point: with the wrenches of that level.
    """
    best = fitted_at(problem, point, level, PASSING)
    if best is None:
        return None
    alone = _alone_at_once(best)
    leapt = None if alone is None else climbed(alone)
    if leapt is not None and leapt.alone:
        return leapt
    # Where it leaves something after all the leap may have led into another valley
    while best.level < ALONE:
        weaker = fitted_at(problem, best.evaluation.point, best.level + 1, PASSING)
        if weaker is not None and weaker.evidence < best.evidence < _at_best(weaker):
            # Only where a fit to its end says so is a weaker wrench less likely
            weaker = fitted_at(problem, weaker.evaluation.point, weaker.level, STAYING)
        if weaker is None or weaker.evidence < best.evidence:
            break
        best = weaker
    return best if leapt is None or best.evidence > leapt.evidence else leapt


def _at_best(rung: Rung) -> float:
    """Evidence that further steps may come to: what is promised is right within a factor of two."""
    return rung.evidence + (rung.within_reach - rung.evidence) / REACHED


def _alone_at_once(rung: Rung) -> Rung | None:
    """The model without a wrench, where its motion is not lost and it is likelier; None where it is not."""
    if rung.level >= ALONE - 1:
        return None
    point = replace(rung.evaluation.point, latents=())
    try:
        there = evaluate(rung.model, point, residuals_only=True)
        if there is None or misfit(there) > LOST:
            return None
        near, _ = solve(rung.model, point, iterations=STAYING, tolerance=0.05)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None
    if log_evidence(near) < rung.evidence:
        return None
    return fitted_at(rung.model, near.point, ALONE, STAYING)


def fitted_at(problem: Problem, point: Point, level: int, steps: int) -> Rung | None:
    """The model fitted in so many steps at one level; None where it cannot be followed there."""
    try:
        here = _at(problem, point, level)
        if level == ALONE:
            evaluation, _ = solve(here, replace(point, latents=()), iterations=ALONE_STEPS, tolerance=0.05)
            return Rung(here, evaluation, level)
        found = _stepped(here, point, steps)
        return None if found is None else Rung(here, found, level)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None


def _at(problem: Problem, point: Point, level: int) -> Problem:
    """The problem with a discrepancy of that level for the body as ``point`` has it."""
    return at_level(problem, float(problem.bench.parameters.elements(point.theta)[0]), level)


def _stepped(problem: Problem, point: Point, steps: int) -> Evaluation | None:
    current = _followed(problem, point)
    for _ in range(steps):
        if current is None:
            return None
        step = left_to_go(problem, current)
        if promised_by(current, step) < WORTH:
            break
        better = _paying(problem, current, step)
        if better is None:
            break
        current = better
    return current


def _followed(problem: Problem, point: Point) -> Evaluation | None:
    """The problem about the motion that the recordings tell, from the wrenches that ``point`` has.

    An effect that enters with all of its amount acts beside wrenches that stood in for it, and within seconds
    the motion is lost: the wrenches are then found anew.
    """
    current = _evaluated(problem, followed(problem, point))
    if current is not None and misfit(current) < LOST:
        return current
    other = _evaluated(problem, found_from(problem, replace(point, latents=())))
    return min((e for e in (current, other) if e is not None), key=lambda e: e.cost, default=None)


def _paying(problem: Problem, current: Evaluation, step: np.ndarray) -> Evaluation | None:
    """As much of a step as pays, with each run's wrench smoothed again; None where nothing of it does."""
    for part in SHORTER:
        moved = moved_by(problem, current, part * step)
        new = _evaluated(problem, followed(problem, beside(problem, moved, problem, current)))
        if new is not None and new.cost < current.cost + JITTER:
            return new
    return None


def _evaluated(problem: Problem, point: Point | None) -> Evaluation | None:
    return None if point is None else evaluate(problem, point)
