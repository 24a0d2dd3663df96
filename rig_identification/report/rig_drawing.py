"""The rig at rest in four views, as inline SVG."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from rig_identification.report.labels import Box, Label, placed
from rig_identification.report.rig_scene import Scene

Array = NDArray[np.float64]

WIDTH, HEIGHT, MARGIN = 440, 340, 44  # px of one view, less the scale bar
BAR = 28  # px below a view, for the scale bar: arrows of the axes go up to 50 px beyond what is drawn
#: px by which the body's outline goes around its hinges, devices and centre of mass: a body on two cables
#: has hinges on one line, and is drawn all the same.
AROUND = 12.0
_CIRCLE = AROUND * np.column_stack([f(np.linspace(0.0, 2.0 * np.pi, 17)[:-1]) for f in (np.cos, np.sin)])

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


def rig_svgs(scene: Scene) -> list[tuple[str, str]]:
    """Name and SVG of each view, all to one scale."""
    boxes = [_extent(scene, view) for view in VIEWS]
    scale = min(_scale(box) for box in boxes)
    return [
        (v.name, _view_svg(scene, v, 0.5 * (lo + hi), scale))
        for v, (lo, hi) in zip(VIEWS, boxes, strict=True)
    ]


def picture_svg(scene: Scene) -> str:
    """The first view by itself, as large as fits."""
    lower, upper = _extent(scene, VIEWS[0])
    return _view_svg(scene, VIEWS[0], 0.5 * (lower + upper), _scale((lower, upper)))


def _scale(box: tuple[Array, Array]) -> float:
    """px per m at which a view fits."""
    width, height = np.maximum(box[1] - box[0], 1e-6)
    return float(min((WIDTH - 2 * MARGIN) / width, (HEIGHT - 2 * MARGIN) / height))


def _extent(scene: Scene, view: View) -> tuple[Array, Array]:
    points = [p for _, a, b in scene.cables for p in (a, b)] + [p for _, p in (*scene.devices, *scene.spots)]
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

    parts = [f'<svg class="rig" viewBox="0 0 {WIDTH} {HEIGHT + BAR}" role="img"><title>{view.name}</title>']
    parts.append(f'<path class="body" d="{_outline(np.array([at(p) for p in _body_points(scene)]))}"/>')
    if scene.center_of_mass is not None and scene.ellipsoid is not None:
        parts.append(_ellipse(at(scene.center_of_mass), scale * view.axes @ scene.ellipsoid))
    drawn = [(name, _cable(at(a), at(b))) for name, a, b in scene.cables]
    drawn += [(name, _device(at(p))) for name, p in scene.devices]
    parts += [drawing for name, drawing in drawn if name not in scene.marked]
    axes, taken = _body_axes(scene, at)
    parts += axes
    labels = placed(_labels(scene, at), WIDTH, HEIGHT, [*taken, _scale_box(scale)])
    parts += [label.svg for label in labels if not label.faulty]
    # What is at fault lies on top of all else
    drawn += [(name, _spot(at(p))) for name, p in scene.spots]
    marked = scene.marked | {name for name, _ in scene.spots}
    written = {label.text: label.svg for label in labels if label.faulty}
    parts += [
        f'<g class="faulty">{drawing}{written.get(name, "")}</g>' for name, drawing in drawn if name in marked
    ]
    if scene.center_of_mass is not None:
        parts.append(_center_mark(at(scene.center_of_mass)))
    parts.append(_scale_bar(scale))
    return "".join(parts) + "</svg>"


def _body_points(scene: Scene) -> list[Array]:
    """What is surely part of the body: hinges, devices, centre of mass; m, world."""
    points = [b for _, _, b in scene.cables] + [p for _, p in scene.devices]
    return points if scene.center_of_mass is None else [*points, scene.center_of_mass]


def _labels(scene: Scene, at: Callable[[Array], Array]) -> list[Label]:
    """Names of cables (at the ceiling), devices and what else was found."""
    points = [(name, at(a), name in scene.marked) for name, a, _ in scene.cables]
    points += [(name, at(p), name in scene.marked) for name, p in scene.devices]
    points += [(name, at(p), True) for name, p in scene.spots]
    return [Label(name, float(p[0]), float(p[1]), faulty) for name, p, faulty in points]


def _outline(points: Array) -> str:
    """Convex outline around points of the body, (n, 2) px, at a distance."""
    around = np.concatenate([point + _CIRCLE for point in points])
    around = around[ConvexHull(around).vertices]
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in around) + "Z"


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


def _cable(top: Array, bottom: Array) -> str:
    return (
        f'<path class="cable" d="M{top[0]:.1f} {top[1]:.1f}L{bottom[0]:.1f} {bottom[1]:.1f}"/>'
        f'<path class="ceiling" d="M{top[0] - 9:.1f} {top[1]:.1f}h18"/>'
        f'<circle class="hinge" cx="{bottom[0]:.1f}" cy="{bottom[1]:.1f}" r="3"/>'
    )


def _device(point: Array) -> str:
    x, y = point
    return f'<rect class="device" x="{x - 4.5:.1f}" y="{y - 4.5:.1f}" width="9" height="9"/>'


def _spot(point: Array) -> str:
    x, y = point
    return f'<path class="spot" d="M{x - 6:.1f} {y - 6:.1f}l12 12m0 -12l-12 12"/>'


def _body_axes(scene: Scene, at: Callable[[Array], Array]) -> tuple[list[str], list[Box]]:
    """Arrows of the body's axes with their letters, and what the letters cover."""
    origin, R_world_body = scene.body_axes
    start = at(origin)
    parts, covered = [], []
    for name, direction in zip("xyz", R_world_body.T, strict=True):
        unit = at(origin + direction) - start
        size = np.linalg.norm(unit)
        full = np.linalg.norm(at(origin + R_world_body @ np.ones(3)) - start) or 1.0
        if size < 0.15 * full:
            continue  # points at the reader
        tip = start + unit * (40.0 / full)
        label = start + unit / size * (np.linalg.norm(tip - start) + 8.0)
        covered.append((label[0] - 5.0, label[1] - 8.0, label[0] + 5.0, label[1] + 6.0))
        parts.append(
            f'<path class="frame" d="M{start[0]:.1f} {start[1]:.1f}L{tip[0]:.1f} {tip[1]:.1f}"/>'
            f'<text class="mid frame" x="{label[0]:.1f}" y="{label[1] + 4:.1f}">{name}</text>'
        )
    return parts, covered


def _center_mark(point: Array) -> str:
    """The quartered circle that drawings mark a centre of mass with."""
    x, y = point
    return (
        f'<g class="center" transform="translate({x:.1f} {y:.1f})"><circle r="7"/>'
        '<path d="M0 0V-7A7 7 0 0 1 7 0ZM0 0V7A7 7 0 0 1 -7 0Z"/></g>'
    )


def _scale_bar(scale: float) -> str:
    length = _bar_length(scale)
    return (
        f'<path class="scale" d="M{MARGIN / 2:.1f} {HEIGHT + BAR - 14}v5h{length * scale:.1f}v-5"/>'
        f'<text x="{MARGIN / 2 + length * scale + 6:.1f}" y="{HEIGHT + BAR - 7}">{length:g} m</text>'
    )


def _bar_length(scale: float) -> float:
    """A round length (m) that takes at most 110 px."""
    return next((s for s in _SCALE_BARS if s * scale <= 110.0), 0.0)


def _scale_box(scale: float) -> Box:
    return 0.0, HEIGHT + BAR - 20.0, MARGIN / 2 + _bar_length(scale) * scale + 56.0, float(HEIGHT + BAR)
