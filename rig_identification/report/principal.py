"""Principal moments and axes of an inertia tensor with their uncertainty, and whether a body can have it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.result import ELEMENTS, InertialEstimate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PrincipalInertia:
    """Moments ascending; first-order uncertainties (perturbation of a symmetric eigenproblem)."""

    moments: Array  # (3,) kg m^2
    moments_std: Array  # (3,) kg m^2
    axes: Array  # (3, 3) columns are the axes in body, each with its largest component positive
    axes_std: Array  # (3,) rad, root of the summed variances of the two tilts
    margin: float  # kg m^2, sum of the two smaller moments less the largest: negative for no body
    margin_std: float  # kg m^2
    semi_axes: Array | None  # (3,) m, of the homogeneous ellipsoid with this mass and inertia


def inertia_matrix(values: Array) -> Array:
    """(3, 3) tensor from the ten elements."""
    xx, xy, xz, yy, yz, zz = values[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def principal_inertia(estimate: InertialEstimate) -> PrincipalInertia | None:
    """Principal moments and axes; None where an element of the tensor is not determined."""
    if set(ELEMENTS[4:]) & set(estimate.unobservable):
        return None
    moments, axes = np.linalg.eigh(inertia_matrix(estimate.values))
    largest: Array = axes[np.argmax(np.abs(axes), axis=0), np.arange(3)]
    axes = np.asarray(axes * np.sign(largest))
    covariance = estimate.covariance[4:, 4:]
    slopes = np.array([[_slope(axes[:, i], axes[:, j]) for j in range(3)] for i in range(3)])
    margin_slope = slopes[0, 0] + slopes[1, 1] - slopes[2, 2]
    return PrincipalInertia(
        moments=moments,
        moments_std=np.array([_std(slopes[i, i], covariance) for i in range(3)]),
        axes=axes,
        axes_std=np.array([_tilt_std(i, moments, slopes, covariance) for i in range(3)]),
        margin=float(moments[0] + moments[1] - moments[2]),
        margin_std=_std(margin_slope, covariance),
        semi_axes=_semi_axes(estimate, moments),
    )


def _slope(left: Array, right: Array) -> Array:
    """Derivative of ``left @ J @ right`` in Jxx Jxy Jxz Jyy Jyz Jzz."""
    outer = np.outer(left, right)
    both = outer + outer.T
    return np.array([outer[0, 0], both[0, 1], both[0, 2], outer[1, 1], both[1, 2], outer[2, 2]])


def _std(slope: Array, covariance: Array) -> float:
    return float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))


def _tilt_std(axis: int, moments: Array, slopes: Array, covariance: Array) -> float:
    """Tilt towards another axis is that off-diagonal element over the difference of the moments."""
    tilts = []
    for other in range(3):
        if other != axis:
            gap = abs(moments[axis] - moments[other])
            tilts.append(_std(slopes[axis, other], covariance) / gap if gap > 0.0 else np.pi / 2)
    return float(min(np.hypot(tilts[0], tilts[1]), np.pi / 2))


def _semi_axes(estimate: InertialEstimate, moments: Array) -> Array | None:
    """From ``J1 = m (b^2 + c^2) / 5`` and so on; None where no homogeneous ellipsoid has these moments."""
    mass = estimate.values[0]
    if "m" in estimate.unobservable or not mass > 0.0:
        return None
    squares = 2.5 / mass * (np.sum(moments) - 2.0 * moments)
    return np.sqrt(squares) if np.all(squares > 0.0) else None
