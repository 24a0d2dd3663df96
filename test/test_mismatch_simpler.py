"""A hypothesis that has a smaller one as its special case is told beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import with_reference
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import fitted_to_its_end, mass_of
from rig_identification.recording import Recording
from rig_identification.search.expand import Standing, _alike, special_cases
from rig_identification.search.ladder import Rung
from rig_identification.search.levels import ALONE
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


def _child(standing: Standing, candidates: list[Candidate], label: str) -> Standing:
    """A model with one more effect."""
    problem, evaluation = standing.rung.problem, standing.rung.evaluation
    promises = screen(problem, evaluation, candidates, mass_of(problem, evaluation))
    trial = fitted_to_its_end(problem, evaluation, next(p for p in promises if p.candidate.label == label))
    assert trial is not None
    return Standing(Rung(trial.problem, trial.evaluation, ALONE), (trial.candidate,))


@pytest.mark.parametrize(("felt", "likelier"), [(0.0, SMALLER), (FELT, LARGER)])
def test_evidence_tells_the_special_case_from_the_whole(felt: float, likelier: str) -> None:
    problem, evaluation = _fitted(felt)
    candidates, ideal = catalogue(problem), Standing(Rung(problem, evaluation, ALONE))
    larger = _child(ideal, candidates, LARGER)
    simple = _alike(ideal, [larger], candidates, UNLIMITED, lambda label: None)
    assert [child.label for child in simple] == [SMALLER]
    assert max([larger, *simple], key=lambda child: child.rung.evidence).label == likelier
    # What was fitted already is not fitted again
    assert _alike(ideal, [larger, *simple], candidates, UNLIMITED, lambda label: None) == []


def test_what_has_no_special_case_has_none() -> None:
    problem, _ = _fitted(0.0)
    candidates = catalogue(problem)
    smaller = next(c for c in candidates if c.label == SMALLER)
    assert special_cases(smaller, candidates) == []
    bent = next(c for c in candidates if c.label == "unknown cable_1 tension curvature")
    assert {c.effect for c in special_cases(bent, candidates)} == {"load_cell_gain", "load_cell_offset"}
