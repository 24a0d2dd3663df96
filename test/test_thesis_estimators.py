"""The thesis' estimator and its neighbours on exact Euler motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from rig_identification.errors import InputError
from rig_identification.thesis.estimators import fit_euler_predictor, fit_momentum
from rig_identification.thesis.predictor import SEARCHES, EulerPredictor, tensor

INERTIA = np.array([[1617.0, -20.0, 15.0], [-20.0, 365.0, 70.0], [15.0, 70.0, 1785.0]])
GUESS = tensor(np.array([1000.0, 10.0, 10.0, 300.0, 40.0, 1000.0]))
ALL = [(s, c) for s in SEARCHES for c in ("sum", "determinant")]


def moment_at(time):
    return np.stack(
        [
            300.0 * np.sin(3.1 * time) + 60.0 * np.cos(0.9 * time),
            120.0 * np.cos(2.3 * time) - 40.0 * np.sin(5.2 * time),
            250.0 * np.sin(1.7 * time + 0.4),
        ],
        axis=-1,
    )


def free_motion(sampling, duration=20.0, gyroscopic=True):
    """Rates of Euler's equations under a smooth moment, to 1e-11."""
    inverse = np.linalg.inv(INERTIA)

    def slope(time, rate):
        turning = np.cross(rate, INERTIA @ rate) if gyroscopic else 0.0
        return inverse @ (moment_at(time) - turning)

    time = np.arange(0.0, duration, sampling)
    start = np.array([0.3, 0.6, -0.4])
    found = solve_ivp(slope, (0.0, duration), start, method="DOP853", t_eval=time, rtol=1e-11, atol=1e-12)
    return found.y.T, moment_at(time)


def euler_steps(sampling, samples, gyroscopic):
    """Motion that the predictor describes exactly."""
    inverse = np.linalg.inv(INERTIA)
    moment = moment_at(sampling * np.arange(samples))
    rate = np.empty((samples, 3))
    rate[0] = [0.3, 0.6, -0.4]
    for n in range(samples - 1):
        turning = np.cross(rate[n], INERTIA @ rate[n]) if gyroscopic else 0.0
        rate[n + 1] = rate[n] + sampling * inverse @ (moment[n] - turning)
    return rate, moment


def worst(fit):
    return np.abs(fit.inertia - INERTIA).max() / 365.0


@pytest.mark.parametrize("gyroscopic", [False, True])
@pytest.mark.parametrize("search", SEARCHES)
def test_predictor_recovers_what_it_describes_exactly(search, gyroscopic):
    rate, moment = euler_steps(0.01, 1500, gyroscopic)
    fit = fit_euler_predictor(
        rate, moment, 0.01, GUESS, gyroscopic=gyroscopic, search=search, criterion="sum"
    )
    assert fit.converged
    assert worst(fit) < 1e-8


@pytest.mark.parametrize("factor", [0.2, 5.0])
@pytest.mark.parametrize(("search", "criterion"), ALL)
def test_searches_agree_from_guesses_far_off(search, criterion, factor):
    rate, moment = free_motion(0.01)
    near = fit_euler_predictor(rate, moment, 0.01, INERTIA, search=search, criterion=criterion)
    far = fit_euler_predictor(rate, moment, 0.01, factor * GUESS, search=search, criterion=criterion)
    assert far.converged
    assert far.inertia == pytest.approx(near.inertia, abs=1e-4)


def test_leaving_out_the_gyroscopic_term_is_what_costs_accuracy():
    rate, moment = free_motion(0.01)
    thesis = fit_euler_predictor(rate, moment, 0.01, GUESS)
    complete = fit_euler_predictor(rate, moment, 0.01, GUESS, gyroscopic=True)
    assert worst(thesis) > 0.05
    assert worst(complete) < 0.02
    assert complete.residual_std.max() < 0.1 * thesis.residual_std.max()


def test_euler_error_shrinks_with_the_sampling_time():
    errors = []
    for sampling in (0.02, 0.01, 0.005):
        rate, moment = free_motion(sampling)
        fit = fit_euler_predictor(rate, moment, sampling, GUESS, gyroscopic=True, criterion="sum")
        errors.append(worst(fit))
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.25)


def test_momentum_form_is_exact_on_smooth_motion():
    rate, moment = free_motion(0.01)
    fit = fit_momentum(rate, moment, 0.01)
    assert fit.converged
    assert worst(fit) < 3e-6


def test_momentum_form_without_the_gyroscopic_term_is_not():
    rate, moment = free_motion(0.01)
    assert worst(fit_momentum(rate, moment, 0.01, gyroscopic=False)) > 0.05
    rate, moment = free_motion(0.01, gyroscopic=False)
    assert worst(fit_momentum(rate, moment, 0.01, gyroscopic=False)) < 3e-6


def test_momentum_form_says_when_motion_does_not_tell():
    time = np.arange(0.0, 10.0, 0.01)
    about_z = np.zeros((len(time), 3))
    about_z[:, 2] = np.sin(time)
    moment = np.zeros_like(about_z)
    moment[:, 2] = 1785.0 * np.cos(time)
    assert not fit_momentum(about_z, moment, 0.01).converged


@pytest.mark.parametrize("gyroscopic", [False, True])
def test_few_rows_in_place_of_all_samples_have_the_same_minimum(gyroscopic):
    """A search by another hand on every sample, SciPy's Levenberg-Marquardt, ends at the same tensor."""
    rate, moment = free_motion(0.01, duration=8.0)
    predictor = EulerPredictor(rate, moment, 0.01, gyroscopic)
    found = least_squares(
        lambda p: predictor.error(p).ravel(), INERTIA[np.triu_indices(3)], method="lm", xtol=1e-14, ftol=1e-14
    ).x
    fit = fit_euler_predictor(rate, moment, 0.01, 0.5 * GUESS, gyroscopic=gyroscopic, criterion="sum")
    assert fit.inertia == pytest.approx(tensor(found), rel=1e-5, abs=1e-3)
    turning = np.cross(rate[:-1], rate[:-1] @ INERTIA) if gyroscopic else 0.0
    euler = rate[:-1] + 0.01 * (moment[:-1] - turning) @ np.linalg.inv(INERTIA)
    error = predictor.error(INERTIA[np.triu_indices(3)])
    assert error == pytest.approx(rate[1:] - euler, abs=1e-12)


@pytest.mark.parametrize("search", SEARCHES)
def test_what_no_sample_tells_is_a_result_and_no_defect(search):
    still = np.zeros((50, 3))
    fit = fit_euler_predictor(still, still, 0.01, GUESS, search=search)
    assert fit.inertia == pytest.approx(GUESS)


def test_regularised_search_leaves_unexcited_elements_at_their_guess():
    """Rotation about z alone: only what multiplies it moves, the rest stays where it began."""
    time = np.arange(0.0, 10.0, 0.01)
    rate = np.zeros((len(time), 3))
    moment = np.zeros_like(rate)
    moment[:, 2] = 500.0 * np.sin(time)
    rate[1:, 2] = np.cumsum(0.01 * moment[:-1, 2] / 1785.0)
    guess = np.diag([1000.0, 300.0, 1000.0])
    fit = fit_euler_predictor(
        rate, moment, 0.01, guess, search="regularized_gauss_newton", criterion="sum", eigenvalue_limit=1e-6
    )
    assert fit.inertia[2, 2] == pytest.approx(1785.0, rel=1e-6)
    assert fit.inertia[0, 0] == pytest.approx(1000.0, rel=1e-6)
    assert fit.inertia[0, 1] == pytest.approx(0.0, abs=1e-6)


def test_frame_does_not_matter():
    """Rates and moments in turned axes give the turned tensor."""
    rate, moment = free_motion(0.01)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    fit = fit_momentum(rate @ turn.T, moment @ turn.T, 0.01)
    assert fit.inertia == pytest.approx(turn @ fit_momentum(rate, moment, 0.01).inertia @ turn.T, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rate": np.zeros((10, 2))}, "both must be"),
        ({"rate": np.zeros((4, 3)), "moment": np.zeros((4, 3))}, "at least 8"),
        ({"rate": np.full((10, 3), np.nan)}, "not every sample"),
        ({"sampling": 0.0}, "must be positive"),
        ({"search": "newton"}, "search 'newton'"),
        ({"criterion": "max"}, "criterion 'max'"),
    ],
)
def test_unusable_input_is_named(change, message):
    arguments = {
        "rate": np.ones((10, 3)), "moment": np.ones((10, 3)), "sampling": 0.01, "initial_inertia": GUESS
    } | change  # fmt: skip
    with pytest.raises(InputError, match=message):
        fit_euler_predictor(**arguments)
