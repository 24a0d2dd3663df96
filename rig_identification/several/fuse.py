"""One body seen by several sessions: one estimate, with what they share counted once.

Each session's posterior, less its priors, is what its recordings say of body and doubts: a quadratic form

    f_i(z_i) = 1/2 (z_i - z^_i)' D_i (z_i - z^_i) + g_i' (z_i - z^_i),
    D_i = R_i' R_i - P_i,    g_i = -(gradient of the priors at z^_i),

for at the optimum z^_i the gradients of recordings and priors add to nothing. A doubt is p = a s + b f with
s shared and f new (ties.py). The sum over the sessions, with the prior N(0, 1) of every s and f and every
weighing once, is least at the estimate; the inverse of its second derivative is the covariance. It is what a
joint fit of all recordings finds, to first order about the sessions' own optima. What is new in each session
is integrated out before the sum, so that the sum has ten unknowns and the shared ones.

A weighted mean of the sessions' ten numbers is less: a session that tells a shared gain well helps the
other's ten numbers, and a mean knows nothing of that. What neither session determines alone, two poses may
determine together.

What an answer's covariance holds beyond its fit's own, E_i (rivals, traces), is an error e_i of that session.
How the e_i of one rig are correlated is not known. With the gains W_i of the estimate,

    (sum W_i e_i)(sum W_i e_i)' <= n sum W_i e_i e_i' W_i'    (Cauchy and Schwarz),

so n sum W_i E_i W_i' bounds the variance whatever their correlation is: such errors do not average away.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from rig_identification.errors import InputError
from rig_identification.estimate.observability import GAIN
from rig_identification.estimate.without_frame import vehicle_alone
from rig_identification.joint import JointInformation, Weighing
from rig_identification.model.definite import definite, integrated_out
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.rig import CarryingFrame
from rig_identification.several.compare import Comparison, compare
from rig_identification.several.session_result import SessionResult
from rig_identification.several.ties import Sharing, Ties, ties

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fused:
    """One body from several sessions."""

    total: InertialEstimate
    without_frame: InertialEstimate | None
    comparison: Comparison
    gain: dict[str, float]  # std of the best single session over the fused one, by element


@dataclass(frozen=True)
class Reduced:
    """What one session says of the body and of the shared numbers, all else integrated out."""

    keys: tuple[Hashable, ...]
    information: Array  # (10 + S, 10 + S), priors of body and shared numbers not in it
    pull: Array  # (10 + S,) information times optimum
    excess: Array  # (10, 10)


def fuse(results: Sequence[SessionResult], sharing: Sharing | None = None) -> Fused:
    """The one body behind several sessions.

    Raises
    ------
    InputError
        The sessions' carrying frames differ, so that the ten numbers are not of one body.
    """
    frame = _one_frame(results)
    found = ties(results, sharing)
    parts = [reduced(result, found, i) for i, result in enumerate(results)]
    keys: dict[Hashable, int] = {}
    for part in parts:
        for key in part.keys:
            keys.setdefault(key, 10 + len(keys))
    information, pull = _summed(parts, keys)
    scales = {r.joint.weighing for r in results if r.joint is not None}
    data = information.copy()
    for scale in scales - {None}:
        _weigh(data, pull, scale)
    information = data.copy()
    first = next((r.joint for r in results if r.joint is not None), None)
    if first is not None:
        information[:10, :10] += first.weak
        pull[:10] += first.weak @ first.elements - first.weak_gradient
    root = root_of_inverse(information)
    covariance = root.T @ root
    values = (covariance @ pull)[:10]
    spread = covariance[:10, :10] + _together(parts, keys, covariance, found)
    total = InertialEstimate(values, spread, unobservable(results, data))
    return Fused(total, vehicle_alone(total, frame), compare(results, sharing), _gain(results, total))


def reduced(result: SessionResult, found: Ties, i: int) -> Reduced:
    """Session i as information on body and shared numbers."""
    joint = result.joint
    if joint is None:
        seen = np.ix_(result.observed, result.observed)
        told = np.zeros((10, 10))
        told[seen] = np.linalg.inv(definite(result.estimate.covariance[seen]))
        return Reduced((), told, told @ result.values, result.excess)
    data, pull = _recordings_alone(result, joint)
    share = found.shared[i]
    tied = np.flatnonzero(share > 0.0)
    # Unknowns: body, shared numbers, new parts of all doubts, errors beyond the fit's own
    beyond = result.excess_root
    count, doubts = len(tied), len(share)
    size = 10 + count + doubts + beyond.shape[1]
    map_ = np.zeros((10 + doubts, size))
    map_[:10, :10] = np.eye(10)
    map_[10 + tied, 10 + np.arange(count)] = share[tied]
    map_[10:, 10 + count : 10 + count + doubts] = np.diag(np.sqrt(1.0 - share**2))
    map_[:10, 10 + count + doubts :] = beyond
    whole = map_.T @ data @ map_
    own = np.arange(10 + count, size)
    whole[own, own] += 1.0
    kept, kept_pull = integrated(whole, map_.T @ pull, 10 + count)
    return Reduced(tuple(found.keys[i][t] for t in tied), kept, kept_pull, result.excess)


def _recordings_alone(result: SessionResult, joint: JointInformation) -> tuple[Array, Array]:
    """(information, information times optimum) of the recordings, every prior taken off."""
    at = np.array([doubt.at for doubt in joint.doubts])
    gradient = np.concatenate([joint.weak_gradient, at])
    data = joint.root.T @ joint.root
    data[:10, :10] -= joint.weak
    doubts = np.arange(10, len(data))
    data[doubts, doubts] -= 1.0
    if joint.weighing is not None:
        weight = joint.weighing.std**-2
        data[0, 0] -= weight
        gradient[0] += weight * (joint.elements[0] - joint.weighing.mass)
    # Rivals may have moved the answer from the fit's optimum: what the recordings say moves with it
    return data, data @ np.concatenate([result.values, at]) + gradient


def integrated(information: Array, pull: Array, kept: int) -> tuple[Array, Array]:
    """Information and pull on the first ``kept`` unknowns, the others integrated out by a Cholesky factor."""
    order = np.roll(np.arange(len(information)), -kept)
    scale = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))[order]
    factor = np.linalg.cholesky(definite(information[np.ix_(order, order)] / np.outer(scale, scale)))
    block = scale[-kept:, None] * factor[-kept:, -kept:]
    solved = solve_triangular(factor, pull[order] / scale, lower=True)
    return np.asarray(block @ block.T), np.asarray(block @ solved[-kept:])


def _summed(parts: Sequence[Reduced], keys: dict[Hashable, int]) -> tuple[Array, Array]:
    """All sessions' information and pull on body and shared numbers, with the shared numbers' priors."""
    size = 10 + len(keys)
    information, pull = np.zeros((size, size)), np.zeros(size)
    shared = np.arange(10, size)
    information[shared, shared] = 1.0
    for part in parts:
        columns = _columns(part, keys)
        information[np.ix_(columns, columns)] += part.information
        pull[columns] += part.pull
    return information, pull


def _columns(part: Reduced, keys: dict[Hashable, int]) -> NDArray[np.int64]:
    return np.array([*range(10), *(keys[key] for key in part.keys)])


def _weigh(information: Array, pull: Array, scale: Weighing | None) -> None:
    if scale is not None:
        information[0, 0] += scale.std**-2
        pull[0] += scale.std**-2 * scale.mass


def _together(parts: Sequence[Reduced], keys: dict[Hashable, int], covariance: Array, found: Ties) -> Array:
    """(10, 10) what errors beyond the fits' own add at the worst correlation within a rig."""
    out = np.zeros((10, 10))
    for part, rig in zip(parts, found.rigs, strict=True):
        alike = sum(
            bool(np.any(p.excess)) for p, other in zip(parts, found.rigs, strict=True) if other == rig
        )
        gain = covariance[:10, _columns(part, keys)] @ part.information[:, :10]
        # Once is in the covariance already, as an unknown of its own
        out += max(alike - 1, 0) * gain @ part.excess @ gain.T
    return out


def unobservable(results: Sequence[SessionResult], data: Array) -> tuple[str, ...]:
    """Elements that all recordings together do not determine, judged as in observability.py."""
    told = [r.joint for r in results if r.joint is not None]
    if not told:
        return tuple(n for k, n in enumerate(ELEMENTS) if not any(r.observed[k] for r in results))
    belief = np.min([joint.belief for joint in told], axis=0)
    scaled = integrated_out(data, 10) * np.outer(belief, belief)
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    left = np.sqrt((vectors**2) @ (1.0 / (np.maximum(values, 0.0) + 1.0)))
    return tuple(name for name, share in zip(ELEMENTS, left, strict=True) if not share < GAIN)


def _one_frame(results: Sequence[SessionResult]) -> CarryingFrame | None:
    """The carrying frame of all sessions."""
    frames = [(r.name, r.joint.frame) for r in results if r.joint is not None]
    for name, frame in frames[1:]:
        if not _same(frame, frames[0][1]):
            raise InputError(
                f"{name}: hangs with another carrying frame than {frames[0][0]}, so that their numbers are "
                "of two bodies; describe the same frame in both, or fuse sessions with one frame"
            )
    return frames[0][1] if frames else None


def _same(one: CarryingFrame | None, other: CarryingFrame | None) -> bool:
    if one is None or other is None:
        return one is other
    return (
        one.mass == other.mass
        and np.allclose(one.center_of_mass, other.center_of_mass)
        and np.allclose(one.inertia, other.inertia)
    )


def _gain(results: Sequence[SessionResult], total: InertialEstimate) -> dict[str, float]:
    """How much smaller the fused std is than the best session's; of elements that a session determines."""
    out = {}
    for k, name in enumerate(ELEMENTS):
        best = min(
            (float(np.sqrt(r.estimate.covariance[k, k])) for r in results if r.observed[k]), default=np.nan
        )
        if np.isfinite(best) and name not in total.unobservable:
            out[name] = best / float(np.sqrt(total.covariance[k, k]))
    return out


def root_of_inverse(information: Array) -> Array:
    """W of which W' W is the inverse of an information matrix."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    factor = np.linalg.cholesky(definite(information * np.outer(scale, scale)))
    return np.asarray(solve_triangular(factor, np.diag(scale), lower=True))
