"""The body alone: the carrying frame's share taken off, its uncertainty added."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.model.body import (
    complex_step_jacobian,
    elements_from_linear,
    linear_from_elements,
    six_elements,
)
from rig_identification.result import ELEMENTS, InertialEstimate, UncertaintySource
from rig_identification.rig import CarryingFrame

Array = NDArray[np.float64]

#: Uncertainty of the frame where nothing is said of it: parts of its mass, of its size, of its inertia.
FRAME_MASS_STD = 0.001
FRAME_CENTER_STD = 0.001  # m
FRAME_INERTIA_STD = 0.005


def subtract_frame(total: InertialEstimate, frame: CarryingFrame) -> InertialEstimate:
    """What is left of ``total`` without the frame; linear in (m, m c, I about the datum)."""
    own = np.concatenate([[frame.mass], frame.center_of_mass, six_elements(frame.inertia)])

    def rest(both: Array) -> Array:
        return elements_from_linear(linear_from_elements(both[:10]) - linear_from_elements(both[10:]))

    both = np.concatenate([total.values, own])
    scale = np.sqrt(np.outer(np.diag(frame.inertia), np.diag(frame.inertia)))
    std = np.concatenate(
        [
            [FRAME_MASS_STD * frame.mass],
            np.full(3, FRAME_CENTER_STD),
            FRAME_INERTIA_STD * six_elements(scale),
        ]
    )
    covariance = np.zeros((20, 20))
    covariance[:10, :10] = total.covariance
    covariance[10:, 10:] = np.diag(std**2)
    map_ = complex_step_jacobian(rest, both)
    lost = set(total.unobservable)
    if "m" in lost:
        lost |= set(ELEMENTS)
    # A centre that is not determined leaves no inertia about the other centre determined
    for axis, name in enumerate(("cx", "cy", "cz")):
        if name in lost:
            touched = {
                0: ("Jxy", "Jxz", "Jyy", "Jzz"),
                1: ("Jxx", "Jxy", "Jyz", "Jzz"),
                2: ("Jxx", "Jxz", "Jyy", "Jyz"),
            }
            lost |= set(touched[axis])
    sources = tuple(
        replace(s, covariance=map_[:, :10] @ s.covariance @ map_[:, :10].T) for s in total.sources
    )
    if sources:
        own_share = map_[:, 10:] @ covariance[10:, 10:] @ map_[:, 10:].T
        sources = (*sources, UncertaintySource("carrying frame", "frame", own_share))
    names = tuple(n for n in ELEMENTS if n in lost)
    return InertialEstimate(rest(both), map_ @ covariance @ map_.T, names, sources)


def vehicle_alone(total: InertialEstimate, frame: CarryingFrame | None) -> InertialEstimate | None:
    """The body without its carrying frame; None where the rig has none."""
    return None if frame is None else subtract_frame(total, frame)
