"""One state for everything a set of static recordings depends on, and its exact slopes.

The state holds the centre of mass and the mass, each recording's pose and tensions, and the
errors of what the lab believes about the rig, each in units of its tolerance. The balance of
every recording constrains it; inclinations, tensions, the scale and the beliefs measure it.

Anchored, two vague beliefs join them that hold for any body on any rig: its centre of mass is
within the hinges' span of their middle, a tension within the weight of an even share. They
keep directions that nothing measures from running away, and show by how little the posterior
is narrower which those are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.model.so3 import skew
from rig_identification.rig import Rig
from rig_identification.statics.balance import Suspension, balance, hinge_stiffness, spans
from rig_identification.statics.equilibrium import hanging_mass
from rig_identification.statics.observation import StaticObservation, mount

Array = NDArray[np.float64]

SHARPEST_ANGLE = 1e-7  # rad; a standard error of zero is taken to be this
SHARPEST_PART = 1e-7  # of the weight or the mass, likewise


@dataclass(frozen=True)
class StaticState:
    """A point of the adjustment."""

    center_of_mass: Array  # (3,) m, body
    mass: float  # kg
    position: Array  # (k, 3) m
    attitude: Array  # (k, 3, 3)
    tension: Array  # (k, n) in weights of all that hangs
    beliefs: Array  # errors of the description in units of their tolerance


@dataclass(frozen=True)
class Believed:
    """The rig with the beliefs' errors put in."""

    suspension: Suspension
    inclinometer: Array  # (3, 3) rotates inclinometer-frame vectors into body
    gain: Array  # (n,) 1
    zero: Array  # (n,) N


class StaticModel:
    """Residuals and constraints of a rig's static recordings (thesis section 2.2, n cables)."""

    def __init__(self, rig: Rig, observations: tuple[StaticObservation, ...], anchored: bool = False) -> None:
        self.rig = rig
        self.anchored = anchored
        self.observations = observations
        self.cables = len(rig.cables)
        self.nominal = Suspension.of(rig)
        self.mount = mount(rig).as_matrix()
        n, tol = self.cables, rig.tolerance
        blocks = [
            ("length", n, tol["cable_length"]),
            ("ceiling", 3 * n, tol["hinge_position"]),
            ("body", 3 * n, tol["hinge_position"]),
            ("level", 2, tol["level"]),
            ("inclinometer", 3, tol["inclinometer_orientation"]),
            ("gain", n, tol["load_cell_gain"]),
            ("zero", n, tol["load_cell_zero"]),
        ]
        self.belief: dict[str, slice] = {}
        start = 0
        for name, count, _ in blocks:
            self.belief[name] = slice(start, start + count)
            start += count
        self.tolerance = np.concatenate([np.full(count, value) for _, count, value in blocks])
        self.first_belief = 4 + len(observations) * (6 + n)
        self.size = self.first_belief + start

    @property
    def span(self) -> float:
        """m, the longest side of the box about the body's hinges."""
        return float(np.ptp(self.nominal.body, axis=0).max())

    def pose_columns(self, k: int) -> slice:
        """Position and rotation vector of recording ``k`` in a step."""
        start = 4 + k * (6 + self.cables)
        return slice(start, start + 6)

    def tension_columns(self, k: int) -> slice:
        """Tensions of recording ``k`` in a step."""
        start = self.pose_columns(k).stop
        return slice(start, start + self.cables)

    def belief_columns(self, name: str) -> slice:
        """Errors of one kind of belief in a step."""
        block = self.belief[name]
        return slice(self.first_belief + block.start, self.first_belief + block.stop)

    def believed(self, state: StaticState) -> Believed:
        """The rig as the state has it."""
        error = self.tolerance * state.beliefs
        ceiling = self.nominal.ceiling + error[self.belief["ceiling"]].reshape(-1, 3)
        level = np.append(error[self.belief["level"]], 0.0)
        turn = Rotation.from_rotvec(error[self.belief["inclinometer"]]).as_matrix()
        return Believed(
            Suspension(
                ceiling + np.cross(level, self.nominal.ceiling),
                self.nominal.body + error[self.belief["body"]].reshape(-1, 3),
                self.nominal.length + error[self.belief["length"]],
            ),
            turn @ self.mount,
            error[self.belief["gain"]],
            error[self.belief["zero"]],
        )

    def move(self, state: StaticState, step: Array) -> StaticState:
        """Apply a step; the mass moves in parts of itself, attitudes turn by rotation vectors."""
        position, attitude, tension = state.position.copy(), state.attitude.copy(), state.tension.copy()
        for k in range(len(self.observations)):
            pose = step[self.pose_columns(k)]
            position[k] += pose[:3]
            attitude[k] = Rotation.from_rotvec(pose[3:]).as_matrix() @ attitude[k]
            tension[k] += step[self.tension_columns(k)]
        return replace(
            state,
            center_of_mass=state.center_of_mass + step[:3],
            mass=state.mass * np.exp(step[3]),
            position=position,
            attitude=attitude,
            tension=tension,
            beliefs=state.beliefs + step[self.first_belief :],
        )

    def constraints(self, state: StaticState) -> tuple[Array, Array]:
        """Lengths and balance of every recording, and their slopes."""
        rig = self.believed(state)
        parts = [self._balance(state, rig, k) for k in range(len(self.observations))]
        return np.concatenate([p[0] for p in parts]), np.vstack([p[1] for p in parts])

    def residuals(self, state: StaticState) -> tuple[Array, Array]:
        """Measurements and beliefs in units of their standard deviations, and their slopes."""
        rig = self.believed(state)
        rows = [self._inclination(state, rig, k) for k in range(len(self.observations))]
        rows += [self._tension(state, rig, k) for k in range(len(self.observations))]
        rows.append(self._scale(state))
        slope = np.zeros((len(state.beliefs), self.size))
        slope[:, self.first_belief :] = np.eye(len(state.beliefs))
        rows.append((state.beliefs, slope))
        if self.anchored:
            rows.append(self.anchor(state))
        return np.concatenate([r[0] for r in rows]), np.vstack([r[1] for r in rows])

    def _balance(self, state: StaticState, rig: Believed, k: int) -> tuple[Array, Array]:
        n = self.cables
        attitude, tension = state.attitude[k], state.tension[k]
        total, arm = hanging_mass(state.mass, state.center_of_mass, self.observations[k].dummy)
        at = balance(rig.suspension, arm, state.position[k], attitude, tension)
        slope = np.zeros((n + 6, self.size))
        slope[:, self.pose_columns(k)] = at.pose_slope
        slope[:, self.tension_columns(k)] = at.tension_slope
        # The weight's moment is z x (R arm); its share of the arm is what the body weighs.
        weight = skew(np.array([0.0, 0.0, 1.0])) @ attitude
        slope[n + 3 :, :3] = weight * (state.mass / total)
        slope[n + 3 :, 3] = weight @ (state.center_of_mass - arm) * (state.mass / total)
        self._believed_slopes(slope, state, rig.suspension, k)
        return at.residual, slope

    def _believed_slopes(self, slope: Array, state: StaticState, suspension: Suspension, k: int) -> None:
        n = self.cables
        attitude, tension = state.attitude[k], state.tension[k]
        arms, _, distance, unit = spans(suspension, state.position[k], attitude)
        stiffness = hinge_stiffness(distance, unit, tension)
        pull = tension[:, None] * unit
        ceiling = np.zeros((n + 6, n, 3))
        body = np.zeros((n + 6, n, 3))
        for i in range(n):
            ceiling[i, i] = unit[i]
            ceiling[n : n + 3, i] = stiffness[i]
            ceiling[n + 3 :, i] = skew(arms[i]) @ stiffness[i]
            # A body hinge that moves carries its cable along and changes the arm of the pull.
            body[:, i] = -ceiling[:, i] @ attitude
            body[n + 3 :, i] -= skew(pull[i]) @ attitude
        level = np.einsum("rij,ijk->rk", ceiling, -skew(self.nominal.ceiling))[:, :2]
        lengths = np.vstack([-np.eye(n), np.zeros((6, n))])
        for name, columns in (
            ("length", lengths),
            ("ceiling", ceiling.reshape(n + 6, -1)),
            ("body", body.reshape(n + 6, -1)),
            ("level", level),
        ):
            slope[:, self.belief_columns(name)] = columns * self.tolerance[self.belief[name]]

    def _inclination(self, state: StaticState, rig: Believed, k: int) -> tuple[Array, Array]:
        seen = self.observations[k]
        up = state.attitude[k][2]
        axes = rig.inclinometer[:, :2].T
        sine = axes @ up
        steep = 1.0 / np.sqrt(1.0 - sine**2)
        slope = np.zeros((2, self.size))
        pose = self.pose_columns(k)
        vertical = np.array([0.0, 0.0, 1.0])
        slope[:, pose.start + 3 : pose.stop] = steep[:, None] * np.cross(axes @ state.attitude[k].T, vertical)
        turn = steep[:, None] * np.cross(axes, up)
        slope[:, self.belief_columns("inclinometer")] = turn * self.tolerance[self.belief["inclinometer"]]
        measured = np.isfinite(seen.inclination)
        weight = 1.0 / np.maximum(seen.inclination_std[measured], SHARPEST_ANGLE)
        error = np.arcsin(sine[measured]) - seen.inclination[measured]
        return weight * error, weight[:, None] * slope[measured]

    def _tension(self, state: StaticState, rig: Believed, k: int) -> tuple[Array, Array]:
        seen = self.observations[k]
        extra = 0.0 if seen.dummy is None else seen.dummy.mass
        weight = (state.mass + extra) * self.rig.gravity
        pull = weight * state.tension[k]
        slope = np.zeros((self.cables, self.size))
        slope[:, self.tension_columns(k)] = np.diag(weight * (1.0 + rig.gain))
        slope[:, 3] = (1.0 + rig.gain) * state.tension[k] * state.mass * self.rig.gravity
        slope[:, self.belief_columns("gain")] = np.diag(pull * self.tolerance[self.belief["gain"]])
        slope[:, self.belief_columns("zero")] = np.diag(self.tolerance[self.belief["zero"]])
        measured = np.isfinite(seen.tension)
        sharp = 1.0 / np.maximum(seen.tension_std[measured], SHARPEST_PART * weight)
        unit = spans(rig.suspension, state.position[k], state.attitude[k])[3]
        carried = pull + self.rig.cable_weight_at_cells(unit[:, 2])
        error = ((1.0 + rig.gain) * carried + rig.zero)[measured] - seen.tension[measured]
        return sharp * error, sharp[:, None] * slope[measured]

    def anchor(self, state: StaticState) -> tuple[Array, Array]:
        """The two vague beliefs as residuals, and their slopes."""
        middle = self.nominal.body.mean(axis=0)
        center = np.zeros((3, self.size))
        center[:, :3] = np.eye(3) / self.span
        rows = [((state.center_of_mass - middle) / self.span, center)]
        for k in range(len(self.observations)):
            slope = np.zeros((self.cables, self.size))
            slope[:, self.tension_columns(k)] = np.eye(self.cables)
            rows.append((state.tension[k] - 1.0 / self.cables, slope))
        return np.concatenate([r[0] for r in rows]), np.vstack([r[1] for r in rows])

    def _scale(self, state: StaticState) -> tuple[Array, Array]:
        if self.rig.mass is None:
            return np.zeros(0), np.zeros((0, self.size))
        std = max(self.rig.mass_std or 0.0, SHARPEST_PART * self.rig.mass)
        slope = np.zeros((1, self.size))
        slope[0, 3] = state.mass / std
        return np.array([(state.mass - self.rig.mass) / std]), slope
