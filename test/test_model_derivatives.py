"""Exact derivatives of the motion against central differences with Richardson extrapolation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation
from test_model_rigs import Sample, moving, random_sample, thesis_case_14, trifilar

from rig_identification.model import layout
from rig_identification.model.constraints import project_columns, rigid_jacobian
from rig_identification.model.equilibrium import find_rest, settle
from rig_identification.model.integrate import EXCITER_CLOCK
from rig_identification.model.motion import Input, Motion, RigModel, State, on_cables, simulate

Array = NDArray[np.float64]

SUBSTEPS = 4
ROTATION = slice(layout.OUT_ROTATION, layout.OUT_ROTATION + 3)


def richardson(difference: Callable[[float], Array], h: float) -> Array:
    """Derivative from central differences of step h and h/2, error of order h^4."""
    return np.asarray((4.0 * difference(h / 2.0) - difference(h)) / 3.0)


def outputs_difference(plus: Motion, minus: Motion, h: float) -> Array:
    """(N, 18 + n) central difference of the raw outputs; rotation as the increment between the two poses."""
    out = (plus.outputs - minus.outputs) / (2.0 * h)
    turn = minus.R_world_body.transpose(0, 2, 1) @ plus.R_world_body
    out[:, ROTATION] = Rotation.from_matrix(turn).as_rotvec() / (2.0 * h)
    return np.asarray(out)


def tangent_basis(model: RigModel, state: State) -> Array:
    """(12, 2 dof) directions that keep the cables."""
    n = model.cables
    G, gap, rate = np.zeros((n, 6)), np.zeros(n), np.zeros(n)
    count = rigid_jacobian(
        model.physics, model.modes, state.vector(), state.R_world_body.copy(), G, gap, rate
    )
    free = null_space(G[:count]) if count else np.eye(6)
    zero = np.zeros_like(free)
    return np.block([[free, zero], [zero, free]])


def drive_of(nodes: int, step: float, seed: int) -> Input:
    rng = np.random.default_rng(seed)
    force = rng.normal(0.0, 150.0, (nodes, 3))
    rate = rng.normal(0.0, 900.0, (nodes, 3))
    return Input(step, force, rate, rng.normal(0.0, 40.0, (nodes, 6)))


def size_of(entry: int, cables: int) -> float:
    """A step for central differences: a thousandth of what such an entry usually is."""
    if layout.INERTIAL <= entry < layout.INERTIAL + 10:
        return 0.5
    if entry >= layout.CABLES:
        kind = (entry - layout.CABLES) % layout.CABLE_SIZE
        return 2e3 if entry < layout.cable_offset(cables) and kind == layout.AXIAL_STIFFNESS else 1e-4
    return 1e-3


def physics_derivative(model: RigModel, state: State, drive: Input, entry: int, h: float) -> Array:
    """(N, 18 + n) derivative of the raw outputs by an entry of the physics, from steps of h and h/2."""

    def difference(h: float) -> Array:
        ends = []
        for sign in (1.0, -1.0):
            physics = model.physics.copy()
            physics[entry] += sign * h
            ends.append(simulate(model.with_physics(physics), state, drive, substeps=SUBSTEPS))
        return outputs_difference(*ends, h)

    return richardson(difference, h)


def assert_close(exact: Array, numeric: Array, what: str, tolerance: float) -> None:
    """Each output's whole history at once, against the largest derivative in it and its group."""
    groups = [(0, 3), (3, 6), (6, 9), (9, 12), (12, 15), (15, 18), (18, exact.shape[1])]
    for first, last in groups:
        size = max(float(np.max(np.abs(numeric[:, first:last]))), 1e-3)
        error = np.max(np.abs(exact[:, first:last] - numeric[:, first:last]))
        assert error <= tolerance * size, f"{what}, outputs {first} to {last}: off by {error / size:.2e}"


def is_of(entry: int, kinds: tuple[int, ...]) -> bool:
    """Whether an entry is one of some numbers of a cable."""
    return entry >= layout.CABLES and (entry - layout.CABLES) % layout.CABLE_SIZE in kinds


def smooth(cables: int) -> list[int]:
    """Entries of body, exciter and cables, without the hinges' moments (test_model_more_effects.py).

    Those answer by so little that differences tell them to no better than a thousandth.
    """
    hinges = (layout.HINGE_DAMPING, layout.HINGE_FRICTION)
    return [e for e in range(layout.effects_offset(cables)) if not is_of(e, hinges)]


def check_physics(model: RigModel, state: State, drive: Input, entries: list[int], tolerance: float) -> None:
    directions = np.array([*entries, EXCITER_CLOCK])
    exact = simulate(model, state, drive, directions=directions, substeps=SUBSTEPS)
    assert exact.J is not None
    for k, entry in enumerate(entries):
        numeric = physics_derivative(model, state, drive, entry, size_of(entry, model.cables))
        assert_close(exact.J[:, :, k], numeric, f"physics {entry}", tolerance)

    def shifted(h: float) -> Array:
        """Stamps late by h: what was stamped t was measured at t - h."""
        ends = [
            simulate(
                model,
                state,
                Input(drive.step, drive.force + s * drive.force_rate, drive.force_rate, drive.wrench),
                substeps=SUBSTEPS,
            )
            for s in (h, -h)
        ]
        return outputs_difference(*ends, h)

    assert_close(exact.J[:, :, -1], richardson(shifted, 1e-3), "clock", tolerance)


@given(st.integers(0, 10_000), st.integers(2, 6))
@settings(max_examples=6, deadline=None, derandomize=True)
def test_every_physics_entry_of_rigid_rigs(seed: int, cables: int) -> None:
    sample = random_sample(seed, cables)
    model = sample.model(rods=True)
    entries = [e for e in smooth(cables) if not is_of(e, (layout.AXIAL_STIFFNESS, layout.AXIAL_DAMPING))]
    check_physics(model, moving(sample, model, seed), drive_of(61, 0.01, seed), entries, 1e-6)


@given(st.integers(0, 10_000), st.integers(2, 6))
@settings(max_examples=4, deadline=None, derandomize=True)
def test_every_physics_entry_of_elastic_rigs(seed: int, cables: int) -> None:
    sample = random_sample(seed, cables)
    model = sample.model(axial_stiffness=2e6, rods=True)
    physics = model.physics.copy()
    for i in range(cables):
        physics[layout.cable_offset(i) + layout.AXIAL_DAMPING] = 2e-3
    model = model.with_physics(physics)
    entries = smooth(cables)
    check_physics(model, moving(sample, model, seed), drive_of(41, 0.01, seed), entries, 1e-6)


@pytest.mark.parametrize("sample", [thesis_case_14(), trifilar()], ids=["case_14", "trifilar"])
def test_every_physics_entry_over_a_whole_swing(sample: Sample) -> None:
    # Rods: where a cable goes slack and snaps tight the motion has no derivative in the usual sense
    model = sample.model(rods=True)
    entries = [*range(layout.CABLES), *(layout.cable_offset(1) + k for k in range(7))]
    drive = drive_of(301, 0.01, 1)
    check_physics(model, sample.start, drive, entries, 5e-7)


@given(st.integers(0, 10_000), st.integers(2, 5), st.booleans())
@settings(max_examples=10, deadline=None, derandomize=True)
def test_start_coordinates_and_transition_matrices(seed: int, cables: int, elastic: bool) -> None:
    sample = random_sample(seed, cables)
    model = sample.model(axial_stiffness=2e6 if elastic else None, rods=True)
    state, drive = moving(sample, model, seed), drive_of(61, 0.01, seed)
    basis = tangent_basis(model, state)
    none = np.zeros(0, dtype=np.int64)
    exact = simulate(model, state, drive, directions=none, start_basis=basis, substeps=SUBSTEPS)
    assert exact.J is not None
    assert exact.A is not None
    assert exact.H is not None
    # A direction of the pose carries the velocity along that keeps a moving body on its cables
    columns = basis.copy()
    x, R = state.vector(), state.R_world_body.copy()
    project_columns(model.physics, model.modes, x, R, none, basis.shape[1], columns)
    chained = np.empty_like(exact.J)
    for k in range(exact.J.shape[0]):
        chained[k] = exact.H[k] @ columns
        columns = exact.A[k] @ columns
    np.testing.assert_allclose(chained, exact.J, atol=1e-9 * np.max(np.abs(exact.J)))
    for column in range(basis.shape[1]):

        def difference(h: float, column: int = column) -> Array:
            ends = [
                simulate(model, state.moved(s * basis[:, column]), drive, substeps=SUBSTEPS) for s in (h, -h)
            ]
            return outputs_difference(*ends, h)

        assert_close(exact.J[:, :, column], richardson(difference, 1e-3), f"start {column}", 1e-6)


@given(st.integers(0, 10_000), st.integers(2, 5), st.booleans())
@settings(max_examples=8, deadline=None, derandomize=True)
def test_a_wrench_held_over_one_interval(seed: int, cables: int, elastic: bool) -> None:
    sample = random_sample(seed, cables)
    model = sample.model(axial_stiffness=2e6 if elastic else None, rods=True)
    state, drive = moving(sample, model, seed), drive_of(31, 0.01, seed)
    exact = simulate(model, state, drive, directions=np.zeros(0, dtype=np.int64), substeps=SUBSTEPS)
    assert exact.A is not None
    assert exact.B is not None
    assert exact.H is not None
    assert exact.D is not None
    node = seed % 20
    for axis in range(6):
        predicted = np.zeros_like(exact.outputs)
        predicted[node] = exact.D[node][:, axis]
        response = exact.B[node][:, axis]
        for k in range(node + 1, 31):
            predicted[k] = exact.H[k] @ response
            response = exact.A[k] @ response

        def difference(h: float, axis: int = axis) -> Array:
            ends = []
            for sign in (h, -h):
                wrench = drive.wrench.copy()
                wrench[node, axis] += sign
                pushed = Input(drive.step, drive.force, drive.force_rate, wrench)
                ends.append(simulate(model, state, pushed, substeps=SUBSTEPS))
            return outputs_difference(*ends, h)

        numeric = richardson(difference, 20.0)
        for first, last in ((0, 3), (3, 6), (6, 9), (9, 12), (12, 15), (15, 18), (18, 18 + cables)):
            size = np.max(np.abs(predicted[:, first:last])) + 1e-10
            error = np.max(np.abs(predicted[:, first:last] - numeric[:, first:last]))
            assert error <= 1e-6 * size, f"wrench {axis}, outputs {first}: off by {error / size:.1e}"


def test_the_clock_of_a_smooth_force() -> None:
    sample = random_sample(5, 4)
    model = sample.model(rods=True)
    t, omega = 0.005 * np.arange(401)[:, None], 2.0 * np.pi * np.array([0.9, 1.3, 1.9])

    def stamped_late(offset: float) -> Input:
        at = t + offset
        force, rate = 200.0 * np.sin(omega * at), 200.0 * omega * np.cos(omega * at)
        return Input(0.005, force, rate, np.zeros((401, 6)))

    exact = simulate(model, sample.start, stamped_late(0.0), directions=np.array([EXCITER_CLOCK]))
    assert exact.J is not None

    def difference(h: float) -> Array:
        return outputs_difference(
            simulate(model, sample.start, stamped_late(h), substeps=1),
            simulate(model, sample.start, stamped_late(-h), substeps=1),
            h,
        )

    assert_close(exact.J[:, :, 0], richardson(difference, 1e-3), "clock", 1e-5)


def test_where_a_start_follows_the_cables() -> None:
    """A longer cable moves the start itself; the derivative holds from the first node on."""
    sample = thesis_case_14()
    model = sample.model()
    entry = layout.cable_offset(0) + layout.LENGTH
    motion = simulate(model, sample.start, Input.none(2, 0.01), directions=np.array([entry]))
    assert motion.J is not None
    moved = motion.J[0, :6, 0]
    n = model.cables
    G, gap, rate = np.zeros((n, 6)), np.zeros(n), np.zeros(n)
    x, R = sample.start.vector(), sample.start.R_world_body.copy()
    rigid_jacobian(model.physics, model.modes, x, R, G, gap, rate)
    np.testing.assert_allclose(G @ moved, [1.0, 0.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("axial_stiffness", [None, 2e6], ids=["rigid", "elastic"])
@pytest.mark.parametrize(
    "sample", [thesis_case_14(), random_sample(7, 3), random_sample(7, 5)], ids=["four", "three", "five"]
)
def test_rest_in_every_physics_entry(sample: Sample, axial_stiffness: float | None) -> None:
    model = sample.model(axial_stiffness=axial_stiffness, rods=True)
    entries = np.array(smooth(model.cables))
    near = settle(sample.model(rods=True), sample.start)
    rest = find_rest(model, near, directions=entries)
    assert rest.converged
    for k, entry in enumerate(entries):
        kind = (entry - layout.CABLES) % layout.CABLE_SIZE
        if axial_stiffness is None and entry >= layout.CABLES and kind == layout.AXIAL_STIFFNESS:
            continue

        def difference(h: float, entry: int = int(entry)) -> Array:
            ends = []
            for sign in (h, -h):
                physics = model.physics.copy()
                physics[entry] += sign
                ends.append(find_rest(model.with_physics(physics), rest.state))
            out = (ends[0].outputs - ends[1].outputs) / (2.0 * h)
            turn = ends[1].state.R_world_body.T @ ends[0].state.R_world_body
            out[0, ROTATION] = Rotation.from_matrix(turn).as_rotvec() / (2.0 * h)
            return np.asarray(out)

        numeric = richardson(difference, size_of(int(entry), model.cables))
        scale = np.maximum(np.max(np.abs(numeric)), 1e-6) * np.array([1.0] * 18 + [1.0] * model.cables)
        error = np.max(np.abs(rest.J[0, :, k] - numeric[0]) / scale)
        assert error < 1e-6, f"physics {entry}: off by {error:.1e}"


@pytest.mark.parametrize("sample", [thesis_case_14(), trifilar(), random_sample(7, 2), random_sample(7, 4)])
def test_rest_is_the_lowest_place_on_the_cables(sample: Sample) -> None:
    model = sample.model()
    rest = find_rest(model, settle(model, sample.start))
    assert rest.converged
    state = rest.state
    center = sample.elements[1:4]

    def height(s: State) -> float:
        return float((s.position + s.R_world_body @ center)[2])

    free = tangent_basis(model, state)[:, : tangent_basis(model, state).shape[1] // 2]
    for direction in free.T:
        for step in (0.02, -0.02):
            assert height(on_cables(model, state.moved(step * direction))) > height(state) + 1e-7
    motion = simulate(model, state, Input.none(501, 0.01))
    assert np.max(np.abs(motion.states[:, :3] - state.position)) < 1e-7
