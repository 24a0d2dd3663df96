"""Errors that all cables share: one number moves every cable's, and is told as one error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from test_estimate_prediction import recorded
from test_model_rigs import thesis_case_14
from wrong_sessions import made

from rig_identification.estimate.identify import pose_problem
from rig_identification.mismatch.opened import extended
from rig_identification.mismatch.shared_errors import ALL, shared_errors
from rig_identification.model import layout
from rig_identification.recording import Recording, Session
from rig_identification.search.identify import identify


@pytest.fixture(scope="module")
def session() -> Session:
    return recorded(thesis_case_14(), duration=2.0)[0]


def test_what_it_moves_is_what_its_derivative_says(session: Session) -> None:
    problem, theta, _ = pose_problem(session)
    candidates = tuple(shared_errors(session.rig, problem.bench.parameters))
    assert {c.parameters[0].name for c in candidates} == {
        "cables.length", "cables.edge_radius", "load_cells.gain",
        "imu.gyroscope_scale", "imu.accelerometer_scale",
    }  # fmt: skip
    wide = extended(problem, candidates).bench.parameters
    there = wide.converted(theta, problem.bench.parameters)
    jacobian, directions = wide.physics_jacobian(there), wide.directions()
    columns, entries, scale = wide.device_columns()
    for candidate in candidates:
        k = wide.index_of(candidate.parameters[0].name)
        step = np.zeros(wide.size)
        step[k] = 1e-3
        physics = (wide.physics(there + step) - wide.physics(there - step)) / 2e-3
        known = directions < physics.size
        np.testing.assert_allclose(physics[directions[known]], jacobian[known, k], atol=1e-12)
        device = (wide.device(there + step) - wide.device(there - step)) / 2e-3
        said = np.zeros_like(device)
        np.add.at(said, entries[columns == k], scale[columns == k])
        np.testing.assert_allclose(device, said, atol=1e-12)
        assert np.count_nonzero(physics) + np.count_nonzero(device) >= 3


def wound(radius: float, hinge: np.ndarray, throat: np.ndarray) -> float:
    """Length of a cable from a throat over an edge of this radius to a hinge: an arc, then straight."""
    line = hinge - throat
    aside, down = float(np.hypot(line[0], line[1])), float(-line[2])

    def miss(angle: float) -> float:
        straight = down * np.cos(angle) + aside * np.sin(angle) - radius * np.sin(angle)
        return radius * (1.0 - np.cos(angle)) + straight * np.sin(angle) - aside

    angle = brentq(miss, 0.0, 1.4)
    end = throat + radius * np.array(
        [(1.0 - np.cos(angle)) * line[0] / aside, (1.0 - np.cos(angle)) * line[1] / aside, -np.sin(angle)]
    )
    return float(radius * angle + np.linalg.norm(hinge - end))


def test_a_cable_over_an_edge_swings_about_the_arc_s_end() -> None:
    """To the second order: what is left grows with the cube of the swing."""
    rig = recorded(thesis_case_14(), duration=1.0)[0].rig
    problem, theta, _ = pose_problem(recorded(thesis_case_14(), duration=1.0)[0])
    (edge,) = (c for c in shared_errors(rig, problem.bench.parameters) if c.effect == "cable_edge")
    wide = extended(problem, (edge,)).bench.parameters
    there = wide.converted(theta, problem.bench.parameters)
    radius = 0.04
    there[wide.index_of("cables.edge_radius")] = radius / edge.parameters[0].prior_std
    physics, plain = wide.physics(there), wide.model.physics
    o = layout.cable_offset(0)
    throat, center = plain[o : o + 3], physics[o : o + 3]
    straight = float(physics[o + layout.LENGTH])
    shorter = float(plain[o + layout.LENGTH] - physics[o + layout.LENGTH])
    rest = center + straight * _down(throat, center, shorter / radius)
    aside = np.array([rest[0] - throat[0], rest[1] - throat[1], 0.0])
    aside /= np.linalg.norm(aside)
    down = (rest - center) / straight
    across = aside - (aside @ down) * down
    across /= np.linalg.norm(across)

    def left(angle: float) -> float:
        hinge = center + straight * (np.cos(angle) * down + np.sin(angle) * across)
        return wound(radius, hinge, throat) - plain[o + layout.LENGTH]

    assert abs(left(0.0)) < 1e-9
    small, large = abs(left(0.02)), abs(left(0.04))
    assert small < 1e-7
    assert large / small == pytest.approx(8.0, rel=0.2)


def _down(throat: np.ndarray, center: np.ndarray, angle: float) -> np.ndarray:
    """Unit vector down a cable that bends by so much over the edge."""
    aside = np.array([center[0] - throat[0], center[1] - throat[1], 0.0])
    aside /= np.linalg.norm(aside)
    return np.asarray(np.sin(angle) * aside - np.cos(angle) * np.array([0.0, 0.0, 1.0]))


def longer(session: Session, error: float) -> Session:
    """The session under a description whose lengths are all too short by ``error`` (m)."""
    cables = tuple(replace(c, length=c.length - error) for c in session.rig.cables)
    return replace(session, rig=replace(session.rig, cables=cables))


def scaled(session: Session, gain: float) -> Session:
    """The session with tensions that read too high by ``gain``."""

    def louder(recording: Recording) -> Recording:
        tensions = {
            name: replace(series, values=(1.0 + gain) * series.values)
            for name, series in recording.tension.items()
        }
        return replace(recording, tension=tensions)

    return replace(session, recordings=tuple(louder(r) for r in session.recordings))


@pytest.mark.parametrize(
    ("change", "effect", "value"), [(longer, "cable_length", 0.006), (scaled, "load_cell_gain", 0.012)]
)
def test_it_is_told_as_one_error_of_all_cables(change, effect, value) -> None:  # type: ignore[no-untyped-def]
    found = identify(change(made(14, 12.0, 3, doubts=True), value))
    assert found.mismatch.verdict == "explained", found.mismatch.explanation
    (finding,) = found.mismatch.findings
    assert (finding.effect, finding.where["channel"]) == (effect, ALL)
    (number,) = finding.parameters.values()
    assert abs(number["value"] - value) < 3.0 * number["std"]  # type: ignore[operator]
