"""Cables that stretch from the first guess on (estimate/stretching.py), told as what they are: a finding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.estimates import estimates
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.stretching import STIFFNESS
from rig_identification.mismatch.findings import finding
from rig_identification.mismatch.supports import cable_elasticity
from rig_identification.mismatch.trial import Trial, mass_of
from rig_identification.result import Finding, Identification, Mismatch

#: Factor by which EA may be off, three standard deviations either way, for a stiffness to count as told.
TWICE = 2.0
NOT_TOLD = (
    "More cables hold the body than it takes, or hold it in no pose at their lengths: they are taken to "
    "stretch. How stiff they are these recordings do not tell."
)


def with_stretch_told(found: Identification, ideal: Fitted) -> Identification:
    """The answer with the cables' stretch as its first finding, where the ``ideal`` model has it."""
    if ideal.stretch is None or any(f.effect == "cable_elasticity" for f in found.mismatch.findings):
        return found
    told = estimates(ideal.problem, ideal.evaluation)
    value, std = told.of(STIFFNESS)
    if not 3.0 * std / value < np.log(TWICE):
        return replace(found, notes=(*found.notes, NOT_TOLD))
    problem, evaluation = ideal.problem, ideal.evaluation
    candidate = cable_elasticity(
        problem.bench.rig, problem.bench.parameters.model, mass_of(problem, evaluation)
    )
    evidence = {
        "log_likelihood_gain": None if ideal.stretch.gain is None else float(ideal.stretch.gain),
        "holdout_error_before": None,
        "holdout_error_after": found.holdout_error,
    }
    stretch = finding(Trial(candidate, problem, evaluation, 0.0), told, evidence)
    return replace(
        found, mismatch=_beside(found.mismatch, stretch.effect, (stretch, *found.mismatch.findings))
    )


def _beside(mismatch: Mismatch, effect: str, findings: tuple[Finding, ...]) -> Mismatch:
    verdict, text = mismatch.verdict, mismatch.explanation
    if verdict == "none":
        verdict = "explained"
    text = f"With {effect} in the model from the start: {text[:1].lower()}{text[1:]}"
    return replace(mismatch, verdict=verdict, explanation=text, findings=findings)
