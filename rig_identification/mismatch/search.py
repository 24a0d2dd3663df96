"""From a session that the ideal model does not explain to the effects that do.

Screening (screen.py) ranks every hypothesis; the best few are fitted in full (first_fits.py), in short
pieces first, where no model is far off; the most likely one stays (Laplace's approximation of the
marginal likelihood charges each free parameter for what it could have explained). Then the
whole runs are fitted with it, and if something is left the search goes on from there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, excess
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.first_fits import DIRECT, Notify, at_noise, shows
from rig_identification.mismatch.hypotheses import count_of
from rig_identification.mismatch.look import Look
from rig_identification.mismatch.outcome import MEANT, NOTHING, Alone, Trials
from rig_identification.mismatch.pairs import first_of_two
from rig_identification.mismatch.screen import Promise, screen
from rig_identification.mismatch.supports import gives_way
from rig_identification.mismatch.telling import ended, leads, told_of
from rig_identification.mismatch.trial import VERY_FAR, Trial, at_minimum, mass_of

#: Effects looked for at most.
MOST_EFFECTS = 2
#: Pieces that hypotheses are tried on; fewer where very much is left.
TRIED, TRIED_FAR = 4, 2


def worst_pieces(problem: Problem, evaluation: Evaluation) -> tuple[Problem, Evaluation]:
    """The problem on the pieces that fit worst: what tells hypotheses apart at a fraction of the cost."""
    tried = TRIED_FAR if misfit(evaluation) > VERY_FAR else TRIED
    if len(problem.runs) <= tried:
        return problem, evaluation
    misfits = [float(np.sum(run.residual**2) - run.residual.size) for run in evaluation.runs]
    chosen = sorted(np.argsort(misfits)[-tried:])
    part = replace(problem, runs=tuple(problem.runs[i] for i in chosen))
    point = replace(
        evaluation.point,
        starts=tuple(evaluation.point.starts[i] for i in chosen),
        latents=tuple(evaluation.point.latents[i] for i in chosen) if evaluation.point.latents else (),
    )
    again = evaluate(part, point)
    return (problem, evaluation) if again is None else (part, again)


def trials(
    problem: Problem,
    evaluation: Evaluation,
    candidates: list[Candidate],
    limit: float,
    notify: Notify,
    screened: list[Promise] | None = None,
    budget: Budget = UNLIMITED,
    more: bool = False,
    alone: Alone = NOTHING,
    led: Trial | None = None,
) -> Trials:
    """Full fits of the most promising hypotheses to the pieces that fit worst, most likely first.

    All get a few steps; the best few go on to their end, and where one reaches the noise only those
    that had come as close. Where much is left and no hypothesis takes it away that promised to, first order
    is not to be trusted: witnesses are then heard one without the other, and what gives way is
    tried whatever screening says. Beside a part on springs the ceiling that rings as it does is tried.
    Where the budget is spent nothing more that changes the model is begun. screened: promises about this
    evaluation, where they are known. more: another effect may be added after. alone: what is asked as long as
    nothing else is in the model. led: what the effect that is in the model was adopted for.
    """
    mass = mass_of(problem, evaluation)
    far = misfit(evaluation) > NEAR_SQUARE
    if far:
        problem, evaluation = worst_pieces(problem, evaluation)
        if more and misfit(evaluation) <= VERY_FAR:
            evaluation = at_minimum(problem, evaluation)
    promises = screened or screen(problem, evaluation, candidates, mass)
    here, seen = (problem, evaluation) if far else worst_pieces(problem, evaluation)
    two = None
    if more and not far:
        two = first_of_two(problem, evaluation, promises, count_of(candidates), MEANT, limit, notify, budget)
    look = Look(
        problem, evaluation, here, seen, candidates, promises, mass, limit, far, notify, budget, alone, led
    )
    if two is not None and two.leads:
        # It was fitted to all there is
        look.here, look.seen = problem, evaluation
        return Trials(told_of(look, [two.first]))
    if two is not None and here is problem:
        look.fitted = two.instead or two.first
    lead, certain = _from_afar(look, more) if misfit(seen) > VERY_FAR else (None, [])
    if certain:
        return leads(look, certain, asked=True)
    if far and misfit(seen) <= VERY_FAR:
        look.as_it_hangs()
    if lead is None and more:
        lead = look.leading()
    if lead is None and not look.enough and (not far or (promises and promises[0].share > DIRECT)):
        look.directly()
        lead = look.leading() if more else None
    if lead is not None:
        return leads(look, [lead])
    if more and far and not look.enough:
        ahead = look.giving_way_beside()
        if ahead:
            return leads(look, ahead, asked=True)
    for witness in (look.without_devices, look.giving_way):
        if far and not look.enough and not look.budget.spent():
            witness()
    if look.lawful is not None:
        return Trials([], lawful=look.lawful)
    if not far and not _without_support(look.tried, seen) and not look.budget.spent():
        look.yielding_a_little()
    elif not gives_way(problem.bench.parameters.model):
        look.ringing()
    found = ended(look)
    if found.done or far or not look.passed_over():
        return found
    return ended(look)


def _from_afar(look: Look, more: bool) -> tuple[Trial | None, list[Trial]]:
    """What leaves nothing together with one more, and what rest is certain of, where very much is left.

    Each witness is asked only where those before it leave something. What takes nearly all away is asked at
    once whether with one more it leaves nothing.
    """
    for witness in (look.as_weighed, look.as_measured, look.slowly_as_measured, look.outright):
        if look.budget.spent():
            return None, []
        witness()
        if more and look.certain:
            return None, look.certain
        lead = look.leading() if more and look.leads_on else None
        if lead is not None or look.enough:
            return lead, []
    look.at_rest()
    if more and look.certain:
        return None, look.certain
    if look.moving:
        look.giving_way_at_once()
        lead = look.leading() if more and look.almost else None
        if lead is not None:
            return lead, []
    if not look.enough:
        look.from_nothing_bent()
    return None, []


def _without_support(tried: list[Trial], before: Evaluation) -> bool:
    """Whether near the noise there is no need to try what gives way.

    There is none where a hypothesis takes away the larger part of what is left; if it swings, which is
    alike, all of it. Where the residuals as a whole show nothing that is, there is only if something that
    swings is the best.
    """
    first = max(tried, key=lambda t: t.evidence, default=None)
    if not shows(before):
        return first is None or first.candidate.build is None
    if first is None or (first.candidate.build is not None and not at_noise(first)):
        return False
    return before.cost - first.evaluation.cost > CHIEF * excess(before)
