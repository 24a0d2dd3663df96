"""The joint information of body and doubts at the end of a fit (joint.py)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from rig_identification.estimate.observability import believed_std
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.joint import Doubt, JointInformation, Weighing
from rig_identification.model.definite import definite
from rig_identification.recording import Session
from rig_identification.rig import Mount, Rig

Array = NDArray[np.float64]

#: Devices whose places on the body a description tells.
MOUNTED = ("imu", "inclinometer", "exciter", "mocap")


def joint_information(session: Session, problem: Problem, evaluation: Evaluation) -> JointInformation:
    """What the fit of a session knows of body and doubts together, its start states integrated out.

    The root of the information is handed on instead of a covariance: a direction of which the recordings
    tell nothing has no variance that a number could hold, and a root keeps twice the digits.
    """
    parameters = problem.bench.parameters
    theta = evaluation.point.theta
    in_elements = np.linalg.inv(parameters.elements_jacobian(theta))  # d log-Cholesky / d elements
    to_theta = block_diag(in_elements, np.eye(parameters.size - INERTIAL))
    root = np.linalg.qr(_root(evaluation.information, parameters.size) @ to_theta, mode="r")
    off = (theta[:INERTIAL] - problem.weak_center) / problem.weak**2
    scale = None if problem.mass is None else Weighing(*map(float, problem.mass))
    return JointInformation(
        elements=parameters.elements(theta),
        doubts=tuple(
            Doubt(q.name, q.unit, q.nominal, q.prior_std, float(at))
            for q, at in zip(parameters.free, theta[INERTIAL:], strict=True)
        ),
        root=np.asarray(root),
        weak=in_elements.T @ np.diag(problem.weak**-2) @ in_elements,
        weak_gradient=in_elements.T @ off,
        belief=believed_std(problem),
        weighing=scale,
        frame=session.rig.frame,
        ceiling={cable.name: np.asarray(cable.ceiling_point, dtype=float) for cable in session.rig.cables},
        mounts=_mounts(session.rig),
        start_ns=min((recording.start_ns for recording in session.recordings), default=0),
    )


def _root(information: Array, kept: int) -> Array:
    """(kept, kept) R: R^T R is the information on the first ``kept`` unknowns, the others integrated out.

    With the others first R^T is the last block of the Cholesky factor (model/definite.py, integrated_out).
    """
    order = np.roll(np.arange(information.shape[0]), -kept)
    scale = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))[order]
    factor = np.linalg.cholesky(definite(information[np.ix_(order, order)] / np.outer(scale, scale)))
    return np.asarray((scale[-kept:, None] * factor[-kept:, -kept:]).T)


def _mounts(rig: Rig) -> dict[str, Array]:
    placed = {name: getattr(rig, name) for name in MOUNTED}
    return {
        name: np.concatenate([mount.position, mount.orientation])
        for name, mount in placed.items()
        if isinstance(mount, Mount)
    }
