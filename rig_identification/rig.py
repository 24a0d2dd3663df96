"""What the lab believes about its rig: frozen values, SI units, no files.

Frames: ``world`` is fixed to the room with z up; ``body`` is fixed to the carrying
frame. Orientations are quaternions ``x y z w`` that rotate vectors of the mounted
device into ``body``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

#: Standard deviation of one sample; ``None`` in :class:`Noise` means "estimate it".
#: Standard deviation of what the lab believes, where the description is silent (contract).
DEFAULT_TOLERANCE = {
    "cable_length": 0.0005,  # m
    "hinge_position": 0.0005,  # m, each coordinate, either end
    "level": 0.0005,  # rad
    "imu_position": 0.001,  # m
    "imu_orientation": 0.001,  # rad
    "inclinometer_orientation": 0.0003,  # rad
    "exciter_position": 0.001,  # m
    "exciter_orientation": 0.001,  # rad
    "load_cell_gain": 0.0005,  # 1
    "load_cell_zero": 3.0,  # N
    "exciter_gain": 0.001,  # 1
    "accelerometer_bias": 0.02,  # m/s^2
    "accelerometer_scale": 0.001,  # 1
    "gyroscope_bias": 0.001,  # rad/s
    "gyroscope_scale": 0.001,  # 1
    "clock": 0.0005,  # s
}

NOISE_NAMES = (
    "tension",  # N
    "exciter_force",  # N
    "specific_force",  # m/s^2
    "angular_rate",  # rad/s
    "inclination",  # rad
    "mocap_position",  # m
    "mocap_orientation",  # rad
)


@dataclass(frozen=True)
class Cable:
    """One cable between a hinge on the ceiling and a hinge on the body."""

    name: str
    ceiling_point: Vector  # (3,) m, world
    body_point: Vector  # (3,) m, body
    length: float  # m, between the hinge centres, unloaded
    load_cell: str = "ceiling"  # the end that carries the load cell: "ceiling" or "body"


@dataclass(frozen=True)
class Mount:
    """Where a device sits on the body."""

    position: Vector  # (3,) m, body
    orientation: Vector  # (4,) quaternion xyzw, rotates device-frame vectors into body


@dataclass(frozen=True)
class CarryingFrame:
    """The carrying frame alone, weighed and measured by itself."""

    mass: float  # kg
    center_of_mass: Vector  # (3,) m, body
    inertia: Vector  # (3, 3) kg m^2, about its own centre of mass, body axes


@dataclass(frozen=True)
class WheelContacts:
    """Where a vehicle's four wheels touch level ground; (3,) m, body."""

    front_left: Vector
    front_right: Vector
    rear_left: Vector
    rear_right: Vector


@dataclass(frozen=True)
class Rig:
    """A rig description (recording contract, section "Rig description")."""

    gravity: float  # m/s^2, along world -z
    cables: tuple[Cable, ...]  # two or more
    mass: float | None = None  # kg, body and frame together, from the ground scale
    mass_std: float | None = None  # kg
    cable_linear_density: float | None = None  # kg/m, as weighed; None: not known, and taken for none
    frame: CarryingFrame | None = None
    imu: Mount | None = None
    inclinometer: Mount | None = None  # its position does not matter and is zero
    exciter: Mount | None = None
    mocap: Mount | None = None  # pose of the marker frame in body; None: not known
    vehicle: WheelContacts | None = None  # None: the body is no vehicle, or nobody said where its wheels are
    noise: dict[str, float] = field(default_factory=dict)  # keys of NOISE_NAMES; missing: estimate it
    tolerance: dict[str, float] = field(default_factory=lambda: dict(DEFAULT_TOLERANCE))  # complete

    def cable_weight_at_cells(self, steepness: NDArray[np.float64]) -> NDArray[np.float64]:
        """(..., n) N: what the cables' known weight adds at their load cells, at rest.

        steepness (..., n): upward component of each cable's direction. A cell at the ceiling carries what of
        the weight lies along the cable. Across itself a cable rests half on the body: newtons to the side, in
        which opposite cables cancel. The forward model has all of it (model/effects/cable_mass.py); this is
        for what reads tensions without a model.
        """
        length = np.array([cable.length for cable in self.cables])
        carried = np.array([cable.load_cell == "ceiling" for cable in self.cables])
        return np.asarray((self.cable_linear_density or 0.0) * self.gravity * length * carried * steepness)
