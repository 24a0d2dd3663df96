"""The session with what was left out in the model: located, named, fitted, judged on held-out runs, told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit, settled_starts
from rig_identification.estimate.identify import (
    ORDINARY,
    Ideal,
    judged,
    near_noise,
    parameter_estimates,
    with_pieces,
)
from rig_identification.estimate.segments import in_pieces
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, excess
from rig_identification.estimate.verdict import hear, weighed_otherwise
from rig_identification.estimate.whole import fit_whole
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained, evidence_of, held_out_errors, only_a_trace
from rig_identification.mismatch.findings import finding, rival
from rig_identification.mismatch.push import outside, push_beside, with_push, without_push
from rig_identification.mismatch.screen import Promise, carried, extended, screen, with_reference
from rig_identification.mismatch.search import (
    AT_NOISE,
    CHIEF,
    MOST_EFFECTS,
    Trials,
    catalogue,
    count_of,
    needed_gain,
    trials,
    worth_a_fit,
)
from rig_identification.mismatch.slack import Spell, taut_ideal, with_slack
from rig_identification.mismatch.trial import Trial, adopted, beyond_doubt, mass_of, strength
from rig_identification.mismatch.unknown import unknown_finding
from rig_identification.result import Finding, Mismatch

Notify = Callable[[str, float], None]

#: Mean square of whitened residuals up to which short pieces count as explained.
EXPLAINED = 1.3
#: Mean square of whole runs' residuals that refutes what short pieces agreed to.
WRONG = 3.0
#: Share of the excess that named effects must take away to be told where something is left.
CONVINCING = 0.95
#: Gain, in parts of what chance gives, above which it is not tried whether the rest does without an effect.
FIRM = 10.0


@dataclass
class _Search:
    """Where a search stands."""

    problem: Problem  # whole runs, ideal model
    here: Problem  # what hypotheses are tried on: short pieces where much is left, whole runs near the noise
    evaluation: Evaluation
    start: float  # excess in short pieces before anything was found
    share: float = 0.0  # of that excess that the effects found take away
    found: list[Trial] = field(default_factory=list)
    rivals: list[dict[str, object]] = field(default_factory=list)
    liar: str | None = None
    screened: list[Promise] | None = None  # promises about ``evaluation``, where they are known
    budget: Budget = field(default_factory=Budget)

    @property
    def whole(self) -> bool:
        """Whether hypotheses are tried on whole runs."""
        return len(self.here.runs) == len(self.problem.runs)


def explain(ideal: Ideal, spells: list[Spell], notify: Notify) -> Explained | None:
    """Search for what the ideal model leaves out; None where every residual is noise.

    Near the noise the search looks at whole runs, which say most; where the ideal model fails by
    far, at short pieces, in which no model is far off. spells: in which a cable carries nothing (slack.py).
    """
    if ideal.mismatch.verdict == "none":
        return _hidden(ideal, notify)
    if not spells:
        return _explain(ideal, notify)
    notify("search: stretches in which every cable pulls", 0.02)
    taut = taut_ideal(ideal, spells, notify)
    if taut is None:
        return _explain(ideal, notify)
    if not near_noise(taut.fitted):
        taut = with_pieces(taut, notify)
    found = _explain(taut, notify)
    return with_slack(found or Explained(taut.fitted, taut.mismatch, taut), ideal, spells)


def _hidden(ideal: Ideal, notify: Notify) -> Explained | None:
    """What no residual shows by itself, and a hypothesis that knows what to look for does.

    A score test of all hypotheses at once: one among ever so many that gains more than chance does is fitted,
    and told if it explains every run. Otherwise there is nothing to tell.
    """
    notify("search: anything within the noise", 0.1)
    fitted = ideal.fitted
    problem = with_reference(fitted.problem, fitted.rest)
    candidates = catalogue(problem)
    promises = screen(problem, fitted.evaluation, candidates, mass_of(problem, fitted.evaluation))
    if not worth_a_fit(promises, count_of(candidates)):
        return None
    search = _Search(problem, problem, fitted.evaluation, excess(fitted.evaluation), screened=promises)
    best = _named(ideal, search, notify)
    return best if best is not None and best.mismatch.verdict == "explained" and not best.trace else None


def _explain(ideal: Ideal, notify: Notify) -> Explained | None:
    """The search, on runs in which every cable pulls."""
    if ideal.mismatch.verdict == "none":
        return None
    fitted = ideal.fitted
    problem = with_reference(fitted.problem, fitted.rest)
    here, evaluation = _short_pieces(ideal) or (problem, evaluate(problem, fitted.evaluation.point))
    if evaluation is None:
        return None
    search = _Search(problem, here, evaluation, excess(evaluation))
    pushed = None if search.whole else without_push(ideal, problem, here, evaluation, notify)
    if pushed is not None:
        return pushed
    beside = None if search.whole else _beside_push(ideal, here, evaluation, notify)
    if beside is not None:
        return beside
    near = search.whole
    best = _named(ideal, search, notify)
    if best is not None and best.mismatch.verdict == "explained":
        return best
    if near:
        ideal = with_pieces(ideal, notify)
        pushed = _gentle_push(ideal, problem, notify)
        if pushed is not None:
            return pushed
    return _unexplained(ideal, search, best, notify)


def _short_pieces(ideal: Ideal) -> tuple[Problem, Evaluation | None] | None:
    """The short pieces that the cautious fit was made to, and where it ended; None where there was none."""
    if ideal.pieces is None or ideal.careful is None:
        return None
    here = with_reference(ideal.pieces, ideal.fitted.rest)
    return here, evaluate(here, ideal.careful[1].point)


def _gentle_push(ideal: Ideal, problem: Problem, notify: Notify) -> Explained | None:
    """A push so gentle that whole runs come near the noise with it."""
    here, evaluation = _short_pieces(ideal) or (problem, None)
    return None if evaluation is None else without_push(ideal, problem, here, evaluation, notify)


def _beside_push(ideal: Ideal, here: Problem, evaluation: Evaluation, notify: Notify) -> Explained | None:
    """What explains the session outside a push; None where nothing pushes, or nothing explains the rest."""
    event = push_beside(here, evaluation, notify)
    if event is None:
        return None
    found = _explain(outside(ideal, event, notify), notify)
    if found is None or found.mismatch.verdict != "explained":
        return None
    return with_push(found, ideal, here, event)


def _named(ideal: Ideal, search: _Search, notify: Notify) -> Explained | None:
    """Effects of the catalogue, one after the other, until the whole runs are explained."""
    candidates = catalogue(search.problem)
    best: Explained | None = None
    fallback: Explained | None = None
    for step in range(MOST_EFFECTS):
        if step and search.budget.spent:
            break
        left = [c for c in candidates if c.label not in {t.candidate.label for t in search.found}]
        at = (step + 0.5) / (MOST_EFFECTS + 1)
        tried = trials(
            search.here,
            search.evaluation,
            left,
            ORDINARY,
            lambda label, at=at: notify(f"search: {label}", at),  # type: ignore[misc]
            search.screened,
            search.budget,
        )
        search.screened = None
        search.liar = search.liar or tried.liar
        if not tried.done:
            break
        before = replace(search, found=list(search.found), rivals=list(search.rivals))
        first = tried.done[0]
        _adopt(search, tried, first)
        if not search.whole:
            search.share = 1.0 - excess(search.evaluation) / max(search.start, 1.0)
        if misfit(search.evaluation) > EXPLAINED:
            # A push among pieces that all lack something stands out with that in the model
            beside = None if search.whole else _beside_push(ideal, search.here, search.evaluation, notify)
            if beside is not None:
                return beside
            if search.share < CHIEF:
                # Two effects take nearly all away only where the first takes the larger part
                break
            # Something large is left: there is no use yet in whole runs
            continue
        notify("search: whole runs with " + ", ".join(t.candidate.label for t in search.found), at)
        best = _whole(ideal, search)
        if best.mismatch.verdict == "explained" and not best.trace:
            return _pruned(best, search, len(candidates))
        if best.mismatch.verdict == "explained":
            # All but a trace: a second effect may be that trace, or nothing better is found
            fallback = best
        elif near_noise(best.fitted):
            again = _second_choice(ideal, before, tried, notify)
            if again is not None:
                return _pruned(again[0], again[1], len(candidates))
        if near_noise(best.fitted):
            search.here, search.evaluation = best.fitted.problem, best.fitted.evaluation
        elif misfit(best.fitted.evaluation) > WRONG and first.candidate.build is not None:
            # Short pieces bend to anything that swings; what whole runs refute is no base to go on from
            break
    return fallback or best


def _adopt(search: _Search, tried: Trials, chosen: Trial) -> None:
    """Go on with ``chosen`` in the model; the other likely ones are its rivals."""
    search.found.append(chosen)
    search.rivals += [rival(t, chosen) for t in tried.done if t is not chosen]
    search.here, search.evaluation = adopted(search.here, search.evaluation, chosen)


def _second_choice(
    ideal: Ideal, before: _Search, tried: Trials, notify: Notify
) -> tuple[Explained, _Search] | None:
    """A less likely hypothesis that explains all runs where the likeliest does not, and how it was found.

    What has more numbers may bend further to the fitted runs. Held-out runs and the scale, which
    tell what is bent, are heard by the verdict alone.
    """
    for other in (*tried.done[1:], *tried.beaten):
        search = replace(before, found=list(before.found), rivals=list(before.rivals))
        _adopt(search, tried, other)
        if misfit(search.evaluation) > AT_NOISE:
            continue
        notify("search: whole runs with " + ", ".join(t.candidate.label for t in search.found), 0.9)
        found = _whole(ideal, search)
        if found.mismatch.verdict == "explained" and not found.trace:
            return found, search
    return None


def _whole(ideal: Ideal, search: _Search) -> Explained:
    return _fitted_whole(ideal, search, search.found, search.here, search.evaluation.point)


def _fitted_whole(
    ideal: Ideal, search: _Search, found: list[Trial], here: Problem, known: Point
) -> Explained:
    """Whole runs with the effects ``found``, from a ``known`` point of the problem ``here``."""
    whole = extended(search.problem, tuple(t.candidate for t in found))
    point = replace(known, theta=carried(whole, here, known).theta)
    fitted = fit_whole(ideal.fitted, whole, here, point)
    # What says most comes first, whatever was found first
    found = sorted(found, key=lambda t: -strength(_at(fitted, t)))
    after, verdict = judged(fitted)
    # What the ground scale contradicts is no trace, though it is one number among a hundred thousand
    trace = verdict.verdict != "none" and weighed_otherwise(fitted) is None
    heard = hear(fitted) if trace and only_a_trace(ideal.fitted, fitted) else None
    trace = heard is not None and not heard.contradicted
    loose = heard.looseness if heard is not None and trace else 1.0
    findings = _findings(ideal, fitted, found, after.holdout, loose)
    named = ", ".join(f.effect for f in findings)
    errors = held_out_errors(ideal.scores.holdout, after.holdout)
    if verdict.verdict == "none":
        told, text = "explained", f"With {named} in the model every residual is noise. {errors}"
    elif trace:
        told, text = "explained", f"{named} explains all but a trace. {errors} {verdict.explanation}"
    else:
        told = "unexplained"
        text = f"{named} explains part of it; something is left. {verdict.explanation}"
    return Explained(fitted, Mismatch(told, text, findings, tuple(search.rivals)), ideal, loose, trace)


def _at(fitted: Fitted, trial: Trial) -> Trial:
    """A trial whose effect is in a fit's model, as that fit has it."""
    return replace(trial, problem=fitted.problem, evaluation=fitted.evaluation)


def _pruned(best: Explained, search: _Search, count: int) -> Explained:
    """The explanation less what it can do without: an early effect may only have stood in for a later one."""
    kept = list(search.found)
    ordinary = {p.name: p.prior_std for p in search.problem.bench.parameters.free if p.bounded}
    while len(kept) > 1:
        fitted = best.fitted
        here = [_at(fitted, t) for t in kept]
        strengths = [
            strength(t) / needed_gain(t.candidate, count) if beyond_doubt(t, ordinary, ORDINARY) else 0.0
            for t in here
        ]
        for i in np.argsort(strengths):
            if strengths[i] > FIRM:
                return best
            less = [t for k, t in enumerate(kept) if k != i]
            again = _fitted_whole(best.ideal, search, less, fitted.problem, fitted.evaluation.point)
            if again.mismatch.verdict == "explained":
                best, kept = again, less
                break
        else:
            return best
    return best


def _findings(
    ideal: Ideal, fitted: Fitted, found: list[Trial], after: float | None, loose: float
) -> tuple[Finding, ...]:
    """The effects in the recording contract's words. loose: factor on their variances."""
    parameters = parameter_estimates(fitted.problem, fitted.evaluation)
    evidence = evidence_of(ideal, fitted, after)
    values = {p.name: p.value for p in parameters}
    # An error beyond what is ordinary comes on top of an ordinary one, and only their sum is seen
    ordinary = {p.name: p.prior_std for p in ideal.fitted.problem.bench.parameters.free}
    stds = {p.name: float(np.sqrt(loose * p.std**2 + ordinary.get(p.name, 0.0) ** 2)) for p in parameters}
    return tuple(finding(t, values, stds, evidence) for t in found)


def _unexplained(ideal: Ideal, search: _Search, best: Explained | None, notify: Notify) -> Explained:
    """What is told where something is left: named effects only where they take nearly all of it away."""
    convincing = bool(search.found) and search.share > CONVINCING and misfit(search.evaluation) < EXPLAINED**2
    ideal = with_pieces(ideal, notify)
    if convincing and best is None:
        best = _whole(ideal, search)
    notify("search: the missing wrench", 0.95)
    here, evaluation = search.here, search.evaluation
    convincing = convincing and best is not None and misfit(best.fitted.evaluation) < WRONG
    if convincing and best is not None and not hear(best.fitted).contradicted:
        kept: tuple[Finding, ...] = best.mismatch.findings
        fitted, explanation, rivals = best.fitted, best.mismatch.explanation, best.mismatch.alternatives
    else:
        kept, fitted, explanation = (), ideal.fitted, ideal.mismatch.explanation
        partly: list[dict[str, object]] = [
            {"effect": t.candidate.effect, "where": dict(t.candidate.where), "log_likelihood_gap": 0.0}
            for t in search.found
        ]
        rivals = (*partly, *search.rivals)
        if partly:
            named = ", ".join(str(p["effect"]) for p in partly)
            explanation += f" {named} would take away a part of it, which does not convince."
        pieces = _short_pieces(ideal) if search.found else None
        if pieces is not None:
            # What is not told must not take part of the missing wrench away
            here, evaluation = pieces[0], pieces[1] or evaluation
    if search.budget.spent:
        explanation += f" The search ended after {search.budget.seconds:.0f} s, short of some hypotheses."
    unknown = _unknown(ideal.fitted, here, evaluation, search.liar)
    evidence = evidence_of(ideal, ideal.fitted, ideal.scores.holdout)
    findings = kept if unknown is None else (*kept, replace(unknown, evidence=evidence))
    # Far from the noise the cautious fit knows by itself how little it knows
    loose = hear(ideal.fitted).looseness if near_noise(ideal.fitted) else 1.0
    return Explained(fitted, Mismatch("unexplained", explanation, findings, tuple(rivals)), ideal, loose)


def _unknown(ideal: Fitted, here: Problem, evaluation: Evaluation, liar: str | None) -> Finding | None:
    """A stand-in for what ``evaluation`` leaves, seen in short pieces."""
    if len(here.runs) == len(ideal.problem.runs):
        point = evaluation.point
        here, start = in_pieces(here, point.theta, ideal.rest, point.rest_guesses)
        again = evaluate(here, replace(start, starts=settled_starts(here, start)))
        if again is None:
            return None
        evaluation = again
    return unknown_finding(here, evaluation, ideal.rest, mass_of(here, evaluation), liar)
