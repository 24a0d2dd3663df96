"""Left-out physics of a simulation: its switches told by the contract's names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

#: Kind of a device's error -> the contract's effect; orientation is told apart by its device.
_OF_DEVICE = {
    "gyroscope_bias": "imu_bias",
    "accelerometer_bias": "imu_bias",
    "gyroscope_scale": "imu_scale",
    "accelerometer_scale": "imu_scale",
    "position": "imu_position",
    "load_cell_gain": "load_cell_gain",
    "load_cell_zero": "load_cell_offset",
    "clock": "clock_offset",
    "lag": "sensor_lag",
    "mount": "sensor_resonance",
    "zero": "inclinometer_offset",
}
#: Kind of an error of where the exciter is -> the contract's effect.
_OF_EXCITER = {"position": "exciter_position", "orientation": "exciter_misalignment"}
#: Switches that belong to an effect of another name; ropes that twist have none in the contract's table.
_OF_SWITCH = {
    "cable_damping_ratio": "cable_elasticity",
    "cable_torsion": "unknown",
    "gyroscopic_share": "gyroscopic_term",
} | dict.fromkeys(("tether_damping", "tether_point", "tether_pull", "tether_reach"), "tether")


def effect_of(name: str) -> str:
    """The contract's effect that a switch, or a device's error, belongs to."""
    first, _, rest = name.partition(".")
    kind = rest.partition(".")[0]
    if {"feels", "drift", "load_cell_curve", "load_cell_hysteresis", "load_cell_play"} & set(rest.split(".")):
        # A law of a reading, which the contract's table has no word for
        return "unknown"
    if first == "exciter" and kind in _OF_EXCITER:
        return _OF_EXCITER[kind]
    if kind == "orientation":
        return "imu_misalignment" if first == "imu" else "inclinometer_offset"
    return _OF_SWITCH.get(first, _OF_DEVICE.get(kind, first) if first not in _WITH_PARTS else first)


#: Effects whose switches have names of their own behind a dot, as ``sprung_mass.position``.
_WITH_PARTS = frozenset(
    (
        "ceiling_compliance",
        "external_force",
        "hinge_position",
        "liquid_slosh",
        "loose_mass",
        "point_law",
        "sprung_mass",
    )
)


def effects_document(effects: Mapping[str, tuple[float, ...]]) -> list[dict[str, Any]]:
    """One entry an effect that was switched on, for ``truth.json``: its switches and their numbers."""
    found = sorted({effect_of(name) for name in effects})
    return [
        {"effect": effect, "switches": {n: list(v) for n, v in effects.items() if effect_of(n) == effect}}
        for effect in found
    ]
