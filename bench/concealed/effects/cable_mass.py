"""The cables weigh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.place import level_origin
from bench.concealed.mechanism import CONSTRAINT_TIME, IMPEDANCE
from bench.concealed.scene import Array, Body, Plan, Scene


@dataclass(frozen=True)
class CableMass(Effect):
    """Every cable a straight rod of even density, hung by a joint that does not spin."""

    name = "cable_mass"
    mechanical = True
    aside = True
    own_cables = True
    linear_density: float  # kg/m

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CableMass:
        """From thin rope to heavy chain."""
        return cls(log_size(size, 0.1, 4.0))

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> CableMass:
        """Up to a chain of 2 kg/m."""
        return cls(log_size(size, 0.1, 2.0))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        return {"parameters": {"linear_density": quantity(self.linear_density, "kg/m")}}

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        origin = level_origin(scene)
        # A yielding ceiling carries the rods, if there is one.
        ceiling = spec.body("plate") or spec.worldbody
        for i, length in enumerate(scene.geometry.length):
            span = origin + scene.geometry.hinge[i] - scene.geometry.ceiling[i]
            mass = self.linear_density * length
            rod = ceiling.add_body(name=f"rod_{i}", pos=scene.geometry.ceiling[i], quat=_z_along(-span))
            rod.explicitinertial = True
            rod.mass, rod.ipos = mass, [0.0, 0.0, -0.5 * length]
            across = mass * length**2 / 12.0
            rod.fullinertia = [across, across, 1e-6 * across, 0.0, 0.0, 0.0]
            for axis in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]):
                rod.add_joint(name=f"rod_{i}_{int(axis[1])}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
            rod.add_site(name=f"rod_{i}_top")
            spec.add_sensor(
                name=f"rod_{i}",
                type=mujoco.mjtSensor.mjSENS_FORCE,
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                objname=f"rod_{i}_top",
            )
            rod.add_site(name=f"rod_{i}_end", pos=[0.0, 0.0, -length])
            spec.add_equality(
                name=f"cable_{i}",
                type=mujoco.mjtEq.mjEQ_CONNECT,
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                name1=f"rod_{i}_end",
                name2=f"hinge_{i}",
                solref=[CONSTRAINT_TIME, 1.0],
                solimp=[IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0],
            )

    def assemble(self, made: Any, scene: Scene) -> None:
        """See :class:`Effect`."""
        origin, g = level_origin(scene), scene.geometry
        for top, hinge, length, cell in zip(g.ceiling, g.hinge, g.length, g.load_cell, strict=True):
            up = top - origin - hinge
            turn = Rotation.align_vectors(up[None] / np.linalg.norm(up), [[0.0, 0.0, 1.0]])[0].as_matrix()
            mass = self.linear_density * length
            across = mass * length**2 / 12.0
            # What it spins about itself with does not matter
            inertia = np.diag([across, across, 1e-3 * across])
            made.rod(top, hinge, Body(mass, np.array([0.0, 0.0, -0.5 * length]), inertia), turn, length, cell)

    def tension(self, model: Any, data: Any, scene: Scene) -> Array:
        """At the ceiling what the joint carries along the rod, at the body what the connection carries."""
        mujoco.mj_rnePostConstraint(model, data)
        out = np.empty(len(scene.geometry.length))
        for i, cell in enumerate(scene.geometry.load_cell):
            rod = data.body(f"rod_{i}")
            down = -rod.xmat.reshape(3, 3)[:, 2]
            if cell == "body":
                out[i] = abs(float(data.efc_force[3 * i : 3 * i + 3] @ down))
            else:
                out[i] = abs(float(data.sensor(f"rod_{i}").data[2]))
        return out


def _z_along(direction: Array) -> Array:
    """(4,) quaternion wxyz of a frame whose z axis points along ``direction`` (3,)."""
    quaternion = np.empty(4)
    mujoco.mju_quatZ2Vec(quaternion, direction / np.linalg.norm(direction))
    return quaternion
