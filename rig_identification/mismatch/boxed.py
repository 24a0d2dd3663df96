"""What freeing some numbers would gain, to first order, with every other one kept within its bound.

Where a model lacks something, its geometry bends to swallow it and lies at the bounds of its tolerances.
With what is missing free it lies there no longer: a promise for which nothing may come back from its bound
falls short of what the fit gains by half and more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from rig_identification.estimate.box import in_box
from rig_identification.estimate.parameters import INERTIAL, Parameter
from rig_identification.estimate.solve import Evaluation, Problem, limit_of
from rig_identification.model.definite import definite

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Step:
    """The best step with some parameters free."""

    gain: float  # nats over the best step without them
    values: Array  # where it leads these parameters, std of their priors in the problem


def probed_of(full: Evaluation, size: int, probed: int) -> NDArray[np.int64]:
    """Unknowns that are the last ``probed`` starts of every run. size: parameters, which come first."""
    ends = size + np.cumsum([run.jacobian.shape[1] - size for run in full.runs], dtype=np.int64)
    return (ends[:, None] - 1 - np.arange(probed)).ravel()


class Boxed:
    """A linearised problem, with all that has neither a bound nor a hypothesis eliminated.

    full: of ``problem``. added: names of parameters that are free in no step but with their hypothesis.
    probed: states, the last of every run's, that stay where they are. asked: names of hypotheses' parameters.
    """

    def __init__(
        self, problem: Problem, full: Evaluation, added: set[str], probed: int, asked: set[str]
    ) -> None:
        free, size = problem.bench.parameters.free, problem.bench.parameters.size
        limit = np.array([limit_of(problem, q) for q in free])
        kept = np.flatnonzero(np.isfinite(limit) | [q.name in asked or q.name in added for q in free])
        kept += INERTIAL
        outer = np.ones(full.information.shape[0], dtype=bool)
        outer[kept] = False
        outer[probed_of(full, size, probed)] = False
        out = np.flatnonzero(outer)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(full.information)[out], 1e-300))
        inside = full.information[np.ix_(out, out)] * np.outer(scale, scale)
        across = scale[:, None] * full.information[np.ix_(out, kept)]
        solved = cho_solve(cho_factor(definite(inside + 1e-12 * np.eye(out.size))), across)
        self._matrix = full.information[np.ix_(kept, kept)] - across.T @ solved
        self._right = full.gradient[kept] - solved.T @ (scale * full.gradient[out])
        self._here = full.point.theta[kept]
        self._std = np.array([free[i - INERTIAL].prior_std for i in kept])
        self._limit = limit[kept - INERTIAL]
        self._at = {free[i - INERTIAL].name: k for k, i in enumerate(kept)}
        self._base = np.array([free[i - INERTIAL].name not in added for i in kept])
        self._without = self._best([], [], 0)[0]

    def step(self, parameters: Sequence[Parameter], positive: int) -> Step:
        """The best step with ``parameters`` free, each with its own prior.

        positive: so many of the first cannot be negative.
        """
        chosen = [self._at[q.name] for q in parameters]
        gain, step = self._best(chosen, [q.prior_std for q in parameters], positive)
        return Step(gain - self._without, self._here[chosen] + step[chosen])

    def _best(self, chosen: list[int], stds: list[float], positive: int) -> tuple[float, Array]:
        matrix, right = self._matrix.copy(), self._right.copy()
        open_, limit, dearer = self._base.copy(), self._limit.copy(), 0.0
        low = -limit - self._here
        high = limit - self._here
        for order, (k, std) in enumerate(zip(chosen, stds, strict=True)):
            # Replace the prior: precision 1 in the old units becomes ratio^2
            ratio = self._std[k] / std
            matrix[k, k] += ratio**2 - 1.0
            right[k] += self._here[k] * (1.0 - ratio**2)
            # ... which costs less where it is already off
            dearer += 0.5 * self._here[k] ** 2 * (1.0 - ratio**2)
            open_[k] = True
            low[k], high[k] = (-self._here[k] if order < positive else -np.inf), np.inf
        at = np.flatnonzero(open_)
        # A fit's last digits may lie outside of what bounds it
        low, high = np.minimum(low[at], 0.0), np.maximum(high[at], 0.0)
        inside = matrix[np.ix_(at, at)]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(inside), 1e-300))
        inside = inside * np.outer(scale, scale) + 1e-12 * np.eye(at.size)
        inside = definite(inside)
        x = in_box(inside, scale * right[at], low / scale, high / scale)
        step = np.zeros(right.size)
        step[at] = scale * x
        return dearer + float(scale @ (right[at] * x)) - 0.5 * float(x @ inside @ x), step
