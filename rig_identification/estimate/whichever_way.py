"""What a body's heading leaves open where motion capture with an undescribed marker is all that sees it.

A tracker whose marker is described, a load cell of a named cable, an IMU, an inclinometer or an exciter with
a mount know how the body is turned; a marker that may sit anyhow does not. In a rig that falls on itself
under a turn S (symmetry.py) the body is then one of several: its centre of mass turned about the middle h of
the hinges, its inertia tensor with it,

    c' = h + S (c - h),    J' = S J S^T.

Rigs are regular within tolerances, and whether a turned one fits as well is told to first order without
another fit. Seen from the body, turning it is to describe its rig otherwise: hinge i where S^T brings the one
that falls on it. Of a Gaussian likelihood under the priors N(0, T) and N(d, T) of what the rig is off,

    log(p_d / p_0) = d^T T^-1 e - d^T (T^-1 - T^-1 C T^-1) d / 2

with the posterior N(e, C) that the fit has under the first. What no recording tells of (C = T) costs nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from rig_identification.estimate.first_guess import rest_of
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.mixture import weights
from rig_identification.estimate.observability import invert_information
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.symmetry import Turn, turns
from rig_identification.model.body import six_elements, tensor
from rig_identification.result import ELEMENTS, InertialEstimate

Array = NDArray[np.float64]

#: Factor on a std from which it is said that other headings make it wider.
WIDER = 1.5


def only_seen(problem: Problem) -> bool:
    """Whether motion capture with an undescribed marker is all that knows how the body is turned."""
    devices = {c.device for run in problem.runs for c in run.channels}
    driven = any(run.force is not None for run in problem.runs)
    at_rest = {c.device for rest in problem.rests for c in rest.channels} - {"mocap"}
    return problem.bench.rig.mocap is None and devices == {"mocap"} and not driven and not at_rest


def turned(estimate: InertialEstimate, turn: Turn) -> InertialEstimate:
    """What the ten numbers are of the body turned."""
    values = estimate.values.copy()
    values[1:4] = turn.middle + turn.R @ (values[1:4] - turn.middle)
    values[4:] = six_elements(turn.R @ tensor(values[4:]) @ turn.R.T)
    # J -> S J S^T on six elements, column by column
    columns = np.stack([six_elements(turn.R @ tensor(e) @ turn.R.T) for e in np.eye(6)], axis=1)
    map_ = block_diag(1.0, turn.R, columns)
    return replace(estimate, values=values, covariance=np.asarray(map_ @ estimate.covariance @ map_.T))


def lead(problem: Problem, evaluation: Evaluation, turn: Turn) -> float:
    """Nats by which the rig as fitted is likelier than turned; fewer where more than noise is left."""
    free = problem.bench.parameters.free
    d = np.array([turn.off.get(p.name, 0.0) / p.prior_std for p in free])
    rig = slice(INERTIAL, INERTIAL + len(free))
    e = evaluation.point.theta[rig]
    C = invert_information(evaluation.information)[rig, rig]
    return float(0.5 * (d @ d - d @ C @ d) - d @ e) / max(1.0, misfit(evaluation))


def whichever_way(
    problem: Problem, evaluation: Evaluation, estimate: InertialEstimate
) -> tuple[InertialEstimate, str]:
    """The estimate, its intervals holding the body of each heading that fits as well, and what to say of it.

    The values stay those of the smaller turn of the tracker: a lab lays its axes along the room's as far as
    it can. How often it does not nobody knows, so each heading has its share of the interval.
    """
    if not only_seen(problem):
        return estimate, ""
    model = model_at(problem.bench.parameters, evaluation.point.theta)
    up = rest_of(model).R_world_body[2]
    ways = turns(problem.bench.rig, up)
    share = weights([lead(problem, evaluation, turn) for turn in ways])[1:]
    covariance = estimate.covariance.copy()
    for turn, weight in zip(ways, share, strict=True):
        other = turned(estimate, turn)
        apart = other.values - estimate.values
        covariance += weight * (other.covariance - estimate.covariance + np.outer(apart, apart))
    wider = np.sqrt(np.diag(covariance) / np.diag(estimate.covariance))
    names = [n for n, w in zip(ELEMENTS, wider, strict=True) if w > WIDER and n not in estimate.unobservable]
    if not names:
        return estimate, ""
    angles = ", ".join(f"{np.degrees(turn.angle):.0f}" for turn in ways)
    note = (
        f"The tracker's marker is not described, and turned about the vertical by {angles} degrees the rig "
        f"looks alike: no recording tells in which of these headings the body hangs. The smallest turn of "
        f"the tracker's axes against the room's is taken; the intervals of {', '.join(names)} cover all. "
        f"Give the marker's pose (mocap) in the rig description to settle it."
    )
    return replace(estimate, covariance=covariance), note
