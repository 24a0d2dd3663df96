"""Natural frequencies against pendulums with known ones."""

import numpy as np
import pytest

from rig_identification.model.equilibrium import design_pose, find_rest, settle
from rig_identification.model.modes import natural_modes
from rig_identification.model.motion import rig_model
from rig_identification.rig import Cable, Rig
from rig_identification.thesis import load_case
from rig_identification.thesis_rerun.rerun import modes_of

GRAVITY = 9.81


def hanging(ceiling, body, length, elements):
    cables = tuple(
        Cable(f"cable_{i}", np.array(c, dtype=float), np.array(b, dtype=float), length)
        for i, (c, b) in enumerate(zip(ceiling, body, strict=True))
    )
    model = rig_model(Rig(gravity=GRAVITY, cables=cables), np.array(elements, dtype=float))
    return natural_modes(model, find_rest(model, settle(model, design_pose(model))).state)


def test_four_parallel_cables_swing_as_a_point_and_twist_as_a_plate():
    """Parallel cables of length L: sway without turning at sqrt(g/L), twist at sqrt(m g a^2 / (Jzz L))."""
    corners = [[x, y, 0.0] for x in (-0.5, 0.5) for y in (-1.0, 1.0)]
    mass, length, Jzz = 300.0, 2.0, 180.0
    modes = hanging(corners, corners, length, [mass, 0.0, 0.0, -0.4, 90.0, 0.0, 0.0, 120.0, 0.0, Jzz])
    sway = np.sqrt(GRAVITY / length) / (2.0 * np.pi)
    twist = np.sqrt(mass * GRAVITY * 1.25 / (Jzz * length)) / (2.0 * np.pi)
    assert [m.frequency for m in modes] == pytest.approx(sorted([sway, sway, twist]), rel=1e-6)
    assert {m.shape for m in modes} >= {"yaw"}
    assert sum("sway" in m.shape for m in modes) == 2


def test_two_cables_swing_about_the_line_of_their_hinges():
    """Across the line through the body's hinges it is a double pendulum, along it a single one."""
    mass, length, depth = 20.0, 1.5, 0.3
    J = 0.8
    modes = hanging(
        [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]],
        [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]],
        length,
        [mass, 0.0, 0.0, -depth, J, 0.0, 0.0, 1.0, 0.0, 1.2],
    )
    assert len(modes) == 4
    # Double pendulum across the line: M q'' + K q = 0 in cable angle and body angle
    M = mass * np.array([[length**2, length * depth], [length * depth, depth**2 + J / mass]])
    K = mass * GRAVITY * np.diag([length, depth])
    across = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K))) / (2.0 * np.pi)
    found = np.array([m.frequency for m in modes])
    for frequency in across:
        assert np.min(np.abs(found / frequency - 1.0)) < 1e-6
    assert np.min(np.abs(found * 2.0 * np.pi / np.sqrt(GRAVITY / length) - 1.0)) < 1e-6  # sway along the line


@pytest.mark.parametrize(("number", "count"), [(1, 2), (14, 2)])
def test_the_thesis_rigs_leave_two_modes(number, count):
    modes = modes_of(load_case(number))
    assert len(modes) == count
    for mode in modes:
        assert 0.2 < mode.frequency < 2.0
        assert abs(mode.decay) < 1e-6
        assert np.sum(mode.energy) == pytest.approx(1.0)


def test_case_1_sways_with_roll_and_pitch():
    shapes = [mode.shape for mode in modes_of(load_case(1))]
    assert shapes == ["pitch with sway along x", "sway along y with roll"]
