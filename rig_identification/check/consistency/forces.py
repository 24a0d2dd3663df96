"""How well measured forces agree with the motion: Newton and Euler, linear in ten inertial numbers.

About the body's datum, in body axes, with proper acceleration a, rate w, mass m, first moment h = m c and
inertia I:

    force    m a + w' x h + w x (w x h)                = sum T_i u_i + F
    moment   h x a + I w' + w x I w                    = sum b_i x T_i u_i + r_e x F

Deviations from the run's mean alone are compared: zeros belong to rest. Ten numbers are fitted about
the body that hangs at rest, and the cells' gains about those that rest tells, as closely as rest tells them.
What they leave is judged as any reading is (:mod:`motion`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.consistency.measured import ACROSS, ORDINARY, TINY
from rig_identification.check.consistency.motion import INDEPENDENT, nats
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.rest_model import SCALE
from rig_identification.check.consistency.trajectory import Trajectory, rotation
from rig_identification.model.body import inertia_times
from rig_identification.model.so3 import skew
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Radius of gyration over a body's size, and how wrong a moment guessed so may be, in itself.
GYRATION, GUESSED = 0.35, 1.0
#: Std of the centre of mass beyond what rest tells, share of the hinges' span.
CENTER = 0.02
#: A cell gives at least this share of the force that it measures: less is no gain (:mod:`faults.gain`).
LEAST = 0.1


class ForceModel:
    """Forces of one run beside the motion of a trajectory."""

    def __init__(self, rig: Rig, at: Trajectory, rest: RestFit, cells: RestFit | None = None) -> None:
        """cells: the fit at rest that tells the cells' gains, where it is another than the body's."""
        self.rig, self.at = rig, at
        R = at.R
        hinges = np.array([c.body_point for c in rig.cables])
        span = np.array([c.ceiling_point for c in rig.cables]) - at.position[:, None, :]
        span = np.einsum("nji,ncj->nci", R, span) - hinges
        unit = span / np.linalg.norm(span, axis=2, keepdims=True)
        self.lines = np.concatenate([unit, np.cross(hinges, unit)], axis=2)  # (N, n, 6)
        self.inertial = _inertial_map(at, rig.gravity)
        self.guess, self.guess_std = _guess(rig, hinges, rest)
        gain, std = (cells or rest).value("gain")
        self.share = 1.0 / np.maximum(1.0 + gain, LEAST)  # newtons that a newton read stands for
        self.share_std = std * self.share**2

    def cost(self, values: Mapping[str, Array]) -> tuple[float, Array]:
        """Nats by which the forces disagree with the motion, and what is left of each (6,) in its own std.

        Zero where a cell is not measured, or an exciter that the description mounts is not.
        """
        names = [c.name for c in self.rig.cables]
        tension = [values.get(name) for name in names]
        force = values.get("exciter")
        if any(t is None for t in tension) or (force is None and self.rig.exciter is not None):
            return 0.0, np.zeros(6)
        pull = self.share * np.column_stack([t for t in tension if t is not None])
        each = pull[:, :, None] * self.lines
        wrench = each.sum(axis=1)
        if force is not None and self.rig.exciter is not None:
            wrench = wrench + force @ self._exciter_map()
        known = np.isfinite(wrench).all(axis=1)
        if np.count_nonzero(known) < 20:
            return 0.0, np.zeros(6)
        # What a gain adds to the left-hand side, in shares of the force: slopes beside the ten numbers'
        slope = np.concatenate([self.inertial[known], -np.swapaxes(each[known], 1, 2)], axis=2)
        return self._judged(wrench[known], slope, pull[known])

    def _exciter_map(self) -> Array:
        """(3, 6) from a force in exciter axes to force and moment about the datum."""
        mount = self.rig.exciter
        assert mount is not None
        turn = rotation(mount)
        return np.asarray(np.concatenate([turn, skew(mount.position) @ turn]).T)

    def _judged(self, wrench: Array, slope: Array, pull: Array) -> tuple[float, Array]:
        spread = np.std(pull, axis=0)
        whole = float(np.sqrt(np.mean(spread**2)))
        noise = self.rig.noise.get("tension", 0.0)
        std = np.sqrt((ORDINARY * spread) ** 2 + (ACROSS * whole) ** 2 + noise**2)
        lines = self.lines.mean(axis=0)
        covariance = lines.T @ (std[:, None] ** 2 * lines)
        deviation = wrench - wrench.mean(axis=0)
        size = np.repeat(
            [np.mean(np.var(deviation[:, :3], axis=0)), np.mean(np.var(deviation[:, 3:], axis=0))], 3
        )
        covariance += np.diag(ACROSS**2 * size + 1e-12)
        sharp = np.linalg.inv(np.linalg.cholesky(covariance))
        slope = slope - slope.mean(axis=0)
        rows = (sharp @ slope).reshape(-1, slope.shape[2])
        miss = (deviation - slope[:, :, :10] @ self.guess) @ sharp.T
        sharpness = np.full(6, float(np.exp(np.mean(np.log(std / np.maximum(spread, TINY))))))
        # Least squares with gains need not be the likeliest: each reading chooses its level of ordinary error
        tried = [self._fitted(rows[:, :count], miss, sharpness) for count in (10, rows.shape[1])]
        return min(tried, key=lambda one: one[0])

    def _fitted(self, rows: Array, miss: Array, sharpness: Array) -> tuple[float, Array]:
        """Nats and what is left once the ten numbers, and gains where ``rows`` has them, are fitted."""
        gain_std = (self.share_std / self.share)[: rows.shape[1] - 10]
        # Samples are far more than independent observations: rest's word on the gains weighs as much more
        sure = 1.0 / gain_std**2 * max(1.0, len(miss) / INDEPENDENT)
        normal = rows.T @ rows + np.diag(np.concatenate([1.0 / self.guess_std**2, sure]))
        change = np.linalg.solve(normal, rows.T @ miss.reshape(-1))
        square = np.mean((miss - (rows @ change).reshape(-1, 6)) ** 2, axis=0)
        belief = 0.5 * float(np.sum(np.log1p((change[:10] / self.guess_std) ** 2)))
        belief += 0.5 * float(np.sum((change[10:] / gain_std) ** 2))
        return float(np.sum(nats(square, sharpness))) + belief, np.sqrt(square)


def _inertial_map(at: Trajectory, gravity: float) -> Array:
    """(N, 6, 10) wrench about the datum, body axes, per (m, h, Ixx, Ixy, Ixz, Iyy, Iyz, Izz)."""
    proper, rate, change = at.proper_acceleration(gravity), at.rate, at.rate_change
    out = np.zeros((rate.shape[0], 6, 10))
    turning = skew(rate)
    out[:, :3, 0] = proper
    out[:, :3, 1:4] = skew(change) + turning @ turning
    out[:, 3:, 1:4] = -skew(proper)
    out[:, 3:, 4:] = inertia_times(change) + turning @ inertia_times(rate)
    return out


def _guess(rig: Rig, hinges: Array, rest: RestFit) -> tuple[Array, Array]:
    """(10,) numbers about the datum of a body as large as its hinges that hangs as at rest, and their std."""
    span = max(float(np.ptp(hinges, axis=0).max()), 1e-3)
    center, center_std = rest.center_of_mass, np.minimum(rest.value("center")[1], span)
    mass, mass_std = rest.mass, rest.mass * np.hypot(SCALE, float(rest.value("mass")[1][0]))
    inertia = mass * (GYRATION * span) ** 2
    c = center
    about = mass * (c @ c * np.eye(3) - np.outer(c, c))[np.triu_indices(3)]
    guess = np.concatenate(
        [[mass], mass * c, np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0]) * 2.0 * inertia + about]
    )
    first = np.hypot(mass * np.hypot(center_std, CENTER * span), np.abs(c) * mass_std)
    off = np.maximum(mass * 2.0 * span * np.hypot(center_std, CENTER * span).max(), GUESSED * 2.0 * inertia)
    return guess, np.concatenate([[mass_std], first, np.full(6, off)])
