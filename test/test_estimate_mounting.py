"""A device on a soft mount shows what a mass on a spring does whose foot is shaken."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_estimate_prediction import recorded
from test_model_rigs import thesis_case_14

from rig_identification.estimate.first_guess import rest_of
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.mounting import Answer, mounted, mounted_change
from rig_identification.estimate.prediction import linearise_run, model_at
from rig_identification.mismatch.opened import extended
from rig_identification.mismatch.soft_mount import soft_mounts

STEP = 0.01


def shaken(t: np.ndarray | float) -> np.ndarray:
    """What the body does: two slow swings that begin from rest."""
    t = np.asarray(t)
    return np.asarray(
        (1.0 - np.exp(-t)) * (np.sin(2.0 * np.pi * 0.6 * t) + 0.4 * np.sin(2.0 * np.pi * 2.1 * t))
    )


@pytest.mark.parametrize(("frequency", "error"), [(5.0, 0.03), (8.0, 0.05), (14.0, 0.15)])
def test_it_shows_what_the_equation_of_motion_says(frequency: float, error: float) -> None:
    """Nodes 10 ms apart follow 14 Hz, the quickest, to a tenth of what it adds."""
    w, z, time = 2.0 * np.pi * frequency, 0.1, np.arange(0.0, 12.0, STEP)

    def law(t: float, x: np.ndarray) -> list[float]:
        # x: stretch of the mount and its rate; the device's acceleration is u + stretch's
        return [x[1], -2.0 * z * w * x[1] - w * w * x[0] - float(shaken(t))]

    found = solve_ivp(law, (0.0, 12.0), [0.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-12, max_step=2e-3)
    device = -2.0 * z * w * found.y[1] - w * w * found.y[0]
    shown = mounted(STEP, Answer(w**-2, z), shaken(time)[:, None])[:, 0]
    own = np.std(device - shaken(time))
    assert own > 0.003
    assert np.std(shown - device) < error * own


def test_a_stiff_mount_shows_the_motion_itself_and_a_soft_one_more() -> None:
    time = np.arange(0.0, 10.0, STEP)
    swing = np.sin(2.0 * np.pi * 1.0 * time)[:, None]
    assert mounted(STEP, Answer(0.0, 0.1), swing) is swing
    for frequency in (6.0, 12.0, 40.0):
        shown = mounted(STEP, Answer((2.0 * np.pi * frequency) ** -2, 0.1), swing)[500:]
        assert np.max(shown) == pytest.approx(1.0 / (1.0 - frequency**-2.0), rel=3e-3)


def test_derivatives_of_a_run_are_those_of_its_residuals() -> None:
    problem, theta, _ = pose_problem(recorded(thesis_case_14(), duration=3.0)[0])
    quantities = {c.quantity for run in problem.runs for c in run.channels}
    *_, mount = soft_mounts(problem.bench.parameters, quantities)
    assert mount.closer is not None
    here = SimpleNamespace(point=SimpleNamespace(theta=theta))
    ((both, _),) = mount.closer(problem, here)  # type: ignore[arg-type]
    assert len(both.parameters) == 6
    wide = extended(problem, (both,))
    parameters, run = wide.bench.parameters, wide.runs[0]
    there = parameters.converted(theta, problem.bench.parameters)
    columns = [parameters.index_of(p.name) for p in both.parameters]
    there[columns] = 0.7, 0.5, 0.3, -0.4, 0.5, 0.8
    start = rest_of(model_at(parameters, there))

    def residual(theta: np.ndarray) -> np.ndarray:
        found = linearise_run(wide.bench, run, theta, start)
        assert found is not None
        return found.residual

    found = linearise_run(wide.bench, run, there, start)
    assert found is not None
    for column in columns:
        step = np.zeros(parameters.size)
        step[column] = 1e-4
        numeric = (residual(there + step) - residual(there - step)) / 2e-4
        own = found.jacobian[:, column]
        assert np.linalg.norm(numeric) > 1e-3
        np.testing.assert_allclose(numeric, -own, atol=2e-3 * np.abs(own).max())


def test_a_device_whose_own_filter_rings_answers_as_that_filter() -> None:
    """w^2/(s^2 + 2 z w s + w^2): the damper does not stand on the body."""
    w, z, time = 2.0 * np.pi * 7.5, 0.07, np.arange(0.0, 12.0, STEP)

    def law(t: float, x: np.ndarray) -> list[float]:
        return [x[1], w * w * (float(shaken(t)) - x[0]) - 2.0 * z * w * x[1]]

    found = solve_ivp(law, (0.0, 12.0), [0.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-12, max_step=2e-3)
    shown = mounted(STEP, Answer(w**-2, z, 2.0 * z / w), shaken(time)[:, None])[:, 0]
    own = np.std(found.y[0] - shaken(time))
    assert own > 0.01
    assert np.std(shown - found.y[0]) < 0.05 * own
    on_rubber = mounted(STEP, Answer(w**-2, z), shaken(time)[:, None])[:, 0]
    assert np.std(on_rubber - found.y[0]) > 0.3 * own


@pytest.mark.parametrize("k", [-2e-4, 0.0, 6e-4])
def test_its_change_is_its_derivative(k: float) -> None:
    values, there = shaken(np.arange(0.0, 6.0, STEP))[:, None], Answer(k, 0.1, 2e-3)
    for field, change, own in zip(
        Answer._fields, mounted_change(STEP, there, values), (1e-7, 1e-4, 1e-5), strict=True
    ):
        more, less = (there._replace(**{field: getattr(there, field) + s * own}) for s in (1.0, -1.0))
        near = (mounted(STEP, more, values) - mounted(STEP, less, values)) / (2.0 * own)
        np.testing.assert_allclose(change, near, rtol=1e-3, atol=1e-3 * max(np.abs(near).max(), 1e-9))
