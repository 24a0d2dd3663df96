"""Parts that MuJoCo mechanisms of the rig are made of."""

from __future__ import annotations

import mujoco
import numpy as np

from bench.concealed.scene import Array, Scene

STEP = 0.0005  # s
CONSTRAINT_TIME = 2.0 * STEP  # s: the shortest that MuJoCo keeps stable
IMPEDANCE = 0.9999  # MuJoCo's largest


def give_mass(body: mujoco.MjsBody, mass: float, center: Array, inertia: Array) -> None:
    """Set mass (kg), centre (3,) and inertia about it (3, 3) of a body, in its own axes."""
    body.explicitinertial = True
    body.mass = mass
    body.ipos = center
    j = inertia
    body.fullinertia = [j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2]]


def add_rigid_cables(spec: mujoco.MjSpec, scene: Scene) -> None:
    """One tendon per cable between its hinges, held at its length."""
    for i in range(len(scene.geometry.length)):
        tendon = spec.add_tendon(name=f"cable_{i}")
        tendon.wrap_site(f"ceiling_{i}")
        tendon.wrap_site(f"hinge_{i}")
        spec.add_equality(
            name=f"cable_{i}",
            type=mujoco.mjtEq.mjEQ_TENDON,
            name1=f"cable_{i}",
            solref=[CONSTRAINT_TIME, 1.0],
            solimp=[IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0],
        )


def set_lengths(model: mujoco.MjModel, length: Array) -> None:
    """Hold each rigid cable at ``length`` (n,), whatever pose the model was compiled in."""
    for i, value in enumerate(length):
        model.eq_data[i, 0] = value - model.tendon_length0[i]


def rigid_tension(data: mujoco.MjData, cables: int) -> Array:
    """(cables,) force of the rigid cables, positive when they pull."""
    # MuJoCo lists equalities first, in the order they were added: an effect's own come after the cables.
    return np.asarray(-data.efc_force[:cables])
