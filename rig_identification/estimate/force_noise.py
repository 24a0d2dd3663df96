"""What noise drives the model with: the error of the exciter's force, and wrenches that the model lacks.

A force that is a line from node to node (sampling.py) errs anew in every interval: six numbers w_k, the
wrench held over it. One that is smooth (smooth_force.py) errs by what is smooth as well, white up to some
frequency c (band_limited.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.band_limited import POLES, shaping
from rig_identification.estimate.evidence import Run
from rig_identification.estimate.parameters import ParameterSet
from rig_identification.estimate.sampling import NodeInput
from rig_identification.model import layout

Array = NDArray[np.float64]

#: No row: noise of a node that has no part in the next one's.
WHITE = np.zeros((0, 0))


@dataclass(frozen=True)
class Discrepancy:
    """A wrench on the body that the model lacks, as noise: force and moment about the datum, body axes.

    Each component is a first-order Markov process of its own (Ornstein-Uhlenbeck): of a constant standard
    deviation, forgotten with the time constant ``correlation``. A body at rest feels one draw of it.
    """

    force: float  # std, N
    moment: float  # std, N m
    correlation: float  # s

    @property
    def covariance(self) -> Array:
        """(6, 6) at any instant."""
        return np.diag([self.force**2] * 3 + [self.moment**2] * 3)


@dataclass(frozen=True)
class RandomWrench:
    """Numbers at each node that are noise, and what they do; whitening.py has how they are drawn.

    w of them: a wrench that is another one at each node, or the state of what filters the force's noise.
    """

    Q: Array  # (N or fewer, w, w) covariance of what each node draws, the last one also after it
    follow: Array  # (f, f) how each component of a force goes on; of no rows: all is drawn anew
    through: Array  # (N, X, w) response of the next node's state
    felt: Array  # (m, w) response of each row
    wrench: Array  # (6, w) response of the wrench at a node


def exciter_wrench_map(parameters: ParameterSet, theta: Array) -> Array:
    """(6, 3): wrench about the datum, body axes, of a force in the exciter frame."""
    physics = parameters.physics(theta)
    position = physics[layout.EXCITER_POSITION : layout.EXCITER_POSITION + 3]
    turn = Rotation.from_rotvec(physics[layout.EXCITER_ROTATION : layout.EXCITER_ROTATION + 3]).as_matrix()
    force = turn @ parameters.model.exciter_orientation
    return np.concatenate([force, np.cross(position, force.T).T])


def random_wrench(
    run: Run,
    parameters: ParameterSet,
    theta: Array,
    B: Array,
    D: Array,
    felt: Array | None,
    extra: Array | None = None,
    discrepancy: Discrepancy | None = None,
) -> RandomWrench:
    """What the error of a run's force does.

    B (N, X, 6), D (m, 6): response of the next state, and of each row, to the wrench of an interval. felt
    (m,): std of the noise that a row feels at once, in that of an interval's; None where a wrench that really
    acts is among it, which reaches every row as it is. extra (6, 6): covariance of such a one over each
    interval. discrepancy: such a one that goes on.
    """
    if discrepancy is not None:
        white = _of_intervals(run, parameters, theta)
        return _going_on(discrepancy, white if extra is None else white + extra, run.grid.step, B, D)
    if felt is None or run.force is None or run.force.cutoff == 0.0:
        Q = _of_intervals(run, parameters, theta)
        at_once = D if felt is None else felt[:, None] * D
        return RandomWrench(Q if extra is None else Q + extra, WHITE, B, at_once, np.eye(6))
    spread = exciter_wrench_map(parameters, theta)
    follow, reads = shaping(run.force.cutoff, run.grid.step)
    begun = _variance(run, run.force, parameters, theta) * np.eye(3 * POLES)
    carried = np.kron(follow, np.eye(3))
    # Midway to the next node all but what is drawn there is known
    midway = 0.5 * (reads + reads @ follow)
    return RandomWrench(
        np.stack([begun, begun - carried @ begun @ carried.T]),
        follow,
        np.ascontiguousarray(B @ np.kron(midway, spread)),
        np.ascontiguousarray(D @ np.kron(reads, spread)),
        np.asarray(np.kron(reads, spread)),
    )


def _going_on(discrepancy: Discrepancy, white: Array, step: float, B: Array, D: Array) -> RandomWrench:
    """A discrepancy, and a wrench of covariance ``white`` (N, 6, 6) that is another one in each interval."""
    kept = float(np.exp(-step / discrepancy.correlation))
    Q = np.zeros((white.shape[0], 12, 12))
    Q[:, :6, :6] = (1.0 - kept**2) * discrepancy.covariance
    Q[0, :6, :6] = discrepancy.covariance
    Q[:, 6:, 6:] = white
    return RandomWrench(
        Q,
        np.diag([kept, kept, 0.0, 0.0]),
        np.ascontiguousarray(np.concatenate([B, B], axis=2)),
        np.ascontiguousarray(np.concatenate([D, D], axis=1)),
        np.concatenate([np.eye(6), np.zeros((6, 6))], axis=1),
    )


def _variance(run: Run, force: NodeInput, parameters: ParameterSet, theta: Array) -> float:
    """Variance (N2) of each component that the samples' noise has over an interval of a run's ``force``.

    Where a low-pass is undone the noise of the force's rate is added.
    """
    tau = parameters.device(theta)[parameters.places.lag("exciter")]
    mean = run.exciter_noise**2 / (run.exciter_rate * run.grid.step)
    return float(mean * (1.0 + tau**2 * force.rate_noise))


def _of_intervals(run: Run, parameters: ParameterSet, theta: Array) -> Array:
    """(N, 6, 6) covariance of the wrench held over each node interval that the force's error stands for.

    Three errors: the samples' noise, the moment of a jump, which lies anywhere between two nodes, and what
    the force did where it was not sampled.
    """
    out = np.zeros((run.grid.nodes, 6, 6))
    if run.force is None or (run.exciter_noise == 0.0 and not np.any(run.force.doubt)):
        return out
    spread = exciter_wrench_map(parameters, theta)
    noise = _variance(run, run.force, parameters, theta)
    out[:] = (noise + run.force.doubt)[:, None, None] * (spread @ spread.T)
    jumps = spread @ run.force.jumps[:, :, None]
    # Where a jump's moment is uniform over an interval, its impulse varies by jump^2 step^2 / 12
    return np.asarray(out + jumps @ jumps.transpose(0, 2, 1) / 12.0)
