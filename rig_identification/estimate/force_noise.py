"""What noise drives the model with: the error of the exciter's force, and random wrenches.

A force that is a line from node to node (sampling.py) errs anew in every interval: six numbers w_k, the
wrench held over it. One that is smooth (smooth_force.py) errs by what is smooth as well, white up to some
frequency c. Here that is a line from draw to draw of three numbers u_j, the force's components, 1/(2 c)
apart, whose power at f is that of white noise times sinc(f / 2c)^4: two thirds at half of c, a sixth
at c, and a thousandth from twice c on, where a ceiling that rings at fifty times the power of all else would
answer to hundredths of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.parameters import ParameterSet
from rig_identification.model import layout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RandomWrench:
    """Six numbers a node that are noise, and what they do; whitening.py has how they are drawn."""

    Q: Array  # (N, 6, 6) covariance of what each node draws
    each: int  # nodes from draw to draw
    through: Array  # (N, X, 6) response of the next node's state
    felt: Array  # (m, 6) response of each row
    wrench: Array  # (N, 6, 6) response of the wrench at each node


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
    node: NDArray[np.int64],
    felt: Array | None,
    extra: Array | None = None,
) -> RandomWrench:
    """What the error of a run's force does.

    B (N, X, 6), D (m, 6): response of the next state, and of each row, to the wrench of an interval. node
    (m,): of each row. felt (m,): std of the noise that a row feels at once, in that of an interval's; None
    where a wrench that really acts is among it, which reaches every row as it is. extra (6, 6): covariance of
    such a one over each interval.
    """
    if felt is None or run.force is None or run.force.held == 1:
        Q = _of_intervals(run, parameters, theta)
        each = np.tile(np.eye(6), (run.grid.nodes, 1, 1))
        at_once = D if felt is None else felt[:, None] * D
        return RandomWrench(Q if extra is None else Q + extra, 1, B, at_once, each)
    held = run.force.held
    spread = exciter_wrench_map(parameters, theta)
    along = (np.arange(run.grid.nodes) % held) / held
    between = along + 0.5 / held
    through = B @ spread
    rows, at = D @ spread, along[node, None]
    ways = np.tile(spread, (run.grid.nodes, 1, 1))
    return RandomWrench(
        np.tile(_variance(run, parameters, theta, held) * np.eye(6), (run.grid.nodes, 1, 1)),
        held,
        _two(through, between[:, None, None]),
        _two(rows, at),
        _two(ways, along[:, None, None]),
    )


def _two(ways: Array, along: Array) -> Array:
    """Responses (..., 3) to one draw as (..., 6) to the mean of two, ``along`` the way to the second one."""
    return np.ascontiguousarray(np.concatenate([(1.0 - along) * ways, along * ways], axis=-1))


def _variance(run: Run, parameters: ParameterSet, theta: Array, held: int) -> float:
    """Variance (N2) of each component that the samples' noise has over ``held`` nodes.

    Where a low-pass is undone the noise of the force's rate is added.
    """
    if run.force is None:
        return 0.0
    tau = parameters.device(theta)[parameters.places.lag("exciter")]
    apart = held * run.grid.step
    return float(run.exciter_noise**2 / (run.exciter_rate * apart) * (1.0 + tau**2 * run.force.rate_noise))


def _of_intervals(run: Run, parameters: ParameterSet, theta: Array) -> Array:
    """(N, 6, 6) covariance of the wrench held over each node interval that the force's error stands for.

    Three errors: the samples' noise, the moment of a jump, which lies anywhere between two nodes, and what
    the force did where it was not sampled.
    """
    out = np.zeros((run.grid.nodes, 6, 6))
    if run.force is None or (run.exciter_noise == 0.0 and not np.any(run.force.doubt)):
        return out
    spread = exciter_wrench_map(parameters, theta)
    noise = _variance(run, parameters, theta, 1)
    out[:] = (noise + run.force.doubt)[:, None, None] * (spread @ spread.T)
    jumps = spread @ run.force.jumps[:, :, None]
    # Where a jump's moment is uniform over an interval, its impulse varies by jump^2 step^2 / 12
    return np.asarray(out + jumps @ jumps.transpose(0, 2, 1) / 12.0)
