"""Machine code of the live nodes, compiled before they start: once after installation, which takes minutes.

Afterwards it is loaded from disk. Any rig will do: what is compiled does not depend on the numbers.
"""

from __future__ import annotations

import numpy as np

from rig_identification.live.body_tracker import BodyTracker
from rig_identification.live.plant import Plant
from rig_identification.live.plant_effects import PlantEffects, with_effects
from rig_identification.model.motion import rig_model
from rig_identification.rig import Cable, Mount, Rig

_LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
_CORNERS = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
_BODY = np.array([10.0, 0.3, 0.3, -0.2, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0])


def _rig() -> Rig:
    cables = tuple(
        Cable(f"cable_{i}", np.array([x, y, 1.0]), np.array([x, y, z]), 1.0)
        for i, (x, y, z) in enumerate(_CORNERS)
    )
    mount = Mount(np.array([0.3, 0.3, 0.0]), _LEVEL)
    return Rig(gravity=9.81, cables=cables, mass=10.0, imu=mount, inclinometer=mount, exciter=mount)


def compile_plant() -> None:
    """What ``rig_simulator`` runs."""
    plant = Plant(with_effects(rig_model(_rig(), _BODY), PlantEffects()), 1)
    plant.advance(0.01)


def compile_tracker() -> None:
    """What ``tracker`` runs."""
    rig = _rig()
    tracker = BodyTracker(rig)
    tracker.add_inclination(np.array([1_000_000]), np.zeros((1, 2)))
    for cable in rig.cables:
        tracker.add_tension(cable.name, np.array([1_000_000]), np.array([[33.0]]))
    tracker.add_imu(1_000_000 * np.arange(1, 60), np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 9.8], (59, 1)))
