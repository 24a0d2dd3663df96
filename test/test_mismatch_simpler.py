"""A hypothesis that has a smaller one as its special case is told beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.screen import promises_of, with_reference
from rig_identification.mismatch.simpler import fitted_simpler, special_cases
from rig_identification.mismatch.trial import Trial, attempt, finished
from rig_identification.recording import Recording
from rig_identification.simulate import simulate_session

#: rad/s too much about y, and rad/s per m/s^2 of the x axis.
TOO_MUCH, FELT = 8e-3, 3e-3
LARGER, SMALLER = "unknown imu y angular_rate cross-sensitivity accelerometer x", "imu_bias imu y"


def _fitted(felt: float) -> tuple[Problem, Evaluation]:
    spec = replace(shaken(10, 8.0), doubts=False)
    made, _ = simulate_session(spec, np.random.default_rng(3))

    def wrong(recording: Recording) -> Recording:
        imu = recording.imu
        assert imu is not None
        values = imu.values.copy()
        values[:, 1] += TOO_MUCH + felt * imu.values[:, 3]
        return replace(recording, imu=replace(imu, values=values))

    fitted = fit_session(replace(made, recordings=tuple(wrong(r) for r in made.recordings)))
    return with_reference(fitted.problem, fitted.rest), fitted.evaluation


def _tried(problem: Problem, evaluation: Evaluation, label: str) -> tuple[Trial, list[Candidate]]:
    candidates = catalogue(problem)
    larger = next(c for c in candidates if c.label == label)
    begun = attempt(problem, evaluation, *promises_of(problem, evaluation, [larger]))
    trial = None if begun is None else finished(begun)
    assert trial is not None
    return trial, candidates


@pytest.mark.parametrize(("felt", "likelier"), [(0.0, SMALLER), (FELT, LARGER)])
def test_evidence_tells_the_special_case_from_the_whole(felt: float, likelier: str) -> None:
    problem, evaluation = _fitted(felt)
    trial, candidates = _tried(problem, evaluation, LARGER)
    simple = list(fitted_simpler(problem, trial, candidates))
    assert [t.candidate.label for t in simple] == [SMALLER]
    assert max([trial, *simple], key=lambda t: t.evidence).candidate.label == likelier


def test_what_has_no_special_case_has_none() -> None:
    problem, _ = _fitted(0.0)
    candidates = catalogue(problem)
    smaller = next(c for c in candidates if c.label == SMALLER)
    assert special_cases(smaller, candidates) == []
    bent = next(c for c in candidates if c.label == "unknown cable_1 tension curvature")
    assert {c.effect for c in special_cases(bent, candidates)} == {"load_cell_gain", "load_cell_offset"}
