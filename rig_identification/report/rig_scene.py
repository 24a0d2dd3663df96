"""What is drawn of a rig: cables, devices and body at rest, placed in world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.report.principal import principal_inertia
from rig_identification.report.rest_pose import rest_pose
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Sizes of the rig from its middle within which what a finding places is drawn; farther off it is only told.
_NEARBY = 1.0


@dataclass(frozen=True)
class Scene:
    """What is drawn, in world."""

    cables: tuple[tuple[str, Array, Array], ...]  # name, ceiling point, body point
    devices: tuple[tuple[str, Array], ...]  # name, position
    center_of_mass: Array | None
    ellipsoid: Array | None  # (3, 3) columns are the semi-axes
    body_axes: tuple[Array, Array]  # origin, columns are x, y, z of body
    marked: frozenset[str] = frozenset()  # names of cables and devices that are at fault
    spots: tuple[tuple[str, Array], ...] = ()  # what else was found, and where


#: Contract's words of the devices that have a place, as they are drawn.
DRAWN = {"imu": "IMU", "exciter": "exciter", "mocap": "markers"}


def rig_scene(
    rig: Rig,
    estimate: InertialEstimate,
    faulty: frozenset[str] = frozenset(),
    spots: Sequence[tuple[str, Array]] = (),
) -> Scene:
    """Place rig, devices and inertia ellipsoid at the rest pose.

    faulty: cables and devices at fault, by the contract's words. spots: what findings place on the body, and
    where, (3,) m in body; what lies far off the rig is left out.
    """
    known = not {"cx", "cy", "cz"} & set(estimate.unobservable)
    center = estimate.values[1:4] if known else np.mean([c.body_point for c in rig.cables], axis=0)
    R_world_body, origin = rest_pose(rig, center)

    def world(position_body: Array) -> Array:
        return np.asarray(origin + R_world_body @ position_body)

    hinges = np.array([c.ceiling_point for c in rig.cables] + [world(c.body_point) for c in rig.cables])
    middle, size = hinges.mean(axis=0), float(np.max(np.ptp(hinges, axis=0)))
    found = [(name, world(at)) for name, at in spots]
    mounts = [(name, getattr(rig, device)) for device, name in DRAWN.items()]
    principal = principal_inertia(estimate)
    semi = principal.semi_axes if principal is not None and known else None
    return Scene(
        cables=tuple((c.name, np.asarray(c.ceiling_point), world(c.body_point)) for c in rig.cables),
        devices=tuple((name, world(m.position)) for name, m in mounts if m is not None),
        center_of_mass=world(center) if known else None,
        ellipsoid=None if semi is None or principal is None else R_world_body @ principal.axes * semi,
        body_axes=(origin, R_world_body),
        marked=frozenset(DRAWN.get(name, name) for name in faulty),
        spots=tuple((name, at) for name, at in found if float(np.linalg.norm(at - middle)) <= _NEARBY * size),
    )


def described_scene(rig: Rig, faulty: frozenset[str] = frozenset()) -> Scene:
    """The rig as described, before anything is known of the body: no centre of mass, no ellipsoid."""
    nothing = InertialEstimate(np.full(10, np.nan), np.full((10, 10), np.nan), ELEMENTS)
    return rig_scene(rig, nothing, faulty)
