"""Inertial parameters by regression on momentum: a first guess that needs none itself.

Integrated over a window, Newton and Euler in world axes about the world's origin read
    [m v + R (w x h)]           = int (m g + F) dt
    [x x P + R h x v + R I w]   = int ((m x + R h) x g + M) dt
with P the linear momentum, F and M force and moment of cables and exciter. Every term is
linear in (m, h, I). Only velocities enter, no measured acceleration, so noise is averaged
and not amplified. Measured forces and poses enter as if exact, which costs accuracy that a
first guess can spare.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.force_noise import exciter_wrench_map
from rig_identification.estimate.parameters import ParameterSet
from rig_identification.estimate.prediction import drive
from rig_identification.estimate.sampling import node_values
from rig_identification.estimate.track import Track
from rig_identification.model import layout
from rig_identification.model.body import inertia_times, linear_from_log_cholesky, linear_in_log_cholesky
from rig_identification.model.definite import definite
from rig_identification.model.so3 import skew

Array = NDArray[np.float64]

#: Windows over which momentum is balanced, s.
WINDOW = 0.25
#: Gauss-Newton steps of the regression; it is linear but for the body having to exist.
REGRESSION_STEPS = 12


def momentum_map(track: Track) -> Array:
    """(N, 6, 10): linear and angular momentum (world axes, about the origin) per inertial parameter."""
    R = track.R_world_body
    x, v, w = track.states[:, :3], track.states[:, 6:9], track.states[:, 9:12]
    out = np.zeros((x.shape[0], 6, 10))
    out[:, :3, 0] = v
    out[:, :3, 1:4] = R @ skew(w)
    out[:, 3:, 0] = np.cross(x, v)
    out[:, 3:, 1:4] = skew(x) @ R @ skew(w) - skew(v) @ R
    out[:, 3:, 4:] = R @ inertia_times(w)
    return out


def weight_map(track: Track, gravity: Array) -> Array:
    """(N, 6, 10): weight and its moment about the origin per inertial parameter."""
    out = np.zeros((track.time.size, 6, 10))
    out[:, :3, 0] = gravity
    out[:, 3:, 0] = np.cross(track.states[:, :3], gravity)
    out[:, 3:, 1:4] = -skew(np.broadcast_to(gravity, (track.time.size, 3))) @ track.R_world_body
    return out


def applied_wrench(track: Track, run: Run, parameters: ParameterSet, theta: Array) -> Array | None:
    """(N, 6) wrench about the origin, world axes, of cables and exciter; None: a cell is missing."""
    physics = parameters.physics(theta)
    channels = {c.device: c for c in run.channels if c.quantity == "tension"}
    if any(name not in channels for name in parameters.places.cables):
        return None
    R, x = track.R_world_body, track.states[:, :3]
    total = np.zeros((x.shape[0], 6))
    for i, name in enumerate(parameters.places.cables):
        o = layout.cable_offset(i)
        hinge = x + R @ physics[o + layout.BODY_POINT : o + layout.BODY_POINT + 3]
        along = physics[o + layout.CEILING_POINT : o + layout.CEILING_POINT + 3] - hinge
        tension = node_values(run.grid, channels[name].time, channels[name].values)
        force = tension * along / np.linalg.norm(along, axis=1, keepdims=True)
        total += np.concatenate([force, np.cross(hinge, force)], axis=1)
    body = (
        drive(run, parameters, theta).force @ exciter_wrench_map(parameters, theta).T if run.force else None
    )
    if body is not None:
        force = np.einsum("nij,nj->ni", R, body[:, :3])
        moment = np.einsum("nij,nj->ni", R, body[:, 3:]) + np.cross(x, force)
        total += np.concatenate([force, moment], axis=1)
    return total


def balance(track: Track, run: Run, parameters: ParameterSet, theta: Array) -> tuple[Array, Array] | None:
    """(rows (m, 10), right side (m,)) of the momentum balance over windows; None: a load cell is missing."""
    wrench = applied_wrench(track, run, parameters, theta)
    if wrench is None:
        return None
    gravity = parameters.physics(theta)[layout.GRAVITY : layout.GRAVITY + 3]
    momentum, weight = momentum_map(track), weight_map(track, gravity)
    edges = np.arange(0, track.time.size, max(1, round(WINDOW / run.grid.step)))
    impulse = cumulative_trapezoid(weight, dx=run.grid.step, axis=0, initial=0.0)
    given = cumulative_trapezoid(wrench, dx=run.grid.step, axis=0, initial=0.0)
    rows = np.diff(momentum[edges], axis=0) - np.diff(impulse[edges], axis=0)
    right = np.diff(given[edges], axis=0)
    return rows.reshape(-1, 10), right.reshape(-1)


def regress(balances: list[tuple[Array, Array]], theta: Array, weak: Array) -> tuple[Array, float]:
    """(10,) log-Cholesky vector of the body that balances momentum best, and what it leaves.

    What is left is the sum of the logarithms of the root mean squares of force and moment rows.
    theta (10,): guess; weak (10,): std of the belief in it, so that what the motion does not
    excite stays there. The imbalance is weighed by its own size at each step, so that poor
    tracking counts as what it is. Every iterate is a body that can exist.
    """
    rows = np.concatenate([b[0] for b in balances])
    right = np.concatenate([b[1] for b in balances])
    guess = theta.copy()
    for _ in range(REGRESSION_STEPS):
        miss = right - rows @ linear_from_log_cholesky(theta)
        slope = rows @ linear_in_log_cholesky(theta)
        spread = spread_of_rows(miss)
        slope, miss = slope / spread[:, None], miss / spread
        normal = slope.T @ slope + np.diag(1.0 / weak**2)
        change = np.linalg.solve(definite(normal), slope.T @ miss - (theta - guess) / weak**2)
        theta = theta + change * min(1.0, 1.0 / float(np.max(np.abs(change))))
    left = _spreads(right - rows @ linear_from_log_cholesky(theta))
    return theta, float(np.sum(np.log(left)))


def spread_of_rows(miss: Array) -> Array:
    """(m,) root mean square of a balance's rows ``miss`` (m,), of each by its kind.

    Force and moment rows scatter differently: each kind is weighed by its own spread.
    """
    return np.asarray(_spreads(miss)[_kinds(miss.size)])


def _spreads(miss: Array) -> Array:
    """(2,) root mean square of force and of moment rows."""
    kind = _kinds(miss.size)
    return np.array([np.sqrt(np.mean(miss[kind == k] ** 2)) + 1e-12 for k in (0, 1)])


def _kinds(size: int) -> NDArray[np.int64]:
    """(size,) 0 for a row of force, 1 for one of moment."""
    return np.tile(np.repeat([0, 1], 3), size // 6)
