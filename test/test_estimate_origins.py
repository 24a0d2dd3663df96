"""Where the room's corner and the body's datum lie is nobody's business but the tape measure's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_estimate_prediction import recorded
from test_model_rigs import thesis_case_14

from rig_identification.estimate.origins import Origins, moved, near_origins
from rig_identification.recording import Session
from rig_identification.result import Identification
from rig_identification.search.identify import identify

FAR = Origins(np.array([-20.0, 30.0, -5.0]), np.array([-100.0, 60.0, -8.0]))


@pytest.fixture(scope="module")
def session() -> Session:
    found, _ = recorded(thesis_case_14(), seed=12, duration=6.0, holdout=True)
    return found


@pytest.fixture(scope="module")
def near(session: Session) -> Identification:
    return identify(session)


@pytest.fixture(scope="module")
def far(session: Session) -> Identification:
    """The same session, surveyed from elsewhere."""
    return identify(moved(session, FAR))


def test_ordinary_origins_stay(session: Session) -> None:
    assert near_origins(session.rig).given


def test_far_origins_are_moved_to_the_middle_of_the_hinges(session: Session) -> None:
    away = moved(session, FAR)
    origins = near_origins(away.rig)
    points = np.array([c.body_point for c in moved(away, origins).rig.cables])
    np.testing.assert_allclose(np.mean(points, axis=0), 0.0, atol=1e-9)
    points = np.array([c.ceiling_point for c in moved(away, origins).rig.cables])
    np.testing.assert_allclose(np.mean(points, axis=0), 0.0, atol=1e-9)


def test_the_body_is_the_same_from_far_origins(near: Identification, far: Identification) -> None:
    assert near.mismatch.verdict == far.mismatch.verdict == "none"
    std = np.sqrt(np.diag(near.total.covariance))
    shift = np.zeros(10)
    shift[1:4] = FAR.body
    # Where the fits start differs, and with it where within the noise they stop
    np.testing.assert_array_less(np.abs(far.total.values + shift - near.total.values), 0.1 * std)
    np.testing.assert_allclose(np.sqrt(np.diag(far.total.covariance)), std, rtol=0.02)


def test_doubts_are_told_about_the_given_origins(session: Session, far: Identification) -> None:
    rig = moved(session, FAR).rig
    values = {p.name: p.nominal for p in far.parameters}
    for cable in rig.cables:
        for a, axis in enumerate("xyz"):
            assert values[f"{cable.name}.ceiling_point.{axis}"] == pytest.approx(cable.ceiling_point[a])
            assert values[f"{cable.name}.body_point.{axis}"] == pytest.approx(cable.body_point[a])
    assert rig.exciter is not None
    assert values["exciter.position.x"] == pytest.approx(rig.exciter.position[0])
    assert values["imu.position.x"] == 0.0


def test_places_of_findings_are_told_about_the_given_origins(near: Identification) -> None:
    from rig_identification.estimate.origins import told
    from rig_identification.result import Finding

    where = {"position": [1.0, 2.0, 3.0]}
    parameters = {"position_y": {"value": 2.0, "std": 0.1, "unit": "m"}}
    finding = Finding("liquid_slosh", where, parameters, {}, "")
    found = replace(near, mismatch=replace(near.mismatch, findings=(finding,)))
    (given,) = told(found, FAR).mismatch.findings
    assert given.where["position"] == pytest.approx([-19.0, 32.0, -2.0])
    assert given.parameters["position_y"]["value"] == pytest.approx(32.0)
