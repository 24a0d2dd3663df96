"""What road-vehicle engineering asks of a body: height of the centre of mass, axle shares, radii of gyration.

Axes are those of ISO 8855: x forward in the ground plane, y to the left, z up from it. The ground plane is
the one that lies nearest to the four points where the wheels touch it. Places of the centre of mass are those
that ISO 10392 (determination of the centre of gravity) asks for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.model.body import tensor
from rig_identification.result import ELEMENTS, InertialEstimate, Quantity
from rig_identification.rig import Rig, WheelContacts

Array = NDArray[np.float64]

#: Step of the numeric derivative, in std of each of the ten numbers. What is asked is nearly linear over it.
STEP = 1e-3
#: Elements that radii of gyration and the place of the centre of mass need.
_RADII, _CENTER = ("m", *ELEMENTS[4:]), ("cx", "cy", "cz")


def vehicle_quantities(alone: InertialEstimate, rig: Rig) -> tuple[Quantity, ...]:
    """What follows of the body ``alone``, without its carrying frame; what is not determined is left out.

    Without a described vehicle these are the radii of gyration about the body's axes. The contact points and
    the axes are taken as exact.
    """
    lost = set(alone.unobservable)
    found: list[Quantity] = []
    if not lost & set(_RADII):
        found += _with_std(alone, _turning(rig.vehicle))
    if rig.vehicle is not None and not lost & set(_CENTER):
        found += _with_std(alone, _center(rig.vehicle))
        if "m" not in lost:
            found += _with_std(alone, _loads(rig.vehicle, rig.gravity))
    return tuple(found)


def vehicle_axes(wheels: WheelContacts) -> Array:
    """(3, 3) whose rows are the vehicle's x, y and z axis in body axes."""
    ahead = wheels.front_left + wheels.front_right - wheels.rear_left - wheels.rear_right
    left = wheels.front_left + wheels.rear_left - wheels.front_right - wheels.rear_right
    up = np.cross(ahead, left)
    up, ahead = up / np.linalg.norm(up), ahead / np.linalg.norm(ahead)
    return np.stack([ahead, np.cross(up, ahead), up])


@dataclass(frozen=True)
class _Asked:
    """What is asked of a body: names with units, and their values of the ten numbers."""

    names: tuple[tuple[str, str], ...]
    of: Callable[[Array], Array]


def _turning(wheels: WheelContacts | None) -> _Asked:
    """Radii of gyration, and with a vehicle its moments of inertia, about axes through the centre of mass."""
    axes = np.eye(3) if wheels is None else vehicle_axes(wheels)
    ways = ("x", "y", "z") if wheels is None else ("roll", "pitch", "yaw")
    names = [(f"radius_of_gyration_{way}", "m") for way in ways]
    if wheels is not None:
        names += [*((f"{way}_inertia", "kg*m^2") for way in ways), ("roll_yaw_product", "kg*m^2")]

    def of(elements: Array) -> Array:
        turned = axes @ tensor(elements[4:]) @ axes.T
        moments = np.diag(turned)
        radii = np.sqrt(moments / elements[0])
        return np.concatenate([radii, moments, [turned[0, 2]]])[: len(names)]

    return _Asked(tuple(names), of)


def _center(wheels: WheelContacts) -> _Asked:
    """Where the centre of mass lies between the wheels, and how the weight is shared on level ground."""
    axes = vehicle_axes(wheels)
    points = np.array([wheels.front_left, wheels.front_right, wheels.rear_left, wheels.rear_right])
    middle = np.mean(points, axis=0)
    placed = (points - middle) @ axes.T
    front, wheelbase = np.mean(placed[:2, 0]), np.mean(placed[:2, 0]) - np.mean(placed[2:, 0])
    track = np.mean(placed[[0, 2], 1]) - np.mean(placed[[1, 3], 1])
    names = (
        ("center_of_mass_height", "m"),
        ("center_of_mass_behind_front_axle", "m"),
        ("center_of_mass_to_the_left", "m"),
        ("front_axle_share", "1"),
        ("rear_axle_share", "1"),
        ("left_side_share", "1"),
    )

    def of(elements: Array) -> Array:
        along, left, height = axes @ (elements[1:4] - middle)
        behind = front - along
        rear_share = behind / wheelbase
        return np.array([height, behind, left, 1.0 - rear_share, rear_share, 0.5 + left / track])

    return _Asked(names, of)


def _loads(wheels: WheelContacts, gravity: float) -> _Asked:
    """What each axle and each side carries on level ground. gravity: m/s^2."""
    center = _center(wheels)
    shares = [i for i, (name, _) in enumerate(center.names) if name.endswith("_share")]
    names = tuple((center.names[i][0].replace("_share", "_load"), "N") for i in shares)

    def of(elements: Array) -> Array:
        return np.asarray(elements[0] * gravity * center.of(elements)[shares])

    return _Asked(names, of)


def _with_std(alone: InertialEstimate, asked: _Asked) -> list[Quantity]:
    """The quantities with their std to first order."""
    std = np.sqrt(np.maximum(np.nan_to_num(np.diag(alone.covariance)), 0.0))
    known = [i for i, name in enumerate(ELEMENTS) if name not in alone.unobservable and std[i] > 0.0]
    values = asked.of(alone.values)
    slope = np.zeros((values.size, len(known)))
    for column, i in enumerate(known):
        aside = np.zeros(len(ELEMENTS))
        aside[i] = STEP * std[i]
        slope[:, column] = (asked.of(alone.values + aside) - asked.of(alone.values - aside)) / (
            2.0 * aside[i]
        )
    variance = np.einsum("qi,ij,qj->q", slope, alone.covariance[np.ix_(known, known)], slope)
    return [
        Quantity(name, float(v), float(np.sqrt(max(s, 0.0))), unit)
        for (name, unit), v, s in zip(asked.names, values, variance, strict=True)
    ]
