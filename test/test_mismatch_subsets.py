"""Subsets of effects by one linearisation, against the evidence of each subset."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from rig_identification.mismatch.subsets import best_subset, gains_alone


def posterior(design: np.ndarray, data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best (n,) and covariance (n, n) with unit noise and unit prior."""
    covariance = np.linalg.inv(design.T @ design + np.eye(design.shape[1]))
    return covariance @ design.T @ data, covariance


def evidence(design: np.ndarray, data: np.ndarray) -> float:
    """Log marginal likelihood of a linear model with unit noise and unit prior, less a constant."""
    total = design @ design.T + np.eye(data.size)
    return float(-0.5 * data @ np.linalg.solve(total, data) - 0.5 * np.linalg.slogdet(total)[1])


@pytest.mark.parametrize("seed", range(8))
def test_the_best_subset_is_the_one_of_the_highest_evidence(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((60, 5)) @ (np.eye(5) + 0.8 * rng.standard_normal((5, 5)))
    truth = np.array([0.6, 0.0, -0.5, 0.0, 0.0])
    data = design @ truth + rng.standard_normal(60)
    groups = [[0], [1, 2], [3], [4]]
    best, covariance = posterior(design, data)
    found = best_subset(best, covariance, groups, [False] * 4, [1.0] * 4)
    scores = {}
    for count in range(5):
        for kept in combinations(range(4), count):
            columns = [i for k in kept for i in groups[k]]
            scores[kept] = evidence(design[:, columns], data) - float(count)
    assert found == max(scores, key=lambda kept: scores[kept])


def test_two_that_explain_together_what_a_third_takes_alone_are_found() -> None:
    """The third is nearly their sum: adding one at a time takes it first and asks for nothing else."""
    rng = np.random.default_rng(4)
    one, two = rng.standard_normal((2, 200))
    third = one + two + 0.3 * rng.standard_normal(200)
    design = np.stack([one, two, third], axis=1)
    data = 2.0 * one + 2.0 * two + rng.standard_normal(200)
    alone = [evidence(design[:, [k]], data) for k in range(3)]
    assert int(np.argmax(alone)) == 2
    assert best_subset(*posterior(design, data), [[0], [1], [2]], [True] * 3, [3.0] * 3) == (0, 1)


def test_what_cannot_be_negative_is_left_out_where_it_would_be() -> None:
    rng = np.random.default_rng(5)
    design = rng.standard_normal((100, 2))
    data = design @ [1.5, -1.5] + rng.standard_normal(100)
    best, covariance = posterior(design, data)
    assert best_subset(best, covariance, [[0], [1]], [True, True], [2.0, 2.0]) == (0,)
    assert best_subset(best, covariance, [[0], [1]], [True, False], [2.0, 2.0]) == (0, 1)


def test_of_two_laws_of_one_thing_one_is_kept() -> None:
    rng = np.random.default_rng(6)
    design = rng.standard_normal((100, 3))
    data = design @ [1.5, 1.0, 1.2] + rng.standard_normal(100)
    best, covariance = posterior(design, data)
    groups, amounts, penalties = [[0], [1], [2]], [True] * 3, [2.0] * 3
    assert best_subset(best, covariance, groups, amounts, penalties) == (0, 1, 2)
    apart = best_subset(best, covariance, groups, amounts, penalties, [(0, 1)])
    without = [evidence(design[:, [k, 2]], data) for k in (0, 1)]
    assert apart == (int(np.argmax(without)), 2)


def test_a_number_known_to_more_digits_than_there_are_stays() -> None:
    """Beside dry hinges that stop a body rounding leaves a covariance without rank."""
    best = np.array([3.0, 0.1, 0.1])
    covariance = np.zeros((3, 3))
    covariance[1:, 1:] = 0.04  # the other two are one, twice
    kept = best_subset(best, covariance, [[0], [1], [2]], [False] * 3, [1.0] * 3)
    assert kept == (0,)


@pytest.mark.parametrize("seed", range(4))
def test_what_each_gains_alone_is_its_evidence_over_none(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((60, 3)) @ (np.eye(3) + 0.5 * rng.standard_normal((3, 3)))
    data = design @ [0.8, 0.0, -0.8] + rng.standard_normal(60)
    gains = gains_alone(*posterior(design, data), [[0], [1, 2]], [False, False])
    none = evidence(design[:, :0], data)
    assert gains == pytest.approx([evidence(design[:, c], data) - none for c in ([0], [1, 2])], abs=1e-4)
    signed = gains_alone(*posterior(design[:, :1], -data), [[0]], [True])
    other = gains_alone(*posterior(design[:, :1], data), [[0]], [True])
    assert sorted([signed[0], other[0]])[0] == -np.inf


@pytest.mark.parametrize("seed", range(4))
def test_a_number_that_two_effects_share_is_in_the_model_with_either(seed: int) -> None:
    """Two laws of one hinge share how it is twisted: leaving one out leaves the share to the other."""
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((60, 3))
    data = design @ [1.5, 1.0, 0.0] + rng.standard_normal(60)
    groups = [[0, 1], [2, 1]]
    best, covariance = posterior(design, data)
    scores = {}
    for kept in [(), (0,), (1,), (0, 1)]:
        columns = sorted({i for k in kept for i in groups[k]})
        scores[kept] = evidence(design[:, columns], data) - float(len(kept))
    assert best_subset(best, covariance, groups, [False] * 2, [1.0] * 2) == max(
        scores, key=lambda kept: scores[kept]
    )
