"""The session with what was left out in the model: located, named, fitted, judged on held-out runs, told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import Ideal, near_noise, with_pieces
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, excess
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.burst import burst
from rig_identification.mismatch.disagreeing import where_runs_disagree
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import catalogue, count_of, worth_a_fit
from rig_identification.mismatch.lawful import law_of_pieces, lawful_instead
from rig_identification.mismatch.left_over import unexplained
from rig_identification.mismatch.locate import Event, calm_pieces
from rig_identification.mismatch.named import named
from rig_identification.mismatch.pulse import Pulse, likeliest_pulse
from rig_identification.mismatch.push import (
    Calmed,
    Likeliest,
    Pushes,
    chiefly,
    nothing_known,
    outside,
    outside_of_event,
    outside_of_pulse,
    push_beside,
    shows_beside,
    with_pulse,
    with_push,
    without_push,
)
from rig_identification.mismatch.screen import Promise, screen, with_reference
from rig_identification.mismatch.slack import Spell, slack_alone, taut_ideal, with_slack
from rig_identification.mismatch.standing import Heard, Search, short_pieces, unheard
from rig_identification.mismatch.trial import VERY_FAR, mass_of
from rig_identification.mismatch.undecided import undecided

Notify = Callable[[str, float], None]


def explain(
    ideal: Ideal, spells: list[Spell], notify: Notify, budget: Budget, heard: Heard = unheard
) -> Explained | None:
    """Search for what the ideal model leaves out; None where every residual is noise.

    Near the noise the search looks at whole runs, which say most; where the ideal model fails by
    far, at short pieces, in which no model is far off. spells: in which a cable carries nothing (slack.py).
    budget: how much it may compute. heard: is told what explains the session, as it is found.
    """
    if ideal.mismatch.verdict == "none":
        return _hidden(ideal, notify, budget)
    if not spells:
        return _explain(ideal, notify, budget, heard=heard)
    notify("search: stretches in which every cable pulls", 0.02)
    taut = taut_ideal(ideal, spells, notify)
    if taut is None:
        return slack_alone(ideal, spells)
    if not near_noise(taut.fitted):
        taut = with_pieces(taut, notify)
    found = _explain(taut, notify, budget)
    return with_slack(found or Explained(taut.fitted, taut.mismatch, taut), ideal, spells)


def _hidden(ideal: Ideal, notify: Notify, budget: Budget) -> Explained | None:
    """What no residual shows by itself, and a hypothesis that knows what to look for does.

    A score test of all hypotheses at once: one among ever so many that gains more than chance does is fitted,
    and told if it explains every run. Otherwise what may be there beside nothing is stated.
    """
    notify("search: anything within the noise", 0.1)
    fitted = ideal.fitted
    problem = with_reference(fitted.problem, fitted.rest)
    candidates = catalogue(problem)
    promises = screen(problem, fitted.evaluation, candidates, mass_of(problem, fitted.evaluation))
    count = count_of(candidates)
    if worth_a_fit(promises, count):
        search = Search(
            problem, problem, fitted.evaluation, excess(fitted.evaluation), budget, screened=promises
        )
        best = named(ideal, search, notify)
        if best is not None and best.wholly:
            return best
    return undecided(ideal, problem, fitted.evaluation, promises, count, notify, budget)


def _explain(
    ideal: Ideal, notify: Notify, budget: Budget, *, part: bool = False, heard: Heard = unheard
) -> Explained | None:
    """The search, on runs in which every cable pulls.

    part: these are what an event leaves of them; None then also where they are not explained.
    """
    if ideal.mismatch.verdict == "none":
        return None
    fitted = ideal.fitted
    notify("search: a push", 0.02)
    pulse = cache(partial(likeliest_pulse, fitted))
    problem = with_reference(fitted.problem, fitted.rest)
    promises: list[Promise] | None = None
    here, evaluation = short_pieces(ideal) or (problem, evaluate(problem, fitted.evaluation.point))
    if evaluation is None:
        return None
    very_far = misfit(evaluation) > VERY_FAR
    # Far from the noise first order tells of a push only where little else is wrong, and very far of none
    likeliest = None if very_far else pulse()
    if likeliest is not None and (near_noise(fitted) or chiefly(likeliest, fitted)):
        promises = screen(problem, fitted.evaluation, catalogue(problem), mass_of(problem, fitted.evaluation))
        pulsed = _pulsed(ideal, likeliest, promises, notify, budget)
        if pulsed is not None:
            return pulsed
    search = Search(problem, here, evaluation, excess(evaluation), budget, heard=heard)
    if search.whole:
        search.screened = promises
    if not search.whole:
        calm = cache(partial(calm_pieces, here, evaluation))
        pushed = without_push(ideal, problem, here, evaluation, pulse, notify, calm)
        pushed = pushed or _beside_push(ideal, here, evaluation, notify, budget, calm)
        if pushed is None and very_far and not budget.spent():
            pushed = _beside_event(ideal, here, burst(here, evaluation), notify, budget, chief=True)
        if pushed is not None:
            return pushed
    near = search.whole
    fresh = replace(search, found=[], rivals=[])
    pushes = Pushes(
        partial(_beside_push, ideal, notify=notify, budget=budget),
        partial(_beside_pulse, ideal, notify=notify, budget=budget),
    )
    best = named(ideal, search, notify, pushes, law_of_pieces(ideal, fresh, notify))
    if best is not None and best.told:
        return best
    if near:
        agreed = where_runs_disagree(ideal, notify, budget)
        if agreed is not None:
            return agreed
        law = None
        if not budget.spent():
            notify("search: a force that follows one point's motion", 0.7)
            law = lawful_instead(ideal, fresh, notify)
        if law is not None:
            return law
        ideal = with_pieces(ideal, notify)
        pushed = None if budget.spent() else _gentle_push(ideal, problem, pulse, notify)
        if pushed is not None:
            return pushed
    return None if part else unexplained(ideal, search, best, notify)


def _pulsed(
    ideal: Ideal, pulse: Pulse, promises: list[Promise], notify: Notify, budget: Budget
) -> Explained | None:
    """What explains the session outside a push likelier than all else; None where there is none, or nothing.

    promises: of everything else, about the ideal model's fit.
    """
    if promises and promises[0].gain > pulse.net:
        return None
    rest = outside_of_pulse(ideal, pulse, notify)
    return None if rest is None else with_pulse(explain(rest, [], notify, budget), rest, ideal, pulse)


def _gentle_push(ideal: Ideal, problem: Problem, pulse: Likeliest, notify: Notify) -> Explained | None:
    """A push so gentle that whole runs come near the noise with it."""
    here, evaluation = short_pieces(ideal) or (problem, None)
    return None if evaluation is None else without_push(ideal, problem, here, evaluation, pulse, notify)


def _beside_push(
    ideal: Ideal,
    here: Problem,
    evaluation: Evaluation,
    notify: Notify,
    budget: Budget,
    calm: Calmed = nothing_known,
) -> Explained | None:
    """What explains the session outside a push; None where nothing pushes, or nothing explains the rest."""
    return _beside_event(ideal, here, push_beside(here, evaluation, notify, calm), notify, budget)


def _beside_event(
    ideal: Ideal, here: Problem, event: Event | None, notify: Notify, budget: Budget, *, chief: bool = False
) -> Explained | None:
    """What explains the session outside an event; None where there is none, or nothing explains the rest.

    chief: whether the rest is worth a search only where the event has the larger part of what is wrong.
    """
    if event is None:
        return None
    rest = outside_of_event(ideal, event, notify, chief=chief)
    found = None if rest is None else _explain(rest, notify, budget, part=True)
    if found is None or not found.told:
        return None
    return with_push(found, ideal, here, event)


def _beside_pulse(ideal: Ideal, best: Explained, notify: Notify, budget: Budget) -> Explained | None:
    """What explains the session outside a push that whole runs show with something in the model; or None.

    best: near the noise, and what it leaves may be such a push.
    """
    notify("search: a push beside " + ", ".join(f.effect for f in best.mismatch.findings), 0.6)
    pulse = likeliest_pulse(best.fitted)
    if pulse is None or not shows_beside(pulse, best.fitted):
        return None
    rest = outside(ideal, pulse.recording, pulse.start, pulse.end, notify)
    return with_pulse(explain(rest, [], notify, budget), rest, ideal, pulse, last=True)
