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
    def excess(self) -> Array:
        """(10, 10) what the answer's covariance holds beyond the fit's own: rivals, traces, other headings.

        Without joint information it is all of it. Elements that are not determined have none.
        """
        seen = np.ix_(self.observed, self.observed)
        own = np.zeros((10, 10)) if self.joint is None else self.posterior[:10, :10]
        out = np.zeros((10, 10))
        out[seen] = _beyond(self.estimate.covariance[seen], own[seen])
        return out

    @cached_property
    def values(self) -> Array:
        """(10,) the answer; of what is not determined the fit's own number, 0 without one."""
        fallback = np.zeros(10) if self.joint is None else self.joint.elements
        return np.where(self.observed, self.estimate.values, fallback)


def _beyond(whole: Array, own: Array) -> Array:
    """What a covariance holds beyond another one, in the directions in which that is more than rounding."""
    if not whole.size:
        return whole
    scale = np.sqrt(np.diag(whole))
    values, vectors = np.linalg.eigh((whole - own) / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.where(values > ROUNDING, values, 0.0))
    return np.asarray(root @ root.T)
