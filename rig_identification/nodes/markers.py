"""The rig for RViz and Foxglove: ceiling, cables coloured by tension, and the body's hinges and devices."""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from rig_identification.rig import Rig

Array = NDArray[np.float64]
_GREY = ColorRGBA(r=0.5, g=0.5, b=0.5, a=1.0)
_BODY = ColorRGBA(r=0.25, g=0.45, b=0.7, a=0.9)
_DEVICE = ColorRGBA(r=0.9, g=0.6, b=0.1, a=1.0)


def rig_markers(rig: Rig, pose: Array, tension: dict[str, float], stamp: Time) -> MarkerArray:
    """Markers of the rig at a pose (7,): position of the datum in world, quaternion xyzw."""
    position, turn = pose[:3], Rotation.from_quat(pose[3:])
    hinges = [position + turn.apply(cable.body_point) for cable in rig.cables]
    ceiling = [cable.ceiling_point for cable in rig.cables]
    fair_share = (
        rig.gravity * (rig.mass or sum(abs(t) for t in tension.values()) / rig.gravity or 1.0) / len(hinges)
    )
    cables = _marker(0, "cables", Marker.LINE_LIST, stamp, 0.02)
    for cable, top, bottom in zip(rig.cables, ceiling, hinges, strict=True):
        shade = tension_colour(tension.get(cable.name), fair_share)
        for end in (top, bottom):
            cables.points.append(_point(end))
            cables.colors.append(shade)
    body = _marker(1, "body", Marker.LINE_LIST, stamp, 0.03, _BODY)
    for i, one in enumerate(hinges):
        for other in hinges[i + 1 :]:
            body.points += [_point(one), _point(other)]
    points = _marker(2, "ceiling", Marker.SPHERE_LIST, stamp, 0.06, _GREY)
    points.points = [_point(point) for point in ceiling]
    devices = _marker(3, "devices", Marker.SPHERE_LIST, stamp, 0.08, _DEVICE)
    mounts = [mount for mount in (rig.imu, rig.exciter) if mount is not None]
    devices.points = [_point(position + turn.apply(mount.position)) for mount in mounts]
    return MarkerArray(markers=[cables, body, points, devices])


def tension_colour(tension: float | None, fair_share: float) -> ColorRGBA:
    """Blue for slack, green for an equal share of the weight, red for twice that; grey: not measured."""
    if tension is None or not np.isfinite(tension):
        return _GREY
    load = float(np.clip(tension / fair_share, 0.0, 2.0))
    return ColorRGBA(r=max(0.0, load - 1.0), g=1.0 - abs(load - 1.0), b=max(0.0, 1.0 - load), a=1.0)


def _marker(
    number: int, name: str, kind: int, stamp: Time, size: float, colour: ColorRGBA | None = None
) -> Marker:
    marker = Marker(ns=name, id=number, type=kind, action=Marker.ADD)
    marker.header.frame_id = "world"
    marker.header.stamp = stamp
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = size
    if colour is not None:
        marker.color = colour
    return marker


def _point(p: Array) -> Point:
    return Point(x=float(p[0]), y=float(p[1]), z=float(p[2]))
