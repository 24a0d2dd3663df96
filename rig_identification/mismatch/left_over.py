"""What is told where something is left: names that convince, and a stand-in for the rest."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit, settled_starts
from rig_identification.estimate.identify import Ideal, near_noise, with_pieces
from rig_identification.estimate.segments import in_pieces
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, excess
from rig_identification.estimate.verdict import hear
from rig_identification.mismatch.explained import Explained, evidence_of
from rig_identification.mismatch.findings import called, not_fitted, rival
from rig_identification.mismatch.first_fits import NO_STAND_IN, shows
from rig_identification.mismatch.locate import DRIVE
from rig_identification.mismatch.something_loose import loose_finding
from rig_identification.mismatch.standing import EXPLAINED, WRONG, Search, short_pieces
from rig_identification.mismatch.trial import Trial, mass_of
from rig_identification.mismatch.unknown import unknown_finding
from rig_identification.mismatch.whole_runs import whole_runs
from rig_identification.result import Finding, Mismatch

Notify = Callable[[str, float], None]
#: What is told, and the fit that something loose is looked for beside.
_Base = tuple[tuple[Finding, ...], Fitted]

#: Share of the excess that named effects must take away to be told where something is left.
CONVINCING = 0.95


def unexplained(ideal: Ideal, search: Search, best: Explained | None, notify: Notify) -> Explained:
    """What is told where something is left: named effects only where they take nearly all of it away."""
    convincing = bool(search.found) and search.share > CONVINCING and misfit(search.evaluation) < EXPLAINED**2
    ideal = with_pieces(ideal, notify)
    if convincing and best is None:
        best = whole_runs(ideal, search)
    notify("search: the missing wrench", 0.95)
    here, evaluation = search.here, search.evaluation
    # A part of less than no mass on springs takes away what a push to a beat does
    near = best is not None and best.possible and misfit(best.fitted.evaluation) < WRONG
    told = best if convincing and near else None
    nearly_all = told is not None and _next_to_none(ideal, told, search.found)
    heard = None if told is None else hear(told.fitted)
    if told is not None and heard is not None and (nearly_all or not heard.contradicted):
        kept: tuple[Finding, ...] = told.mismatch.findings
        fitted, explanation, rivals = told.fitted, told.mismatch.explanation, told.mismatch.alternatives
    else:
        kept, fitted, explanation = (), ideal.fitted, ideal.mismatch.explanation
        partly = [rival(t, 0.0) for t in search.found]
        rivals = (*partly, *search.rivals)
        if partly:
            named = ", ".join(called(t.candidate.effect, t.candidate.where) for t in search.found)
            explanation += f" {named} would take away a part of it, which does not convince."
        pieces = short_pieces(ideal) if search.found else None
        if pieces is not None:
            # What is not told must not take part of the missing wrench away
            here, evaluation = pieces[0], pieces[1] or evaluation
    # What knocks at the body moves all witnesses: where all but one device agree, nothing does
    knocks = search.liar in (None, DRIVE)
    bases = _bases(ideal, search, best, alone=not nearly_all)
    loose = _something_loose(bases, ideal.scores.holdout, search, notify) if knocks else None
    if loose is not None:
        kept, fitted = loose
        explanation = f"{', '.join(f.effect for f in kept)} explains part of it. {explanation}"
    if search.budget.spent():
        explanation += f" The search ended after {search.budget.limit:g} units of work, short of "
        short = [p.candidate for p in search.waiting]
        explanation += ", ".join(called(c.effect, c.where) for c in short) or "some hypotheses"
        explanation += " and others." if short else "."
        known = {str(r["effect"]) for r in rivals}
        rivals = (*rivals, *(not_fitted(p) for p in search.waiting if p.candidate.effect not in known))
    # Where whole runs with what is told are noise, and something else contradicts, no force is missing
    missing = not kept or shows(fitted.evaluation)
    unknown = _unknown(ideal.fitted, here, evaluation, search.liar) if missing else None
    evidence = evidence_of(ideal, ideal.fitted, ideal.scores.holdout)
    findings = kept if unknown is None else (*kept, replace(unknown, evidence=evidence))
    if fitted is ideal.fitted:
        # Far from the noise the cautious fit knows by itself how little it knows
        looseness = hear(fitted).looseness if near_noise(fitted) else 1.0
    else:
        # With what is told in the model the body comes from whole runs, as loosely as these disagree
        ideal, looseness = replace(ideal, careful=None), (heard or hear(fitted)).looseness
    return Explained(fitted, Mismatch("unexplained", explanation, findings, tuple(rivals)), ideal, looseness)


def _next_to_none(ideal: Ideal, best: Explained, found: list[Trial]) -> bool:
    """Whether names leave so little of whole runs that they stand in for nothing, held-out runs or not.

    Dry hinges of which a part in a million is left are dry, whatever else a loose part does to the body.
    What has numbers enough bends to as much of a force that is none of it, in the runs that it is fitted to.
    """
    if any(trial.candidate.many for trial in found):
        return False
    return excess(best.fitted.evaluation) < NO_STAND_IN * excess(ideal.fitted.evaluation)


def _bases(ideal: Ideal, search: Search, best: Explained | None, *, alone: bool) -> Iterator[_Base]:
    """The fits that something loose is looked for beside.

    First the ideal model, if it may be ``alone``; then what was found, though it does not convince by itself:
    an effect of the motion in which blows are left over takes no share of them away.
    """
    if alone:
        yield (), ideal.fitted
    if best is None and search.found and not search.budget.late():
        best = whole_runs(ideal, search)
    if best is not None and best.possible:
        yield best.mismatch.findings, best.fitted


def _something_loose(
    bases: Iterable[_Base], before: float | None, search: Search, notify: Notify
) -> _Base | None:
    """What is told, and the fit it is told beside, where the session has something loose; None: it has not.

    It is looked for beside the ideal model, unless what was found cannot stand in for it, and then beside
    what was found. before: held-out error of the ideal model.
    """
    for others, fitted in bases:
        notify("search: something loose", 0.9)
        found = loose_finding(fitted, before, scan=not search.budget.late())
        if found is not None:
            return (*others, found), fitted
    return None


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
