"""The rig at rest in four views, as inline SVG."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from rig_identification.report.principal import principal_inertia
from rig_identification.report.rest_pose import rest_pose
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.rig import Rig

Array = NDArray[np.float64]

WIDTH, HEIGHT, MARGIN = 440, 340, 40  # px of one view
#: m, longest first: a description in millimetres is drawn as it is written.
_SCALE_BARS = tuple(step * 10.0**power for power in range(4, -4, -1) for step in (5.0, 2.0, 1.0))


@dataclass(frozen=True)
class View:
    """One parallel projection; rows are the picture's right and up in world."""

    name: str
    axes: Array  # (2, 3)


_COS, _SIN = np.cos(np.radians(35.0)), np.sin(np.radians(35.0))
_TILT = np.radians(22.0)
VIEWS = (
    View(
        "In space",
        np.array([[_COS, _SIN, 0.0], [-_SIN * np.sin(_TILT), _COS * np.sin(_TILT), np.cos(_TILT)]]),
    ),
    View("From above: x to the right, y up", np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
    View("From the side: x to the right, z up", np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])),
    View("From the end: y to the right, z up", np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])),
)


@dataclass(frozen=True)
class Scene:
    """What is drawn, in world."""

    cables: tuple[tuple[str, Array, Array], ...]  # name, ceiling point, body point
    devices: tuple[tuple[str, Array], ...]  # name, position
    center_of_mass: Array | None
    ellipsoid: Array | None  # (3, 3) columns are the semi-axes
    body_axes: tuple[Array, Array]  # origin, columns are x, y, z of body
    marked: frozenset[str] = frozenset()  # names of cables and devices that are at fault


#: Contract's words of the devices that have a place, as they are drawn.
DRAWN = {"imu": "IMU", "exciter": "exciter", "mocap": "markers"}


def rig_scene(rig: Rig, estimate: InertialEstimate, faulty: frozenset[str] = frozenset()) -> Scene:
    """Place rig, devices and inertia ellipsoid at the rest pose.

    faulty: cables and devices at fault, by the contract's words.
    """
    known = not {"cx", "cy", "cz"} & set(estimate.unobservable)
    center = estimate.values[1:4] if known else np.mean([c.body_point for c in rig.cables], axis=0)
    R_world_body, origin = rest_pose(rig, center)

    def world(position_body: Array) -> Array:
        return np.asarray(origin + R_world_body @ position_body)

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
    )


def described_scene(rig: Rig, faulty: frozenset[str] = frozenset()) -> Scene:
    """The rig as described, before anything is known of the body: no centre of mass, no ellipsoid."""
    nothing = InertialEstimate(np.full(10, np.nan), np.full((10, 10), np.nan), ELEMENTS)
    return rig_scene(rig, nothing, faulty)


def rig_svgs(scene: Scene) -> list[tuple[str, str]]:
    """Name and SVG of each view, all to one scale."""
    boxes = [_extent(scene, view) for view in VIEWS]
    scale = min(
        min((WIDTH - 2 * MARGIN) / max(hi[0] - lo[0], 1e-6), (HEIGHT - 2 * MARGIN) / max(hi[1] - lo[1], 1e-6))
        for lo, hi in boxes
    )
    return [
        (v.name, _view_svg(scene, v, 0.5 * (lo + hi), scale))
        for v, (lo, hi) in zip(VIEWS, boxes, strict=True)
    ]


def _extent(scene: Scene, view: View) -> tuple[Array, Array]:
    points = [p for _, a, b in scene.cables for p in (a, b)] + [p for _, p in scene.devices]
    flat = np.array(points) @ view.axes.T
    lower, upper = flat.min(axis=0), flat.max(axis=0)
    if scene.center_of_mass is not None:
        middle = view.axes @ scene.center_of_mass
        reach = (
            np.zeros(2) if scene.ellipsoid is None else np.linalg.norm(view.axes @ scene.ellipsoid, axis=1)
        )
        lower, upper = np.minimum(lower, middle - reach), np.maximum(upper, middle + reach)
    return lower, upper


def _view_svg(scene: Scene, view: View, middle: Array, scale: float) -> str:
    def at(position_world: Array) -> Array:
        right, up = view.axes @ position_world - middle
        return np.array([WIDTH / 2 + scale * right, HEIGHT / 2 - scale * up])

    parts = [f'<svg class="rig" viewBox="0 0 {WIDTH} {HEIGHT}" role="img"><title>{view.name}</title>']
    hinges = np.array([at(b) for _, _, b in scene.cables])
    parts.append(f'<path class="body" d="{_outline(hinges)}"/>')
    if scene.center_of_mass is not None and scene.ellipsoid is not None:
        parts.append(_ellipse(at(scene.center_of_mass), scale * view.axes @ scene.ellipsoid))
    drawn = [(name, _cable(name, at(a), at(b))) for name, a, b in scene.cables]
    drawn += [(name, _device(name, at(p))) for name, p in scene.devices]
    parts += [drawing for name, drawing in drawn if name not in scene.marked]
    parts += _body_axes(scene, at)
    # What is at fault lies on top of all else
    parts += [f'<g class="faulty">{drawing}</g>' for name, drawing in drawn if name in scene.marked]
    if scene.center_of_mass is not None:
        parts.append(_center_mark(at(scene.center_of_mass)))
    parts.append(_scale_bar(scale))
    return "".join(parts) + "</svg>"


def _outline(points: Array) -> str:
    """Convex outline of the hinges on the body, or the line that they lie on."""
    try:
        points = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        points = points[np.lexsort(points.T)][[0, -1]]
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points) + "Z"


def _ellipse(center: Array, semi_axes: Array) -> str:
    """Outline of an ellipsoid under parallel projection: an ellipse of matrix ``A A^T``."""
    squares, directions = np.linalg.eigh(semi_axes @ semi_axes.T)
    minor, major = np.sqrt(np.maximum(squares, 0.0))
    angle = np.degrees(np.arctan2(-directions[1, 1], directions[0, 1]))
    x, y = center
    return (
        f'<ellipse class="ellipsoid" rx="{major:.1f}" ry="{minor:.1f}" '
        f'transform="translate({x:.1f} {y:.1f}) rotate({angle:.1f})"/>'
    )


def _cable(name: str, top: Array, bottom: Array) -> str:
    line = f'<path class="cable" d="M{top[0]:.1f} {top[1]:.1f}L{bottom[0]:.1f} {bottom[1]:.1f}"/>'
    ceiling = f'<path class="ceiling" d="M{top[0] - 9:.1f} {top[1]:.1f}h18"/>'
    hinge = f'<circle class="hinge" cx="{bottom[0]:.1f}" cy="{bottom[1]:.1f}" r="3"/>'
    return (
        line
        + ceiling
        + hinge
        + f'<text class="mid" x="{top[0]:.1f}" y="{top[1] - 7:.1f}">{escape(name)}</text>'
    )


def _device(name: str, point: Array) -> str:
    x, y = point
    return (
        f'<rect class="device" x="{x - 4.5:.1f}" y="{y - 4.5:.1f}" width="9" height="9"/>'
        f'<text x="{x + 9:.1f}" y="{y + 4:.1f}">{escape(name)}</text>'
    )


def _body_axes(scene: Scene, at: Callable[[Array], Array]) -> list[str]:
    origin, R_world_body = scene.body_axes
    start = at(origin)
    parts = []
    for name, direction in zip("xyz", R_world_body.T, strict=True):
        unit = at(origin + direction) - start
        size = np.linalg.norm(unit)
        full = np.linalg.norm(at(origin + R_world_body @ np.ones(3)) - start) or 1.0
        if size < 0.15 * full:
            continue  # points at the reader
        tip = start + unit * (40.0 / full)
        label = start + unit / size * (np.linalg.norm(tip - start) + 8.0)
        parts.append(
            f'<path class="frame" d="M{start[0]:.1f} {start[1]:.1f}L{tip[0]:.1f} {tip[1]:.1f}"/>'
            f'<text class="mid frame" x="{label[0]:.1f}" y="{label[1] + 4:.1f}">{name}</text>'
        )
    return parts


def _center_mark(point: Array) -> str:
    """The quartered circle that drawings mark a centre of mass with."""
    x, y = point
    return (
        f'<g class="center" transform="translate({x:.1f} {y:.1f})"><circle r="7"/>'
        '<path d="M0 0V-7A7 7 0 0 1 7 0ZM0 0V7A7 7 0 0 1 -7 0Z"/></g>'
    )


def _scale_bar(scale: float) -> str:
    length = next((s for s in _SCALE_BARS if s * scale <= 110.0), 0.0)
    text = f"{length:g} m"
    return (
        f'<path class="scale" d="M{MARGIN / 2:.1f} {HEIGHT - 14}v5h{length * scale:.1f}v-5"/>'
        f'<text x="{MARGIN / 2 + length * scale + 6:.1f}" y="{HEIGHT - 7}">{text}</text>'
    )
