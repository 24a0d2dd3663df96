"""Every way a body can hang: the equations of :mod:`balance` solved from starts all around.

Two searches share one solver. With the mass's place known, all six coordinates and the
tensions are free (the thesis' case generator). With two inclinations known instead, position,
heading and the tensions are free and the two moments about the horizontal axes, in which
alone the unknown centre of mass appears, are left out (thesis section 2.2.3). Both systems
have as many equations as unknowns for any number of cables: the balance of forces and of the
moment about the vertical completes the pose where fewer than four lengths cannot.

No start is asked for: headings all round the circle are tried at once, as one batch of
Levenberg-Marquardt iterations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.statics.balance import Suspension, balance, is_stable, undetermined_tensions

Array = NDArray[np.float64]

ITERATIONS = 200
EXACT = 1e-10  # largest residual of a solution, m or weights
SAME_POSE = 1e-4  # m and rad: two solutions closer than this are one


@dataclass(frozen=True)
class HangingPose:
    """One solution of the balance."""

    position: Array  # (3,) m, body origin in world
    attitude: Array  # (3, 3) rotates body vectors into world
    tension: Array  # (n,) in weights of all that hangs
    misfit: float  # largest residual, m or weights
    stable: bool  # every small motion that the cables allow raises the body; False where not known
    undetermined_tensions: int  # combinations of tensions that the balance leaves open

    @property
    def taut(self) -> bool:
        """Whether every cable pulls."""
        return bool(np.all(self.tension > 0.0))


def poses_with_known_mass(suspension: Suspension, arm_of_mass: Array) -> tuple[HangingPose, ...]:
    """All balanced poses of a body whose centre of mass (3,) m, body, is known; lowest first."""
    tilts = np.vstack([np.zeros(3), 0.4 * np.vstack([np.eye(3)[:2], -np.eye(3)[:2]])])
    upright = Rotation.from_rotvec(tilts).as_matrix()
    starts = np.concatenate([_turned(upright, heading) for heading in _headings(12)])
    found = _solve(suspension, arm_of_mass, starts, known_inclination=False, tolerance=EXACT)
    poses = [_hanging(suspension, arm_of_mass, *solution) for solution in found]
    return tuple(sorted(poses, key=lambda pose: float(pose.position[2] + (pose.attitude @ arm_of_mass)[2])))


def poses_with_known_inclination(
    suspension: Suspension, up: Array, tolerance: float
) -> tuple[HangingPose, ...]:
    """All poses in which the body's unit vector ``up`` (3,), body, points upwards.

    ``tolerance`` (m) is by how much lengths may miss: measured inclinations and described
    lengths fit one another only so far where cables are redundant.
    """
    level = Rotation.align_vectors(np.array([[0.0, 0.0, 1.0]]), up[None])[0].as_matrix()
    starts = np.concatenate([_turned(level[None], heading) for heading in _headings(48)])
    found = _solve(suspension, np.zeros(3), starts, known_inclination=True, tolerance=tolerance)
    return tuple(_hanging(suspension, None, *solution) for solution in found)


def _headings(count: int) -> Array:
    return np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)


def _turned(attitudes: Array, heading: float) -> Array:
    return np.asarray(Rotation.from_rotvec([0.0, 0.0, heading]).as_matrix() @ attitudes)


@dataclass(frozen=True)
class _Batch:
    """Many trial poses at once, with the equations' values there."""

    position: Array  # (K, 3)
    attitude: Array  # (K, 3, 3)
    tension: Array  # (K, n)
    residual: Array  # (K, rows)
    slope: Array  # (K, rows, unknowns)

    @property
    def cost(self) -> Array:
        return np.asarray(np.sum(self.residual**2, -1))

    def chosen(self, mine: NDArray[np.bool_], other: _Batch) -> _Batch:
        """Mine where ``mine``, else the other's."""
        fields = []
        for name in ("position", "attitude", "tension", "residual", "slope"):
            here = getattr(self, name)
            mask = mine.reshape((-1,) + (1,) * (here.ndim - 1))
            fields.append(np.where(mask, here, getattr(other, name)))
        return _Batch(*fields)


class _System:
    """The equations in the unknowns of one of the two searches."""

    def __init__(self, suspension: Suspension, arm_of_mass: Array, known_inclination: bool) -> None:
        cables = len(suspension.length)
        self.suspension, self.arm = suspension, arm_of_mass
        self.rows = np.arange(cables + 6)
        self.free = np.arange(6)
        if known_inclination:
            self.rows = np.delete(self.rows, [cables + 3, cables + 4])
            self.free = np.array([0, 1, 2, 5])

    def at(self, position: Array, attitude: Array, tension: Array) -> _Batch:
        found = balance(self.suspension, self.arm, position, attitude, tension)
        slope = np.concatenate([found.pose_slope[..., self.free], found.tension_slope], -1)
        return _Batch(position, attitude, tension, found.residual[:, self.rows], slope[:, self.rows])

    def moved(self, batch: _Batch, step: Array) -> _Batch:
        turn = np.zeros((len(step), 3))
        turn[:, self.free[3:] - 3] = step[:, 3 : len(self.free)]
        return self.at(
            batch.position + step[:, :3],
            Rotation.from_rotvec(turn).as_matrix() @ batch.attitude,
            batch.tension + step[:, len(self.free) :],
        )


def _solve(
    suspension: Suspension, arm_of_mass: Array, attitude: Array, known_inclination: bool, tolerance: float
) -> list[tuple[Array, Array, Array, float]]:
    """Levenberg-Marquardt on every start at once; returns the distinct solutions."""
    system = _System(suspension, arm_of_mass, known_inclination)
    cables = len(suspension.length)
    even = np.full((len(attitude), cables), 1.0 / cables)
    batch = system.at(_below_the_ceiling(suspension, attitude), attitude, even)
    damping = np.full(len(attitude), 1e-3)
    for _ in range(ITERATIONS):
        step = _damped_step(batch.residual, batch.slope, damping)
        trial = system.moved(batch, step)
        better = trial.cost < batch.cost
        batch = trial.chosen(better, batch)
        damping = np.clip(np.where(better, 0.2 * damping, 5.0 * damping), 1e-15, 1e6)
        settled = np.abs(step).max(-1) < 1e-13
        if np.all((batch.cost < EXACT**2 * 1e-4) | settled | (damping >= 1e6)):
            break
    misfit = np.abs(batch.residual).max(-1)
    good = np.flatnonzero(misfit < tolerance)
    order = good[np.argsort(misfit[good])]
    return _distinct(
        [(batch.position[k], batch.attitude[k], batch.tension[k], float(misfit[k])) for k in order]
    )


def _damped_step(residual: Array, slope: Array, damping: Array) -> Array:
    """(K, q) steps, no longer than half a radian or half a metre."""
    transposed = np.swapaxes(slope, -1, -2)
    normal = transposed @ slope
    scale = np.einsum("kii->ki", normal).mean(-1)
    normal = normal + (damping * scale)[:, None, None] * np.eye(normal.shape[-1])
    step = -np.linalg.solve(normal, transposed @ residual[..., None])[..., 0]
    longest = np.abs(step).max(-1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, 0.5 / np.maximum(longest, 1e-300)))


def _below_the_ceiling(suspension: Suspension, attitude: Array) -> Array:
    """(K, 3) positions that put the hinges' centre a cable's height below that of the ceiling."""
    middle = attitude @ suspension.body.mean(0)
    aside = suspension.ceiling - suspension.ceiling.mean(0) - (suspension.body - suspension.body.mean(0))
    drop = np.mean(np.sqrt(np.maximum(suspension.length**2 - np.sum(aside[:, :2] ** 2, 1), 0.01)))
    return np.asarray(suspension.ceiling.mean(0) - np.array([0.0, 0.0, drop]) - middle)


def _distinct(found: list[tuple[Array, Array, Array, float]]) -> list[tuple[Array, Array, Array, float]]:
    """Drop what repeats a better solution; what misses by much is only known that well."""
    kept: list[tuple[Array, Array, Array, float]] = []
    for one in found:
        same = max(SAME_POSE, 20.0 * one[3])
        gaps = [max(np.abs(one[0] - other[0]).max(), np.abs(one[1] - other[1]).max()) for other in kept]
        if all(gap > same for gap in gaps):
            kept.append(one)
    return kept


def _hanging(
    suspension: Suspension, arm: Array | None, position: Array, attitude: Array, tension: Array, misfit: float
) -> HangingPose:
    cables = len(tension)
    at = balance(suspension, np.zeros(3) if arm is None else arm, position, attitude, tension)
    stable = arm is not None and is_stable(at, cables)
    return HangingPose(position, attitude, tension, misfit, stable, undetermined_tensions(at, cables))
