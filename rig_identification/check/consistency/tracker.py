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
from rig_identification.model.so3 import skew
from rig_identification.rig import Rig

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
            attitudes = self._attitudes(None, q)
            nats = self._by_cables(np.hstack([d, q]), np.array(attitudes))
            return min(float(one) + slanted(R) for one, R in zip(nats, attitudes, strict=True))
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

    def _by_cables(self, z: Array, R: Array) -> Array:
        """(h,) nats for attitudes R (h, 3, 3): what stretches the cables, the marker's arm fitted to each.

        z: (N, 6) displacement and turn, tracker axes. All that is left is linear in them: their moments do.
        """
        whole_turn = np.zeros((len(R), 6, 6))
        whole_turn[:, :3, :3] = whole_turn[:, 3:, 3:] = R
        mean = z.mean(axis=0) @ whole_turn  # (h, 6), world axes
        square = np.swapaxes(whole_turn, 1, 2) @ (z.T @ z / len(z)) @ whole_turn  # (h, 6, 6)
        hinges = np.array([c.body_point for c in self.rig.cables]) @ self.R0.T
        span = np.array([c.ceiling_point for c in self.rig.cables]) - self.position - hinges
        unit = span / np.linalg.norm(span, axis=1, keepdims=True)
        stretch = np.concatenate([unit, np.cross(hinges, unit)], axis=1)  # (n, 6)
        by_arm = -np.swapaxes(skew(unit), 1, 2)  # (n, 3, 3): stretch by the arm's axes times the turn
        turned = square[:, 3:]
        rows = np.einsum("nka,hab,nlb->hkl", by_arm, turned[:, :, 3:], by_arm) * len(z)
        right = np.einsum("nka,hab,nb->hk", by_arm, turned, stretch) * len(z)
        miss = np.mean(mean @ stretch.T, axis=1)
        spread = np.sqrt(np.maximum(np.mean(_forms(stretch, square), axis=1) - miss**2, 0.0))
        arm = self._arms(rows, right, spread)
        left = np.tile(stretch, (len(R), 1, 1))
        left[:, :, 3:] -= np.einsum("hk,nka->hna", arm, by_arm)
        moved, turn = (float(np.trace(square[0, part, part])) for part in (slice(0, 3), slice(3, 6)))
        whole = float(np.sqrt((moved + turn * np.mean(hinges**2)) / 3.0))
        blur = self._second_order(moved, turn, hinges, np.linalg.norm(span, axis=1))
        return self._missed(_forms(left, square) + blur**2, np.full(len(unit), whole), self._floor(0))

    @staticmethod
    def _second_order(moved: float, turn: float, hinges: Array, length: Array) -> Array:
        """(n,) m: what a cable keeps of its length in the second order, which rows of the first order lack.

        A hinge that moves by s lies on a sphere, s^2/2L off its tangent; a turn by q brings a point at h
        q^2 h/2 back. Less than this no pose is known to miss: a body on two parallel cables, whose motion
        hardly stretches them in the first order, would be judged by it alone. moved, turn: mean squares.
        """
        arm = np.linalg.norm(hinges, axis=1)
        return np.asarray(0.5 * ((moved + turn * arm**2) / length + turn * arm))

    def _arm_of(self, rows: Array, miss: Array) -> Array:
        normal, right = (rows.T @ rows)[None], (rows.T @ miss)[None]
        return np.asarray(self._arms(normal, right, np.array([np.std(miss)]))[0])

    def _arms(self, normal: Array, right: Array, spread: Array) -> Array:
        """(h, 3) m, least squares held near the datum. normal: (h, 3, 3); right: (h, 3); spread: (h,)."""
        span = max(float(np.ptp([c.body_point for c in self.rig.cables], axis=0).max()), 0.1)
        weight = (ORDINARY * np.maximum(spread, FLOOR[0])) ** -2.0
        held = normal * weight[:, None, None] + np.eye(3) / (REACH * span) ** 2
        return np.asarray(np.linalg.solve(held, (right * weight[:, None])[:, :, None])[:, :, 0])

    def _nats(self, left: Array, spread: Array) -> float:
        """Nats by which ``left`` (N, 6), displacements and turns, is missed."""
        floor = np.repeat([self._floor(0), self._floor(1)], 3)
        return float(self._missed(np.mean(left**2, axis=0)[None], spread, floor)[0])

    def _floor(self, part: int) -> float:
        """Smallest displacement (m) or turn (rad) that tells anything."""
        noise = self.rig.noise.get(("mocap_position", "mocap_orientation")[part], 0.0)
        return max(FLOOR[part], noise)

    @staticmethod
    def _missed(square: Array, spread: Array, floor: Array | float) -> Array:
        """(h,) nats of mean squares (h, k) that are left of readings of std ``spread`` (k,)."""
        whole = np.sqrt(np.mean(spread**2))
        std = np.sqrt(floor**2 + (ORDINARY * spread) ** 2 + (ACROSS * whole) ** 2)
        sharpness = std / np.maximum(spread, TINY)
        return np.array([float(np.sum(nats(one / std**2, sharpness))) for one in square])


def _forms(rows: Array, square: Array) -> Array:
    """(h, n) mean squares of rows (n, 6), or (h, n, 6), times what has second moments (h, 6, 6)."""
    return np.asarray(np.sum((rows @ square) * rows, axis=2))


def slanted(R: Array) -> float:
    """Nats by which a tracker's z axis is not up. R: (3, 3) world vectors into tracker axes."""
    tilt = float(np.arccos(np.clip(R[2, 2], -1.0, 1.0)))
    return 0.5 * INDEPENDENT * float(np.log1p((tilt / LEVEL) ** 2))
