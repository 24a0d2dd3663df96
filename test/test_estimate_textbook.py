"""What a formula makes of a free swing: period at small turns, amplitude taken off, its own interval."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rig_identification.estimate.free_swing import free_swing
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.textbook import textbook_answers
from rig_identification.recording import Recording, Series, Session
from rig_identification.result import InertialEstimate
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Mount, Rig

GRAVITY, MASS, INERTIA, DECAY = 9.80665, 1.3, 0.04, 0.02
TIME = np.arange(0.0, 30.0, 0.02)
UPRIGHT = Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
BODY = InertialEstimate(np.array([MASS, *[0.0] * 9]), np.eye(10))


def rig(threads: int, above: float, below: float, length: float = 1.2) -> Rig:
    """So many threads, their hinges so far from the middle."""
    angles = 2.0 * np.pi * np.arange(threads) / threads
    around = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    cables = tuple(Cable(f"cable_{i}", above * a, below * a, length) for i, a in enumerate(around))
    tolerance = {**DEFAULT_TOLERANCE, "cable_length": 0.002, "hinge_position": 0.001}
    return Rig(GRAVITY, cables, MASS, 0.002, imu=UPRIGHT, tolerance=tolerance)


def turned(above: float, below: float, length: float, amplitude: float) -> np.ndarray:
    """(2, n) turn and rate of the exact motion of a body that hangs midway, damped a little."""
    p, h2 = above * below, length**2 - (above - below) ** 2

    def moved(_: float, state: np.ndarray) -> list[float]:
        angle, rate = state
        h = np.sqrt(h2 - 2.0 * p * (1.0 - np.cos(angle)))
        rise = p * np.sin(angle) / h  # dz/da
        bend = p * np.cos(angle) / h + rise**2 / h
        moment = MASS * (GRAVITY + bend * rate**2) * rise + 2.0 * DECAY * INERTIA * rate
        return [rate, -moment / (INERTIA + MASS * rise**2)]

    found = solve_ivp(moved, (0.0, TIME[-1]), [amplitude, 0.0], t_eval=TIME, rtol=1e-10, atol=1e-12)
    return np.asarray(found.y)


def session(one: Rig, rate: np.ndarray) -> Session:
    """A gyroscope that reads ``rate`` about the vertical."""
    values = np.full((TIME.size, 6), np.nan)
    values[:, 2] = rate + 1e-3 * np.random.default_rng(1).normal(size=TIME.size)
    run = Recording("run_1", "dynamic", False, 0, float(TIME[-1]), imu=Series(TIME, values))
    return Session("threads", one, (run,))


@pytest.mark.parametrize(("threads", "above", "below"), [(2, 0.2, 0.2), (3, 0.25, 0.25), (3, 0.15, 0.25)])
@pytest.mark.parametrize("amplitude", [0.05, 0.6])
def test_the_formula_gives_the_inertia_back(
    threads: int, above: float, below: float, amplitude: float
) -> None:
    problem, _, _ = pose_problem(session(rig(threads, above, below), turned(above, below, 1.2, amplitude)[1]))
    (answer,) = textbook_answers(problem, BODY)
    assert answer.formula == {2: "bifilar", 3: "trifilar"}[threads]
    # Next order of the amplitude: 0.6^4 of some per mille
    assert answer.value == pytest.approx(INERTIA, rel=1e-3)
    assert answer.decay == pytest.approx(DECAY, rel=0.1)
    assert answer.amplitude == pytest.approx(amplitude, rel=0.1)


def test_its_interval_comes_from_what_was_measured() -> None:
    one = rig(2, 0.2, 0.2)
    problem, _, _ = pose_problem(session(one, turned(0.2, 0.2, 1.2, 0.1)[1]))
    (answer,) = textbook_answers(problem, BODY)
    # J = m g D^2 / (4 h w^2) with both distances D measured to sqrt(2) tolerances of a hinge
    assert answer.shares["distances"] == pytest.approx(answer.value * 2.0 * 0.001 / 0.4, rel=1e-6)
    assert answer.shares["mass"] == pytest.approx(answer.value * 0.002 / MASS, rel=1e-6)
    assert answer.std == pytest.approx(np.sqrt(sum(s**2 for s in answer.shares.values())))


def test_no_formula_where_threads_splay_unevenly() -> None:
    one = rig(2, 0.2, 0.2)
    askew = replace(one.cables[0], ceiling_point=one.cables[0].ceiling_point + np.array([0.0, 0.3, 0.0]))
    session_ = session(replace(one, cables=(askew, one.cables[1])), turned(0.2, 0.2, 1.2, 0.1)[1])
    assert textbook_answers(pose_problem(session_)[0], BODY) == ()


def test_a_swing_that_is_no_longer_than_its_windows_tells_nothing() -> None:
    angle = 0.1 * np.cos(2.0 * np.pi * TIME / 20.0)
    assert free_swing(TIME, angle, 0.0, rate=False) is None
