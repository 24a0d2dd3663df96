"""What gives way, by trying how much: cables that stretch and a ceiling that yields.

They ring at tens of hertz: first order about a rig that does not give way tells next to nothing of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from rig_identification.estimate.growing import settled_starts
from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, excess, shortened
from rig_identification.estimate.stretching import usual_stiffness
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.opened import Promise, carried, extended
from rig_identification.mismatch.rider_promises import ELSEWHERE
from rig_identification.mismatch.supports import (
    CEILING_FREQUENCY,
    cable_elasticity,
    ceiling_candidate,
    gives_way,
    largest_compliance,
)
from rig_identification.mismatch.trial import HORIZONS, promised

Array = NDArray[np.float64]

#: What gives way is looked at more finely where trying its amounts takes away a larger part of what is left.
WORTH = 0.05
#: Parts of the largest compliance of a ceiling that are tried.
SINKS = (0.03, 0.7)
#: Multiples of the usual stiffness of cables that are tried: thin wire to thick rope.
STRETCHES = (0.1, 18.0)
#: Frequencies (Hz) of a ceiling by itself that are tried: what it weighs decides at which one it rings with
#: the body, and a light one that is held for a heavy one is out of step at any compliance.
CEILING_FREQUENCIES = (CEILING_FREQUENCY, 2.0 * CEILING_FREQUENCY, 4.0 * CEILING_FREQUENCY)
#: Factor between two amounts: little is left, and one that is not nearly right explains none of that.
SPACED = 1.4


@dataclass(frozen=True)
class Amount:
    """How much of what a change of the model's amount explains, by trying it instead of to first order.

    It is tried over the second of HORIZONS: what rings is soon out of step everywhere else.
    """

    problem: Problem
    evaluation: Evaluation
    candidate: Candidate
    name: str  # of the parameter that an amount is a value of

    @cached_property
    def part(self) -> Problem:
        """What amounts are tried on."""
        return shortened(self.problem, HORIZONS[-1])

    @cached_property
    def before(self) -> Evaluation | None:
        """That part without the change."""
        return evaluate(self.part, self.evaluation.point, residuals_only=True)

    def gain(self, amount: float) -> float:
        """What ``amount`` explains (nats) with everything else but start states as it is."""
        wide = extended(self.part, (self.candidate,))
        start = carried(wide, self.problem, self.evaluation.point)
        before = self.before
        try:
            point = promised(wide, start, self.candidate, {self.name: amount}, self.evaluation)
            found = evaluate(wide, replace(point, starts=settled_starts(wide, point)), residuals_only=True)
        except FloatingPointError:
            return 0.0
        if before is None or found is None:
            return 0.0
        return before.cost - found.cost

    def best(self, amounts: list[float]) -> Promise:
        """The promise of the best of ``amounts``."""
        gains = [self.gain(amount) for amount in amounts]
        at = int(np.argmax(gains))
        return self._promise(amounts[at], gains[at])

    def refined(self, promise: Promise) -> Promise:
        """The promise with the best amount within a factor of SPACED of its own."""
        amount = promise.values[self.name]
        found = minimize_scalar(
            lambda x: -self.gain(amount * float(np.exp(x))),
            bounds=(-np.log(SPACED), np.log(SPACED)),
            method="bounded",
            options={"xatol": 0.1},
        )
        better = self._promise(amount * float(np.exp(found.x)), -float(found.fun))
        return max(promise, replace(better, elsewhere=promise.elsewhere), key=lambda p: p.gain)

    def _promise(self, amount: float, gain: float) -> Promise:
        return Promise(self.candidate, max(0.0, gain), {self.name: amount})


def supports(
    problem: Problem, evaluation: Evaluation, mass: float, budget: Budget = UNLIMITED
) -> list[Promise]:
    """What gives way, each scanned over its amount; nothing where the model gives way already.

    What comes after the ``budget`` is spent is not scanned.
    """
    rig, model = problem.bench.rig, problem.bench.parameters.model
    if gives_way(model) or budget.spent():
        return []
    found = [_stretching(problem, evaluation, mass)]
    sinks = list(largest_compliance(rig, mass) * _spread(SINKS))
    for axis, a in enumerate(AXES):
        if budget.spent():
            break
        ceilings = [ceiling_candidate(rig, model, mass, axis, frequency=f) for f in CEILING_FREQUENCIES]
        tried = [Amount(problem, evaluation, c, f"ceiling.compliance.{a}") for c in ceilings]
        first, *others = sorted(((t, t.best(sinks)) for t in tried), key=lambda t: -t[1].gain)
        # Another frequency may lead to another mass and stiffness, and hide as much from a scan of amounts
        also = tuple(p for _, p in others[:1] if p.gain > ELSEWHERE * first[1].gain)
        found.append((first[0], replace(first[1], elsewhere=also)))
    out = [promise for _, promise in found]
    finer = {int(np.argmax([promise.gain for promise in out]))}
    if out[0].gain > WORTH * excess(evaluation):
        # Where cables ring with the exciter a fifth more or less hides most of what they explain
        finer.add(0)
    for i in sorted(finer):
        if out[i].gain > 0.0 and not budget.spent():
            out[i] = found[i][0].refined(out[i])
    return out


def _stretching(problem: Problem, evaluation: Evaluation, mass: float) -> tuple[Amount, Promise]:
    rig, model = problem.bench.rig, problem.bench.parameters.model
    amounts = usual_stiffness(rig, mass) * _spread(STRETCHES)
    amount = Amount(problem, evaluation, cable_elasticity(rig, model, mass), "cable.axial_stiffness")
    return amount, amount.best(list(amounts))


def _spread(ends: tuple[float, float]) -> Array:
    """Amounts from end to end, at most a factor of SPACED apart."""
    count = int(np.ceil(np.log(ends[1] / ends[0]) / np.log(SPACED))) + 1
    return np.asarray(np.geomspace(*ends, count))
