"""Scenes of the world of labs: rigs of 2 to 8 cables, bodies from a scooter to a van."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bench.concealed.draw import GEOMETRIES, assemble, draw_body, draw_rig
from bench.concealed.scene import Array, Body, Geometry, Scene

Rig = tuple[Geometry, Body]
UNEVEN = 0.1  # of a cable's share: how far from even a lab sets the loads of many cables, one std
GRAVITY = 9.80665

#: Rigs that stand by statics alone.
DETERMINATE = (*GEOMETRIES, "bifilar", "splayed_5", "van", "scooter")
#: More cables than statics can tell the loads of: they are set by how the cables stretch.
INDETERMINATE = ("parallel_4", "parallel_5", "parallel_6", "parallel_7", "parallel_8")


def draw_lab_scene(
    seed: int, duration: float, *, name: str | None, stiffness: float | None, attempt: int = 0
) -> Scene:
    """A scene with nothing left out but that the cables stretch where the rig is indeterminate.

    ``name``: of the rig; None draws one that statics determine. ``stiffness``: EA in N, for the others;
    ``attempt`` draws the rig anew.
    """
    rng = np.random.default_rng([seed, 5, attempt])
    name = str(rng.choice(DETERMINATE)) if name is None else name
    if name in INDETERMINATE:
        if stiffness is None:
            raise ValueError(f"rig {name}: its cables must stretch: give cable_elasticity")
        geometry, body = _parallel(rng, int(name.split("_")[1]), stiffness)
    else:
        geometry, body = _OWN[name](rng) if name in _OWN else draw_rig(rng, name)
    held = name not in INDETERMINATE and len(geometry.length) > 3
    return assemble(rng, seed, name, geometry, body, duration, held)


def _parallel(rng: np.random.Generator, cables: int, stiffness: float) -> Rig:
    """Upright cables in two rows, set so that each carries about its share."""
    front, rear = cables - cables // 2, cables // 2
    deep, wide = rng.uniform(1.2, 1.8), rng.uniform(2.4, 3.4)
    hinge = np.array(
        [[0.0, y, 0.0] for y in np.linspace(0.0, wide, front)]
        + [[deep, y, 0.0] for y in np.linspace(0.0, wide, rear)]
    )
    hinge = hinge + rng.normal(0.0, 0.02, hinge.shape) * [1.0, 1.0, 0.02]
    drop = rng.uniform(2.0, 3.5)
    ceiling = hinge + [0.0, 0.0, drop] + rng.normal(0.0, 0.003, hinge.shape) * [1.0, 1.0, 0.2]
    center = np.array([*hinge[:, :2].mean(axis=0), rng.uniform(-1.0, -0.5)])
    body = draw_body(rng, rng.uniform(900.0, 1700.0), center, (1900, 600, 2000, 30))
    load = _shares(hinge, body) * (1.0 + UNEVEN * rng.normal(size=cables))
    return Geometry(*_hung(ceiling, hinge, load, stiffness), _cells(rng, cables)), body


def _shares(hinge: Array, body: Body) -> Array:
    """(n,) N: the most even loads of upright cables that hold the body."""
    lever = np.stack([np.ones(len(hinge)), hinge[:, 0], hinge[:, 1]])
    wanted = body.mass * GRAVITY * np.array([1.0, *body.center_of_mass[:2]])
    return np.asarray(np.linalg.lstsq(lever, wanted, rcond=None)[0])


def _hung(ceiling: Array, hinge: Array, load: Array, stiffness: float) -> tuple[Array, Array, Array]:
    """Points and unloaded lengths of cables that carry ``load`` in the pose they are drawn in."""
    loaded = np.linalg.norm(hinge - ceiling, axis=1)
    return ceiling - ceiling[0], hinge, loaded / (1.0 + load / stiffness)


def _bifilar(rng: np.random.Generator) -> Rig:
    wide = rng.uniform(1.2, 2.4)
    hinge = np.array([[0.0, 0.0, 0.0], [wide, 0.0, 0.0]]) + rng.normal(0.0, 0.01, (2, 3))
    splay = rng.uniform(0.9, 1.6)
    middle = hinge.mean(axis=0)
    ceiling = middle + splay * (hinge - middle) + [0.0, 0.0, rng.uniform(1.8, 3.5)]
    center = np.array([middle[0], middle[1], rng.uniform(-0.9, -0.4)])
    body = draw_body(rng, rng.uniform(250.0, 900.0), center, (340, 300, 400, 10))
    return _rigid(rng, ceiling, hinge, body)


def _splayed_5(rng: np.random.Generator) -> Rig:
    """Four splayed cables and one more at the middle of a side: one degree of freedom is left."""
    wide, long = rng.uniform(1.5, 2.2), rng.uniform(2.6, 4.0)
    hinge = np.array([[0, 0, 0], [wide, 0, 0], [0, long, 0], [wide, long, 0], [0.5 * wide, 0, 0]])
    out = rng.uniform(0.4, 0.9, 2)
    side = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1], [0.2, -1.6]]) * out
    ceiling = hinge + np.column_stack([side, np.full(5, rng.uniform(1.5, 2.5))])
    center = np.array([0.5 * wide, 0.42 * long, rng.uniform(-1.1, -0.5)])
    body = draw_body(rng, rng.uniform(700.0, 1600.0), center, (1500, 500, 1600, 40))
    spread = rng.normal(0.0, 0.01, (2, 5, 3))
    return _rigid(rng, ceiling + spread[0], hinge + spread[1], body)


def _four(rng: np.random.Generator, wide: float, long: float, drop: float, mass: float) -> Rig:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=float)
    hinge = corners * [wide, long, 0.0] + rng.normal(0.0, 0.01, (4, 3))
    out = (2.0 * corners[:, :2] - 1.0) * rng.uniform(0.25, 0.45, 2) * drop
    ceiling = corners * [wide, long, 0.0] + np.column_stack([out, np.full(4, drop)])
    ceiling = ceiling + rng.normal(0.0, 0.01, (4, 3))
    center = np.array([0.5 * wide, 0.46 * long, -0.25 * (wide + long) * rng.uniform(0.6, 0.9)])
    xx, yy = mass * long**2 / 11.0, mass * wide**2 / 7.0
    return _rigid(rng, ceiling, hinge, draw_body(rng, mass, center, (xx, yy, 1.06 * xx, 0.02 * xx)))


def _van(rng: np.random.Generator) -> Rig:
    mass = rng.uniform(2200.0, 3500.0)
    return _four(rng, rng.uniform(2.0, 2.4), rng.uniform(4.5, 6.0), rng.uniform(2.5, 4.5), mass)


def _scooter(rng: np.random.Generator) -> Rig:
    mass = rng.uniform(90.0, 220.0)
    return _four(rng, rng.uniform(0.9, 1.3), rng.uniform(1.4, 2.0), rng.uniform(1.4, 2.2), mass)


def _rigid(rng: np.random.Generator, ceiling: Array, hinge: Array, body: Body) -> Rig:
    length = np.linalg.norm(hinge - ceiling, axis=1)
    return Geometry(ceiling - ceiling[0], hinge, length, _cells(rng, len(length))), body


def _cells(rng: np.random.Generator, cables: int) -> tuple[str, ...]:
    return tuple(str(rng.choice(["ceiling", "body"], p=[0.8, 0.2])) for _ in range(cables))


_OWN: dict[str, Callable[[np.random.Generator], Rig]] = {
    "bifilar": _bifilar,
    "splayed_5": _splayed_5,
    "van": _van,
    "scooter": _scooter,
}
