"""Models with one more effect: screened where the model at hand stands, the best fitted and walked down.

All hypotheses are compared by one number, the evidence, each with the discrepancy that it asks for itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.growing import NEAR_SQUARE, misfit, shows
from rig_identification.estimate.identify import ORDINARY
from rig_identification.estimate.solve import Point, Problem, excess
from rig_identification.estimate.stretching import STIFFNESS
from rig_identification.mismatch.amounts import supports
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import compatible, count_of, net_gain, stood_for
from rig_identification.mismatch.in_motion import unearned
from rig_identification.mismatch.late import lag_like, told_apart
from rig_identification.mismatch.opened import Promise, carried, extended
from rig_identification.mismatch.same_clock import contradicted
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.supports import TAUT, cable_elasticity, gives_way, stiffnesses, taut_cables
from rig_identification.mismatch.trial import (
    Trial,
    attempt,
    beyond_doubt,
    mass_of,
    ordinary_errors,
    possible,
    promised,
)
from rig_identification.model.motion import State
from rig_identification.search.ladder import REACHED, STAYING, Rung, fitted_at, walked_down
from rig_identification.search.laws import promised_laws
from rig_identification.search.path import beside

#: Is told what is being fitted.
Say = Callable[[str], None]

#: Hypotheses that are fitted after each screening, of each kind so many, and how many to their own level.
FITTED, ALIKE, WALKED = 5, 2, 3
#: Share of the best promise that another one has to come to.
SHARE = 0.1
#: Share of what is left of the residuals as a whole that counts as the larger part.
CHIEF = 0.5
#: Level at which a wrench of 3 % of the weight carries all but the largest effects.
STRONG = 1
#: Nats that count ("positive" evidence: Kass and Raftery, J. Am. Stat. Assoc. 90, 1995).
MEANT = 3.0
#: Steps of the first fit of each. What a further step promises is counted: with four steps the same were the
#: best, at a fourth more work (sessions of bench/concealed, labs).
FIRST_STEPS = 2


@dataclass(frozen=True, eq=False)
class Standing:
    """Effects in the model, and the model at its own level."""

    rung: Rung
    found: tuple[Candidate, ...] = ()
    unearned: float = 0.0  # nats that it gains from the noise of the exciter's force alone (in_motion.py)
    promises: tuple[Promise, ...] | None = None  # about it, where they are known

    @property
    def evidence(self) -> float:
        """Log marginal likelihood less a constant, each effect as likely beforehand wherever it is."""
        return self.rung.evidence - self.unearned - float(sum(np.log(c.places) for c in self.found))

    @property
    def label(self) -> str:
        """Names of its effects."""
        return ", ".join(c.label for c in self.found)

    def trial(self, candidate: Candidate) -> Trial:
        """One of its effects, as fits without a discrepancy have it."""
        there = replace(self.rung.evaluation, point=replace(self.rung.evaluation.point, latents=()))
        return Trial(candidate, self.rung.model, there, self.evidence, settled=True)


def children(
    problem: Problem,
    standing: Standing,
    candidates: list[Candidate],
    budget: Budget,
    say: Say,
    promises: list[Promise] | None = None,
) -> list[Standing]:
    """Models with one more effect, each at its own level, likeliest first. problem: without any effect.

    promises: about ``standing``, where they are known. Once the ``budget`` is spent no further hypothesis is
    fitted.
    """
    rung = standing.rung
    left = compatible(candidates, list(standing.found))
    if promises is None and standing.promises is not None:
        promises = list(standing.promises)
    if promises is None:
        promises = _screened(rung, standing.found, left, say)
    promised_here = worthy(promises, count_of(candidates))
    taut = [] if rung.alone else _stretching(standing, budget, say)
    led = _led_by(problem, standing, taut, promised_here, candidates, budget, say)
    if led:
        return led
    first = _first_fits(standing, promised_here, budget, say) + taut
    first += _giving_way(standing, first, budget, say) if rung.alone else []
    first += _alike(standing, first, left, budget, say)
    walked = _walked(problem, standing, first, budget, say)
    if not any(w.rung.alone for w in walked):
        walked += _unbent(problem, standing, left, promised_here, budget, say)
    sense = [s for s in walked if makes_sense(s, problem)]
    absurd = {s.found[-1].kind for s in walked} - {s.found[-1].kind for s in sense}
    behind = [p for p in promises if p.candidate.kind not in absurd] if absurd else []
    fitted = {id(p) for p in promised_here}
    others = [p for p in worthy(behind, count_of(candidates)) if id(p) not in fitted]
    if others and not any(leaves_noise(s.rung) for s in sense):
        # An absurd one that promises the most had kept all others from a fit
        again = _walked(problem, standing, _first_fits(standing, others, budget, say), budget, say)
        sense += [s for s in again if makes_sense(s, problem)]
    return _clocks_and_lags(sorted((earned(standing, s) for s in sense), key=lambda s: -s.evidence))


def _walked(
    problem: Problem, standing: Standing, first: list[Standing], budget: Budget, say: Say
) -> list[Standing]:
    """The most likely of some first fits at their own levels, with closer descriptions of them."""
    first = [child for child in first if not contradicted(_last_of(child))]
    first.sort(key=lambda child: -child.rung.within_reach)
    walked: list[Standing] = []
    for k, child in enumerate(first[:WALKED]):
        if walked and budget.spent():
            budget.leave(c.found[-1].label for c in first[k:WALKED])
            break
        explains = [w.found[-1].kind for w in walked if w.rung.alone and makes_sense(w, problem)]
        if explains and _gain(standing, child) < REACHED * _gain(standing, first[0]):
            break
        if child.found[-1].kind in explains:
            # The same effect, of which a closer description explains all
            continue
        walked += _at_own_level(problem, child, budget, say)
    return walked


def _at_own_level(problem: Problem, child: Standing, budget: Budget, say: Say) -> list[Standing]:
    """A first fit walked down to its own level, and closer descriptions of it where it leaves something.

    Or where it leaves nothing and makes no sense: a line between two axes is taken for a part too heavy along
    one of them.
    """
    say(child.found[-1].label)
    down = walked_down(child.rung.model, child.rung.evaluation.point, child.rung.level)
    if down is None:
        return []
    walked = replace(child, rung=down)
    if leaves_noise(down) and makes_sense(walked, problem):
        return [walked]
    return [walked, *_closer(problem, walked, budget, say)]


def _screened(rung: Rung, found: tuple[Candidate, ...], left: list[Candidate], say: Say) -> list[Promise]:
    """What the hypotheses ``left`` promise about a model with the effects ``found``."""
    say("screening")
    promises = screen(rung.problem, rung.evaluation, left, mass_of(rung.problem, rung.evaluation))
    return promises + promised_laws(rung, found)


def _led_by(
    problem: Problem,
    standing: Standing,
    taut: list[Standing],
    promises: list[Promise],
    candidates: list[Candidate],
    budget: Budget,
    say: Say,
) -> list[Standing]:
    """Cables that stretch at their level, where they gain what anything else promises and leave something.

    All cables stretch, and what else is there is there beside that. It is asked beside them: without them in
    the model it bends to what they do to the tensions, and its fits cost several times theirs. Beside them it
    promises more then than without them; where it promises less they stand in for it. Where they leave
    nothing, or make no sense, they are one hypothesis of others. taut: their first fit.
    """
    most = max((p.gain for p in promises), default=np.inf)
    if not taut or _gain(standing, taut[0]) < most:
        return []
    begun = taut[0].rung
    down = walked_down(begun.model, begun.evaluation.point, begun.level)
    if down is None or down.alone:
        return []
    led = replace(taut[0], rung=down)
    beside = _screened(down, led.found, compatible(candidates, list(led.found)), say)
    if max((p.gain for p in worthy(beside, count_of(candidates))), default=0.0) < most:
        return []
    led = replace(led, promises=tuple(beside))
    every = [s for s in (led, *_closer(problem, led, budget, say)) if makes_sense(s, problem)]
    return sorted(every, key=lambda s: -s.evidence)


def _gain(standing: Standing, child: Standing) -> float:
    """What a model with one more effect gains beside the same wrench.

    Alone they compare otherwise: a device that follows slowly trailed one whose clock is late by 67 nats
    beside a wrench, and led by 15 without (bench/concealed, 22002). But for a factor of two first order is
    right.
    """
    return child.rung.within_reach - standing.rung.evidence


def _unbent(
    problem: Problem,
    standing: Standing,
    left: list[Candidate],
    known: list[Promise],
    budget: Budget,
    say: Say,
) -> list[Standing]:
    """What else is promised where the wrench is strong, walked down from there; nothing beside other effects.

    A model at its own level bends what it has, the body before all, to what it lacks. Where nothing weighs
    the body but a weak exciter, it bends so far that first order about it knows nothing of a liquid. A wrench
    that carries nearly anything leaves the body to what the recordings say of it.
    """
    rung = standing.rung
    if standing.found or rung.level <= STRONG or rung.alone or budget.spent():
        return []
    strong = fitted_at(rung.model, replace(rung.evaluation.point, latents=()), STRONG, FIRST_STEPS)
    if strong is None:
        return []
    say("screening with a strong wrench")
    promises = screen(strong.problem, strong.evaluation, left, mass_of(strong.problem, strong.evaluation))
    kinds = {p.candidate.kind for p in known}
    others = [p for p in worthy(promises, count_of(left)) if p.candidate.kind not in kinds][:ALIKE]
    first = _first_fits(Standing(strong), others, budget, say)
    if not first:
        return []
    best = max(first, key=lambda child: child.rung.within_reach)
    return _at_own_level(problem, best, budget, say)


def _clocks_and_lags(ranked: list[Standing]) -> list[Standing]:
    """The same with a lag before a clock only where the motion says so (late.py)."""
    if not all(s.rung.alone for s in ranked):
        return ranked
    by_candidate = {id(s.found[-1]): s for s in ranked}
    out = []
    for trial in told_apart([s.trial(s.found[-1]) for s in ranked], MEANT):
        standing = by_candidate[id(trial.candidate)]
        lost = standing.evidence - trial.evidence
        out.append(replace(standing, unearned=standing.unearned + lost))
    return out


def earned(before: Standing, after: Standing) -> Standing:
    """A model beside the one ``before``: where neither needs a wrench, what it gains from noise is none."""
    if not (before.rung.alone and after.rung.alone):
        return after
    runs = after.rung.evaluation.runs
    return replace(after, unearned=unearned(before.rung.problem, before.rung.evaluation, runs))


def _first_fits(standing: Standing, promises: list[Promise], budget: Budget, say: Say) -> list[Standing]:
    """First fits of promises, what is fitted soon before what is fitted in ten times the time."""
    asked = list(_with_twins(sorted(promises, key=lambda p: p.candidate.slow), standing.found))
    first: list[Standing] = []
    kept = 0.0
    for k, promise in enumerate(asked):
        if budget.spent():
            budget.leave(p.candidate.label for p in asked[k:])
            break
        if standing.rung.alone and promise.gain < REACHED * kept:
            # Beside a wrench first order is no bound: the wrench gives way by more than that
            continue
        child = _begun_best(standing, promise, budget, say)
        if child is not None:
            first.append(child)
            gained = child.rung.evidence - standing.rung.evidence
            if gained < promise.gain / REACHED:
                # Where one gains much more than it promised first order says little of the others too
                kept = max(kept, min(promise.gain, gained))
    return first


def _giving_way(standing: Standing, first: list[Standing], budget: Budget, say: Say) -> list[Standing]:
    """First fits of what gives way beside no wrench, where first order says nothing of what rings.

    It is scanned by its amount, where the residuals as a whole show something and nothing that was fitted
    takes the larger part away.
    """
    rung = standing.rung
    before = rung.evaluation
    taken = any(excess(child.rung.evaluation) < CHIEF * excess(before) for child in first)
    if taken or not shows(before) or budget.spent():
        return []
    say("what gives way")
    promises = supports(rung.problem, before, mass_of(rung.problem, before), budget)
    return _first_fits(standing, worthy(promises, len(promises)), budget, say)


def _stretching(standing: Standing, budget: Budget, say: Say) -> list[Standing]:
    """The best first fit of cables that stretch: as wire, or as rope where the wrench leaves some of it.

    With a wrench what rings is told by its forces. But cables that stretch let the body move where no force
    could move it, and the rig's geometry and the wrench bend to that: first order promised 92 nats of the
    17,000 that they explain of a car on wires. So they are begun, whatever is promised.
    """
    rung = standing.rung
    rig, model = rung.problem.bench.rig, rung.problem.bench.parameters.model
    mass = mass_of(rung.problem, rung.evaluation)
    *ropes, wire = stiffnesses(rig, mass)
    starts = [Promise(c, 0.0, {TAUT: 1.0 / wire}) for c in taut_cables(rig, model, mass)]
    if misfit(rung.evaluation) > NEAR_SQUARE and not gives_way(model):
        elastic = cable_elasticity(rig, model, mass)
        starts += [Promise(elastic, 0.0, {STIFFNESS: amount}) for amount in ropes]
    found = [begun_with(standing, start, budget, say) for start in starts if not budget.spent()]
    return sorted((f for f in found if f is not None), key=lambda f: -f.rung.within_reach)[:1]


def _begun_best(standing: Standing, promise: Promise, budget: Budget, say: Say) -> Standing | None:
    """The best first fit of a promise; from elsewhere too where it does not keep what it promised."""
    best: Standing | None = None
    for start in (promise, *promise.elsewhere):
        child = begun_with(standing, start, budget, say)
        if child is None:
            continue
        if best is None or child.rung.within_reach > best.rung.within_reach:
            best = child
        if best.rung.within_reach - standing.rung.evidence > REACHED * promise.gain:
            break
    return best


def begun_with(standing: Standing, promise: Promise, budget: Budget, say: Say) -> Standing | None:
    """The first fit with one more effect, at the level of ``standing``; None where it cannot be followed."""
    rung, candidate = standing.rung, promise.candidate
    say(candidate.label)
    if rung.alone:
        begun = attempt(rung.problem, rung.evaluation, promise, budget)
        if begun is None:
            return None
        fitted = Rung(begun.problem, begun.evaluation, rung.level)
        return Standing(fitted, (*standing.found, begun.candidate))
    wide, point = _entered(rung, rung.problem, rung.evaluation.point, candidate, promise.values)
    there = fitted_at(wide, point, rung.level, FIRST_STEPS)
    return None if there is None else Standing(there, (*standing.found, candidate))


def _alike(
    standing: Standing, first: list[Standing], left: list[Candidate], budget: Budget, say: Say
) -> list[Standing]:
    """What the best first fit is alike to: special cases of it, and the lag beside a late clock."""
    if not first or budget.spent():
        return []
    best = max(first, key=lambda child: child.rung.within_reach)
    known = {child.found[-1].label for child in first}
    trial = best.trial(best.found[-1])
    lag = lag_like(trial, left)
    asked = [Promise(c, 0.0, trial.values) for c in special_cases(trial.candidate, left)]
    asked += [] if lag is None else [lag]
    alike = (begun_with(standing, p, budget, say) for p in asked if p.candidate.label not in known)
    return [child for child in alike if child is not None]


def special_cases(candidate: Candidate, others: list[Candidate]) -> list[Candidate]:
    """Those of ``others`` whose numbers are some, and not all, of a candidate's.

    A bias beside a cross-sensitivity with its own bias promises no more than that, and may be all there is.
    """
    own = {p.name for p in candidate.parameters}
    return [c for c in others if c.build is None and {p.name for p in c.parameters} < own]


def makes_sense(standing: Standing, problem: Problem) -> bool:
    """Whether the last effect has an amount and a place that it can have, beyond what the ideal model has.

    What is ordinary and not in the ideal model makes sense, and is no finding (whole_runs.py). problem:
    without any effect.
    """
    trial = _last_of(standing)
    if not possible(trial):
        return False
    unknown_to_ideal = bool(trial.candidate.ordinary)
    return unknown_to_ideal or beyond_doubt(trial, ordinary_errors(problem), ORDINARY)


def _last_of(standing: Standing) -> Trial:
    """The last effect, as the model with the discrepancy has it."""
    rung = standing.rung
    return Trial(standing.found[-1], rung.problem, rung.evaluation, standing.evidence, settled=True)


def _with_twins(promises: list[Promise], found: tuple[Candidate, ...]) -> Iterator[Promise]:
    """What is fitted: each promise, and its twins to first order that can stand beside ``found``."""
    for promise in promises:
        yield promise
        for candidate, values in promise.candidate.twins:
            if compatible([candidate], list(found)):
                yield replace(promise, candidate=candidate, values=values, elsewhere=())


def worthy(promises: list[Promise], count: int) -> list[Promise]:
    """The promises worth a fit: of each kind and size the best ones, as many as are fitted."""
    out: list[Promise] = []
    for promise in sorted(promises, key=lambda p: -net_gain(p, count)):
        if net_gain(promise, count) <= 0.0 or len(out) == FITTED:
            break
        if out and promise.gain < SHARE * out[0].gain:
            break
        if stood_for(promise, promises, count):
            continue
        if sum(_alike_in_size(promise.candidate, other.candidate) for other in out) < ALIKE:
            out.append(promise)
    return out


def _alike_in_size(one: Candidate, other: Candidate) -> bool:
    """Whether two are of one kind and size, as a part that moves one way and one that turns are not."""
    return one.kind == other.kind and len(one.parameters) == len(other.parameters)


def _entered(
    rung: Rung, parent: Problem, point: Point, candidate: Candidate, values: dict[str, float]
) -> tuple[Problem, Point]:
    """The ``parent`` with one more effect, started at ``values``, and moving as ``rung`` does.

    point: of the rung, with the internal coordinates of the parent.
    """
    wide = extended(parent, (candidate,))
    there = promised(wide, carried(wide, rung.problem, point), candidate, values, rung.evaluation)
    return wide, beside(rung.problem, there, wide, rung.evaluation)


def leaves_noise(rung: Rung) -> bool:
    """Whether a model needs no wrench, and its residuals as a whole show nothing more."""
    return rung.alone and not shows(rung.evaluation)


def described_closer(problem: Problem, standing: Standing, budget: Budget, say: Say) -> list[Standing]:
    """A model that leaves noise on its stretch, with likelier closer descriptions of its effects, best first.

    They are asked where whole runs show that something is left. Of a model that leaves noise a closer
    description gains next to nothing, and its fit costs as much as the first one's: 7 nats of 82,000 and half
    of the work for the third axis that a car's wheels turn about. problem: without any effect.
    """
    if not leaves_noise(standing.rung):
        # Those were asked on the way to its level
        return []
    every = [s for s in _closer(problem, standing, budget, say) if makes_sense(s, problem)]
    return sorted((s for s in every if s.evidence > standing.evidence + MEANT), key=lambda s: -s.evidence)


def _closer(problem: Problem, standing: Standing, budget: Budget, say: Say) -> Iterator[Standing]:
    """The model with closer descriptions of its effects that first order cannot tell from them.

    Each takes the place of its effect. With a second effect in the model a closer description of the first
    one may be the likelier one. problem: without any effect.
    """
    rung = standing.rung
    for k, candidate in enumerate(standing.found):
        asked = candidate.between or candidate.closer
        if asked is None:
            continue
        others = (*standing.found[:k], *standing.found[k + 1 :])
        parent = replace(extended(problem, others), discrepancy=rung.problem.discrepancy)
        for closer, values in asked(rung.problem, rung.evaluation):
            if budget.spent():
                budget.leave([closer.label])
                return
            say(closer.label)
            wide, point = _entered(rung, parent, _without(problem, standing, k), closer, values)
            # It starts from another description's numbers, and has to find its own before it is walked down
            begun = fitted_at(wide, point, rung.level, STAYING)
            down = None if begun is None else walked_down(wide, begun.evaluation.point, rung.level)
            if down is not None:
                nearer = Standing(down, (*others, closer))
                yield nearer
                if nearer.evidence > standing.evidence + MEANT and not leaves_noise(down):
                    yield from _closer(problem, nearer, budget, say)


def _without(problem: Problem, standing: Standing, left_out: int) -> Point:
    """The point without what one of the effects moves within the rig. problem: without any effect."""
    model = problem.bench.parameters.model
    kept = [True] * model.internal
    for k, candidate in enumerate(standing.found):
        wider, _ = candidate.built(model)
        kept += [k != left_out] * (wider.internal - model.internal)
        model = wider
    point, stay = standing.rung.evaluation.point, np.array(kept + kept, dtype=bool)

    def own(state: State) -> State:
        return replace(state, internal=state.internal[stay]) if state.internal.size == stay.size else state

    return replace(
        point, starts=tuple(map(own, point.starts)), rest_guesses=tuple(map(own, point.rest_guesses))
    )
