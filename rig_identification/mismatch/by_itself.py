"""What each of several findings is worth by itself: what is lost when it alone is taken out of the model.

All the others stay in the model and are fitted again from where they stand. A few steps suffice: each one's
numbers hardly move where another is missing, or they move along what both explain. A fit that is broken off
still leaves a little more than it would at its end, so that a gain is told by that much too large.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import scores
from rig_identification.estimate.whole import fit_whole
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.opened import carried, extended
from rig_identification.mismatch.trial import Trial, may_be_none
from rig_identification.mismatch.whole_runs import as_fitted
from rig_identification.result import Finding

#: Steps of a fit without one of the effects.
STEPS = 6
#: Chance with which an amount that is none gains as much as one that is told at least.
CHANCE = 0.05
#: What is told of a finding that was not weighed by itself.
NOT_WEIGHED: Mapping[str, float | None] = {"log_likelihood_gain": None, "holdout_error_before": None}


def each_by_itself(found: Explained, stop: Callable[[], bool]) -> Explained:
    """The same with each finding's own evidence; a single one's is its gain over the ideal model.

    A finding whose amount's 95 % interval includes zero, and without which the others explain as much but for
    what chance gives, is none, and is not told. stop: whether a fit ends after the step that it is at.
    """
    if len(found.effects) < 2 or found.plain is None:
        return found
    findings = list(found.mismatch.findings)
    for k, trial in enumerate(found.effects):
        at = next((i for i, f in enumerate(findings) if _tells(f, trial)), None)
        if at is None:
            continue
        evidence = _own_evidence(found, k, findings[at].evidence, stop)
        if len(findings) > 1 and _by_chance(as_fitted(found.fitted, trial), evidence):
            del findings[at]
        else:
            findings[at] = replace(findings[at], evidence=evidence)
    return replace(found, mismatch=replace(found.mismatch, findings=tuple(findings)))


def not_weighed(found: Explained) -> Explained:
    """The same where there is no time to weigh several findings one by one: no gain is told of any."""
    if len(found.effects) < 2:
        return found
    findings = tuple(
        replace(f, evidence={**f.evidence, **NOT_WEIGHED}) if any(_tells(f, t) for t in found.effects) else f
        for f in found.mismatch.findings
    )
    return replace(found, mismatch=replace(found.mismatch, findings=findings))


def _tells(finding: Finding, trial: Trial) -> bool:
    """Whether a finding is of this trial's effect, at its place."""
    where = trial.candidate.where
    same = all(finding.where.get(key) == value for key, value in where.items() if key != "axis")
    own = {q.name for q in trial.candidate.parameters}
    # A law may be told by another name; a number may be of two effects, as how much hinges twist
    return same and (finding.effect == trial.candidate.effect or own <= finding.numbers.keys())


def _own_evidence(
    found: Explained, k: int, told: Mapping[str, float | None], stop: Callable[[], bool]
) -> dict[str, float | None]:
    """``evidence`` of the effect ``k`` by itself. told: that of all of them."""
    whole = found.fitted
    if stop():
        return {**told, **NOT_WEIGHED}
    try:
        less = _without(found, k, stop)
    except (FloatingPointError, np.linalg.LinAlgError):
        # What is left cannot be followed without it
        return {**told, **NOT_WEIGHED}
    ideal, before = found.ideal, scores(less).holdout
    cost = less.evaluation.cost
    if _same_runs(ideal.fitted, whole) and ideal.fitted.evaluation.cost < cost:
        # The ideal model is among those without it
        cost, before = ideal.fitted.evaluation.cost, ideal.scores.holdout
    gain = float(cost - whole.evaluation.cost)
    return {**told, "log_likelihood_gain": gain, "holdout_error_before": before}


def _without(found: Explained, k: int, stop: Callable[[], bool]) -> Fitted:
    """Whole runs with all effects but the one ``k``."""
    whole = found.fitted
    assert found.plain is not None
    others = [t.candidate for i, t in enumerate(found.effects) if i != k]
    less = replace(whole.problem, bench=extended(found.plain, tuple(others)).bench)
    point = whole.evaluation.point
    point = replace(point, theta=carried(less, whole.problem, point).theta)
    curved = any(c.curved for c in others)
    return fit_whole(whole, less, whole.problem, point, stop, curved, steps=STEPS)


def _same_runs(one: Fitted, other: Fitted) -> bool:
    """Whether two fits are to the same samples."""

    def begun(runs: tuple[Run, ...]) -> list[tuple[object, int]]:
        return [(run.begins, run.grid.nodes) for run in runs]

    return begun(one.problem.runs) == begun(other.problem.runs)


def _by_chance(trial: Trial, evidence: Mapping[str, float | None]) -> bool:
    """Whether an effect's amount may be none, and its numbers gain no more than chance gives so many."""
    gain = evidence["log_likelihood_gain"]
    if gain is None or not may_be_none(trial):
        return False
    return bool(gain < 0.5 * float(chi2.isf(CHANCE, len(trial.candidate.parameters))))
