"""The forward model beside an independent formulation integrated by scipy, and beside statics.

The reference writes Newton and Euler in world axes about the centre of mass, with a
quaternion, and gets the cables' forces from the acceleration of their hinges; it shares
no line with the model.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from test_model_rigs import Sample, bifilar, moving, random_sample, thesis_case_14, trifilar

from rig_identification.model import layout
from rig_identification.model.equilibrium import design_pose, find_rest, settle
from rig_identification.model.motion import Input, Motion, State, on_cables, simulate

Array = NDArray[np.float64]


def turned(quaternion: Array) -> Array:
    """(3, 3) rotation of a quaternion w x y z that need not have unit norm."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_rate(q: Array, w: Array) -> Array:
    """dq/dt for a rate ``w`` in world axes."""
    scalar, vector = q[0], q[1:]
    return 0.5 * np.array([-vector @ w, *(scalar * w + np.cross(w, vector))])


def reference(sample: Sample, start: State, drive: Input, stiffness: float | None, damping: float) -> Array:
    """(N, 3 + 9 + n) datum position, rotation matrix and tensions at the nodes, by DOP853."""
    mass, center = sample.elements[0], sample.elements[1:4]
    xx, xy, xz, yy, yz, zz = sample.elements[4:]
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    ceiling = np.array([c.ceiling_point for c in sample.rig.cables])
    from_center = np.array([c.body_point for c in sample.rig.cables]) - center
    unloaded = np.array([c.length for c in sample.rig.cables])
    exciter = sample.rig.exciter
    assert exciter is not None
    n, arm, mount = len(unloaded), exciter.position - center, Rotation.from_quat(exciter.orientation)

    def accelerations(t: float, y: Array, node: int) -> tuple[Array, Array, Array]:
        R, v, w = turned(y[3:7]), y[7:10], y[10:13]
        share = min(max(t / drive.step - node, 0.0), 1.0)
        last = min(node + 1, len(drive.force) - 1)
        push = R @ mount.apply(drive.force[node] * (1 - share) + drive.force[last] * share)
        J_world = R @ J @ R.T
        hinges = from_center @ R.T
        span = ceiling - y[:3] - hinges
        length = np.linalg.norm(span, axis=1)
        unit = span / length[:, None]
        speed = v + np.cross(w, hinges)
        force = np.array([0.0, 0.0, -mass * sample.rig.gravity]) + push
        moment = np.cross(R @ arm, push) - np.cross(w, J_world @ w)
        free = np.concatenate([force / mass, np.linalg.solve(J_world, moment)])
        pull = np.hstack([unit, np.cross(hinges, unit)])  # wrench of a unit tension about the centre
        if stiffness is None:
            weight = np.zeros((6, 6))
            weight[:3, :3], weight[3:, 3:] = np.eye(3) / mass, np.linalg.inv(J_world)
            # span . d2(hinge) = |d(hinge)|^2 keeps |span|; the tension follows
            spin = np.cross(w, np.cross(w, hinges))
            needed = np.sum(speed**2, axis=1) / length - np.sum(unit * spin, axis=1)
            tension = np.linalg.solve(pull @ weight @ pull.T, needed - pull @ free)
            total = free + weight @ pull.T @ tension
        else:
            rate = -np.sum(unit * speed, axis=1)
            tension = stiffness / unloaded * (length - unloaded + damping * rate)
            extra = pull.T @ tension
            total = free + np.concatenate([extra[:3] / mass, np.linalg.solve(J_world, extra[3:])])
        return total[:3], total[3:], tension

    def slope(t: float, y: Array, node: int) -> Array:
        a, alpha, _ = accelerations(t, y, node)
        return np.concatenate([y[7:10], quaternion_rate(y[3:7], y[10:13]), a, alpha])

    R = start.R_world_body
    q = Rotation.from_matrix(R).as_quat()
    w = R @ start.rate
    y = np.concatenate(
        [start.position + R @ center, q[[3, 0, 1, 2]], start.velocity + np.cross(w, R @ center), w]
    )
    rows = []
    for node in range(len(drive.force)):
        R = turned(y[3:7])
        tension = accelerations(node * drive.step, y, node)[2]
        rows.append(np.concatenate([y[:3] - R @ center, R.ravel(), tension]))
        if node < len(drive.force) - 1:
            # The input has a kink at each node: no step may straddle one
            span = (node * drive.step, (node + 1) * drive.step)
            y = solve_ivp(slope, span, y, "DOP853", rtol=1e-11, atol=1e-13, args=(node,)).y[:, -1]
    assert rows[0].size == 12 + n
    return np.array(rows)


def exciting(nodes: int, step: float) -> Input:
    """A force that goes round at 1.05 Hz, linear between nodes."""
    phase = 2.0 * np.pi * 1.05 * step * np.arange(nodes)
    force = 150.0 * np.stack([np.sin(phase), np.cos(phase), 0.3 * np.sin(2.0 * phase)], axis=1)
    return Input(step, force, np.zeros((nodes, 3)), np.zeros((nodes, 6)))


def compare(motion: Motion, truth: Array, position: float, tension: float) -> None:
    assert motion.complete
    np.testing.assert_allclose(motion.states[:, :3], truth[:, :3], rtol=0.0, atol=position)
    np.testing.assert_allclose(motion.R_world_body.reshape(-1, 9), truth[:, 3:12], rtol=0.0, atol=position)
    np.testing.assert_allclose(motion.outputs[:, layout.OUT_TENSION :], truth[:, 12:], rtol=0.0, atol=tension)


@pytest.mark.parametrize(
    "sample",
    [thesis_case_14(), trifilar(), random_sample(8, 2), random_sample(8, 5)],
    ids=["case_14", "trifilar", "two_cables", "five_cables"],
)
def test_ten_seconds_agree_with_dop853(sample: Sample) -> None:
    model = sample.model(rods=True)
    drive = exciting(101, 0.1)
    truth = reference(sample, sample.start, drive, None, 0.0)
    assert np.ptp(truth[:, :3], axis=0).max() > 0.01
    compare(simulate(model, sample.start, drive), truth, 1e-7, 1e-2)


def test_elastic_cables_agree_with_dop853() -> None:
    sample = random_sample(8, 3)
    model = sample.model(axial_stiffness=1e6, rods=True)
    physics = model.physics.copy()
    for i in range(3):
        physics[layout.cable_offset(i) + layout.AXIAL_DAMPING] = 1e-3
    drive = exciting(21, 0.1)
    truth = reference(sample, sample.start, drive, 1e6, 1e-3)
    # Bounce at 10 Hz takes finer steps than rigid motion for the same tolerance
    compare(simulate(model.with_physics(physics), sample.start, drive, substeps=400), truth, 1e-7, 1e-1)


def test_default_steps_follow_elastic_bounce() -> None:
    sample = random_sample(8, 3)
    model = sample.model(axial_stiffness=1e6, rods=True)
    drive = exciting(21, 0.1)
    fine = simulate(model, sample.start, drive, substeps=400)
    default = simulate(model, sample.start, drive)
    stretch = 2e-2 * sample.elements[0] * 9.81 * 2.0 / 1e6
    np.testing.assert_allclose(default.states[:, :3], fine.states[:, :3], rtol=0.0, atol=stretch)


def test_refining_the_step_sixteenfolds_the_accuracy() -> None:
    sample = thesis_case_14()
    model, drive = sample.model(rods=True), exciting(31, 0.1)
    best = simulate(model, sample.start, drive, substeps=160).states[:, :3]
    errors = [
        np.max(np.abs(simulate(model, sample.start, drive, substeps=k).states[:, :3] - best))
        for k in (5, 10, 20)
    ]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(16.0, rel=0.25)


#: The drum is light: on stiffer cables it bounces faster than the steps resolve (substeps.FASTEST).
@pytest.mark.parametrize(
    ("sample", "stiffness"),
    [(thesis_case_14(), [1e8, 1e9, 1e10]), (trifilar(0.3), [1e7, 3e7, 1e8])],
    ids=["case_14", "trifilar"],
)
def test_elastic_cables_become_rigid_as_they_stiffen(sample: Sample, stiffness: list[float]) -> None:
    drive = exciting(21, 0.1)
    rigid = simulate(sample.model(rods=True), sample.start, drive).states[:, :3]
    apart = []
    for EA in stiffness:
        elastic = simulate(sample.model(axial_stiffness=EA, rods=True), sample.start, drive)
        apart.append(np.max(np.abs(elastic.states[:, :3] - rigid)))
    rate = np.diff(np.log(apart)) / np.diff(np.log(stiffness))
    np.testing.assert_allclose(rate, -1.0, atol=0.1)
    assert apart[-1] < 1e-4


@pytest.mark.parametrize("sample", [thesis_case_14(), trifilar(), bifilar()], ids=["four", "three", "two"])
def test_elastic_cables_at_rest_stretch_by_their_tension(sample: Sample) -> None:
    model = sample.model(axial_stiffness=2e6)
    rest = find_rest(model, settle(sample.model(), design_pose(sample.model())))
    assert rest.converged
    position, R = rest.state.position, rest.state.R_world_body
    lifted = 0.0
    for cable, tension in zip(sample.rig.cables, rest.tension, strict=True):
        across = cable.ceiling_point - position - R @ cable.body_point
        length = float(np.linalg.norm(across))
        assert length - cable.length == pytest.approx(tension * cable.length / 2e6, rel=1e-9)
        lifted += tension * across[2] / length
    assert lifted == pytest.approx(sample.elements[0] * sample.rig.gravity, rel=1e-10)
    # And there it stays when it is let go
    motion = simulate(model, rest.state, Input.none(101, 0.01))
    np.testing.assert_allclose(motion.states[:, :3], position + np.zeros((101, 3)), atol=1e-9)


def test_start_state_off_the_cables_is_put_on_them_the_short_way() -> None:
    sample = random_sample(2, 4)
    model = sample.model(rods=True)
    state = moving(sample, model, 0)
    pushed = state.moved(1e-4 * np.random.default_rng(0).standard_normal(12))
    back = on_cables(model, pushed)
    again = on_cables(model, back)
    assert np.max(np.abs(back.position - state.position)) < 1e-3
    np.testing.assert_allclose(again.position, back.position, atol=1e-12)
    np.testing.assert_allclose(again.velocity, back.velocity, atol=1e-12)
