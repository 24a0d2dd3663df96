"""Sums and differences of bodies."""

from __future__ import annotations

import numpy as np

from bench.concealed.scene import Array, Body


def about_origin(body: Body) -> Array:
    """(3, 3) inertia about the body frame's origin, body axes."""
    return np.asarray(body.inertia + body.mass * steiner(body.center_of_mass))


def steiner(arm: Array) -> Array:
    """(3, 3) inertia of a unit mass at ``arm`` (3,)."""
    return float(arm @ arm) * np.eye(3) - np.outer(arm, arm)


def add_point(body: Body, mass: float, position: Array) -> Body:
    """The body with a point mass fixed to it; a negative mass takes one away."""
    total = body.mass + mass
    center = (body.mass * body.center_of_mass + mass * position) / total
    inertia = about_origin(body) + mass * steiner(position) - total * steiner(center)
    return Body(total, center, inertia)


def is_body(body: Body) -> bool:
    """Whether matter can have this inertia: two principal moments exceed the third, by 1 % at least."""
    principal = np.linalg.eigvalsh(body.inertia)
    return bool(principal[0] > 0.0 and principal[0] + principal[1] > 1.01 * principal[2])


def take_away(body: Body, part: Body) -> Body:
    """What is left of ``body`` without ``part``."""
    mass = body.mass - part.mass
    center = (body.mass * body.center_of_mass - part.mass * part.center_of_mass) / mass
    return Body(mass, center, about_origin(body) - about_origin(part) - mass * steiner(center))
