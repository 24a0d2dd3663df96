"""Where effects sit, and how the scene around them changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.concealed.scene import Array, Scene


def random_cable(rng: np.random.Generator, scene: Scene) -> int:
    """Index of a cable."""
    return int(rng.integers(len(scene.geometry.length)))


def tank(rng: np.random.Generator, scene: Scene) -> Array:
    """(3,) m, body: a place within the body where a tank, a part or a hose can be."""
    span = scene.geometry.hinge[:, :2].max(axis=0)
    depth = scene.body.center_of_mass[2] * rng.uniform(0.5, 1.3)
    return np.round(np.array([*rng.uniform(0.1, 0.9, 2) * span, depth]), 3)


def with_entry(values: Array, index: int, value: float) -> Array:
    """A copy with one entry replaced."""
    changed = np.array(values, dtype=float)
    changed[index] = value
    return changed


def released_aside(scene: Scene) -> Scene:
    """The same scene with every run released from rest under a sideways pull."""
    plans = tuple(replace(p, start="pull") if p.start == "thesis" else p for p in scene.plans)
    return replace(scene, plans=plans)


def level_origin(scene: Scene) -> Array:
    """(3,) m, world: where the body origin is if the body hangs level; least squares over the cables."""
    geometry = scene.geometry
    origin = np.mean(geometry.ceiling - geometry.hinge, axis=0) - [0.0, 0.0, np.mean(geometry.length)]
    for _ in range(50):
        arm = origin + geometry.hinge - geometry.ceiling
        length = np.linalg.norm(arm, axis=1)
        # Nearly parallel cables say nothing of where it is sideways: weak directions stay as they are.
        step = np.linalg.lstsq(arm / length[:, None], length - geometry.length, rcond=0.05)[0]
        origin = origin - step
    return np.asarray(origin)


def hanging(scene: Scene, position: Array) -> Array:
    """(3,) m, world: where a body point is while the body hangs at rest, nothing left out."""
    if scene.at_rest is None:
        return level_origin(scene) + position
    origin, rotation = scene.at_rest
    return np.asarray(origin + rotation @ position)
