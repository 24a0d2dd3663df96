"""Rest: the pose at which the body hangs still, its tensions, and their exact derivatives.

With v = w = A = alpha = 0 the equations of dynamics.py are r_1..6 - K_1..6,T T = 0 beside the
cables' lengths. Newton finds the rest pose; the implicit function theorem gives its
derivative in every entry of ``physics`` from the same complex steps as the motion's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from rig_identification.model import layout
from rig_identification.model.arithmetic import STEP
from rig_identification.model.constraints import cable_length_and_rate, update_reference
from rig_identification.model.dynamics import assemble, rotation
from rig_identification.model.effects.cable_mass import weight_below_cell
from rig_identification.model.effects.internal import ceiling_shift
from rig_identification.model.effects.place import LINEAR_DENSITY
from rig_identification.model.motion import Input, RigModel, State, on_cables, simulate
from rig_identification.model.so3 import skew

Array = NDArray[np.float64]


@njit(cache=True)
def rest_defect(physics, modes, mount, x, R, tension, K, r, gradient, out):  # type: ignore[no-untyped-def]
    """out (6 + n + s,): unbalanced wrench, each cable's length less what its tension stretches it to, and
    what accelerates each internal coordinate."""
    n = modes.shape[0]
    force = np.zeros(3, dtype=x.dtype)
    wrench = np.zeros(6, dtype=x.dtype)
    assemble(physics, modes, mount, x, R, force, wrench, K, r)
    for i in range(6):
        out[i] = r[i]
        for j in range(n):
            out[i] -= K[i, 6 + j] * tension[j]
    for j in range(n):
        offset = layout.CABLES + layout.CABLE_SIZE * j
        shift = ceiling_shift(physics, n, x, j)
        length, _ = cable_length_and_rate(physics, offset, shift, x, R, gradient)
        if modes[j] == layout.RIGID:
            out[6 + j] = length - physics[offset + layout.LENGTH]
        else:
            out[6 + j] = tension[j] - r[6 + j]
    for i in range(6 + n, r.shape[0]):
        out[i] = r[i]
        for j in range(n):
            out[i] -= K[i, 6 + j] * tension[j]


@njit(cache=True)
def rest_jacobian(physics, modes, mount, x, reference, tension, directions):  # type: ignore[no-untyped-def]
    """(m, m), m = 6 + n + s, in pose, tensions and internal coordinates, and (m, d) in ``directions``."""
    n = modes.shape[0]
    behind = 6 + n
    size = behind + (x.shape[0] - layout.BODY_STATE) // 2
    d = directions.shape[0]
    in_pose = np.zeros((size, size))
    in_physics = np.zeros((size, d))
    pc, xc = physics.astype(np.complex128), x.astype(np.complex128)
    tc = tension.astype(np.complex128)
    Rc = reference.astype(np.complex128)
    Kc = np.empty((size, size), dtype=np.complex128)
    rc, oc = np.empty(size, dtype=np.complex128), np.empty(size, dtype=np.complex128)
    gc = np.empty(6, dtype=np.complex128)
    for c in range(size + d):
        if c < 6:
            xc[c] = complex(x[c], STEP)
        elif c < behind:
            tc[c - 6] = complex(tension[c - 6], STEP)
        elif c < size:
            inner = layout.BODY_STATE + c - behind
            xc[inner] = complex(x[inner], STEP)
        elif directions[c - size] >= 0:
            pc[directions[c - size]] = complex(physics[directions[c - size]], STEP)
        rotation(reference, xc, Rc)
        rest_defect(pc, modes, mount, xc, Rc, tc, Kc, rc, gc, oc)
        for i in range(size):
            if c < size:
                in_pose[i, c] = oc[i].imag / STEP
            else:
                in_physics[i, c - size] = oc[i].imag / STEP
        if c < 6:
            xc[c] = x[c]
        elif c < behind:
            tc[c - 6] = tension[c - 6]
        elif c < size:
            xc[layout.BODY_STATE + c - behind] = x[layout.BODY_STATE + c - behind]
        elif directions[c - size] >= 0:
            pc[directions[c - size]] = physics[directions[c - size]]
    return in_pose, in_physics


def own_weights(model: RigModel, x: Array, R: Array, *, per_density: bool = False) -> Array:
    """(n,) N: what each cable's own weight adds at its load cell; per kg/m where asked (it is linear)."""
    block = layout.effects_offset(model.cables)
    physics = model.physics.copy()
    if per_density:
        physics[block + LINEAR_DENSITY] = 1.0
    modes = model.modes
    return np.array([weight_below_cell(physics, block, modes, i, x, R) for i in range(model.cables)])


@dataclass(frozen=True)
class Rest:
    """The body at rest: one node of raw outputs, as in motion.py."""

    state: State
    tension: Array  # (n,) N
    outputs: Array  # (1, 18 + n)
    J: Array  # (1, 18 + n, d) derivative in ``directions``
    converged: bool


def design_pose(model: RigModel) -> State:
    """A pose near the cables' lengths, the body upright below the ceiling: where :func:`find_rest` starts."""
    cables = model.cable_numbers()
    ceiling = cables[:, layout.CEILING_POINT : layout.CEILING_POINT + 3]
    body = cables[:, layout.BODY_POINT : layout.BODY_POINT + 3]
    length = cables[:, layout.LENGTH]
    below = np.mean(ceiling - body, axis=0) - [0.0, 0.0, np.mean(length)]

    def defect(q: Array) -> Array:
        hinges = below + q[:3] + Rotation.from_rotvec(q[3:]).apply(body)
        gap = np.linalg.norm(ceiling - hinges, axis=1) - length
        return np.concatenate([1e3 * gap, q])

    q = least_squares(defect, np.zeros(6)).x
    R = Rotation.from_rotvec(q[3:]).as_matrix()
    return on_cables(model, State(below + q[:3], R, np.zeros(3), np.zeros(3)))


def settle(model: RigModel, start: State, swings: int = 40) -> State:
    """Fall to rest by kinetic damping: free motion, stopped wherever kinetic energy peaks, until it stays.

    (Day, "An introduction to dynamic relaxation", The Engineer 219, 1965.)
    """
    state = State(start.position, start.R_world_body, np.zeros(3), np.zeros(3), start.internal)
    drive = Input.none(101, 0.01)
    for _ in range(swings):
        motion = simulate(model, state, drive)
        speed = np.sum(motion.states[: motion.nodes, 6:12] ** 2, axis=1)
        if not speed.size:
            # From here nothing moves within bounds: there is no rest to fall to
            break
        peak = int(np.argmax(speed))
        reached = motion.state(peak)
        state = on_cables(model, State(reached.position, reached.R_world_body, np.zeros(3), np.zeros(3)))
        if np.sqrt(speed[peak]) < 2e-3:
            break
    return state


def find_rest(
    model: RigModel, guess: State, *, directions: NDArray[np.int64] | None = None, iterations: int = 12
) -> Rest:
    """Rest pose near ``guess`` by Newton's method, with derivatives in ``directions`` of physics."""
    chosen = np.zeros(0, dtype=np.int64) if directions is None else np.asarray(directions, dtype=np.int64)
    n = model.cables
    x, R = guess.vector(model.states), np.array(guess.R_world_body, order="C")
    x[6:12] = 0.0
    x[12 + model.internal :] = 0.0
    tension = np.full(n, model.physics[layout.INERTIAL] * np.linalg.norm(model.physics[:3]) / n)
    size = 6 + n + model.internal
    K, r, out, gradient = np.empty((size, size)), np.empty(size), np.empty(size), np.empty(6)
    converged = False
    for _ in range(iterations):
        rest_defect(model.physics, model.modes, model.exciter_orientation, x, R, tension, K, r, gradient, out)
        in_pose, in_physics = rest_jacobian(
            model.physics, model.modes, model.exciter_orientation, x, R, tension, chosen
        )
        change = np.linalg.lstsq(in_pose, -out, rcond=1e-13)[0]
        turn = float(np.max(np.abs(change[:6])))
        if not np.isfinite(turn):
            break
        scale = min(1.0, 0.1 / max(turn, 1e-300))
        x[:6] += scale * change[:6]
        tension = tension + change[6 : 6 + n]
        x[12 : 12 + model.internal] += change[6 + n :]
        update_reference(R, x)
        if converged:
            break
        converged = turn < 1e-9
    implicit = -np.linalg.lstsq(in_pose, in_physics, rcond=1e-13)[0]
    down = R.T @ model.physics[:3]
    outputs = np.zeros((1, layout.OUT_TENSION + n))
    outputs[0, :3] = x[:3]
    outputs[0, layout.OUT_SPECIFIC_FORCE : layout.OUT_SPECIFIC_FORCE + 3] = -down
    outputs[0, layout.OUT_GRAVITY : layout.OUT_GRAVITY + 3] = down
    outputs[0, layout.OUT_TENSION :] = tension + own_weights(model, x, R)
    in_gravity = skew(down) @ implicit[3:6]
    for k, d in enumerate(chosen):
        if 0 <= d < 3:
            in_gravity[:, k] += R[d]
    J = _in_outputs(implicit, in_gravity, n)[None]
    density = layout.effects_offset(n) + LINEAR_DENSITY
    for column in np.flatnonzero(chosen == density):
        J[0, layout.OUT_TENSION :, column] += own_weights(model, x, R, per_density=True)
    state = State(x[:3].copy(), R, np.zeros(3), np.zeros(3), x[12:].copy())
    return Rest(state, tension, outputs, J, converged)


def wrench_response(model: RigModel, rest: Rest) -> Array:
    """(18 + n, 6) derivative of the outputs at ``rest`` in a constant wrench about the datum, body axes.

    The implicit function theorem again: the wrench adds to the first six of the equations at rest.
    """
    n = model.cables
    x, R = rest.state.vector(model.states), np.array(rest.state.R_world_body, order="C")
    none = np.zeros(0, dtype=np.int64)
    mount = model.exciter_orientation
    in_pose, _ = rest_jacobian(model.physics, model.modes, mount, x, R, rest.tension, none)
    moved = -np.linalg.lstsq(in_pose, np.eye(in_pose.shape[0], 6), rcond=1e-13)[0]
    in_gravity = skew(R.T @ model.physics[:3]) @ moved[3:6]
    return _in_outputs(moved, in_gravity, n)


def _in_outputs(moved: Array, in_gravity: Array, n: int) -> Array:
    """(18 + n, d) derivative of the outputs at rest of ``n`` cables.

    moved (6 + n + s, d): of pose, tensions, internal coordinates. in_gravity (3, d): of gravity, body axes.
    """
    out = np.zeros((layout.OUT_TENSION + n, moved.shape[1]))
    out[layout.OUT_POSITION : layout.OUT_POSITION + 3] = moved[:3]
    out[layout.OUT_ROTATION : layout.OUT_ROTATION + 3] = moved[3:6]
    out[layout.OUT_SPECIFIC_FORCE : layout.OUT_SPECIFIC_FORCE + 3] = -in_gravity
    out[layout.OUT_GRAVITY : layout.OUT_GRAVITY + 3] = in_gravity
    out[layout.OUT_TENSION :] = moved[6 : 6 + n]
    return out
