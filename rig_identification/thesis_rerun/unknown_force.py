"""Cases 3 and 4: the exciter's force is not measured, so it is estimated with its time history.

What the accelerometer feels beyond the cables' pull is the force, m f - sum(T), at its known
mount; with its moment added, the momentum regression gives a first tensor. Then the force is a
random input with a wide white prior, held over each node interval. The fit integrates it out
(estimate/whitening.py); a smoother says what it was, the motion is linearised about that, and so
on until the tensor stays. What is left to tell the tensor is the moment about the mount.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.force_noise import exciter_wrench_map
from rig_identification.estimate.prediction import smoothed
from rig_identification.estimate.sampling import Grid, group_by_node
from rig_identification.estimate.solve import Point, solve
from rig_identification.live.generalized_wrench import generalized_wrench
from rig_identification.model.body import tensor
from rig_identification.model.motion import on_cables
from rig_identification.thesis.estimators import fit_momentum
from rig_identification.thesis_rerun.motion import CaseMotion
from rig_identification.thesis_rerun.output_error import (
    nearest_body,
    noise_free_run,
    state_at,
    tensor_problem,
)

Array = NDArray[np.float64]

#: Prior of each component of the force over one node interval, N.
FORCE_STD = 500.0
#: Rounds of fitting and smoothing, and the change of the tensor, a part of it, that ends them.
ROUNDS, UNCHANGED = 4, 1e-5


@dataclass(frozen=True)
class UnknownForceFit:
    """Tensor and force that explain the recordings."""

    inertia: Array  # (3, 3) kg m^2
    converged: bool
    rounds: int
    time: Array  # (N,) s
    force: Array  # (N, 3) N, body axes, estimated
    true_force: Array  # (N, 3) N, body axes

    @property
    def force_rms(self) -> float:
        """N, of the force's error over all components."""
        return float(np.sqrt(np.mean((self.force - self.true_force) ** 2)))


def fit_with_unknown_force(motion: CaseMotion, window: tuple[float, float]) -> UnknownForceFit:
    """Fit tensor and force to a window, s. No guess is needed."""
    case = motion.case
    run = _at_sampling_rate(noise_free_run(motion, window, force=False), case.sampling)
    felt, rough = _felt_force(motion, window)
    problem, theta = tensor_problem(motion, (run,), nearest_body(rough))
    parameters = problem.bench.parameters
    spread = exciter_wrench_map(parameters, theta)
    problem = replace(problem, extra_noise=FORCE_STD**2 * spread @ spread.T)
    latent = _held(felt[: run.grid.nodes]) @ spread.T
    point = Point(theta, (state_at(motion, window[0]),), (), (latent,))
    before, converged, rounds = rough, False, 0
    while rounds < ROUNDS and not converged:
        rounds += 1
        evaluation, settled = solve(problem, point, iterations=6, tolerance=1e-3)
        found = tensor(parameters.elements(evaluation.point.theta)[4:])
        latent = latent + smoothed(evaluation.runs[0])[1]
        converged = settled and bool(np.max(np.abs(found - before)) < UNCHANGED * np.max(found))
        before = found
        starts = tuple(on_cables(motion.model, s) for s in evaluation.point.starts)
        point = replace(evaluation.point, starts=starts, latents=(latent,))
    force = np.linalg.lstsq(spread, latent.T, rcond=None)[0].T
    true = _held(motion.force[motion.samples(window)][: run.grid.nodes])
    time = run.grid.step * np.arange(run.grid.nodes, dtype=float)
    return UnknownForceFit(found, converged, rounds, time, force, true)


def _at_sampling_rate(run: Run, sampling: float) -> Run:
    """The run on nodes as far apart as its samples: a force between two of them has one value."""
    grid = Grid(sampling, round(run.grid.duration / sampling) + 1)
    channels = []
    for channel in run.channels:
        group, node = group_by_node(grid, channel.time)
        channels.append(replace(channel, group=group, node=node))
    return replace(run, grid=grid, channels=tuple(channels), force=None, exciter_noise=0.0)


def _felt_force(motion: CaseMotion, window: tuple[float, float]) -> tuple[Array, Array]:
    """Force (k, 3) N, body axes, at the samples, and the tensor (3, 3) of the momentum regression with it."""
    case, samples = motion.case, motion.samples(window)
    turn = Rotation.from_matrix(motion.R_world_body[samples]).as_quat()
    pose = np.concatenate([motion.position[samples], turn], axis=1)
    none = np.zeros((samples.size, 3))
    cables = generalized_wrench(case.rig, pose, motion.tension[samples], none, case.center_of_mass)
    force = case.mass * motion.specific_force[samples] - cables[:, :3]
    moment = cables[:, 3:] + np.cross(case.force.point - case.center_of_mass, force)
    return force, fit_momentum(motion.rate[samples], moment, case.sampling).inertia


def _held(force: Array) -> Array:
    """(N, 3) mean over each interval."""
    return np.concatenate([0.5 * (force[1:] + force[:-1]), force[-1:]])
