"""Kalman whitening and smoothing against the same algebra with every covariance written out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import block_diag

from rig_identification.estimate.whitening import smooth, whiten

Array = NDArray[np.float64]
SEEDS = st.integers(0, 10_000)
NODES = 14


@dataclass(frozen=True)
class Small:
    """A short linear system x_{k+1} = A x_k + B w_k with rows y = H x + D w + e."""

    A: Array
    B: Array
    Q: Array
    latent: Array
    node: NDArray[np.int64]
    H: Array
    D: Array
    variance: Array
    follow: Array  # how each component of a force's noise goes on

    @property
    def width(self) -> int:
        return self.B.shape[2]

    @property
    def prior(self) -> Array:
        """(w NODES, w NODES) covariance of what drives the intervals."""
        drawn = block_diag(*(self.Q[min(k, len(self.Q) - 1)] for k in range(NODES)))
        if self.follow.size == 0:
            return np.asarray(drawn)
        on = np.kron(self.follow, np.eye(3))
        # What each draw is some nodes later
        later = np.block(
            [
                [np.linalg.matrix_power(on, k - j) if j <= k else np.zeros_like(on) for j in range(NODES)]
                for k in range(NODES)
            ]
        )
        return np.asarray(later @ drawn @ later.T)

    @property
    def response(self) -> Array:
        """(m, 12 + w NODES): what each row sees of the start state and of what drives every interval."""
        out = np.zeros((self.node.size, 12 + self.width * NODES))
        state = self.state_response
        for row, k in enumerate(self.node):
            out[row] = self.H[row] @ state[k]
            out[row, 12 + self.width * k :][: self.width] += self.D[row]
        return out

    @property
    def state_response(self) -> Array:
        """(NODES, 12, 12 + w NODES)."""
        states = np.zeros((NODES, 12, 12 + self.width * NODES))
        states[0, :, :12] = np.eye(12)
        for k in range(NODES - 1):
            states[k + 1] = self.A[k] @ states[k]
            states[k + 1, :, 12 + self.width * k :][:, : self.width] += self.B[k]
        return states


def small(seed: int, latent: bool, poles: int = 0) -> Small:
    rng = np.random.default_rng(seed)
    # Some nodes without a row, some with several, as sensors of different rates leave them
    node = np.sort(rng.integers(0, NODES, 30))
    # A wrench, or what filters each component of a force
    width = 3 * poles or 6
    # Noise of lower rank than the wrench, as three force components give six
    spread = rng.normal(size=(NODES, width, 3))
    return Small(
        A=np.eye(12) + 0.2 * rng.normal(size=(NODES, 12, 12)),
        B=rng.normal(size=(NODES, 12, width)),
        Q=(spread @ spread.transpose(0, 2, 1))[: 2 if poles else NODES],
        latent=rng.normal(size=(NODES, width)) if latent else np.zeros((NODES, width)),
        node=node,
        H=rng.normal(size=(30, 12)),
        D=rng.normal(size=(30, width)),
        variance=rng.uniform(0.1, 4.0, 30),
        follow=0.4 * rng.normal(size=(poles, poles)),
    )


@given(SEEDS, st.sampled_from([(False, 0), (True, 0), (False, 2), (True, 2), (False, 4), (True, 4)]))
@settings(max_examples=15, deadline=None, derandomize=True)
def test_whitened_least_squares_are_generalised_least_squares(seed: int, how: tuple[bool, int]) -> None:
    s = small(seed, *how)
    columns = np.random.default_rng(seed + 1).normal(size=(30, 5))
    seen = s.response[:, 12:]
    covariance = seen @ s.prior @ seen.T + np.diag(s.variance)
    expected = columns.copy()
    # The nominal motion already holds ``latent`` of a noise whose mean is zero
    expected[:, 0] += seen @ s.latent.ravel()
    normal = expected.T @ np.linalg.solve(covariance, expected)
    whitened = columns.copy()
    log_spread = whiten(s.A, s.B, s.Q, s.latent, s.node, s.H, s.D, s.variance, whitened, s.follow)
    np.testing.assert_allclose(whitened.T @ whitened, normal, rtol=1e-9, atol=1e-9 * np.max(np.abs(normal)))
    assert log_spread == pytest.approx(0.5 * np.linalg.slogdet(covariance)[1], rel=1e-9, abs=1e-9)


@given(SEEDS, st.sampled_from([(False, 0), (True, 0), (False, 2), (True, 2), (False, 4), (True, 4)]))
@settings(max_examples=15, deadline=None, derandomize=True)
def test_smoother_is_the_posterior_mean(seed: int, how: tuple[bool, int]) -> None:
    s = small(seed, *how)
    rng = np.random.default_rng(seed + 2)
    root = rng.normal(size=(12, 12))
    start = 0.1 * root @ root.T
    residual = rng.normal(size=30)
    prior = block_diag(start, s.prior)
    mean = np.concatenate([np.zeros(12), -s.latent.ravel()])
    seen = s.response
    covariance = seen @ prior @ seen.T + np.diag(s.variance)
    best = mean + prior @ seen.T @ np.linalg.solve(covariance, residual - seen @ mean)
    states, wrenches, filtered = smooth(
        s.A, s.B, s.Q, s.latent, s.node, s.H, s.D, s.variance, residual, start, s.follow
    )
    scale = np.max(np.abs(best))
    np.testing.assert_allclose(wrenches.ravel(), best[12:], atol=1e-8 * scale)
    np.testing.assert_allclose(states, s.state_response @ best, atol=1e-8 * np.max(np.abs(states)))
    # What the filter believes at a node rests on the rows up to it
    for k in (0, NODES // 2, NODES - 1):
        rows = s.node <= k
        part = seen[rows]
        gain = prior @ part.T @ np.linalg.inv(part @ prior @ part.T + np.diag(s.variance[rows]))
        after = (np.eye(prior.shape[0]) - gain @ part) @ prior
        expected = s.state_response[k] @ after @ s.state_response[k].T
        np.testing.assert_allclose(filtered[k], expected, atol=1e-8 * np.max(np.abs(expected)) + 1e-10)


def test_innovations_of_a_simulated_system_are_white() -> None:
    rng = np.random.default_rng(4)
    s = small(9, False)
    seen = s.response[:, 12:]
    root = block_diag(*[np.linalg.cholesky(q + 1e-12 * np.eye(6)) for q in s.Q])
    draws = seen @ root @ rng.normal(size=(6 * NODES, 4000))
    draws += np.sqrt(s.variance)[:, None] * rng.normal(size=draws.shape)
    whiten(s.A, s.B, s.Q, s.latent, s.node, s.H, s.D, s.variance, draws, s.follow)
    correlation = draws @ draws.T / draws.shape[1]
    np.testing.assert_allclose(correlation, np.eye(30), atol=5.0 / np.sqrt(draws.shape[1]))
