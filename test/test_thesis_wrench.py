"""Uncertainty of the generalized wrench against wrenches recomputed on rigs that are not as described."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from rig_identification.live.generalized_wrench import generalized_wrench
from rig_identification.live.wrench_uncertainty import wrench_uncertainty
from rig_identification.simulate.thesis_case import NOISE
from rig_identification.thesis import load_case

SIZE = 1e-6


def pose_on(rig, guess, up):
    """Pose with the rig's lengths and the vertical's two components ``up`` (2,) in body."""

    def defect(x):
        turn = Rotation.from_rotvec(x[3:]) * Rotation.from_quat(guess[3:])
        points = x[:3] + turn.apply([c.body_point for c in rig.cables])
        spans = np.linalg.norm(points - [c.ceiling_point for c in rig.cables], axis=1)
        return np.concatenate([spans - [c.length for c in rig.cables], turn.as_matrix()[2, :2] - up])

    start = np.concatenate([guess[:3], np.zeros(3)])
    x = least_squares(defect, start, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    return np.concatenate([x[:3], (Rotation.from_rotvec(x[3:]) * Rotation.from_quat(guess[3:])).as_quat()])


@pytest.fixture(scope="module")
def hung():
    case = load_case(8)
    rig = replace(case.rig, noise=dict(NOISE))
    pose = np.concatenate([case.position, case.orientation])
    up = Rotation.from_quat(case.orientation).as_matrix()[2, :2]
    return (
        case,
        rig,
        pose_on(rig, pose, up),
        up,
        np.array([700.0, 600.0, 650.0, 550.0]),
        np.array([30.0, -20.0, 5.0]),
    )


def shifted(rig, i, part, axis):
    cable = rig.cables[i]
    if part == "length":
        moved = replace(cable, length=cable.length + SIZE)
    else:
        moved = replace(cable, **{part: getattr(cable, part) + SIZE * np.eye(3)[axis]})
    return replace(rig, cables=(*rig.cables[:i], moved, *rig.cables[i + 1 :]))


def test_lengths_and_hinges_move_pose_and_wrench_together(hung):
    case, rig, pose, up, tension, force = hung
    center = case.center_of_mass

    def wrench(on):
        found = pose_on(on, pose, up)
        return generalized_wrench(on, found[None], tension[None], force[None], center)[0]

    def share(parts):
        slopes = [(wrench(shifted(rig, i, p, a)) - wrench(rig)) / SIZE for i in range(4) for p, a in parts]
        return 0.0005 * np.sqrt(np.sum(np.square(slopes), axis=0))

    found = wrench_uncertainty(rig, pose, tension, force, center, np.zeros(3)).by_source
    hinges = [(part, axis) for part in ("ceiling_point", "body_point") for axis in range(3)]
    assert found["cable lengths"] == pytest.approx(share([("length", 0)]), rel=1e-3)
    assert found["hinges"] == pytest.approx(share(hinges), rel=1e-3)


def test_sensors_and_center_of_mass_enter_by_their_own_size(hung):
    case, rig, pose, up, tension, force = hung
    center, std = case.center_of_mass, np.array([0.001, 0.002, 0.003])
    rng = np.random.default_rng(1)
    count = 4000
    cells = (
        tension
        + rng.normal(0.0, np.hypot(2.0, 3.0), (count, 4))
        + tension * rng.normal(0.0, 5e-4, (count, 4))
    )
    poses = np.tile(pose, (count, 1))
    found = wrench_uncertainty(rig, pose, tension, force, center, std).by_source
    drawn = generalized_wrench(rig, poses, cells, np.tile(force, (count, 1)), center)
    assert found["load cells"] == pytest.approx(drawn.std(axis=0), rel=0.05)
    about = [
        generalized_wrench(rig, pose[None], tension[None], force[None], center + std * n)[0]
        for n in rng.standard_normal((count, 3))
    ]
    assert found["centre of mass"][3:] == pytest.approx(np.std(about, axis=0)[3:], rel=0.05)
    tilted = [pose_on(rig, pose, up + 1e-6 * e) for e in np.eye(2)]
    slopes = [
        (
            generalized_wrench(
                rig, np.stack([t, pose]), np.tile(tension, (2, 1)), np.tile(force, (2, 1)), center
            )
        )
        for t in tilted
    ]
    expected = np.sqrt(sum(((a - b) / 1e-6 * np.hypot(3e-4, 3e-4)) ** 2 for a, b in slopes))
    assert found["inclination"] == pytest.approx(expected, rel=1e-3)


def test_all_sources_add_in_squares(hung):
    case, rig, pose, _, tension, force = hung
    found = wrench_uncertainty(rig, pose, tension, force, case.center_of_mass, np.full(3, 0.001))
    total = np.sqrt(np.sum(np.square(list(found.by_source.values())), axis=0))
    assert found.std == pytest.approx(total)
    assert np.all(found.std > 0.0)


def test_a_weight_turns_with_a_wrong_tilt_and_is_doubted_along_the_vertical(hung):
    """Against wrenches recomputed on tilted poses and with another weight."""
    case, rig, pose, up, tension, force = hung
    center, weight = case.center_of_mass, 2500.0
    doubts = np.zeros(3), weight, 3.0
    found = wrench_uncertainty(rig, pose, tension, force, center, *doubts).by_source

    def wrench(at, weight=weight):
        return generalized_wrench(rig, at[None], tension[None], force[None], center, weight)[0]

    slopes = [(wrench(pose_on(rig, pose, up + SIZE * e)) - wrench(pose)) / SIZE for e in np.eye(2)]
    expected = np.sqrt(sum((slope * np.hypot(3e-4, 3e-4)) ** 2 for slope in slopes))
    assert found["inclination"] == pytest.approx(expected, rel=1e-3)
    assert found["weight"] == pytest.approx(np.abs(wrench(pose, weight + 3.0) - wrench(pose)), abs=1e-9)
