"""The rerun holds what the thesis publishes and what physics says, on motion made from its printed cases."""

from dataclasses import replace

import numpy as np
import pytest

from rig_identification.model import layout
from rig_identification.thesis import load_case
from rig_identification.thesis.estimators import fit_euler_predictor, fit_momentum
from rig_identification.thesis.predictor import SEARCHES
from rig_identification.thesis_rerun.comparison import measured, signed_error, worst_percent
from rig_identification.thesis_rerun.integration import check_integration, integrate
from rig_identification.thesis_rerun.motion import STEP, fly_case
from rig_identification.thesis_rerun.output_error import fit_tensor, nearest_body, with_noise
from rig_identification.thesis_rerun.readings import try_readings
from rig_identification.thesis_rerun.realistic import realistic_uncertainty
from rig_identification.thesis_rerun.statics import rerun_statics
from rig_identification.thesis_rerun.tracking import compare_tracking
from rig_identification.thesis_rerun.unknown_force import fit_with_unknown_force
from rig_identification.thesis_rerun.windows import WINDOWS, convergence_map


@pytest.fixture(scope="module")
def case_14():
    return fly_case(with_noise(load_case(14)))


@pytest.fixture(scope="module")
def case_1():
    return fly_case(with_noise(load_case(1)))


def balance_defect(motion):
    """(N, 3) N m: J alpha + w x J w less the moment of cables and exciter, about the centre of mass."""
    every = np.arange(motion.time.size)
    rate, moment = measured(motion, every)
    alpha = motion.outputs[:, layout.OUT_ANGULAR_ACCELERATION : layout.OUT_ANGULAR_ACCELERATION + 3]
    J = motion.case.inertia
    return alpha @ J + np.cross(rate, rate @ J) - moment


def test_motion_obeys_euler_and_newton(case_14):
    assert np.abs(balance_defect(case_14)).max() < 2.0  # of 500 N m; the held force differs by h^2/12 f''
    jerk = np.gradient(case_14.velocity, STEP, axis=0)[10:-10]
    first = layout.OUT_SPECIFIC_FORCE
    felt = np.einsum("nij,nj->ni", case_14.R_world_body, case_14.outputs[:, first : first + 3])[10:-10]
    datum = felt + np.array([0.0, 0.0, -9.81])
    assert np.abs(jerk - datum).max() < 0.01  # of 3 m/s^2; the difference quotient itself errs so much


def test_force_acts_along_world_axes_and_jumps_where_printed(case_1):
    along_world = np.einsum("nij,nj->ni", case_1.R_world_body, case_1.force)
    inside = (case_1.time >= 0.1) & (case_1.time < 1.1 - 1e-6)
    assert along_world[inside] == pytest.approx(np.tile([200.0, 0.0, 0.0], (inside.sum(), 1)), abs=1e-5)
    assert case_1.time[case_1.jumps] == pytest.approx([0.1, 1.1, 4.1, 5.1])
    assert np.abs(case_1.force[case_1.time > 5.1]).max() == 0.0


def test_case_14_of_the_thesis_predictor_gives_the_published_errors_back(case_14):
    case = case_14.case
    rate, moment = measured(case_14, case_14.samples())
    assert len(rate) == 25001
    for search in SEARCHES:
        fit = fit_euler_predictor(rate, moment, case.sampling, case.initial_guess, search=search)
        assert fit.converged
        ours = np.abs(np.diag(signed_error(case, fit.inertia)))
        assert ours == pytest.approx(np.diag(case.published.error), abs=0.3)


def test_case_14_with_the_gyroscopic_term_and_by_momentum(case_14):
    case = case_14.case
    rate, moment = measured(case_14, case_14.samples())
    complete = fit_euler_predictor(rate, moment, case.sampling, case.initial_guess, gyroscopic=True)
    assert np.abs(np.diag(signed_error(case, complete.inertia))).max() < 0.6
    assert worst_percent(case, fit_momentum(rate, moment, case.sampling).inertia) < 0.01


@pytest.mark.parametrize(("number", "variant"), [(2, ""), (12, ""), (18, "c")])
def test_output_error_is_exact_from_the_thesis_guess_and_from_far_off(number, variant):
    case = with_noise(load_case(number, variant))
    until = min(10.0, case.duration)
    motion = fly_case(case, duration=until)
    rate, moment = measured(motion, motion.samples((0.0, until)))
    regression = fit_momentum(rate, moment, case.sampling).inertia
    for factor in (1.0, 0.2, 5.0):
        fit = fit_tensor(motion, (0.0, until), factor * case.initial_guess, regression)
        assert fit.converged
        assert worst_percent(case, fit.inertia) < 0.01, f"guess times {factor}"


def test_a_guess_that_no_body_has_is_moved_to_one():
    guess = load_case(1).initial_guess
    moments = np.linalg.eigvalsh(guess)
    assert moments[0] + moments[1] < moments[2]
    body = nearest_body(guess)
    moments = np.linalg.eigvalsh(body)
    assert moments[0] + moments[1] > moments[2] > 0.0
    assert np.trace(body) == pytest.approx(np.trace(guess))
    civic = load_case(14).initial_guess
    assert np.array_equal(nearest_body(civic), civic)


@pytest.mark.parametrize("number", [3, 4])
def test_unknown_force_is_estimated_with_the_tensor(number):
    case = with_noise(load_case(number))
    motion = fly_case(case)
    fit = fit_with_unknown_force(motion, case.window)
    assert np.abs(signed_error(case, fit.inertia)).max() < 0.1
    if number == 3:
        middle = np.abs(fit.time - 0.6) < 0.3
        assert fit.force[middle] == pytest.approx(fit.true_force[middle], abs=1.0)
    else:
        assert fit.force_rms < 0.1


def test_map_of_case_5(case_1):
    few = convergence_map(case_1, 1.01 * case_1.case.inertia, every=30)
    assert few.start.size == WINDOWS // 30
    assert few.thesis.shape == few.output_error.shape == (WINDOWS // 30, 3, 3)
    early = worst_percent(case_1.case, few.output_error[0])
    assert early < 0.2  # second order in the hundredth that the linearisation is off by
    spread = few.output_error_std[:, 0, 0]
    # Zeros that wander bound what any window tells
    assert spread[-1] > 4.0 * spread[0]
    assert np.all(np.diff(few.output_error_std[:, 2, 2]) > -1e-9)  # fewer samples never tell more
    assert few.statement(case_1.case.inertia).startswith(f"Of {WINDOWS // 30} windows")


@pytest.mark.parametrize("number", [7, 8])
def test_uncertainty_is_that_of_simulated_errors(number):
    """Errors to first order of independent sessions have unit size in their own sigma, jumps or not."""
    found = [realistic_uncertainty(load_case(number), seed) for seed in range(4)]
    six = np.concatenate([r.error_in_sigma[np.triu_indices(3)] for r in found])
    assert 0.5 < np.sqrt(np.mean(six**2)) < 1.6
    assert np.abs(six).max() < 4.0
    assert np.all(found[0].std > 0.0)


def test_tracker_does_not_drift_and_knows_its_error():
    both = compare_tracking(load_case(10), 20.0, 0)
    assert both.held.position_rms < 1e-3
    assert np.degrees(both.held.attitude_rms) < 0.02
    assert 0.5 < both.nees < 1.8
    assert both.integrated.position_rms > 20.0 * both.held.position_rms


def test_a_case_in_which_nothing_moves_it_stays_at_rest():
    case = load_case(1)
    still = replace(case, force=replace(case.force, segments=()))
    motion = fly_case(still, duration=2.0)
    assert np.abs(motion.center - motion.center[0]).max() < 1e-4  # printed to 0.1 mm
    assert motion.tension.sum() > 0.0


def test_table_2_1_comes_back_to_a_hundredth_of_a_millimetre_beside_the_published():
    found = rerun_statics()
    assert found.worst < 1e-5
    assert found.actual == pytest.approx([1.771, 1.123, 0.612])
    assert found.published - found.actual == pytest.approx([1.1e-5, -2.2e-5, -2.14e-3])
    assert np.all(found.std_with_tensions < found.std / 3.0)


def test_integration_of_ideal_sensors_is_low_and_noise_makes_it_drift(case_1):
    """Figures 4.1 and 4.2; and a spinning body in free fall, whose pose is known."""
    check = check_integration(case_1, 0)
    assert np.abs(check.ideal.center_percent).max() < 0.5
    assert np.abs(check.ideal.T - check.ideal.true_T).max() < 1e-5
    assert np.abs(check.noisy.center_percent[-1]).max() > 2.0 * np.abs(check.ideal.center_percent[-1]).max()
    time = 0.01 * np.arange(101)
    spin = np.tile([0.0, 0.0, 0.3], (101, 1))
    p, R = integrate(
        time, spin, np.zeros((101, 3)), (np.zeros(3), np.eye(3), np.array([1.0, 0.0, 0.0])), 9.81
    )
    assert p[-1] == pytest.approx([1.0, 0.0, -0.5 * 9.81])
    assert R[-1, :2, 0] == pytest.approx([np.cos(0.3), np.sin(0.3)])


def test_readings_hold_the_tables_own_and_turn_the_force():
    case = with_noise(load_case(9))
    short = replace(case, duration=20.0, window=(0.0, 20.0))
    motion = fly_case(short)
    found = try_readings(motion)
    assert found.harmonic
    assert found.tried.shape == (8, 3)
    own = fit_euler_predictor(*measured(motion, motion.samples()), case.sampling, case.initial_guess)
    assert found.tried[0] == pytest.approx(np.abs(np.diag(signed_error(case, own.inertia))))
    assert np.ptp(found.tried[4:], axis=0).max() > 0.01  # another phase is another motion
    assert found.nearest <= np.max(np.abs(found.tried[0] - found.published))
