"""Numbers that are told of a body are asked of the cost itself, where their interval moves the body far."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_estimate_stretching import hung

from rig_identification.estimate.fitted import Fitted, sure_of
from rig_identification.estimate.identify import compose, fit_session, judged
from rig_identification.estimate.observability import GAIN, believed_std, inertial_estimate
from rig_identification.estimate.solve import Pin, evaluate, pinned, solve
from rig_identification.estimate.valley import (
    HELD,
    _held,
    _Node,
    _node,
    _raised,
    _released,
    along_valleys,
    to_be_asked,
)
from rig_identification.model.work import counted
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.simulate import Pulled, RunSpec, SampleRates, SessionSpec, simulate_session

JXX = ELEMENTS.index("Jxx")


@pytest.fixture(scope="module")
def three_cables() -> tuple[Session, Fitted]:
    """Four seconds on three cables at 50 Hz, not shaken: moments of inertia to three percent."""
    pull = Pulled(np.array([400.0, 500.0, 0.0]), np.array([1.6, 0.0, -0.5]))
    spec: SessionSpec = hung(3, {}, (RunSpec("run_1", 4.0, pull),))
    body = np.array([*spec.elements[:1], 0.55, 0.5, *spec.elements[3:]])
    rates = SampleRates(tension=50.0, imu=50.0, inclinometer=25.0, ground_truth=0.0)
    session, _ = simulate_session(replace(spec, elements=body, rates=rates), np.random.default_rng(7))
    return session, fit_session(session)


def test_a_pin_holds_a_number_and_can_be_taken_out_again(three_cables: tuple[Session, Fitted]) -> None:
    fitted = three_cables[1]
    problem, there = fitted.problem, fitted.evaluation
    here = _node(problem, there, JXX)
    held = replace(problem, pin=Pin(JXX, here.u + here.std, HELD * here.std))
    found, converged = solve(held, there.point, tolerance=1e-4)
    assert converged
    assert held.pin is not None
    assert abs(pinned(held, held.pin, found.point.theta)[1]) < 0.05
    free, anew = _released(held, found), evaluate(problem, found.point)
    assert anew is not None
    assert free.cost == pytest.approx(anew.cost, abs=1e-6)
    scale = np.sqrt(np.diag(anew.information))
    np.testing.assert_allclose(
        free.information / np.outer(scale, scale), anew.information / np.outer(scale, scale), atol=1e-6
    )


def test_along_a_straight_valley_the_density_is_normal(three_cables: tuple[Session, Fitted]) -> None:
    """Two stds off, all else fitted anew, both rise by two nats: the std is right within a quarter."""
    fitted = three_cables[1]
    here = _node(fitted.problem, fitted.evaluation, JXX)
    std = np.sqrt(inertial_estimate(fitted.problem, fitted.evaluation).covariance[JXX, JXX])
    assert here.std == pytest.approx(std)
    for sign in (-1.0, 1.0):
        there = _held(fitted.problem, here, JXX, here.u + 2.0 * sign * here.std)
        assert there is not None
        assert there.rises(here) == pytest.approx((2.0, 2.0), abs=1.0)


def test_straight_valleys_change_nothing_and_take_little(three_cables: tuple[Session, Fitted]) -> None:
    session, fitted = three_cables
    assert fitted.valley is not None
    assert to_be_asked(fitted.problem, fitted.evaluation)
    with counted() as once:
        evaluate(fitted.problem, fitted.evaluation.point)
    with counted() as meter:
        valley = along_valleys(fitted.problem, fitted.evaluation)
    assert valley.followed == ()
    assert valley.evaluation is fitted.evaluation
    # Two evaluations without derivatives a number at most
    assert meter.done < 10 * once.done
    plain = inertial_estimate(fitted.problem, fitted.evaluation)
    np.testing.assert_array_equal(valley.estimate.covariance, plain.covariance)
    assert compose(session, fitted, *judged(fitted), None).joint is not None
    assert sure_of(fitted) is fitted.valley


def test_what_bends_raises_the_covariance_and_what_is_open_is_lost(
    three_cables: tuple[Session, Fitted],
) -> None:
    """A place d nats up lies sqrt(2 d) stds away, in Jxx and in what goes with it."""
    problem, evaluation = three_cables[1].problem, three_cables[1].evaluation
    plain = inertial_estimate(problem, evaluation)
    assert "Jxx" not in plain.unobservable
    here = _node(problem, evaluation, JXX)

    def aside(by: float) -> _Node:
        moved = plain.values + by * plain.covariance[JXX] / plain.covariance[JXX, JXX]
        return replace(here, u=moved[JXX], elements=moved)

    def raised(by: float, rise: float) -> InertialEstimate:
        there = replace(here.evaluation, cost=here.evaluation.cost + rise)
        place = replace(aside(by), evaluation=there, log_density=here.log_density - rise)
        return _raised(problem, plain, here, [place])

    same = raised(2.0 * here.std, 2.0)
    np.testing.assert_allclose(same.covariance, plain.covariance, rtol=1e-6)
    wider = raised(8.0 * here.std, 2.0)
    assert np.sqrt(wider.covariance[JXX, JXX]) == pytest.approx(4.0 * here.std, rel=1e-6)
    added = wider.covariance - plain.covariance
    assert np.linalg.matrix_rank(added, tol=1e-9 * np.trace(added)) == 1
    # As likely as the end of the fit: one std away, no nearer
    assert np.sqrt(raised(8.0 * here.std, 0.0).covariance[JXX, JXX]) == pytest.approx(8.0 * here.std)
    open_ = raised(2.0 * GAIN * believed_std(problem)[JXX], 1.0)
    assert {"Jxx", "Jxy", "Jxz"} <= set(open_.unobservable)
    assert not {"m", "cx", "cy"} & set(open_.unobservable)


def test_a_body_that_is_only_watched_is_not_asked(three_cables: tuple[Session, Fitted]) -> None:
    fitted = three_cables[1]
    blind = replace(fitted.problem, runs=())
    assert not to_be_asked(blind, fitted.evaluation)
