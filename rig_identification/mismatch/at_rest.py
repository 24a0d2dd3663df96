"""What the rig at rest asks for, by itself.

A cable that is too long, a hinge or a level that is off shift what hangs still as well. Equilibrium holds no
valleys of a motion out of step, and a fit to it takes a few hundredths of a second: every number of rig and
devices is fitted, not promised to first order. Where four cables carry what three would, first order says
nothing at all: the body turns to one side or to the other with the root of what is wrong. So each is fitted
from a little to either side.

Rest says little of the body's height and nothing of its inertia. What the ideal model made of them may be
near, or bent past recognition: where the motion is fitted from is whichever of them and of what was guessed
beforehand leaves less of it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Point, Problem, solve
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import count_of, needed_gain
from rig_identification.mismatch.screen import Promise, carried, extended
from rig_identification.mismatch.trial import log_evidence
from rig_identification.mismatch.unbent import as_described, at_first

#: Where fits start, in std of a number's prior.
ASIDE = (0.3, -0.3)
#: Steps of a fit.
STEPS = 10
#: Nats within which rest tells next to nothing between two.
CLOSE = 5.0
#: Hypotheses of one effect that are told: its other places are its rivals anyway.
ALIKE = 2


@dataclass(frozen=True)
class AtRest:
    """What one hypothesis explains of the static recordings."""

    promise: Promise  # gain: log evidence, nats, over that of the model without it, as one place of many
    theta: NDArray[np.float64]  # (p,) the problem's parameters with it in
    settles: bool  # whether the rig at rest is explained with it, to the noise


def at_rest(
    problem: Problem,
    evaluation: Evaluation,
    candidates: list[Candidate],
    budget: Budget = UNLIMITED,
    promises: Sequence[Promise] = (),
) -> list[AtRest]:
    """Hypotheses that the static recordings ask for, likeliest first, a few of each effect.

    What changes the model is not asked. problem, evaluation: with effects found before, if any. Fits start
    about the same body in a rig as it is described. What comes after the ``budget`` is spent is not asked.
    promises: of the motion. Of what rest tells next to nothing about, which of three neighbours a load cell
    feels for one, those come first that the motion promises more of.
    """
    if not problem.rests:
        return []
    still = replace(problem, runs=())
    theta = as_described(problem, evaluation.point.theta)
    without = _fitted(still, Point(theta, (), evaluation.point.rest_guesses))
    if without is None or _quiet(still, without):
        return []
    asked = [c for c in candidates if c.build is None and not c.slow]
    out = []
    for candidate in asked:
        if budget.spent():
            break
        best = _with(candidate, still, without.point)
        if best is None:
            continue
        wide, fitted = best
        gain = log_evidence(fitted) - log_evidence(without)
        if gain > needed_gain(candidate, count_of(candidates)):
            named = wide.bench.parameters.named(fitted.point.theta)
            gain -= float(np.log(candidate.places))
            promise = Promise(candidate, gain, {q.name: named[q.name] for q in candidate.parameters})
            out.append(AtRest(promise, carried(still, wide, fitted.point).theta, _quiet(wide, fitted)))
    most = max((a.promise.gain for a in out), default=0.0)
    moving = {p.candidate.label: p.gain for p in promises}

    def order(found: AtRest) -> tuple[bool, float, float]:
        close = most - found.promise.gain < CLOSE
        told = moving.get(found.promise.candidate.label, 0.0) if close else 0.0
        return not close, -told, -found.promise.gain

    out.sort(key=order)
    before: Counter[str] = Counter()
    few: list[AtRest] = []
    for found in out:
        before[found.promise.candidate.kind] += 1
        if before[found.promise.candidate.kind] <= ALIKE:
            few.append(found)
    return few


def from_rest(problem: Problem, evaluation: Evaluation, found: AtRest) -> Evaluation | None:
    """Where a fit to the motion starts: the rig as it hangs with a hypothesis in, and the likelier body."""
    fitted = found.theta.copy()
    fitted[:INERTIAL] = evaluation.point.theta[:INERTIAL]
    starts = (at_first(problem, evaluation, theta) for theta in (found.theta, fitted))
    return min((s for s in starts if s is not None), key=lambda s: s.cost, default=None)


def _quiet(still: Problem, without: Evaluation) -> bool:
    """Whether residuals at rest, and what tolerances are used up for them, are mere noise."""
    theta = without.point.theta[INERTIAL:]
    used = sum(float(t**2) for t, q in zip(theta, still.bench.parameters.free, strict=True) if q.bounded)
    left = sum(float(r.residual @ r.residual) for r in without.rests)
    return used + left < sum(r.residual.size for r in without.rests)


def _with(candidate: Candidate, still: Problem, point: Point) -> tuple[Problem, Evaluation] | None:
    """The likeliest fit with a candidate in."""
    wide = extended(still, (candidate,))
    begun = carried(wide, still, point)
    first = wide.bench.parameters.index_of(candidate.parameters[0].name)
    fits = []
    for aside in ASIDE if candidate.positive == 0 else ASIDE[:1]:
        theta = begun.theta.copy()
        theta[first] = aside
        fits.append(_fitted(wide, replace(begun, theta=theta)))
    best = min((f for f in fits if f is not None), key=lambda f: f.cost, default=None)
    return None if best is None else (wide, best)


def _fitted(problem: Problem, point: Point) -> Evaluation | None:
    try:
        return solve(problem, point, iterations=STEPS, tolerance=0.05)[0]
    except FloatingPointError:
        return None
