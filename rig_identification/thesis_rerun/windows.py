"""Case 5: from which instant on do the recordings still tell the tensor?

The thesis starts 990 identifications one sample later each, all of which end with the last
sample. (a) is run on each as it stands. For (d) the motion is linearised once; since the start
state of a window is free, a window's equations are the rows of its samples in the columns of
tensor and start state of the whole, so that running sums of normal equations hold them all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import linearise_run
from rig_identification.model.body import (
    complex_step_jacobian,
    elements_from_linear,
    linear_from_log_cholesky,
)
from rig_identification.thesis.estimators import fit_euler_predictor
from rig_identification.thesis.predictor import tensor
from rig_identification.thesis_rerun.comparison import measured
from rig_identification.thesis_rerun.motion import STEP, CaseMotion
from rig_identification.thesis_rerun.output_error import (
    HELD_ENTRIES,
    noise_free_run,
    state_at,
    tensor_problem,
)

Array = NDArray[np.float64]

WINDOWS = 990
#: Percent, of the smallest diagonal element off the diagonal, within which an element counts as told.
TOLD = 1.0


@dataclass(frozen=True)
class ConvergenceMap:
    """One row a window, by the instant at which it starts."""

    start: Array  # (w,) s
    thesis: Array  # (w, 3, 3) kg m^2, by (a)
    thesis_converged: NDArray[np.bool_]  # (w,)
    output_error: Array  # (w, 3, 3) kg m^2, by (d), without noise
    output_error_std: Array  # (w, 3, 3) kg m^2, of (d) under the sensors' noise

    def statement(self, true: Array) -> str:
        """What the map shows; true (3, 3) kg m^2."""
        scale = np.full((3, 3), np.diag(true).min())
        np.fill_diagonal(scale, np.diag(true))
        off = (self.thesis - true, self.output_error - true, self.output_error_std)
        first, second, std = (np.max(np.abs(each) / scale, axis=(1, 2)) * 100.0 for each in off)
        known = self.start[std < TOLD]
        until = f"up to the one that starts at {known[-1]:.2f} s" if known.size else "in none"
        settled, within = np.count_nonzero(self.thesis_converged), np.count_nonzero(first < TOLD)
        return (
            f"Of {self.start.size} windows, each begun a sample later, (a) converges in {settled} and keeps "
            f"every element within {TOLD:g} percent in {within}; (d) errs by at most {np.max(second):.1g} "
            f"percent in all. Under the sensors' noise σ of every element of (d) is below {TOLD:g} percent "
            f"{until}: what a short window lacks is samples to average noise over, not equations."
        )


def convergence_map(motion: CaseMotion, near: Array, every: int = 1) -> ConvergenceMap:
    """Windows of case 5, one in ``every``. near (3, 3) kg m^2: tensor about which (d) is linearised."""
    case = motion.case
    rate, moment = measured(motion, motion.samples())
    found, converged = [], []
    for first in range(0, WINDOWS, every):
        fit = fit_euler_predictor(rate[first:], moment[first:], case.sampling, case.initial_guess)
        found.append(fit.inertia)
        converged.append(fit.converged)
    start = case.sampling * np.arange(0, WINDOWS, every, dtype=float)
    tensors, stds = _output_error(motion, near, start)
    return ConvergenceMap(start, np.array(found), np.array(converged), tensors, stds)


def _output_error(motion: CaseMotion, near: Array, start: Array) -> tuple[Array, Array]:
    """(tensors, standard deviations) (w, 3, 3) of one Gauss-Newton step a window."""
    case = motion.case
    run = noise_free_run(motion, case.window)
    problem, theta = tensor_problem(motion, (run,), near)
    lin = linearise_run(problem.bench, run, theta, state_at(motion, case.window[0]))
    if lin is None:
        raise FloatingPointError("case 5: the motion of the tensor near the truth leaves every bound")
    free = [k for k in range(lin.jacobian.shape[1]) if k not in HELD_ENTRIES]
    columns, inertial = lin.jacobian[:, free], INERTIAL - len(HELD_ENTRIES)
    # Rows of a jump's neighbours hold what no fit can follow: how the force rose within a node interval
    calm = np.min(np.abs(lin.nodes[:, None] - motion.jumps[None]), axis=1) > 1
    in_elements = complex_step_jacobian(
        lambda t: elements_from_linear(linear_from_log_cholesky(t)), theta[:INERTIAL]
    )
    in_elements = in_elements[4:, [k for k in range(INERTIAL) if k not in HELD_ENTRIES]]
    about = problem.bench.parameters.elements(theta)[4:]
    tensors, stds = [], []
    for instant in start:
        rows = (lin.nodes >= round(instant / STEP)) & calm
        scale = np.maximum(np.linalg.norm(columns[rows], axis=0), 1e-12)
        left, values, right = np.linalg.svd(columns[rows] / scale, full_matrices=False)
        kept = values > 1e-9 * values[0]
        inverse = (right[kept].T / values[kept]) / scale[:, None]
        step = inverse @ (left[:, kept].T @ lin.residual[rows])
        spread = in_elements @ inverse[:inertial]
        std = np.sqrt(np.sum(spread**2, axis=1))
        # A direction that no sample tells is not known at all
        if not np.all(kept):
            lost = np.abs(in_elements @ (right[~kept].T / scale[:, None])[:inertial]).max(axis=1)
            std = np.where(lost > 1e-6, np.inf, std)
        tensors.append(tensor(about + in_elements @ step[:inertial]))
        stds.append(_symmetric(std))
    return np.array(tensors), np.array(stds)


def _symmetric(six: Array) -> Array:
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
