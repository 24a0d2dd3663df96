"""The contract's table as a scorer needs it: which parameters an effect is asked for, what is inseparable."""

from __future__ import annotations

#: Parameters that the recording contract names, by effect. Others may stand beside them and are not scored.
PARAMETERS: dict[str, tuple[str, ...]] = {
    "imu_bias": ("angular_rate", "specific_force"),
    "imu_scale": ("scale",),
    "imu_misalignment": ("angle",),
    "imu_position": ("error",),
    "load_cell_gain": ("gain",),
    "load_cell_offset": ("offset",),
    "exciter_gain": ("gain",),
    "inclinometer_offset": ("offset",),
    "clock_offset": ("offset",),
    "sensor_lag": ("time_constant",),
    "cable_length": ("error",),
    "hinge_position": ("error",),
    "level_error": ("angle",),
    "cable_elasticity": ("axial_stiffness", "damping_ratio"),
    "cable_mass": ("linear_density",),
    "cable_slack": (),
    "hinge_damping": ("damping",),
    "hinge_friction": ("torque",),
    "air_drag": ("drag_area",),
    "air_added_mass": ("added_mass",),
    "ceiling_compliance": ("stiffness", "mass"),
    "exciter_rotor": ("rotor_mass",),
    "liquid_slosh": ("mass", "frequency", "damping_ratio"),
    "sprung_mass": ("mass", "frequency", "damping_ratio"),
    "loose_mass": ("mass",),
    "tether": ("stiffness",),
    "external_force": ("peak_force",),
}

#: What motion cannot tell from inertia: to be named, or stated among what cannot be told apart; not guessed.
INSEPARABLE = frozenset({"air_added_mass", "exciter_rotor"})

#: Log likelihood by which an alternative may trail the first finding and still count as a stated tie.
TIE = 3.0

#: In units of sigma: from here an effect is of clear size.
CLEAR = 5.0
