"""How well gyroscope, accelerometer, inclinometer, tracker and cables agree on one motion of a rigid body.

Pose over time is a cubic spline in place and turn, six numbers a knot. Every reading is a function of it
that needs neither mass nor inertia (:mod:`measured`), with R = R0 exp(q), w = q' - q x q' / 2 + ..., from the
rest pose (x0, R0). Least squares with a free constant
for each reading (zeros, biases and lengths belong to rest). What a model without left-out
physics may ordinarily miss is ``ORDINARY`` of each reading's own variation; correlated over the
whole run, so that a reading counts as ``INDEPENDENT`` observations however often it was sampled.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.consistency.measured import ORDINARY, Measured, mean
from rig_identification.check.consistency.reduced import Reduced
from rig_identification.check.consistency.spline import Block, Spline
from rig_identification.check.consistency.trajectory import Trajectory
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Levels of ordinary error that a session may have.
LEVELS = (1.0, 0.3, 0.1)
#: Independent observations that one reading of one run stands for: the order of the swings in it.
INDEPENDENT = 10.0
#: A pose leaves rest by so much, where no reading holds it: share of the cables' length, and rad.
AWAY = 0.2
#: rad; a rotation vector beyond half a turn stands for another attitude, and no body hangs so.
UPSIDE_DOWN = np.pi
#: Fits settle in fewer steps; one that improves by less than a tenth of a nat has settled.
STEPS, SETTLED = 8, 0.1
#: Share of a step that is taken where no whole one pays.
SHORTER = 0.5


@dataclass(frozen=True)
class MotionFit:
    """The best motion and what it leaves of each reading."""

    cost: Mapping[str, float]  # block -> nats
    trajectory: Trajectory
    left: Mapping[str, Array]  # block -> (w,) rms of what is left over the reading's own ordinary error

    @property
    def total(self) -> float:
        """Nats by which the motion fails to explain all blocks."""
        return sum(self.cost.values())


def nats(square: Array, sharpness: Array) -> Array:
    """Nats by which readings miss, from mean squares in units of their ordinary error.

    How large the ordinary error is in this session is not known: it is the one of ``LEVELS`` of
    :data:`ORDINARY` that explains what is left best. Where all else agrees to a hundredth, a reading
    that misses by a tenth is told; where everything misses by a half, it is not. The likelihood of a reading
    has heavy tails: log1p.

    sharpness: ordinary error over the spread of the reading itself. It makes this the likelihood of
    what was recorded, whatever unit a hypothesis gives it: a reading that is scaled down until it
    vanishes beside its floor explains nothing.
    """
    level = np.asarray(LEVELS)[:, None] ** 2
    each = np.log1p(square / level) + np.log(level / LEVELS[-1] ** 2)
    return np.asarray(0.5 * INDEPENDENT * (each.min(axis=0) + 2.0 * np.log(sharpness / ORDINARY)))


class MotionModel:
    """Readings of one run as functions of the body's motion."""

    def __init__(self, rig: Rig, run: Reduced, position: Array, R0: Array) -> None:
        self.rig, self.run = rig, run
        self.position, self.R0 = position, R0
        self.measured = Measured.of(rig)
        length = float(np.mean([c.length for c in rig.cables]))
        self.spline = Spline(run.time.size, run.kernel, AWAY * np.repeat([length, 1.0], 3))

    def at_rest(self) -> Trajectory:
        """No motion at all."""
        zero = np.zeros((self.run.time.size, 3))
        place = np.tile(self.position, (self.run.time.size, 1))
        return Trajectory(place, zero, zero, zero, zero, zero, self.R0)

    def once(self, values: Mapping[str, Array], about: Trajectory) -> MotionFit:
        """One step from a trajectory, judged where it ends."""
        return self.at(values, self._stepped(self._blocks(about, values), about))

    def settled(self, values: Mapping[str, Array], about: Trajectory | None = None) -> MotionFit:
        """Fit the motion to readings by device (N, width), linearised after each step until it settles.

        From rest a large swing is overshot at first: a step that doubles the cost or more is taken all the
        same, and the best motion of all is kept. Where no such step pays, shorter ones are taken.
        """
        at = about or self.at_rest()
        best = self._settled(values, at, 1.0, STEPS)
        if best.trajectory is not at:
            return best
        shorter = self._settled(values, at, SHORTER, int(STEPS / SHORTER))
        return min(best, shorter, key=lambda fit: fit.total)

    def _settled(self, values: Mapping[str, Array], at: Trajectory, share: float, steps: int) -> MotionFit:
        """The best motion of so many steps, of each of which a ``share`` is taken."""
        best: MotionFit | None = None
        for _ in range(steps + 1):
            blocks = self._blocks(at, values)
            seen = self._looked_at(blocks, at)
            if best is not None and (not np.isfinite(seen.total) or _upside_down(at)):
                break
            gained = np.inf if best is None else best.total - seen.total
            if best is None or gained > 0.0:
                best = seen
            if -best.total < gained < SETTLED and share == 1.0:
                break
            at = self._stepped(blocks, at, share)
        assert best is not None
        return best

    def _stepped(self, blocks: list[Block], at: Trajectory, share: float = 1.0) -> Trajectory:
        try:
            q, v, a = self.spline.solve(blocks)[0]
            return self._moved(at, (share * q, share * v, share * a))
        except (np.linalg.LinAlgError, ValueError):  # a motion that has left every bound has no next step
            return at

    def at(self, values: Mapping[str, Array], at: Trajectory) -> MotionFit:
        """What a trajectory leaves of the readings, each reading's constant taken off."""
        return self._looked_at(self._blocks(at, values), at)

    def _looked_at(self, blocks: list[Block], at: Trajectory) -> MotionFit:
        return self._judged(blocks, {b.name: b.miss - _constant(b) for b in blocks}, at)

    def _judged(self, blocks: list[Block], left: Mapping[str, Array], at: Trajectory) -> MotionFit:
        cost, remains = {}, {}
        for block in blocks:
            square = mean(left[block.name] ** 2) / block.std**2
            known = np.isfinite(square)
            square = np.where(known, square, 0.0)
            cost[block.name] = float(np.sum(nats(square, block.std / block.spread)[known]))
            remains[block.name] = np.sqrt(square)
        return MotionFit(cost, at, remains)

    def _moved(self, at: Trajectory, change: tuple[Array, Array, Array]) -> Trajectory:
        q, v, a = change
        return Trajectory(
            at.position + q[:, :3], at.velocity + v[:, :3], at.acceleration + a[:, :3],
            at.turn + q[:, 3:], at.turn_rate + v[:, 3:], at.turn_change + a[:, 3:], at.R0,
        )  # fmt: skip

    def _blocks(self, at: Trajectory, values: Mapping[str, Array]) -> list[Block]:
        return self.measured.blocks(at, values)


def _upside_down(at: Trajectory) -> bool:
    return bool(np.max(np.abs(at.turn)) > UPSIDE_DOWN)


def _constant(block: Block) -> Array:
    """(w,) the constant that a reading is off by, held by what is believed of it."""
    weight = np.isfinite(block.miss).sum(axis=0) / block.std**2
    return np.asarray(mean(block.miss) * weight / (weight + 1.0 / block.constant_std**2))
