"""The search: screened where the model at hand stands, the best fitted, the likeliest kept, until enough.

All hypotheses are compared by one number, the evidence, each with the discrepancy that it asks for itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import Point, Problem, excess
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.hypotheses import catalogue, compatible, count_of, net_gain
from rig_identification.mismatch.one_more import one_more
from rig_identification.mismatch.screen import Promise, carried, extended, screen, with_reference
from rig_identification.mismatch.standing import Heard, Search, unheard
from rig_identification.mismatch.trial import Trial, mass_of, promised
from rig_identification.mismatch.whole_runs import fitted_whole, pruned
from rig_identification.model.motion import State
from rig_identification.search.ladder import Rung, begun, fitted_at, walked_down
from rig_identification.search.laws import in_words, promised_laws, sparse
from rig_identification.search.levels import ALONE
from rig_identification.search.path import beside

Notify = Callable[[str, float], None]

#: Effects that are told of a session at most.
MOST_EFFECTS = 3
#: Effects in a row that leave the wrench as strong as it was: of two that are there the first one may, and
#: what two leave they do not explain.
IDLE = 2
#: Hypotheses that are fitted after each screening, of each kind so many, and how many to their own level.
FITTED, ALIKE, WALKED = 5, 2, 3
#: Share of the best promise that another one has to come to.
SHARE = 0.1
#: Log evidence by which a hypothesis trails at the same level (odds of 1 to 20,000) that is no rival.
RIVAL = 10.0
#: Steps of the first fit of each: an amount as large as it may be takes three or four to settle.
FIRST_STEPS = 4
#: The level from which on whole runs are fitted without a discrepancy: a stronger one is no trace.
NEARLY_ALONE = ALONE - 2
#: Log evidence beyond the logarithm of the number of hypotheses that an effect has to gain.
NEEDED = 5.0


@dataclass(frozen=True)
class Standing:
    """Effects in the model, and the model at its own level."""

    rung: Rung
    found: tuple[Candidate, ...] = ()


def search(
    ideal: Ideal, notify: Notify, budget: Budget, heard: Heard = unheard
) -> tuple[Explained | None, Rung | None]:
    """What explains the session, but for a trace perhaps, None where nothing does; and the last model.

    budget: how much it may compute. Once it is spent the last model is the first one: it tells how wide the
    intervals of the body have to be. heard: is told what explains the session, as it is found.
    """
    fitted = ideal.fitted
    problem = with_reference(replace(fitted.problem, discrepancy=None), fitted.rest)
    notify("search: the motion as recorded", 0.05)
    point = fitted.guess or fitted.evaluation.point
    first = begun(problem, replace(point, latents=()))
    if first is None:
        return None, None
    candidates = catalogue(problem)
    standing, best_told, idle = Standing(first), None, 0
    for step in range(MOST_EFFECTS):
        if budget.spent() or idle == IDLE:
            break

        def say(label: str, step: int = step) -> None:
            notify(f"search: {label}", (step + 0.5) / (MOST_EFFECTS + 1))

        children = _children(problem, standing, candidates, budget, say)
        if not children:
            break
        best = children[0]
        if best.rung.evidence < standing.rung.evidence + NEEDED + np.log(count_of(candidates)):
            break
        idle = 0 if best.rung.level > standing.rung.level or best.rung.alone else idle + 1
        standing = best
        if standing.rung.level < NEARLY_ALONE:
            continue
        say("whole runs with " + ", ".join(c.label for c in standing.found))
        told = _whole(ideal, problem, standing, children[1:], candidates, notify, budget, heard)
        if told is not None and told.wholly:
            return told, standing.rung
        if told is not None and told.told:
            best_told = told
    return best_told, standing.rung


def _children(
    problem: Problem,
    standing: Standing,
    candidates: list[Candidate],
    budget: Budget,
    say: Callable[[str], None],
) -> list[Standing]:
    """Models with one more effect, each at its own level, likeliest first. problem: without any effect.

    Once the ``budget`` is spent no further hypothesis is fitted.
    """
    rung = standing.rung
    left = compatible(candidates, list(standing.found))
    say("screening")
    promises = screen(rung.problem, rung.evaluation, left, mass_of(rung.problem, rung.evaluation))
    promises += promised_laws(rung, standing.found)
    first: list[Standing] = []
    asked = list(_with_twins(worthy(promises, count_of(candidates))))
    for k, (candidate, values) in enumerate(asked):
        if budget.spent():
            budget.leave(c.label for c, _ in asked[k:])
            break
        say(candidate.label)
        wide, point = _entered(rung, rung.problem, rung.evaluation.point, candidate, values)
        there = fitted_at(wide, point, rung.level, FIRST_STEPS)
        if there is not None:
            first.append(Standing(there, (*standing.found, candidate)))
    first.sort(key=lambda child: -child.rung.within_reach)
    walked: list[Standing] = []
    for child in first[:WALKED]:
        if walked and budget.spent():
            break
        explains = [w.found[-1].kind for w in walked if w.rung.alone]
        if explains and child.rung.within_reach < first[0].rung.evidence - RIVAL:
            break
        if child.found[-1].kind in explains:
            # The same effect, of which a closer description explains all
            continue
        say(child.found[-1].label)
        down = walked_down(child.rung.model, child.rung.evaluation.point, child.rung.level)
        if down is not None:
            walked.append(replace(child, rung=down))
            walked += _closer(problem, walked[-1], say)
    return sorted(walked, key=lambda s: -s.rung.evidence)


def _with_twins(promises: list[Promise]) -> Iterator[tuple[Candidate, dict[str, float]]]:
    """What is fitted of each promise and where from: itself, and what first order cannot tell from it."""
    for promise in promises:
        yield promise.candidate, promise.values
        yield from promise.candidate.twins


def worthy(promises: list[Promise], count: int) -> list[Promise]:
    """The promises worth a fit: of each kind the best ones, as many as are fitted."""
    out: list[Promise] = []
    for promise in sorted(promises, key=lambda p: -net_gain(p, count)):
        if net_gain(promise, count) <= 0.0 or len(out) == FITTED:
            break
        if out and promise.gain < SHARE * out[0].gain:
            break
        if sum(promise.candidate.kind == other.candidate.kind for other in out) < ALIKE:
            out.append(promise)
    return out


def _entered(
    rung: Rung, parent: Problem, point: Point, candidate: Candidate, values: dict[str, float]
) -> tuple[Problem, Point]:
    """The ``parent`` with one more effect, started at ``values``, and moving as ``rung`` does.

    point: of the rung, with the internal coordinates of the parent.
    """
    wide = extended(parent, (candidate,))
    there = promised(wide, carried(wide, rung.problem, point), candidate, values, rung.evaluation)
    return wide, beside(rung.problem, there, wide, rung.evaluation)


def _closer(problem: Problem, standing: Standing, say: Callable[[str], None]) -> Iterator[Standing]:
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
            say(closer.label)
            wide, point = _entered(rung, parent, _without(problem, standing, k), closer, values)
            down = walked_down(wide, point, rung.level)
            if down is not None:
                yield Standing(down, (*others, closer))


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


def _whole(
    ideal: Ideal,
    problem: Problem,
    standing: Standing,
    others: list[Standing],
    candidates: list[Candidate],
    notify: Notify,
    budget: Budget,
    heard: Heard,
) -> Explained | None:
    """Whole runs with what was found, judged on held-out ones; beside it what explains them as well."""
    rung = standing.rung
    label = standing.found[-1].label
    alike = [
        (rung.evidence - o.rung.evidence, o)
        for o in others
        if o.rung.level >= rung.level and o.found[-1].label != label
    ]
    found = sparse(problem, [_trial(standing, c) for c in standing.found], budget)
    rivals = [(gap, _trial(other, other.found[-1])) for gap, other in alike]
    search_ = Search(
        problem,
        rung.model,
        rung.evaluation,
        excess(ideal.fitted.evaluation),
        budget,
        found=found,
        rivals=[rival(trial, gap) for gap, trial in rivals],
        bodies=tuple((gap, inertial_estimate(t.problem, t.evaluation)) for gap, t in rivals),
        heard=heard,
    )
    best = _alone(ideal, search_, candidates, standing, notify)
    return None if best is None else in_words(best, found)


def _alone(
    ideal: Ideal, search_: Search, candidates: list[Candidate], standing: Standing, notify: Notify
) -> Explained | None:
    """Whole runs with what ``search_`` found and no discrepancy; None where they cannot be fitted."""
    found = search_.found
    try:
        best = fitted_whole(ideal, search_, found, found[0].problem, found[0].evaluation.point)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None
    if not best.wholly:
        return best
    kept = pruned(best, search_, len(candidates))
    if kept is not best or len(found) == MOST_EFFECTS or search_.budget.spent():
        return kept
    return one_more(ideal, search_, kept, compatible(candidates, list(standing.found)), notify)


def _trial(standing: Standing, candidate: Candidate) -> Trial:
    """One effect of a model, as the search of fits without a discrepancy has it."""
    rung = standing.rung
    there = replace(rung.evaluation, point=replace(rung.evaluation.point, latents=()))
    return Trial(candidate, rung.model, there, rung.evidence)
