"""What a fit makes of its parameters, and what follows from several of them together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.observability import invert_information
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.result import ParameterEstimate

Array = NDArray[np.float64]

#: Step, in stds, over which the slope of what follows from parameters is taken.
SLIGHT = 1e-3


@dataclass(frozen=True)
class Estimates:
    """Parameters by name, and how their errors hang together.

    A ring that tells a ceiling's stiffness per moving mass leaves both open along one line: the mass that
    follows from compliance and frequency is then off by more than the two by themselves would make it.
    """

    values: Mapping[str, float]  # in the units of their parameters
    covariance: Array  # (n, n), in the order of ``values``

    def std(self, name: str) -> float:
        """Std of one parameter."""
        i = self._index(name)
        return float(np.sqrt(self.covariance[i, i]))

    def of(self, name: str) -> tuple[float, float]:
        """One parameter and its std."""
        return self.values[name], self.std(name)

    def following(self, of: Callable[..., float], *names: str) -> tuple[float, float]:
        """What follows from the parameters ``names``, and its std to first order.

        of: takes their values in the order of ``names``.
        """
        index = [self._index(name) for name in names]
        at = np.array([self.values[name] for name in names])
        steps = SLIGHT * np.sqrt(np.diag(self.covariance)[index])
        slopes = np.zeros(len(names))
        for k, step in enumerate(steps):
            if step > 0.0:
                aside = np.zeros(len(names))
                aside[k] = step
                slopes[k] = (of(*(at + aside)) - of(*(at - aside))) / (2.0 * step)
        variance = float(slopes @ self.covariance[np.ix_(index, index)] @ slopes)
        return float(of(*at)), float(np.sqrt(max(0.0, variance)))

    def doubted(self, loose: float, ordinary: Mapping[str, float]) -> Estimates:
        """With all variances wider by the factor ``loose``, and the errors ``ordinary`` (stds) on top."""
        on_top = np.diag([ordinary.get(name, 0.0) ** 2 for name in self.values])
        return Estimates(self.values, loose * self.covariance + on_top)

    @cached_property
    def _places(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.values)}

    def _index(self, name: str) -> int:
        return self._places[name]


def estimates(problem: Problem, evaluation: Evaluation, spread: Evaluation | None = None) -> Estimates:
    """Every free parameter of a fit; spread: another fit of the same parameters that tells their errors."""
    parameters = problem.bench.parameters
    inverse = invert_information((spread or evaluation).information)
    own = slice(INERTIAL, INERTIAL + len(parameters.free))
    at = (spread or evaluation).point.theta[own]
    slopes = np.array([q.slope(x) for q, x in zip(parameters.free, at, strict=True)])
    values = parameters.values(evaluation.point.theta)
    names = [q.name for q in parameters.free]
    return Estimates(
        dict(zip(names, map(float, values), strict=True)), inverse[own, own] * np.outer(slopes, slopes)
    )


def parameter_estimates(problem: Problem, evaluation: Evaluation) -> tuple[ParameterEstimate, ...]:
    """Every doubt about the rig: what was believed and what the recordings made of it."""
    found = estimates(problem, evaluation)
    return tuple(
        ParameterEstimate(q.name, q.unit, q.nominal, q.slope(0.0), *found.of(q.name))
        for q in problem.bench.parameters.free
    )
