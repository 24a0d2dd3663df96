"""What is told where something is left: names that take nearly all of it away, a stand-in for the rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import Ideal, fitted_anew, judged, scores
from rig_identification.estimate.verdict import hear
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained, evidence_of
from rig_identification.mismatch.findings import called, rival
from rig_identification.mismatch.latent import AVERAGED, MissingWrench
from rig_identification.mismatch.locate import DRIVE, silenced
from rig_identification.mismatch.something_loose import loose_finding
from rig_identification.mismatch.unknown import missing_finding
from rig_identification.result import Finding, Mismatch
from rig_identification.search.ladder import Rung, fitted_at
from rig_identification.search.levels import ALONE
from rig_identification.search.liar import liar_of
from rig_identification.search.search import Outcome

Array = NDArray[np.float64]
Notify = Callable[[str, float], None]

#: Levels (of half a decade each) by which names have to weaken the wrench to be told beside it.
WEAKER = 2
#: Mean square of whole runs' residuals beyond which names are refuted.
WRONG = 3.0
#: Held-out error up to which a model predicts as one that explains (recording contract).
PREDICTS = 1.1
#: Level at which the wrench is found where the evidence asks for none: what is left lies in the sensors.
STAND_IN = ALONE - 4


def unexplained(ideal: Ideal, outcome: Outcome, budget: Budget, notify: Notify) -> Explained:
    """What is told of a session that nothing explains."""
    notify("search: the missing wrench", 0.95)
    likeliest, partly = outcome.likeliest, _partly(outcome)
    fitted, explanation = ideal.fitted, ideal.mismatch.explanation
    kept: tuple[Finding, ...] = ()
    alternatives: tuple[dict[str, object], ...] = ()
    rung, looseness = outcome.whole, hear(ideal.fitted).looseness
    if partly is not None:
        fitted, kept = partly.fitted, partly.mismatch.findings
        explanation, alternatives = partly.mismatch.explanation, partly.mismatch.alternatives
        rung, looseness = outcome.rung, hear(partly.fitted).looseness
    elif likeliest.found:
        alternatives = tuple(rival(likeliest.trial(c), 0.0) for c in likeliest.found)
        named = ", ".join(called(c.effect, c.where) for c in likeliest.found)
        explanation += f" {named} would take away a part of it, which does not convince."
    device = None if budget.late() else liar_of(outcome.first.rung, budget)
    if device in (None, DRIVE):
        # What knocks at the body moves all witnesses: where all but one device agree, nothing does
        for others, base in _bases(ideal, outcome.partly, partly):
            loose = loose_finding(base, ideal.scores.holdout, scan=not budget.late())
            if loose is not None:
                kept, fitted = (*others, loose), base
                explanation = f"{', '.join(f.effect for f in kept)} explains part of it. {explanation}"
                break
    evidence = evidence_of(ideal, ideal.fitted, ideal.scores.holdout)
    without = None if device in (None, DRIVE) else without_device(ideal, str(device), notify)
    if without is not None:
        fitted, looseness = without.fitted, hear(without.fitted).looseness
        evidence = {**evidence, "holdout_error_after": without.scores.holdout}
        explanation += f" The body's numbers are what everything but {device} tells."
    if budget.spent():
        explanation += f" The search ended after {budget.limit:g} units of work, short of some hypotheses."
    missing = strongest_missing(rung)
    findings = kept
    if missing is not None:
        unknown = missing_finding(missing, ideal.fitted.problem.bench.rig, device)
        findings += (replace(unknown, evidence=evidence),)
    told = Mismatch("unexplained", explanation, findings, alternatives)
    return Explained(fitted, told, ideal, looseness)


def without_device(ideal: Ideal, device: str, notify: Notify) -> Ideal | None:
    """The ideal model fitted to everything but one device; None where that leaves as much.

    What is wrong with a device bends the body as long as it is heard. Where all others agree they tell it.
    """
    notify(f"search: everything but {device}", 0.97)
    fitted = ideal.fitted
    held = replace(fitted.problem, runs=(*fitted.holdout_runs, *fitted.lost), rests=())
    quiet, point = silenced(fitted.problem, device), replace(fitted.evaluation.point, latents=())
    try:
        again = fitted_anew(fitted, quiet, point, silenced(held, device).runs, notify)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None
    left = Ideal(again, *judged(again))
    return left if misfit(again.evaluation) < min(WRONG, misfit(fitted.evaluation)) else None


def _partly(outcome: Outcome) -> Explained | None:
    """Whole runs with the likeliest effects, where these take nearly all of what is left away."""
    best, first = outcome.partly, outcome.first.rung
    if best is None or not best.possible or not best.mismatch.findings:
        return None
    if misfit(best.fitted.evaluation) > WRONG:
        return None
    if outcome.likeliest.rung.level - first.level < WEAKER:
        return None
    if not hear(best.fitted).contradicted:
        return best
    # Sharp numbers that another run moves by some std are no other physics where they predict that run
    held_out = scores(best.fitted).holdout
    return best if held_out is not None and held_out < PREDICTS else None


def _bases(
    ideal: Ideal, found: Explained | None, told: Explained | None
) -> Iterator[tuple[tuple[Finding, ...], Fitted]]:
    """The fits that something loose is looked for beside: the ideal model's, and one with what was found."""
    if told is None:
        yield (), ideal.fitted
    if found is not None and found.possible:
        yield found.mismatch.findings, found.fitted


def strongest_missing(rung: Rung) -> MissingWrench | None:
    """The missing wrench of the run in which it is strongest; None where there is no run."""
    if rung.alone:
        again = fitted_at(rung.problem, replace(rung.evaluation.point, latents=()), STAND_IN, 0)
        if again is None:
            return None
        rung = again
    every = missing_wrenches(rung)
    return max(every, key=lambda m: float(np.mean(m.wrench[:, :3] ** 2)), default=None)


def missing_wrenches(rung: Rung) -> list[MissingWrench]:
    """The wrench that a model with a discrepancy lacks, run by run, as it is smoothed."""
    out = []
    for run, linearised in zip(rung.problem.runs, rung.evaluation.runs, strict=True):
        step = run.grid.step
        width = max(1, round(AVERAGED / step))
        kernel = np.ones(width) / width
        averaged: Array = np.stack([np.convolve(w, kernel, mode="same") for w in linearised.latent.T], axis=1)
        out.append(
            MissingWrench(
                run.recording.name,
                np.asarray(run.offset + step * np.arange(run.grid.nodes), dtype=np.float64),
                averaged,
                linearised.motion.R_world_body,
                linearised.motion.states[:, :12],
            )
        )
    return out
