"""Four estimators on a case: (a) the thesis', (b) with gyroscopic term, (c) momentum, (d) this project's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.live.generalized_wrench import generalized_wrench
from rig_identification.thesis.case import Case
from rig_identification.thesis.estimators import InertiaFit, fit_euler_predictor, fit_momentum
from rig_identification.thesis.predictor import SEARCHES
from rig_identification.thesis_rerun.motion import CaseMotion
from rig_identification.thesis_rerun.output_error import TensorFit, fit_tensor

Array = NDArray[np.float64]

#: Motion that (d) is fitted to, s; (a) to (c) see the thesis' whole window.
FITTED = 20.0
#: Factors on the thesis' initial guess from which (d) is run as well.
FAR_OFF = (0.2, 5.0)


@dataclass(frozen=True)
class Comparison:
    """What each estimator makes of one case without noise."""

    thesis: dict[str, InertiaFit]  # (a) by search
    gyroscopic: InertiaFit  # (b)
    momentum: InertiaFit  # (c)
    output_error: TensorFit  # (d)
    far_off: dict[float, TensorFit]  # (d) by factor on the guess

    @property
    def searches_apart(self) -> float:
        """kg m^2 by which the searches of (a) differ at most."""
        found = np.array([fit.inertia for fit in self.thesis.values()])
        return float(np.max(np.ptp(found, axis=0)))

    @property
    def tensors(self) -> dict[str, Array]:
        """(3, 3) kg m^2 by letter; (a) is that of Gauss-Newton."""
        return {
            "a": self.thesis[SEARCHES[0]].inertia,
            "b": self.gyroscopic.inertia,
            "c": self.momentum.inertia,
            "d": self.output_error.inertia,
        }


def measured(motion: CaseMotion, samples: NDArray[np.int64]) -> tuple[Array, Array]:
    """(rate (k, 3) rad/s, moment about the centre of mass (k, 3) N m) along body axes at sampled nodes.

    The exciter's force is left out where the thesis leaves it out.
    """
    case = motion.case
    turn = Rotation.from_matrix(motion.R_world_body[samples]).as_quat()
    pose = np.concatenate([motion.position[samples], turn], axis=1)
    force = motion.force[samples] if case.force_measured else np.zeros((samples.size, 3))
    wrench = generalized_wrench(case.rig, pose, motion.tension[samples], force, case.center_of_mass)
    return motion.rate[samples], wrench[:, 3:]


def compare(motion: CaseMotion) -> Comparison:
    """Run the four estimators on the thesis' window of a case, from its initial guess."""
    case = motion.case
    rate, moment = measured(motion, motion.samples())
    guess = case.initial_guess
    thesis = {s: fit_euler_predictor(rate, moment, case.sampling, guess, search=s) for s in SEARCHES}
    momentum = fit_momentum(rate, moment, case.sampling)
    window = fitted_window(case)
    near, *far = (fit_tensor(motion, window, f * guess, momentum.inertia) for f in (1.0, *FAR_OFF))
    return Comparison(
        thesis,
        fit_euler_predictor(rate, moment, case.sampling, guess, gyroscopic=True),
        momentum,
        near,
        dict(zip(FAR_OFF, far, strict=True)),
    )


def fitted_window(case: Case) -> tuple[float, float]:
    """Window of (d), s: the first part of the thesis'."""
    first, last = case.window
    return first, min(last, first + FITTED)


def signed_error(case: Case, inertia: Array) -> Array:
    """(3, 3) as the thesis prints errors: percent of the true element, kg m^2 where that is zero."""
    true = case.inertia
    return np.asarray(
        np.where(true == 0.0, inertia - true, 100.0 * (inertia - true) / np.where(true == 0.0, 1.0, true))
    )


def worst_percent(case: Case, inertia: Array) -> float:
    """Largest error: percent of the element on the diagonal, of the smallest diagonal element off it."""
    diagonal = np.diag(case.inertia)
    scale = np.full((3, 3), diagonal.min())
    np.fill_diagonal(scale, diagonal)
    return float(np.max(np.abs(inertia - case.inertia) / scale) * 100.0)
