"""Whole runs with what was found in the model: fitted, judged on held-out runs, pruned and told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.estimates import estimates
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import ORDINARY, Ideal, judged
from rig_identification.estimate.mixture import Bodies
from rig_identification.estimate.solve import Point, Problem
from rig_identification.estimate.verdict import hear
from rig_identification.estimate.whole import fit_whole
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained, evidence_of, held_out_errors, trace_of
from rig_identification.mismatch.findings import effects_of, finding
from rig_identification.mismatch.hypotheses import needed_gain
from rig_identification.mismatch.opened import carried, extended
from rig_identification.mismatch.trial import (
    Trial,
    beyond_doubt,
    is_ordinary,
    may_be_none,
    ordinary_errors,
    possible,
    strength,
)
from rig_identification.result import Finding, Mismatch

#: Gain, in parts of what chance gives, above which it is not tried whether the rest does without an effect.
FIRM = 10.0


#: Who is told what explains whole runs, as it is found.
Heard = Callable[[Explained], None]


def unheard(found: Explained) -> None:
    """Nobody waits for what is found on the way."""


@dataclass(frozen=True)
class Named:
    """Effects that are in a model, fitted to whole runs, and what is told beside them."""

    problem: Problem  # the ideal model's
    found: tuple[Trial, ...]  # the last one's fit has all of them
    budget: Budget
    rivals: tuple[dict[str, object], ...] = ()
    bodies: Bodies = ()  # what rivals of the last one make of the body
    heard: Heard = unheard  # is told what explains whole runs, as it is found


def whole_runs(ideal: Ideal, named: Named, *, as_found: bool = False) -> Explained:
    """Whole runs with what was found. as_found: it is told in that order, whatever says most."""
    known = named.found[-1].evaluation.point
    return fitted_whole(ideal, named, list(named.found), named.found[-1].problem, known, as_found=as_found)


def fitted_whole(
    ideal: Ideal,
    named: Named,
    found: list[Trial],
    here: Problem,
    known: Point,
    *,
    as_found: bool = False,
) -> Explained:
    """Whole runs with the effects ``found``, from a ``known`` point of the problem ``here``."""
    whole = extended(named.problem, tuple(t.candidate for t in found))
    point = replace(known, theta=carried(whole, here, known).theta)
    curved = any(t.candidate.curved for t in found)
    fitted = fit_whole(ideal.fitted, whole, here, point, named.budget.late, curved)
    after, verdict = judged(fitted)
    if verdict.verdict != "none" and not curved and not named.budget.spent() and strayed(fitted):
        fitted = _along_what_happened(ideal.fitted, fitted, named.budget.late)
        after, verdict = judged(fitted)
    if not as_found:
        # What says most comes first, whatever was found first. Without its effect an error goes to its bound
        bounds = {name: ORDINARY * std for name, std in ordinary_errors(named.problem).items()}
        found = sorted(found, key=lambda t: -strength(as_fitted(fitted, t), bounds))
    heard = trace_of(ideal.fitted, fitted) if verdict.verdict != "none" else None
    trace, loose = heard is not None, 1.0 if heard is None else heard.looseness
    # What is ordinary is in the model, and no finding
    named_here = [t for t in found if not is_ordinary(as_fitted(fitted, t))]
    findings = _findings(ideal, fitted, named_here, after.holdout, loose)
    effects = effects_of(findings) or ", ".join(t.candidate.label for t in found)
    errors = held_out_errors(ideal.scores.holdout, after.holdout)
    can_be = all(possible(as_fitted(fitted, t)) for t in found)
    if not can_be:
        told, trace = "unexplained", False
        text = (
            f"{effects} would have less than nothing of an amount, or act where no body in this rig can be: "
            f"it stands for something else. {errors}"
        )
    elif verdict.verdict == "none":
        told, text = "explained", f"With {effects} in the model every residual is noise. {errors}"
    elif trace and findings:
        told, text = "explained", f"{effects} explains all but a trace. {errors} {verdict.explanation}"
    else:
        told, trace = "unexplained", False
        # An amount that may as well be none bends to what is left, and tells nothing of it
        findings = tuple(
            f for f, t in zip(findings, named_here, strict=True) if not may_be_none(as_fitted(fitted, t))
        )
        effects = effects_of(findings) or "Nothing"
        text = f"{effects} explains part of it; something is left. {verdict.explanation}"
    mismatch = Mismatch(told, text, findings, named.rivals)
    outcome = Explained(
        fitted, mismatch, ideal, loose, trace, named.bodies, can_be, tuple(found), named.problem
    )
    if outcome.told:
        named.heard(outcome)
    return outcome


def ordinary_alone(found: Explained) -> Explained:
    """What explains the session, as no finding where all of it is ordinary; as it is otherwise."""
    if not found.wholly or found.mismatch.findings:
        return found
    text = f"{found.mismatch.explanation} That is within what every such rig has, and no finding."
    return replace(found, mismatch=replace(found.mismatch, verdict="none", explanation=text))


def strayed(fitted: Fitted) -> bool:
    """Whether the fitted runs are noise and a held-out one asks for parameters that they exclude by far.

    What lacks something shows in the fitted runs as well: this is another valley than the recordings'.
    """
    heard, own = hear(fitted), {run.recording.name for run in fitted.problem.runs}
    loud = any(w.recording in own and heard.unlikely(w.band.log10_p) for w in heard.witnesses)
    return heard.contradicted and not loud


def _along_what_happened(ideal: Fitted, fitted: Fitted, stop: Callable[[], bool]) -> Fitted:
    """The fit begun anew by way of what happened; as it was where that leads nowhere better.

    Undisturbed, a body that rubs to a halt answers so sharply that a fit stays where it began.
    """
    whole = fitted.problem
    about = fit_whole(ideal, whole, whole, _undisturbed(fitted), stop, curved=True)
    again = fit_whole(ideal, whole, whole, _undisturbed(about), stop)
    return again if again.evaluation.cost < fitted.evaluation.cost else fitted


def _undisturbed(fitted: Fitted) -> Point:
    return replace(fitted.evaluation.point, latents=())


def as_fitted(fitted: Fitted, trial: Trial) -> Trial:
    """A trial whose effect is in a fit's model, as that fit has it."""
    return replace(trial, problem=fitted.problem, evaluation=fitted.evaluation)


def firmness(trial: Trial, ordinary: dict[str, float], count: int) -> float:
    """Gain of a trial's effect, in parts of what chance gives one of ``count``; 0 within what is ordinary."""
    if not beyond_doubt(trial, ordinary, ORDINARY):
        return 0.0
    return strength(trial) / needed_gain(trial.candidate, count)


def pruned(best: Explained, named: Named, count: int) -> Explained:
    """The explanation less what it can do without: an early effect may only have stood in for a later one.

    What may as well be none goes first, and goes too where a trace is left without it.
    """
    kept = list(named.found)
    ordinary = ordinary_errors(named.problem)
    while len(kept) > 1:
        fitted = best.fitted
        here = [as_fitted(fitted, t) for t in kept]
        none = [may_be_none(t) for t in here]
        strengths = [-1.0 if n else firmness(t, ordinary, count) for t, n in zip(here, none, strict=True)]
        for i in np.argsort(strengths):
            if strengths[i] > FIRM:
                return best
            less = [t for k, t in enumerate(kept) if k != i]
            again = fitted_whole(best.ideal, named, less, fitted.problem, fitted.evaluation.point)
            if again.told and (none[i] or best.trace or not again.trace):
                # What leaves a trace that both together do not leave lacks something
                best, kept = again, less
                break
        else:
            return best
    return best


def _findings(
    ideal: Ideal, fitted: Fitted, found: list[Trial], after: float | None, loose: float
) -> tuple[Finding, ...]:
    """The effects in the recording contract's words. loose: factor on their variances."""
    evidence = evidence_of(ideal, fitted, after)
    # An error beyond what is ordinary comes on top of an ordinary one, and only their sum is seen
    ordinary = {p.name: p.prior_std for p in ideal.fitted.problem.bench.parameters.free}
    told = estimates(fitted.problem, fitted.evaluation).doubted(loose, ordinary)
    return tuple(finding(t, told, evidence) for t in found)
