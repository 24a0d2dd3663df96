"""Air that a side of the body carries along, at a place that is tried (place_scan.py)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import AXES
from rig_identification.mismatch.candidate import Candidate, Told, added
from rig_identification.mismatch.place_scan import Scales, point_near_middle
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.motion import Motion, RigModel
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Name of the amounts: one such place is in a model at most.
CARRIED_NAME = "air.carried"


@dataclass(frozen=True)
class CarriedAir:
    """Air that moves with a place, as much along each of the body's axes as may be."""

    @property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """A mass for each axis."""
        return tuple((f"added_mass_{a}", "kg") for a in AXES)

    def candidate(self, rig: Rig, scales: Scales) -> Candidate:
        """The hypothesis that air is carried along somewhere."""
        block = layout.effects_offset(len(rig.cables))
        masses = tuple(
            added(f"{CARRIED_NAME}.{a}", "kg", _plausible(scales), block + place.AIR_CARRIED + i)
            for i, a in enumerate(AXES)
        )
        point = point_near_middle("air_added_mass", rig, 0.3 * scales.size, place.AIR_CARRIED_POINT)

        def told(found: Estimates) -> Told:
            each = {f"added_mass_{a}": (*found.of(m.name), "kg") for a, m in zip(AXES, masses, strict=True)}
            most = max(masses, key=lambda m: found.values[m.name])
            return {"added_mass": (*found.of(most.name), "kg"), **each}

        return Candidate(
            "air_added_mass",
            (*masses, *point),
            "Air that a side of the body carries along adds inertia, {told[added_mass_x]}, "
            "{told[added_mass_y]} and {told[added_mass_z]} along x, y and z, but no weight.",
            "Take off panels and sheets that push air before them, or keep its inertia in the model.",
            {"channel": None, "axis": None},
            positive=3,
            tell=told,
        )

    def values(self, candidate: Candidate, at: Array, amounts: Array, scales: Scales) -> dict[str, float]:
        """Values of its parameters at the place ``at``."""
        masses = {
            q.name: max(0.0, q.value(float(a)))
            for q, a in zip(candidate.parameters[:3], amounts, strict=True)
        }
        return masses | {f"air_added_mass.point.{a}": float(at[i]) for i, a in enumerate(AXES)}

    def makes_sense(self, amounts: Array) -> bool:
        """Whether inertia is added: along other axes noise alone may take some away."""
        return bool(np.max(amounts) > -np.min(amounts))

    def wrenches(self, model: RigModel, motion: Motion, at: Array, scales: Scales) -> Array:
        """(N, 6, 3) wrench about the datum, body axes, of a std of each mass (model/effects/air_carried.py).

        Less the small terms that anisotropy adds: D du/dt as D times the acceleration of the place.
        """
        out = motion.outputs
        w = motion.states[:, layout.RATE : layout.RATE + 3]
        free, gravity, angular = (
            out[:, first : first + 3]
            for first in (layout.OUT_SPECIFIC_FORCE, layout.OUT_GRAVITY, layout.OUT_ANGULAR_ACCELERATION)
        )
        a = free + gravity + np.cross(angular, at) + np.cross(w, np.cross(w, at))
        force = -_plausible(scales) * a[:, None, :] * np.eye(3)
        moment = np.cross(at, np.swapaxes(force, 1, 2))
        return np.asarray(np.concatenate([force, np.swapaxes(moment, 1, 2)], axis=1))


def _plausible(scales: Scales) -> float:
    """kg, std of the prior of each mass: air of the volume of a cube as wide as the rig's longest side.

    A square plate of that side carries 0.48 of it along, a sphere as wide 0.26 (Lamb 1932).
    """
    return AIR * scales.size**3
