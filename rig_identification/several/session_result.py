"""The answer to one session, as several are compared and fused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig_identification.joint import JointInformation
from rig_identification.result import ELEMENTS, InertialEstimate

Array = NDArray[np.float64]

#: Part of a variance that is rounding where it is told twice, by a covariance and by a root of its inverse.
ROUNDING = 1e-9


@dataclass(frozen=True)
class SessionResult:
    """One session's answer, and what it knows of body and rig together."""

    name: str
    estimate: InertialEstimate  # what is unobservable may be NaN
    verdict: str
    findings: tuple[Mapping[str, object], ...] = ()  # as in result.json
    joint: JointInformation | None = None  # None: nobody knows which of its errors another session shares

    @property
    def observed(self) -> NDArray[np.bool_]:
        """(10,) which elements the session determines."""
        return np.array([name not in self.estimate.unobservable for name in ELEMENTS])

    @cached_property
    def posterior(self) -> Array:
        """(10 + K, 10 + K) covariance of body and doubts, doubts in units of their tolerances.

        Raises AssertionError where there is no joint information.
        """
        assert self.joint is not None
        inverse = np.linalg.inv(self.joint.root)
        return np.asarray(inverse @ inverse.T)

    @cached_property
    def excess_root(self) -> Array:
        """(10, k) L: L L' is what the answer's covariance holds beyond the fit's own.

        Rivals, traces, other headings; without joint information all of it. Elements that are not determined
        have none.
        """
        seen = np.flatnonzero(self.observed)
        own = np.zeros((10, 10)) if self.joint is None else self.posterior[:10, :10]
        root = _beyond(self.estimate.covariance[np.ix_(seen, seen)], own[np.ix_(seen, seen)])
        out = np.zeros((10, root.shape[1]))
        out[seen] = root
        return out

    @property
    def excess(self) -> Array:
        """(10, 10) what the answer's covariance holds beyond the fit's own."""
        return np.asarray(self.excess_root @ self.excess_root.T)

    @cached_property
    def values(self) -> Array:
        """(10,) the answer; of what is not determined the fit's own number, 0 without one."""
        fallback = np.zeros(10) if self.joint is None else self.joint.elements
        return np.where(self.observed, self.estimate.values, fallback)


def _beyond(whole: Array, own: Array) -> Array:
    """(n, k) root of what a covariance holds beyond another one, where that is more than rounding."""
    if not whole.size:
        return whole
    scale = np.sqrt(np.diag(whole))
    values, vectors = np.linalg.eigh((whole - own) / np.outer(scale, scale))
    kept = values > ROUNDING
    return np.asarray(scale[:, None] * vectors[:, kept] * np.sqrt(values[kept]))
