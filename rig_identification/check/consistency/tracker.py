"""How well a tracker's poses agree with the motion that the other devices tell, or with the cables alone.

For a marker that is not described: it may sit anywhere on the body. (Where it is described, the poses are
readings of the motion like any other, :mod:`measured`.) A tracker has a frame of its own, fixed to the room:
any proper rotation of it is allowed. With d the marker's displacement and q the body's turn from their
means, in tracker axes, and R the tracker's attitude in the world:

    other devices tell the motion     q = R q_w            d = R (x_w + q_w x m)
    cables alone                      u_i . (R' d) + (R' q) . ((a_i - m) x u_i) = 0

R by Wahba's problem, all turns about its main axis tried where the motion turns about one axis only; the
marker's arm m by least squares. What is left is judged as any reading is (:mod:`motion`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.measured import ACROSS, FEWEST_POSES, ORDINARY, TINY, seen
from rig_identification.check.consistency.motion import INDEPENDENT, nats
from rig_identification.check.consistency.trajectory import Trajectory
from rig_identification.rig import Rig
from rig_identification.statics.balance import skew

Array = NDArray[np.float64]

#: Smallest motion that tells anything: m and rad.
FLOOR = (0.002, 0.002)
#: Headings tried about an axis that the motion leaves open.
HEADINGS = 24
#: A tracker's z axis points upwards within this, rad: one that was levelled by hand.
LEVEL = 0.1
#: A marker lies within the hinges' span of the datum.
REACH = 1.0


@dataclass(frozen=True)
class TrackerModel:
    """A tracker beside one run's motion."""

    rig: Rig
    position: Array  # (3,) m, rest place of the datum
    R0: Array  # (3, 3) rest attitude
    motion: Trajectory | None  # as the other devices tell it; None: they do not

    def cost(self, poses: Array) -> float:
        """Nats by which poses (N, 7) disagree."""
        known = seen(poses)
        if np.count_nonzero(known) < FEWEST_POSES:
            return 0.0
        poses = poses[known]
        d = poses[:, :3] - poses[:, :3].mean(axis=0)
        turns = Rotation.from_quat(poses[:, 3:])
        middle = turns.mean()
        q = (turns * middle.inv()).as_rotvec()
        if self.motion is None:
            return min(self._by_cables(d, q, R) for R in self._attitudes(None, q))
        x, w = self._world(known)
        return min(self._by_motion(d, q, x, w, R) for R in self._attitudes(w, q))

    def _world(self, known: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Displacement of the datum and turn from their means, world axes."""
        assert self.motion is not None
        x = self.motion.position[known]
        turns = Rotation.from_matrix(self.motion.R[known])
        return x - x.mean(axis=0), (turns * turns.mean().inv()).as_rotvec()

    def _attitudes(self, w: Array | None, q: Array) -> list[Array]:
        """(3, 3) candidates of the tracker's attitude: world vectors into tracker axes."""
        headings = 2.0 * np.pi * np.arange(HEADINGS) / HEADINGS
        if w is None:
            ups = [
                Rotation.identity(),
                *(Rotation.from_rotvec(0.5 * np.pi * s * a) for a in np.eye(3)[:2] for s in (1, -1)),
            ]
            ups.append(Rotation.from_rotvec([np.pi, 0.0, 0.0]))
            return [(up * Rotation.from_rotvec([0, 0, h])).as_matrix() for up in ups for h in headings]
        left, _, right = np.linalg.svd(q.T @ w)
        proper = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
        R = left @ proper @ right
        return [R @ Rotation.from_rotvec(h * right[0]).as_matrix() for h in headings]

    def _by_motion(self, d: Array, q: Array, x: Array, w: Array, R: Array) -> float:
        """Nats for one attitude, the marker's arm fitted."""
        moved = d @ R
        arm = self._arm_of(skew(w).reshape(-1, 3), (moved - x).reshape(-1))
        left = np.concatenate([moved - x - np.cross(w, arm), q @ R - w], axis=1)
        spread = np.concatenate([np.std(d @ R, axis=0), np.std(q @ R, axis=0)])
        return self._nats(left, spread) + slanted(R)

    def _by_cables(self, d: Array, q: Array, R: Array) -> float:
        """Nats for one attitude: what stretches the cables."""
        moved, turn = d @ R, q @ R
        hinges = np.array([c.body_point for c in self.rig.cables]) @ self.R0.T
        span = np.array([c.ceiling_point for c in self.rig.cables]) - self.position - hinges
        unit = span / np.linalg.norm(span, axis=1, keepdims=True)
        stretch = moved @ unit.T + turn @ np.cross(hinges, unit).T
        rows = np.cross(unit[None], turn[:, None, :])  # (N, n, 3): by the marker's arm
        arm = self._arm_of(rows.reshape(-1, 3), stretch.reshape(-1))
        left = stretch - rows @ arm
        whole = float(np.sqrt(np.mean(moved**2) + np.mean(turn**2) * np.mean(hinges**2)))
        blur = self._second_order(moved, turn, hinges, np.linalg.norm(span, axis=1))
        return self._nats(left, np.full(unit.shape[0], whole), blur) + slanted(R)

    @staticmethod
    def _second_order(moved: Array, turn: Array, hinges: Array, length: Array) -> Array:
        """(n,) m: what a cable keeps of its length in the second order, which rows of the first order lack.

        A hinge that moves by s lies on a sphere, s^2/2L off its tangent; a turn by q brings a point at h
        q^2 h/2 back. Less than this no pose is known to miss: a body on two parallel cables, whose motion
        hardly stretches them in the first order, would be judged by it alone.
        """
        arm = np.linalg.norm(hinges, axis=1)
        turned = np.mean(np.sum(turn**2, axis=1))
        swing = np.mean(np.sum(moved**2, axis=1)) + turned * arm**2
        return np.asarray(0.5 * (swing / length + turned * arm))

    def _arm_of(self, rows: Array, miss: Array) -> Array:
        span = max(float(np.ptp([c.body_point for c in self.rig.cables], axis=0).max()), 0.1)
        reach = REACH * span
        std = ORDINARY * max(float(np.std(miss)), FLOOR[0])
        normal = rows.T @ rows / std**2 + np.eye(3) / reach**2
        return np.asarray(np.linalg.solve(normal, rows.T @ miss / std**2))

    def _nats(self, left: Array, spread: Array, blur: Array | float = 0.0) -> float:
        """Nats by which ``left`` is missed. blur: error of the model itself, beside what is left."""
        floor = np.repeat(FLOOR, [3, left.shape[1] - 3]) if left.shape[1] == 6 else FLOOR[0]
        noise = (self.rig.noise.get("mocap_position", 0.0), self.rig.noise.get("mocap_orientation", 0.0))
        floor = np.maximum(floor, np.repeat(noise, [3, 3]) if left.shape[1] == 6 else noise[0])
        whole = np.sqrt(np.mean(spread**2))
        std = np.sqrt(floor**2 + (ORDINARY * spread) ** 2 + (ACROSS * whole) ** 2)
        return float(
            np.sum(nats((np.mean(left**2, axis=0) + blur**2) / std**2, std / np.maximum(spread, TINY)))
        )


def slanted(R: Array) -> float:
    """Nats by which a tracker's z axis is not up. R: (3, 3) world vectors into tracker axes."""
    tilt = float(np.arccos(np.clip(R[2, 2], -1.0, 1.0)))
    return 0.5 * INDEPENDENT * float(np.log1p((tilt / LEVEL) ** 2))
