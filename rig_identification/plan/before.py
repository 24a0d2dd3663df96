"""What an earlier session of the same body on the same rig told, as far as the next one builds on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import INERTIAL, ParameterSet
from rig_identification.model.definite import integrated_out

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stated:
    """One explanation as a result states it."""

    name: str  # for a person
    effect: str  # word of the recording contract
    numbers: Mapping[str, tuple[float, float]]  # the model's parameters, each with its std, in its unit
    where: Mapping[str, object] = field(default_factory=dict)
    gap: float = 0.0  # nats by which it trails what is told
    experiment: str = ""  # what would decide on it, whatever is recorded


@dataclass(frozen=True)
class Known:
    """What recordings told of body and rig, priors of both taken off: a Gaussian.

    The unknowns are the ten elements (SI units), then the doubts, each in units of its tolerance.
    """

    doubts: tuple[str, ...]
    information: Array  # (10 + K, 10 + K)

    def on(self, parameters: ParameterSet, theta: Array) -> Array:
        """(p, p) the same on a vector of parameters about ``theta``. What these lack is integrated out."""
        place = {p.name: i for i, p in enumerate(parameters.free, start=INERTIAL)}
        there = [k for k, name in enumerate(self.doubts, start=10) if name in place]
        lost = [k for k, name in enumerate(self.doubts, start=10) if name not in place]
        order = [*range(10), *there, *lost]
        whole = self.information[np.ix_(order, order)].copy()
        kept = 10 + len(there)
        whole[range(kept, len(order)), range(kept, len(order))] += 1.0  # their tolerances
        told = integrated_out(whole, kept) if lost else whole
        map_ = np.zeros((kept, parameters.size))
        map_[:10, :INERTIAL] = parameters.elements_jacobian(theta)
        for row, k in enumerate(there, start=10):
            map_[row, place[self.doubts[k - 10]]] = 1.0
        return np.asarray(map_.T @ told @ map_)


@dataclass(frozen=True)
class Before:
    """An earlier session's answer."""

    findings: tuple[Stated, ...] = ()
    rivals: tuple[Stated, ...] = ()
    known: Known | None = (
        None  # with what its rivals leave open; None: it tells of its body alone, or nothing
    )
    std: Array = field(default_factory=lambda: np.full(10, np.nan))  # (10,) of its answer
