"""How far a wrench that follows the motion may bend the body, where no effect accounts for it.

A random wrench is believed to know nothing of the motion. Over half a minute its errors average out, and the
body's interval becomes as narrow as if nothing were left out. What a lab leaves out follows the motion
instead: a hose its displacement, a damper its velocity, a liquid its acceleration. The share of it that the
inertia can stand for does not average out.

So the wrench w of the fitted model, which is known (search/path.py), is believed to be
    w(t) = sum_j c_j u_j(t) + noise,    u: the body's acceleration, velocity, displacement (6 each), and 1,
with c_ij normal of zero mean and a variance of rms(w_i)^2 / rms(u_j)^2: any of the 19 may make all of it. The
recordings tell the c_ij as far as they can: their columns stand beside those of the model (Gauss and Markov).
Integrated out they widen the body's covariance by K S^-1 K', and would move it by K c; whether they do is not
known, so that the square of that counts as a variance as well (Brynjarsdottir and O'Hagan, Inverse Problems
30, 2014, on why a discrepancy needs a belief of its own to leave a parameter's interval honest).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.cautious import coherence
from rig_identification.estimate.observability import (
    GAIN,
    believed_std,
    inertial_estimate,
    with_products,
)
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import Linearised
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.sources import with_sources
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.opened import free_without
from rig_identification.mismatch.response import whitened_response
from rig_identification.model import layout
from rig_identification.result import ELEMENTS, InertialEstimate

Array = NDArray[np.float64]

#: Numbers of the motion that a wrench may follow: acceleration, velocity, displacement and a constant.
FOLLOWED = 19
#: Where the displacement stands among them.
DISPLACED = slice(12, 18)


def with_what_follows(problem: Problem, evaluation: Evaluation) -> InertialEstimate:
    """The ten numbers of a model with a discrepancy, whose wrench may follow the motion."""
    plain = inertial_estimate(problem, evaluation)
    base = free_without(problem, evaluation.point, evaluation, set(), 0)
    beyond = Beyond(evaluation, base, problem.bench.parameters.size)
    runs, rests = _columns(evaluation)
    columns = beyond.of(runs, rests)
    left = columns.information([*runs, *rests]) + np.eye(columns.right.size)
    bends = (
        problem.bench.parameters.elements_jacobian(evaluation.point.theta)
        @ (beyond.bent_by(columns)[:INERTIAL])
    )
    shift = bends @ np.linalg.solve(left, columns.right)
    loose = coherence(problem, evaluation)
    covariance = loose * plain.covariance + bends @ np.linalg.solve(left, bends.T) + np.outer(shift, shift)
    std = np.sqrt(np.diag(covariance))
    vague = {name for name, s, b in zip(ELEMENTS, std, believed_std(problem), strict=True) if s > GAIN * b}
    lost = with_products({*plain.unobservable, *vague})
    total = replace(plain, covariance=0.5 * (covariance + covariance.T), unobservable=lost)
    return with_sources(total, problem, evaluation, loose)


def _columns(evaluation: Evaluation) -> tuple[list[Array], list[Array]]:
    """(m, 6 FOLLOWED) of every run and of every rest: what a standard deviation of each c_ij does to it."""
    place = np.concatenate([run.motion.states[:, :3] for run in evaluation.runs]).mean(axis=0)
    turns = np.concatenate([run.motion.R_world_body for run in evaluation.runs])
    turn = Rotation.from_matrix(turns).mean().as_matrix()
    follows = [_followed(run, place, turn) for run in evaluation.runs]
    sizes = _rms(np.concatenate(follows))
    strength = _rms(np.concatenate([run.latent for run in evaluation.runs]))
    runs = [
        whitened_response(run, _each_way(u / sizes, strength), smooth=True)
        for run, u in zip(evaluation.runs, follows, strict=True)
    ]
    rests = []
    for rest in evaluation.rests:
        still = np.zeros(FOLLOWED)
        still[DISPLACED] = _displaced(rest.rest.state.position, rest.rest.state.R_world_body, place, turn)
        still[-1] = 1.0
        rests.append(np.asarray(rest.felt @ _each_way((still / sizes)[None], strength)[0]))
    return runs, rests


def _rms(values: Array) -> Array:
    """(c,) root mean square of each column; a column of nothing divides by one."""
    size = np.sqrt(np.mean(values**2, axis=0))
    return np.asarray(np.where(size > 0.0, size, 1.0))


def _each_way(follows: Array, strength: Array) -> Array:
    """(N, 6, 6 FOLLOWED) wrench in each direction, of its own strength, by each of what it ``follows``."""
    return np.asarray(np.einsum("ij,nk->nijk", np.diag(strength), follows).reshape(len(follows), 6, -1))


def _followed(run: Linearised, place: Array, turn: Array) -> Array:
    """(N, FOLLOWED) what a wrench may follow, body axes.

    Of the acceleration the part that the wrench makes itself is taken away: it is its effect and no cause.
    """
    motion = run.motion
    R, out = motion.R_world_body, motion.outputs
    own = np.einsum(
        "nij,nj->ni",
        motion.derivatives[3][:, layout.OUT_SPECIFIC_FORCE : layout.OUT_ANGULAR_ACCELERATION + 3],
        run.latent,
    )
    gravity = out[:, layout.OUT_GRAVITY : layout.OUT_GRAVITY + 3]
    linear = out[:, layout.OUT_SPECIFIC_FORCE : layout.OUT_SPECIFIC_FORCE + 3] + gravity
    angular = out[:, layout.OUT_ANGULAR_ACCELERATION : layout.OUT_ANGULAR_ACCELERATION + 3]
    velocity = np.einsum("nji,nj->ni", R, motion.states[:, layout.VELOCITY : layout.VELOCITY + 3])
    rate = motion.states[:, layout.RATE : layout.RATE + 3]
    displaced = _displaced(motion.states[:, :3], R, place, turn)
    accelerated = np.concatenate([linear, angular], axis=1) - own
    return np.concatenate([accelerated, velocity, rate, displaced, np.ones((len(rate), 1))], axis=1)


def _displaced(position: Array, R_world_body: Array, place: Array, turn: Array) -> Array:
    """(..., 6) displacement and rotation vector against a mean pose, its axes."""
    turned = Rotation.from_matrix(turn.T @ R_world_body).as_rotvec()
    return np.concatenate([(position - place) @ turn, turned], axis=-1)
