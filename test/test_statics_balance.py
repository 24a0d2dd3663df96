"""The balance and the adjustment's model: exact slopes, and the physics of stability."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rig_identification.recording import Dummy
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.statics.balance import Suspension, balance, null_space, undetermined_tensions
from rig_identification.statics.observation import StaticObservation
from rig_identification.statics.static_model import StaticModel, StaticState


def random_rig(rng, cables, **fields):
    angle = np.arange(cables) * 2.0 * np.pi / cables + rng.uniform(-0.2, 0.2, cables)
    ceiling = np.c_[2.5 * np.cos(angle), 2.0 * np.sin(angle), rng.uniform(-0.1, 0.1, cables)]
    body = np.c_[1.5 * np.cos(angle), 0.9 * np.sin(angle), rng.uniform(-0.1, 0.1, cables)]
    length = np.linalg.norm(body + np.array([0.0, 0.0, -2.0]) - ceiling, axis=1)
    links = tuple(Cable(f"cable_{i + 1}", ceiling[i], body[i], float(length[i])) for i in range(cables))
    return Rig(gravity=9.81, cables=links, mass=1000.0, mass_std=0.5, **fields)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), cables=st.integers(2, 7))
def test_slopes_of_the_balance_are_its_derivatives(seed, cables):
    rng = np.random.default_rng(seed)
    suspension = Suspension.of(random_rig(rng, cables))
    arm = rng.normal(0.0, 0.5, 3)
    position = np.array([0.0, 0.0, -2.0]) + rng.normal(0.0, 0.1, 3)
    attitude = Rotation.from_rotvec(rng.normal(0.0, 0.3, 3)).as_matrix()
    tension = rng.uniform(0.1, 0.5, cables)
    at = balance(suspension, arm, position, attitude, tension)
    change = rng.normal(0.0, 1.0, 6 + cables)

    def moved(scale):
        step = scale * change
        turned = Rotation.from_rotvec(step[3:6]).as_matrix() @ attitude
        return balance(suspension, arm, position + step[:3], turned, tension + step[6:]).residual

    numeric = (moved(1e-5) - moved(-1e-5)) / 2e-5
    exact = at.pose_slope @ change[:6] + at.tension_slope @ change[6:]
    assert exact == pytest.approx(numeric, abs=1e-7)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), cables=st.integers(2, 5))
def test_slopes_of_the_static_model_are_its_derivatives(seed, cables):
    rng = np.random.default_rng(seed)
    turned = Rotation.from_rotvec(rng.normal(0.0, 0.5, 3)).as_quat()
    rig = random_rig(rng, cables, inclinometer=Mount(np.zeros(3), turned))
    seen = StaticObservation(
        "bare", np.array([0.1, -0.05]), np.full(2, 1e-3), np.full(cables, 2500.0), np.ones(cables)
    )
    loaded = StaticObservation(
        "dummy",
        np.array([0.0, 0.05]),
        np.full(2, 1e-3),
        seen.tension,
        np.ones(cables),
        Dummy(80.0, np.ones(3)),
    )
    model = StaticModel(rig, (seen, loaded), anchored=True)
    state = StaticState(
        center_of_mass=rng.normal(0.0, 0.3, 3),
        mass=1010.0,
        position=np.array([0.0, 0.0, -2.0]) + rng.normal(0.0, 0.05, (2, 3)),
        attitude=Rotation.from_rotvec(rng.normal(0.0, 0.1, (2, 3))).as_matrix(),
        tension=rng.uniform(0.2, 0.4, (2, cables)),
        beliefs=rng.normal(0.0, 1.0, len(model.tolerance)),
    )
    change = rng.normal(0.0, 1.0, model.size)
    for function in (model.constraints, model.residuals):
        values = [function(model.move(state, scale * change))[0] for scale in (1e-5, -1e-5)]
        numeric = (values[0] - values[1]) / 2e-5
        exact = function(state)[1] @ change
        assert np.abs(exact - numeric).max() < 2e-6 * max(1.0, np.abs(exact).max())


def test_self_stress_is_counted():
    rng = np.random.default_rng(1)
    level = (np.array([0.0, 0.0, -2.0]), np.eye(3))
    for cables, open_combinations in ((2, 0), (4, 0), (7, 1), (8, 2)):
        suspension = Suspension.of(random_rig(rng, cables))
        at = balance(suspension, np.zeros(3), *level, np.full(cables, 1.0 / cables))
        assert undetermined_tensions(at, cables) == open_combinations


def test_four_parallel_cables_have_one_self_stress():
    body = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0]])
    suspension = Suspension(body + np.array([0.0, 0.0, 2.0]), body, np.full(4, 2.0))
    at = balance(suspension, np.array([1.0, 0.5, -0.5]), np.zeros(3), np.eye(3), np.full(4, 0.25))
    assert np.abs(at.residual).max() < 1e-12
    assert undetermined_tensions(at, 4) == 1
    # Three motions stay: sway along x and y, and yaw.
    assert null_space(at.pose_slope[:4]).shape[1] == 3
