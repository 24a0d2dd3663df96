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
from rig_identification.estimate.solve import POLISH, Evaluation, Point, Problem, evaluate, solve
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import compatible, count_of, needed_gain
from rig_identification.mismatch.screen import Promise, carried, extended, promises_of
from rig_identification.mismatch.trial import log_evidence, promised
from rig_identification.mismatch.unbent import as_described, at_first

#: Where fits start, in std of a number's prior.
ASIDE = (0.3, -0.3)
#: Nats that are none at all: what only motion shows.
NONE = 1e-9
#: Steps of a fit, and after how many it is seen where it leads; nats behind what explains rest, to the noise,
#: that no fit is followed to.
STEPS, SURE, FAR_BEHIND = 10, 4, 60.0
#: Nats within which rest tells next to nothing between two.
CLOSE = 5.0
#: Hypotheses of one effect that are told: its other places are its rivals anyway.
ALIKE = 2
#: Hypotheses that one of a pair is looked for among, others fitted beside each, and pairs that are told.
FIRSTS, SECONDS, PAIRS = 4, 12, 3


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
    still, without = _still(problem, evaluation)
    if without is None or _quiet(still, without):
        return []
    out = []
    least = np.inf  # cost of what explains rest best, to the noise
    for candidate in _shown_at_rest(still, without, candidates):
        if budget.spent():
            break
        best = _with(candidate, still, without.point, least + FAR_BEHIND)
        if best is None:
            continue
        wide, fitted = best
        quiet = _quiet(wide, fitted)
        least = min(least, fitted.cost) if quiet else least
        gain = log_evidence(fitted) - log_evidence(without)
        if gain > needed_gain(candidate, count_of(candidates)):
            named = wide.bench.parameters.named(fitted.point.theta)
            gain -= float(np.log(candidate.places))
            promise = Promise(candidate, gain, {q.name: named[q.name] for q in candidate.parameters})
            out.append(AtRest(promise, carried(still, wide, fitted.point).theta, quiet))
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


@dataclass(frozen=True)
class BothAtRest:
    """Two hypotheses with which the static recordings are explained, to the noise."""

    first: Candidate  # of which rest asks more
    second: Candidate
    evidence: float  # log evidence at rest, each as one place of many
    problem: Problem  # with both in
    starts: tuple[Evaluation, ...]  # of the motion, what leaves least first


def both_at_rest(
    problem: Problem,
    evaluation: Evaluation,
    asked: Sequence[AtRest],
    candidates: list[Candidate],
    budget: Budget = UNLIMITED,
) -> list[BothAtRest]:
    """Pairs that explain the static recordings where no single hypothesis does, likeliest first.

    asked: what rest asks for, likeliest first; one of a pair is among the first of them. The other one is
    fitted, from either side again, where first order promises most beside it.
    """
    still, without = _still(problem, evaluation)
    if without is None or any(a.settles for a in asked):
        return []
    settled: dict[frozenset[str], tuple[float, Candidate, Candidate, Problem, Evaluation]] = {}
    for found in asked[:FIRSTS]:
        first = found.promise.candidate
        alone = None if budget.spent() else _with(first, still, without.point)
        if alone is None:
            continue
        for second in _shown_at_rest(*alone, compatible(candidates, [first]))[:SECONDS]:
            pair = frozenset((first.label, second.label))
            both = None if pair in settled or budget.spent() else _with(second, alone[0], alone[1].point)
            if both is None or not _quiet(*both):
                continue
            told = log_evidence(both[1]) - float(np.log(first.places) + np.log(second.places))
            settled[pair] = told, first, second, *both
    likely = sorted(settled.values(), key=lambda pair: -pair[0])[:PAIRS]
    out = []
    for told, first, second, wide, fitted in likely:
        moving = extended(problem, (first, second))
        # The rig as it hangs, with the likelier body, and where the search stands with nothing else changed
        hanging = _begun(moving, evaluation, carried(moving, wide, fitted.point).theta)
        values = wide.bench.parameters.named(fitted.point.theta)
        point = carried(moving, problem, evaluation.point)
        for candidate in (first, second):
            point = promised(moving, point, candidate, values, evaluation)
        starts = [s for s in (hanging, evaluate(moving, point)) if s is not None]
        starts.sort(key=lambda s: s.cost)
        out.append(BothAtRest(first, second, told, moving, tuple(starts)))
    return out


def _shown_at_rest(still: Problem, without: Evaluation, candidates: list[Candidate]) -> list[Candidate]:
    """Those of ``candidates`` that can show at rest, what first order promises most of first.

    A reading follows its device's numbers in a straight line, and promises what it keeps; of the rig first
    order only says whether a number matters at all.
    """
    # A mean holds no time: a drift is a zero to it, which is asked by itself
    asked = [c for c in candidates if c.build is None and not c.slow and c.where.get("law") != "drift"]
    # A wrong sign says nothing of the rig either
    promises = promises_of(still, without, [replace(c, positive=0) for c in asked])
    shown = [
        (c, p.gain)
        for c, p in zip(asked, promises, strict=False)
        if p.gain > (needed_gain(c, count_of(candidates)) if _reads(c) else NONE)
    ]
    return [c for c, _ in sorted(shown, key=lambda s: -s[1])]


def _reads(candidate: Candidate) -> bool:
    """Whether a candidate changes what a device reads, and nothing of what hangs there."""
    return all(p.kind == "device" for p in candidate.parameters)


def _still(problem: Problem, evaluation: Evaluation) -> tuple[Problem, Evaluation | None]:
    """The static recordings alone, and the rig as described fitted to them; None where there are none."""
    still = replace(problem, runs=())
    if not problem.rests:
        return still, None
    theta = as_described(problem, evaluation.point.theta)
    return still, _fitted(still, Point(theta, (), evaluation.point.rest_guesses))


def from_rest(problem: Problem, evaluation: Evaluation, found: AtRest) -> Evaluation | None:
    """Where a fit to the motion starts: the rig as it hangs with a hypothesis in, and the likelier body."""
    return _begun(problem, evaluation, found.theta)


def _begun(problem: Problem, evaluation: Evaluation, theta: NDArray[np.float64]) -> Evaluation | None:
    """About ``theta`` with its own body or that of ``evaluation``, whichever leaves less of the motion."""
    fitted = theta.copy()
    fitted[:INERTIAL] = evaluation.point.theta[:INERTIAL]
    starts = (at_first(problem, evaluation, t) for t in (theta, fitted))
    return min((s for s in starts if s is not None), key=lambda s: s.cost, default=None)


def _quiet(still: Problem, without: Evaluation) -> bool:
    """Whether residuals at rest, and what tolerances are used up for them, are mere noise."""
    theta = without.point.theta[INERTIAL:]
    used = sum(float(t**2) for t, q in zip(theta, still.bench.parameters.free, strict=True) if q.bounded)
    left = sum(float(r.residual @ r.residual) for r in without.rests)
    return used + left < sum(r.residual.size for r in without.rests)


def _with(
    candidate: Candidate, still: Problem, point: Point, near: float = np.inf
) -> tuple[Problem, Evaluation] | None:
    """The likeliest fit with a candidate in. near: cost that is worth going on for."""
    wide = extended(still, (candidate,))
    begun = carried(wide, still, point)
    first = wide.bench.parameters.index_of(candidate.parameters[0].name)
    fits = []
    sides = (0.0,) if _reads(candidate) else (ASIDE if candidate.positive == 0 else ASIDE[:1])
    for aside in sides:
        theta = begun.theta.copy()
        theta[first] = aside
        fits.append(_fitted(wide, replace(begun, theta=theta), near))
    best = min((f for f in fits if f is not None), key=lambda f: f.cost, default=None)
    return None if best is None else (wide, best)


def _fitted(problem: Problem, point: Point, near: float = np.inf) -> Evaluation | None:
    costs: list[float] = []

    def hopeless() -> bool:
        """Whether as many steps as are left, each winning what the last one did, do not come ``near``."""
        if len(costs) < SURE:
            return False
        return costs[-1] - (STEPS - len(costs)) * (costs[-2] - costs[-1]) > near

    try:
        return solve(
            problem,
            point,
            iterations=STEPS,
            tolerance=0.05,
            polish=POLISH,
            notify=lambda _, cost: costs.append(cost),
            stop=hopeless,
        )[0]
    except FloatingPointError:
        return None
