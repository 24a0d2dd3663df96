"""What a wrench over time does to every sample, to first order about a fitted motion.

Between nodes x_{k+1} = A_k x_k + B_k w_k, w_k being the interval's mean, and a sample at node k reads
H x_k + D w_k: whatever acts as a wrench can be screened by one pass of this recursion, without running the
model again. What the run's filter (estimate/whitening.py) has seen of it, state and wrench, is taken away as
it goes: only what is unseen yet is carried on, and what a sample sees of that is its normalised innovation.
Its own noise reaches state and sample in its own way (estimate/force_noise.py).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rig_identification.estimate.prediction import Linearised
from rig_identification.estimate.whitening import followed
from rig_identification.model import work

Array = NDArray[np.float64]


@njit(cache=True, nogil=True)
def _innovations(A, B, node, H, D, through, felt, follow, gains, deviations, wrenches, smooth, out):  # type: ignore[no-untyped-def]
    """out (m, c): normalised innovations of the responses to ``wrenches`` (N, 6, c).

    through (N, X, w), felt (m, w), follow (f, f): the filter's own noise, how it reaches the next state and
    each row, and how it goes on (estimate/whitening.py). gains (m, X + w), deviations (m,): the filter.
    """
    nodes, states, count = A.shape[0], A.shape[1], wrenches.shape[2]
    own = felt.shape[1]
    size = states + 6 + own
    unseen, after = np.zeros((size, count)), np.empty((states, count))
    taken = np.zeros((own, count))  # what the filter takes for its own noise
    seen = np.empty(count)
    F = np.empty((states, size))
    row = 0
    for k in range(nodes):
        followed(taken, follow)
        while row < node.shape[0] and node[row] == k:
            seen[:] = 0.0
            for i in range(states):
                h = H[row, i]
                if h != 0.0:
                    for c in range(count):
                        seen[c] += h * unseen[i, c]
            for i in range(6):
                for c in range(count):
                    seen[c] += D[row, i] * wrenches[k, i, c]
            for i in range(own):
                for c in range(count):
                    seen[c] -= felt[row, i] * taken[i, c]
            for c in range(count):
                seen[c] /= deviations[row]
                out[row, c] = seen[c]
            for i in range(states):
                g = gains[row, i]
                if g != 0.0:
                    for c in range(count):
                        unseen[i, c] -= g * seen[c]
            for i in range(own):
                for c in range(count):
                    taken[i, c] += gains[row, states + i] * seen[c]
            row += 1
        ahead = min(k + 1, nodes - 1) if smooth else k
        for i in range(6):
            for c in range(count):
                unseen[states + i, c] = 0.5 * (wrenches[k, i, c] + wrenches[ahead, i, c])
        for i in range(own):
            for c in range(count):
                unseen[states + 6 + i, c] = -taken[i, c]
        F[:, :states] = A[k]
        F[:, states : states + 6] = B[k]
        F[:, states + 6 :] = through[k]
        after[:, :] = np.dot(F, unseen)
        unseen[:states] = after


def whitened_response(run: Linearised, wrenches: Array, *, smooth: bool = False) -> Array:
    """(m, c): change of the run's whitened prediction under each of ``wrenches`` (N, 6, c), body axes.

    N and N m about the datum, held over each node interval; where ``smooth`` they run straight from node to
    node instead, and what follows a motion is not half an interval late.
    """
    # A third of that is this pass; what is made of its columns takes the rest (rider_places.py)
    work.add(wrenches.shape[0] * wrenches.shape[2])
    A, B, _, _, _ = run.motion.derivatives
    out = np.empty((run.nodes.size, wrenches.shape[2]))
    held = np.ascontiguousarray(wrenches)
    noise = run.noise
    filtered = (noise.through, noise.felt, noise.follow, *run.filter)
    _innovations(A, B, run.nodes, run.row_H, run.row_D, *filtered, held, smooth, out)
    return run.wander.without(out)


def instant_information(run: Linearised, nodes: int = 3) -> Array:
    """(6, 6) what a run tells of a wrench that is held over one node interval, on average over some of them.

    What the run's random wrench leaves of it: at most a diagonal matrix of that one's inverse variances.
    """
    steps = run.motion.derivatives[0].shape[0]
    at = np.linspace(0, steps - 1, nodes + 2).astype(int)[1:-1]
    impulses = np.zeros((steps, 6, 6 * nodes))
    for i, node in enumerate(at):
        impulses[node, :, 6 * i : 6 * (i + 1)] = np.eye(6)
    seen = whitened_response(run, impulses)
    parts = [seen[:, 6 * i : 6 * (i + 1)] for i in range(nodes)]
    return np.asarray(sum(part.T @ part for part in parts) / nodes)
