"""What gives way, by trying how much: cables that stretch and a ceiling that yields.

They ring at tens of hertz: first order about a rig that does not give way tells next to nothing of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from rig_identification.estimate.growing import NEAR_SQUARE, misfit, settled_starts
from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, excess, shortened
from rig_identification.estimate.stretching import usual_stiffness
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.riders import Swing, rider_candidate
from rig_identification.mismatch.screen import ELSEWHERE, Promise, carried, extended
from rig_identification.mismatch.supports import (
    CEILING_FREQUENCY,
    cable_elasticity,
    ceiling_candidate,
    gives_way,
    largest_compliance,
)
from rig_identification.mismatch.trial import HORIZONS, Trial, promised

Array = NDArray[np.float64]

#: A promise this much (nats) behind the best is not worth a fit, in parts of the best; nor is what gives way
#: where trying its amounts takes away no larger part of what is left.
WORTH = 0.05
#: Parts of the largest compliance of a ceiling that are tried.
SINKS = (0.03, 0.7)
#: Multiples of the usual stiffness of cables that are tried: thin wire to thick rope.
STRETCHES = (0.1, 18.0)
#: Frequencies (Hz) of a ceiling by itself that are tried: what it weighs decides at which one it rings with
#: the body, and a light one that is held for a heavy one is out of step at any compliance.
CEILING_FREQUENCIES = (CEILING_FREQUENCY, 2.0 * CEILING_FREQUENCY, 4.0 * CEILING_FREQUENCY)
#: What takes energy out, and the parts of its prior's std that are tried.
BRAKES = ("hinge_damping", "hinge_friction", "air_drag")
BRAKED = (0.1, 10.0)
#: Share of what is left that counts as the larger part of it.
CHIEF = 0.5
#: Factor between two amounts, and where little is left.
SPACED, FINELY = 3.2, 1.4


@dataclass(frozen=True)
class Amount:
    """How much of what a change of the model's amount explains, by trying it instead of to first order.

    It is tried over the second of HORIZONS: what rings is soon out of step everywhere else. Where much is
    left what that tells is told of all; near the noise it tells no more than it sees.
    """

    problem: Problem
    evaluation: Evaluation
    candidate: Candidate
    name: str  # of the parameter that an amount is a value of

    @cached_property
    def far(self) -> bool:
        """Whether much is left."""
        return misfit(self.evaluation) > NEAR_SQUARE

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
        scale = excess(self.evaluation) / max(1.0, excess(before)) if self.far else 1.0
        return scale * (before.cost - found.cost)

    def best(self, amounts: list[float]) -> Promise:
        """The promise of the best of ``amounts``."""
        gains = [self.gain(amount) for amount in amounts]
        at = int(np.argmax(gains))
        return self._promise(amounts[at], gains[at])

    def refined(self, promise: Promise, spaced: float) -> Promise:
        """The promise with the best amount within a factor of ``spaced`` of its own."""
        amount = promise.values[self.name]
        found = minimize_scalar(
            lambda x: -self.gain(amount * float(np.exp(x))),
            bounds=(-np.log(spaced), np.log(spaced)),
            method="bounded",
            options={"xatol": 0.1},
        )
        better = self._promise(amount * float(np.exp(found.x)), -float(found.fun))
        return max(promise, replace(better, elsewhere=promise.elsewhere), key=lambda p: p.gain)

    def _promise(self, amount: float, gain: float) -> Promise:
        left = max(1.0, excess(self.evaluation))
        return Promise(self.candidate, max(0.0, gain), {self.name: amount}, max(0.0, gain) / left)


def supports(
    problem: Problem, evaluation: Evaluation, mass: float, budget: Budget = UNLIMITED
) -> list[Promise]:
    """What gives way, each scanned over its amount; nothing where the model gives way already.

    What comes after the ``budget`` is spent is not scanned.
    """
    rig, model = problem.bench.rig, problem.bench.parameters.model
    if gives_way(model) or budget.spent():
        return []
    spaced = _spacing(evaluation)
    found = [_stretching(problem, evaluation, mass)]
    sinks = list(largest_compliance(rig, mass) * _spread(SINKS, spaced))
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
    if out[0].share > WORTH:  # cables that stretch: see stretching
        finer.add(0)
    for i in sorted(finer):
        if out[i].gain > 0.0 and not budget.spent():
            out[i] = found[i][0].refined(out[i], spaced)
    return out


def stretching(problem: Problem, evaluation: Evaluation, mass: float) -> Promise | None:
    """Cables that stretch, at their best stiffness; None where the model gives way already.

    Where they ring with the exciter a fifth more or less hides most of what they explain: any share that is
    worth a fit is looked at more finely.
    """
    if gives_way(problem.bench.parameters.model):
        return None
    amount, promise = _stretching(problem, evaluation, mass)
    return amount.refined(promise, _spacing(evaluation)) if promise.share > WORTH else promise


def _stretching(problem: Problem, evaluation: Evaluation, mass: float) -> tuple[Amount, Promise]:
    rig, model = problem.bench.rig, problem.bench.parameters.model
    amounts = usual_stiffness(rig, mass) * _spread(STRETCHES, _spacing(evaluation))
    amount = Amount(problem, evaluation, cable_elasticity(rig, model, mass), "cable.axial_stiffness")
    return amount, amount.best(list(amounts))


def _spacing(evaluation: Evaluation) -> float:
    """Factor between two amounts.

    Near the noise little is seen: an amount that is not nearly right explains none of that.
    """
    return SPACED if misfit(evaluation) > NEAR_SQUARE else FINELY


def brakes(problem: Problem, evaluation: Evaluation, promises: list[Promise]) -> list[Promise]:
    """What takes energy out, each scanned over its amount.

    Much of it leaves no swing that first order could tell it by.
    """
    out = []
    for p in promises:
        if p.candidate.effect not in BRAKES:
            continue
        first = p.candidate.parameters[0]
        amount = Amount(problem, evaluation, p.candidate, first.name)
        out.append(amount.best(list(first.prior_std * _spread(BRAKED, SPACED))))
    return [p for p in out if p.share > WORTH]


def _spread(ends: tuple[float, float], spaced: float) -> Array:
    """Amounts from end to end, at most a factor of ``spaced`` apart."""
    count = int(np.ceil(np.log(ends[1] / ends[0]) / np.log(spaced))) + 1
    return np.asarray(np.geomspace(*ends, count))


def ringing_ceiling(problem: Problem, frequency: float, axis: int, mass: float, gain: float) -> Promise:
    """A ceiling that rings at ``frequency`` (Hz) along ``axis``, as a part on springs would.

    A ceiling that is light rings together with the body, slower than by itself; scanned at its usual
    frequency it is out of step at any amount. With next to no compliance it rings at its own frequency:
    from there a fit follows both. gain: nats that the part on springs promises, or wins.
    """
    rig, model = problem.bench.rig, problem.bench.parameters.model
    ceiling = ceiling_candidate(rig, model, mass, axis, frequency=frequency)
    compliance = SINKS[0] * largest_compliance(rig, mass)
    return Promise(ceiling, gain, {f"ceiling.compliance.{AXES[axis]}": compliance})


def ringing_like(problem: Problem, tried: list[Trial], before: Evaluation, mass: float) -> list[Promise]:
    """Ceilings that ring as that fitted part on springs does which takes the larger part of what is left."""
    riders = [t for t in tried if t.candidate.effect in ("sprung_mass", "liquid_slosh")]
    best = min(riders, key=lambda t: excess(t.evaluation), default=None)
    if best is None or excess(best.evaluation) > CHIEF * excess(before):
        return []
    parameters = best.problem.bench.parameters
    values = parameters.named(best.evaluation.point.theta)
    frequency = float(values[f"{best.candidate.effect}.frequency"])
    axis = best.candidate.where["axis"]
    gain = before.cost - best.evaluation.cost
    return [
        ringing_ceiling(problem, frequency, AXES.index(a), mass, gain)
        for a in ("xy" if axis is None else str(axis))
    ]


def far_promises(
    problem: Problem,
    evaluation: Evaluation,
    promises: list[Promise],
    mass: float,
    budget: Budget = UNLIMITED,
) -> list[Promise]:
    """What gives way, and the best rider to one side and to all, whatever screening promises of them."""
    if gives_way(problem.bench.parameters.model):
        return []
    out = [p for p in supports(problem, evaluation, mass, budget) if p.share > WORTH]
    out += brakes(problem, evaluation, promises)
    riders = [p for p in promises if p.candidate.effect in ("liquid_slosh", "sprung_mass")]
    out += riders[:1]
    springs = next((p for p in promises if p.candidate.effect == "sprung_mass"), None)
    if springs is not None:
        frequency = next(p.nominal for p in springs.candidate.parameters if p.name == "sprung_mass.frequency")
        axis = AXES.index(str(springs.candidate.where["axis"]))
        ringing = ringing_ceiling(problem, frequency, axis, mass, springs.gain)
        out.append(replace(ringing, share=springs.share))
    if riders and riders[0].candidate.effect == "sprung_mass":
        # What swings along one axis may swing to all sides
        first = riders[0]
        o = {p.name: p for p in first.candidate.parameters}
        swing = Swing("xy", o["sprung_mass.frequency"].nominal)
        at = np.array([o[f"sprung_mass.position.{a}"].nominal for a in AXES])
        liquid, values = rider_candidate(problem, swing, mass, first.values["sprung_mass.mass"], at)
        out.append(Promise(liquid, 0.0, values))
    return out
