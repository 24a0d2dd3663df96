"""Motion capture beside devices that measure force or acceleration, its mount known and not known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_estimate_prediction import RATES, recorded
from test_model_rigs import thesis_case_14

from rig_identification.estimate.identify import fit_session, judged
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS
from rig_identification.rig import Mount

MOUNT = Mount(np.array([0.4, 0.7, -0.2]), Rotation.from_rotvec([0.3, -1.2, 0.8]).as_quat())


@pytest.fixture(scope="module")
def watched() -> tuple[Session, np.ndarray]:
    sample = thesis_case_14()
    sample = replace(sample, rig=replace(sample.rig, mocap=MOUNT))
    session, truth = recorded(sample, seed=21, duration=6.0, rates=replace(RATES, mocap=100.0))
    return session, truth.elements


def check(session: Session, truth: np.ndarray) -> None:
    fitted = fit_session(session)
    assert judged(fitted)[1].verdict == "none"
    total = inertial_estimate(fitted.problem, fitted.evaluation)
    z = (total.values - truth) / np.sqrt(np.diag(total.covariance))
    seen = [i for i, name in enumerate(ELEMENTS) if name not in total.unobservable]
    assert len(seen) > 6
    assert np.max(np.abs(z[seen])) < 3.5


@pytest.mark.parametrize("known", [True, False])
def test_a_car_that_is_watched_as_well(watched: tuple[Session, np.ndarray], known: bool) -> None:
    session, truth = watched
    check(session if known else replace(session, rig=replace(session.rig, mocap=None)), truth)


def test_a_car_that_is_watched_and_weighed(watched: tuple[Session, np.ndarray]) -> None:
    session, truth = watched
    no_imu = tuple(replace(r, imu=None) for r in session.recordings)
    check(replace(session, recordings=no_imu), truth)
