"""Rigs that look alike turned, and bodies whose heading a tracker with an undescribed marker alone sees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bench.pendulums import drawn
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import solve, still_promised
from rig_identification.estimate.symmetry import turns
from rig_identification.estimate.whichever_way import lead, only_seen, turned
from rig_identification.model.body import point_inertia, six_elements
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.rig import Mount, Rig
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

SEED = 3


def three_threads(**changes: object) -> tuple[Session, np.ndarray]:
    """A clean pendulum on three equal threads under a tracker, and its body."""
    spec, elements = drawn("clean", SEED, 3)
    spec = replace(spec, rig=replace(spec.rig, **changes))  # type: ignore[arg-type]
    return simulate_session(spec, np.random.default_rng(SEED))[0], elements


def longer(rig: Rig, by: float) -> Rig:
    """The rig with its third thread described ``by`` m longer than it is."""
    first, second, third = rig.cables
    return replace(rig, cables=(first, second, replace(third, length=third.length + by)))


@pytest.mark.parametrize(("threads", "angles"), [(2, [180]), (3, [-120, 120]), (4, [-90, 90, 180])])
def test_regular_rigs_fall_on_themselves(threads: int, angles: list[int]) -> None:
    rig = drawn("clean", 1, threads)[0].rig
    found = turns(rig)
    np.testing.assert_allclose(sorted(np.degrees(t.angle) for t in found), angles, atol=1e-6)
    assert all(t.exact for t in found)
    # Wherever the body's axes point, and however the rig stands in the room
    R = Rotation.from_euler("zyx", [0.4, 0.02, -0.03]).as_matrix()
    aside = [replace(c, body_point=R.T @ c.body_point + [3.0, 1.0, 0.2]) for c in rig.cables]
    (first, *_) = tilted = turns(replace(rig, cables=tuple(aside)))
    assert len(tilted) == len(found)
    np.testing.assert_allclose(first.R @ first.R.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(first.middle, np.mean([c.body_point for c in aside], axis=0))


def test_a_rig_that_is_otherwise_turned_is_another() -> None:
    rig = drawn("clean", 1, 3)[0].rig
    tolerance = rig.tolerance["cable_length"]
    near = turns(longer(rig, 2.0 * tolerance))
    assert [t.exact for t in near] == [False, False]
    assert {round(abs(v) / tolerance, 6) for t in near for k, v in t.off.items() if k.endswith("length")} == {
        0.0,
        2.0,
    }
    assert turns(longer(rig, 20.0 * tolerance)) == []
    apart = [replace(c, body_point=c.body_point * [1.0, 1.2, 1.0]) for c in rig.cables]
    assert turns(replace(rig, cables=tuple(apart))) == []


def test_a_turned_body_is_its_points_turned() -> None:
    """Against mass points carried round; the covariance against differences of the turned values."""
    rng = np.random.default_rng(5)
    turn = turns(drawn("clean", 1, 3)[0].rig)[0]
    turn = replace(turn, middle=np.array([0.3, -0.2, 0.1]))
    masses, points = rng.uniform(0.5, 1.5, 6), rng.normal(0.0, 0.2, (6, 3))

    def ten(places: np.ndarray) -> np.ndarray:
        c = masses @ places / masses.sum()
        J = sum(point_inertia(m, p - c) for m, p in zip(masses, places, strict=True))
        return np.concatenate([[masses.sum()], c, six_elements(np.asarray(J))])

    spread = rng.normal(size=(10, 10))
    before = InertialEstimate(ten(points), spread @ spread.T)
    after = turned(before, turn)
    np.testing.assert_allclose(after.values, ten(turn.middle + (points - turn.middle) @ turn.R.T), atol=1e-12)
    map_ = np.stack(
        [turned(replace(before, values=before.values + e), turn).values - after.values for e in np.eye(10)],
        axis=1,
    )
    np.testing.assert_allclose(after.covariance, map_ @ before.covariance @ map_.T, atol=1e-10)


def test_what_turning_costs_is_what_a_fit_with_the_rig_described_turned_costs() -> None:
    """To first order, without that fit: one thread two tolerances longer than described alike."""
    session, _ = three_threads()
    rig = longer(session.rig, 2.0 * session.rig.tolerance["cable_length"])
    fitted = fit_session(replace(session, rig=rig))
    assert only_seen(fitted.problem)
    assert misfit(fitted.evaluation) < 1.02
    parameters = fitted.problem.bench.parameters
    for turn in turns(rig):
        # The same motion to begin with, each number as far from its new description as it was, less that
        d = np.array([turn.off.get(p.name, 0.0) for p in parameters.free])
        free = tuple(replace(p, nominal=p.nominal + by) for p, by in zip(parameters.free, d, strict=True))
        theta = fitted.evaluation.point.theta.copy()
        theta[INERTIAL:] -= d / [p.prior_std for p in parameters.free]
        bench = replace(fitted.problem.bench, parameters=replace(parameters, free=free))
        begin = replace(fitted.evaluation.point, theta=theta)
        problem = replace(fitted.problem, bench=bench)
        other, _ = solve(problem, begin, iterations=80)
        assert still_promised(problem, other) < 1.0
        expected = other.cost - fitted.evaluation.cost
        assert expected > 2.0
        assert lead(fitted.problem, fitted.evaluation, turn) == pytest.approx(expected, rel=0.2)


def test_the_interval_holds_every_heading_and_a_described_marker_closes_it() -> None:
    session, elements = three_threads()
    found = identify(session)
    assert found.mismatch.verdict == "none"
    (note,) = [n for n in found.notes if "looks alike" in n]
    assert "-120, 120 degrees" in note
    assert "cx" in note
    described = three_threads(mocap=Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])))[0]
    settled = identify(described)
    assert not [n for n in settled.notes if "looks alike" in n]
    for answer in (found, settled):
        std = np.sqrt(np.diag(answer.total.covariance))
        seen = [i for i, name in enumerate(ELEMENTS) if name not in answer.total.unobservable]
        assert np.max(np.abs(answer.total.values - elements)[seen] / std[seen]) < 4.0
    # Of one of the three the body is, and of the others as well
    wide = np.sqrt(np.diag(found.total.covariance))
    tight = np.sqrt(np.diag(settled.total.covariance))
    assert np.all(wide[1:3] > 3.0 * tight[1:3])
    for turn in turns(session.rig):
        other = turned(InertialEstimate(elements, np.eye(10)), turn).values
        assert np.all(np.abs(found.total.values - other)[1:3] < 3.0 * wide[1:3])
