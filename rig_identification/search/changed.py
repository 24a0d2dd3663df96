"""Something that changed at an instant: a number that is another one from then on is found, and fitted so.

It comes before the search where it adds more to the log evidence than anything that is wrong all the time,
and after one that explained nothing elsewhere. As with an event, what it leaves of the session is searched.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rig_identification.estimate.estimates import estimates
from rig_identification.estimate.evidence import Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import Ideal, fitted_anew, judged
from rig_identification.estimate.launch import launch_states
from rig_identification.estimate.observability import invert_information
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, solve
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.change import Change
from rig_identification.mismatch.changes import changeable, likeliest_changes, recordings_of
from rig_identification.mismatch.explained import Explained, evidence_of, held_out_errors, trace_of
from rig_identification.mismatch.findings import finding
from rig_identification.mismatch.hypotheses import catalogue, count_of, net_gain
from rig_identification.mismatch.opened import Promise, adding, carried, extended
from rig_identification.mismatch.pulse import all_runs
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import Trial, log_evidence, mass_of
from rig_identification.model.definite import definite
from rig_identification.result import Finding, Mismatch
from rig_identification.search.events import OUTSIDE, Event, all_without, wrong
from rig_identification.search.expand import MEANT
from rig_identification.search.ladder import Rung

Notify = Callable[[str, float], None]
#: Explains what a change leaves of a session; None where the ideal model explains it.
Explain = Callable[[Ideal], Explained | None]

#: Share of what a change takes away that another one, to first order, may fail to take away and be fitted in
#: its stead: of a change of hundreds of standard deviations first order knows no more.
ALIKE = 0.02
#: Share of what is wrong that may be left beside a change that is told, though that is more than a trace.
LITTLE = 0.02
#: Half of what is cut out about the instant of a change, s: so exactly is it known.
ABOUT = 0.1


class Asked(NamedTuple):
    """Changes that are worth a fit, the likeliest first."""

    changes: list[Change]
    leading: bool  # whether the likeliest comes before anything that is wrong all the time


def changes_of(fitted: Fitted, first: Rung) -> Asked:
    """Changes that may be what is wrong.

    first: the model at its own level. Where that needs no wrench held-out runs are asked as well. The
    likeliest change leads where it adds more to the log evidence than anything that is wrong all the time:
    what swings all the time looks like a load that changes several times. What swings or pulls, at any
    frequency or place, takes longest to ask, and comes last; not at all where the change has the larger part
    of what is wrong. Beside a wrench, about a body that is bent to all of it, first order ranks the same
    numbers over time; which ones they are a fit has to say. So a change that adds more than the same numbers
    wrong all the time is worth one, though something else leads.
    """
    seen = _linearised(fitted, first)
    if seen is None:
        return Asked([], False)
    problem, evaluation = seen
    mass = mass_of(problem, evaluation)
    candidates = catalogue(problem)
    count = count_of(candidates)
    changes, always = likeliest_changes(problem, evaluation, mass, candidates)
    if not changes or changes[0].net < MEANT:
        return Asked([], False)

    def likelier(promises: list[Promise]) -> bool:
        return changes[0].net > max((net_gain(p, count) for p in promises), default=0.0)

    most = first.alone and changes[0].net > (1.0 - OUTSIDE) * wrong(fitted)
    leading = likelier(always) and (most or likelier(screen(problem, evaluation, candidates, mass)))
    own = [p.gain for p in always if p.candidate is changes[0].group.of]
    worth = not first.alone and changes[0].net > max(own, default=0.0) + MEANT
    return Asked(changes if leading or worth else [], leading)


def _linearised(fitted: Fitted, first: Rung) -> tuple[Problem, Evaluation] | None:
    if not first.alone:
        return first.problem, first.evaluation
    problem, point = all_runs(fitted)
    evaluation = evaluate(problem, point)
    return None if evaluation is None else (problem, evaluation)


def explained_changed(
    ideal: Ideal, changes: list[Change], explain: Explain, notify: Notify
) -> Explained | None:
    """What explains the session with one of some changes in its model, and the change; None: nothing does.

    A gain and a zero that jump are much the same beside a strong wrench. So each is fitted until one leaves
    only noise, and the one that leaves least is told.
    """
    fitted, best = ideal.fitted, None
    for change in changes:
        found = _fitted_best(fitted, change, notify)
        if found is None:
            continue
        if best is None or wrong(found.fitted) < wrong(best.fitted):
            best = found
        if wrong(best.fitted) > OUTSIDE * wrong(fitted):
            return None
        if _explains(best.fitted):
            break
    if best is None:
        return None
    best = _simpler(fitted, _of_fewer_steps(fitted, best, notify), notify)
    rest = Ideal(best.fitted, *judged(best.fitted))
    told = explain(rest) or Explained(rest.fitted, rest.mismatch, rest)
    if told.mismatch.verdict == "unexplained":
        heard = trace_of(fitted, told.fitted)
        if heard is not None:
            told = replace(told, trace=True, loose=heard.looseness)
        elif wrong(told.fitted) > LITTLE * wrong(fitted):
            return None
    return _with_change(told, ideal, best)


class Changed(NamedTuple):
    """A session fitted with a change in its model."""

    fitted: Fitted
    candidate: Candidate
    own: bool  # whether held-out recordings alone tell of it
    change: Change


def _of_fewer_steps(fitted: Fitted, best: Changed, notify: Notify) -> Changed:
    """The same session without the steps that its fit does not see.

    About a large step first order promises further ones. Fitted, with a of a step's numbers in units of their
    priors and F what the fit tells of them with all else free, it adds a^T F a / 2 - log det F / 2 nats.
    """
    problem, evaluation = best.fitted.problem, best.fitted.evaluation
    steps, parameters = best.change.told_steps, problem.bench.parameters
    if best.own or len(steps) == 1:
        return best
    covariance = invert_information(evaluation.information)
    nets = []
    for own in np.split(
        np.array([parameters.index_of(p.name) for p in best.candidate.parameters]), len(steps)
    ):
        F = np.linalg.inv(definite(covariance[np.ix_(own, own)]))
        a = evaluation.point.theta[own]
        nets.append(0.5 * float(a @ F @ a - np.linalg.slogdet(F)[1]))
    kept = [step for step, net in zip(steps, nets, strict=True) if net > MEANT]
    if not kept or len(kept) == len(steps):
        return best
    fewer = best.change.of_steps(kept)
    again = _fitted_with(fitted, fewer, fewer.candidate, notify)
    if again is None or wrong(again) > wrong(best.fitted) + LITTLE * wrong(fitted):
        return best
    if _explains(best.fitted) and not _explains(again):
        return best
    return Changed(again, fewer.candidate, best.own, fewer)


def _explains(fitted: Fitted) -> bool:
    """Whether nothing but noise is left."""
    return judged(fitted)[1].verdict == "none"


def _simpler(fitted: Fitted, best: Changed, notify: Notify) -> Changed:
    """The same session with fewer numbers that change, where these explain as much.

    A hinge that moves along its cable is a cable that became longer. About the fit, with the numbers a of the
    change among its unknowns, those of another one in their stead cost a^T S a / 2 nats, S being what of a's
    information neither they nor anything else that is free accounts for. The one that costs least is fitted.
    """
    problem, evaluation = best.fitted.problem, best.fitted.evaluation
    parameters = problem.bench.parameters
    own = [parameters.index_of(p.name) for p in best.candidate.parameters]
    others = best.change.with_fewer([c for c in catalogue(problem) if changeable(c)])
    if best.own or not others or not _explains(best.fitted):
        return best
    wide = adding(problem, [c.candidate for c in others])
    full = evaluate(wide, carried(wide, problem, evaluation.point))
    if full is None:
        return best
    indices = [[wide.bench.parameters.index_of(p.name) for p in c.candidate.parameters] for c in others]
    asked = np.array([*own, *(i for columns in indices for i in columns)])
    base = np.setdiff1d(np.arange(full.information.shape[0]), asked)
    left = Beyond(full, base, wide.bench.parameters.size).within(asked)
    a, first, costs = evaluation.point.theta[own], len(own), []
    for columns in indices:
        other = np.arange(first, first + len(columns))
        first += len(columns)
        seen = left[other][:, : len(own)]
        S = left[: len(own), : len(own)] - seen.T @ np.linalg.solve(
            definite(left[np.ix_(other, other)]), seen
        )
        costs.append(float(a @ S @ a))
    k = int(np.argmin(costs))
    if costs[k] > ALIKE * float(a @ left[: len(own), : len(own)] @ a):
        return best
    again = _fitted_with(fitted, others[k], others[k].candidate, notify)
    if again is None or not _explains(again):
        return best
    return Changed(again, others[k].candidate, best.own, others[k])


def _fitted_best(fitted: Fitted, change: Change, notify: Notify) -> Changed | None:
    """The session fitted anew with a change, lasting or not; None where that cannot be."""
    candidate, own = _told_by_held_runs(fitted, change)
    notify(f"search: {candidate.label} that changes", 0.1)
    every = [(candidate, change), *((c.candidate, c) for c in _lasting(fitted, change))]
    fits = [(_fitted_with(fitted, change, told, notify), told, of) for told, of in every]
    known = [
        Changed(again, told, own, of)
        for again, told, of in fits
        if again is not None and of.possible(estimates(again.problem, again.evaluation))
    ]
    return min(known, key=lambda k: wrong(k.fitted), default=None)


def _lasting(fitted: Fitted, change: Change) -> list[Change]:
    """The change through held-out recordings that came later too, where only fitted ones were asked."""
    held = {r.recording.name: r.recording for r in (*fitted.holdout_runs, *fitted.lost)}
    if not change.durations.keys().isdisjoint(held):
        return []
    used = recordings_of(fitted.problem)
    since = min(used[s.recording].start_ns for s in change.stretches)
    later = {name: r.duration for name, r in held.items() if r.start_ns > since}
    return [change.lasting(later)] if later else []


def _fitted_with(fitted: Fitted, change: Change, candidate: Candidate, notify: Notify) -> Fitted | None:
    """The session fitted anew with a change in its model; None where that cannot be."""
    runs, held = _cut(fitted.problem.runs, change), _cut((*fitted.holdout_runs, *fitted.lost), change)
    if not runs:
        return None
    problem = extended(replace(fitted.problem, runs=runs), (candidate,))
    point = carried(problem, fitted.problem, fitted.guess or fitted.evaluation.point)
    try:
        return fitted_anew(fitted, problem, replace(point, latents=()), held, notify)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None


def _with_change(found: Explained, ideal: Ideal, change: Changed) -> Explained:
    """The explanation of the rest, and the change before it."""
    fitted = found.fitted
    after = judged(fitted)[0].holdout
    gain = float(wrong(ideal.fitted) - wrong(fitted))
    evidence = {**evidence_of(ideal, fitted, after), "log_likelihood_gain": gain}
    trial = Trial(change.candidate, fitted.problem, fitted.evaluation, log_evidence(fitted.evaluation))
    told: Finding = finding(trial, estimates(fitted.problem, fitted.evaluation), evidence)
    beside = f"{found.mismatch.explanation} " if found.mismatch.verdict != "none" else ""
    unexplained = found.mismatch.verdict == "unexplained" and not found.trace
    left = (
        "a part is left" if unexplained else "a trace is left" if found.trace else "every residual is noise"
    )
    text = (
        f"Something changed while the session was recorded; with that {left}. "
        f"{beside}{held_out_errors(ideal.scores.holdout, after)}"
    )
    if change.own:
        text += " The held-out recording itself tells the change: nothing else of the model is fitted to it."
    verdict = "unexplained" if unexplained else "explained"
    mismatch = Mismatch(verdict, text, (told, *found.mismatch.findings), found.mismatch.alternatives)
    return replace(found, mismatch=mismatch, ideal=ideal)


def _cut(runs: tuple[Run, ...], change: Change) -> tuple[Run, ...]:
    """Runs in parts before and after every instant of a change."""
    for there in change.within:
        runs = all_without(runs, Event(there.recording, there.start - ABOUT, there.start + ABOUT))
    return runs


def _told_by_held_runs(fitted: Fitted, change: Change) -> tuple[Candidate, bool]:
    """The hypothesis of a change, its numbers known where held-out runs alone have them; and whether so.

    What is another number in a held-out run alone is that run's own, as its start is. No fitted run says
    anything of it, and it says nothing of what they are fitted with.
    """
    used = recordings_of(fitted.problem)
    if any(s.recording in used for s in change.stretches):
        return change.candidate, False
    plain, point = all_runs(fitted)
    plain = replace(plain, runs=_cut(plain.runs, change))
    if len(plain.runs) != len(point.starts):
        # A held-out run that was cut: its parts begin elsewhere
        states = launch_states(plain.bench, plain.runs, point.theta, fitted.rest)
        point = replace(point, starts=states)
    problem = extended(plain, (change.candidate,))
    evaluation, _ = solve(problem, carried(problem, plain, point))
    spread = invert_information(evaluation.information)
    parameters, theta = problem.bench.parameters, evaluation.point.theta
    known = []
    for p in change.candidate.parameters:
        i = parameters.index_of(p.name)
        value = parameters.free[i - INERTIAL].value(theta[i])
        known.append(replace(p, nominal=value, prior_std=p.prior_std * float(np.sqrt(spread[i, i]))))
    return replace(change.candidate, parameters=tuple(known)), True
