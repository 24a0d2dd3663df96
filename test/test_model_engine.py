"""The forward model beside another simulator's ground truth, where this machine has its recordings.

The engine's rig is not the described one: the description errs within its tolerances. To first
order the two motions differ by the model's derivative times those errors, so the derivative
and the tolerances bound the difference.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from test_model_rigs import elements_of

from rig_identification.estimate.sampling import Grid, node_values
from rig_identification.estimate.smoothing import WIDTHS, smoothed_input
from rig_identification.model import layout
from rig_identification.model.integrate import EXCITER_CLOCK
from rig_identification.model.motion import Input, RigModel, State, on_cables, rig_model, simulate
from rig_identification.rig import Rig
from rig_identification.session import read_session

Array = NDArray[np.float64]

FOLDER = Path(
    os.environ.get(
        "RIG_IDENTIFICATION_RECORDINGS", Path(__file__).resolve().parents[2] / "shared" / "recordings"
    )
)
SESSION = FOLDER / "session_a"
pytestmark = pytest.mark.skipif(
    not (SESSION / "truth.json").exists(),
    reason=f"no {SESSION}: set RIG_IDENTIFICATION_RECORDINGS to a folder of sessions",
)
SECONDS = 12.0
SIGMAS = 3.5


def tolerances(rig: Rig) -> dict[int, float]:
    """Standard deviation of each physics entry that a description can have wrong."""
    t = rig.tolerance
    out = {layout.GRAVITY: rig.gravity * t["level"], layout.GRAVITY + 1: rig.gravity * t["level"]}
    for a in range(3):
        out[layout.EXCITER_POSITION + a] = t["exciter_position"]
        out[layout.EXCITER_ROTATION + a] = t["exciter_orientation"]
    out[layout.EXCITER_GAIN] = t["exciter_gain"]
    for i in range(len(rig.cables)):
        o = layout.cable_offset(i)
        for k in range(6):
            out[o + k] = t["hinge_position"]
        out[o + layout.LENGTH] = t["cable_length"]
    out[EXCITER_CLOCK] = t["clock"]
    return out


def errors(model: RigModel, first: State, drive: Input, entries: Array, values: Array) -> tuple[Array, Array]:
    """(N, 9) position m, attitude rad, rate rad/s: engine less model; (N, 9, d) the model's derivative."""
    motion = simulate(model, on_cables(model, first), drive, directions=entries)
    assert motion.complete
    assert motion.J is not None
    R = Rotation.from_quat(values[:, 3:7])
    turn = (Rotation.from_matrix(motion.R_world_body).inv() * R).as_rotvec()
    apart = np.concatenate(
        [values[:, :3] - motion.outputs[:, :3], turn, values[:, 10:13] - motion.outputs[:, 6:9]], axis=1
    )
    return apart, motion.J[:, :9]


@pytest.mark.parametrize("run", ["run_1", "run_2"])
def test_motion_of_the_engine_lies_within_the_tolerances(run: str) -> None:
    """As described, the rig errs by what its tolerances allow; some rig within them moves as the engine."""
    session = read_session(SESSION)
    truth = json.loads((SESSION / "truth.json").read_text())
    recording = next(r for r in session.recordings if r.name == run)
    assert recording.ground_truth is not None
    assert recording.exciter_force is not None
    time, values = recording.ground_truth.time, recording.ground_truth.values
    model = rig_model(
        session.rig, elements_of(truth["mass"], truth["center_of_mass"], np.array(truth["inertia"]))
    )
    step = float(np.median(np.diff(time)))
    grid = Grid(step, int(SECONDS / step))
    np.testing.assert_allclose(time[: grid.nodes] - time[0], step * np.arange(grid.nodes), atol=1e-4)
    values = values[: grid.nodes]
    R = Rotation.from_quat(values[0, 3:7]).as_matrix()
    first = State(values[0, :3], R, R @ values[0, 7:10], values[0, 10:13])
    spread = tolerances(session.rig)
    entries, std = np.array(list(spread)), np.array(list(spread.values()))
    noise = np.repeat([1e-4, 1e-4, 3e-4], 3)
    error = np.zeros(entries.size)
    for iteration in range(3):
        physics = model.physics.copy()
        physics[entries[:-1]] += error[:-1]
        late = recording.exciter_force.time - time[0] - error[-1]
        force = node_values(grid, late, recording.exciter_force.values)
        drive = Input(
            step, force, smoothed_input(step, force, WIDTHS[0]).at(0.0, 1), np.zeros((grid.nodes, 6))
        )
        apart, J = errors(model.with_physics(physics), first, drive, entries, values)
        if iteration == 0:
            allowed = SIGMAS * np.sqrt(np.sum((J * std) ** 2, axis=2))
            assert np.max(np.abs(apart) - allowed - 3.0 * noise) < 0.0
        columns = (J / noise[:, None] * std).reshape(-1, entries.size)
        miss = (apart / noise).ravel() + columns @ (error / std)
        error = std * np.linalg.solve(columns.T @ columns + np.eye(entries.size), columns.T @ miss)
    assert np.max(np.abs(error / std)) < SIGMAS
    # Below a thousandth of the motion; the exciter's noise moves the body about as much
    worst = np.max(np.abs(apart), axis=0)
    assert np.max(worst[:3]) < 1e-4
    assert np.max(worst[3:6]) < 1e-4
    assert np.max(worst[6:]) < 1e-3
