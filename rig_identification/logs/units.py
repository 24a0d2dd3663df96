"""Units that loggers write, and the factor of each to the SI unit of its dimension."""

from __future__ import annotations

import math
import re

from rig_identification.errors import InputError, did_you_mean

_DEGREE = math.pi / 180.0
_G = 9.80665  # m/s^2, standard gravity, by definition

#: SI unit -> unit -> factor. The first of each is the SI unit itself.
UNITS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "rad/s": {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": _DEGREE, "rpm": math.pi / 30.0},
    "m/s^2": {"m/s^2": 1.0, "mm/s^2": 1e-3, "g": _G, "mg": 1e-3 * _G},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": _G, "gf": 1e-3 * _G, "lbf": 4.4482216152605},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254, "ft": 0.3048},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE},
    "1": {"1": 1.0},
}
_ALIKE = {
    "sec": "s", "seconds": "s", "second": "s", "msec": "ms", "µs": "us", "μs": "us", "usec": "us",
    "minutes": "min", "dps": "deg/s", "°/s": "deg/s", "degree/s": "deg/s", "degrees/s": "deg/s",
    "m/s/s": "m/s^2", "m/s2": "m/s^2", "m/s²": "m/s^2", "ms^-2": "m/s^2", "ms-2": "m/s^2", "m s^-2": "m/s^2",
    "newton": "N", "kg": "kgf", "lb": "lbf", "lbs": "lbf", "meter": "m", "metre": "m", "µm": "um",
    "inch": "in", "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad",
    "rad s^-1": "rad/s", "rad·s⁻¹": "rad/s", "deg_s": "deg/s", "rad_s": "rad/s", "-": "1", "none": "1",
    "m_s2": "m/s^2", "ms2": "m/s^2", "mps2": "m/s^2", "1/min": "rpm", "u/min": "rpm", "degps": "deg/s",
    "radps": "rad/s", "rads": "rad/s", "degs": "deg/s",
}  # fmt: skip


def known_unit(text: str) -> str:
    """The unit of :data:`UNITS` that a text means; "" where it means none."""
    plain = re.sub(r"\s+", " ", text.strip().strip("[](){}")).replace("**", "^").replace("*", "")
    for candidate in (plain, _ALIKE.get(plain, ""), _ALIKE.get(plain.lower(), ""), plain.lower()):
        if any(candidate in units for units in UNITS.values()):
            return candidate
    return ""


def si_unit(unit: str) -> str:
    """SI unit of a known unit's dimension; "" where the unit is not known."""
    return next((si for si, units in UNITS.items() if unit in units), "")


def factor(unit: str, si: str, where: str) -> float:
    """SI units in one ``unit``.

    Raises
    ------
    InputError
        The unit is unknown, or of another dimension than ``si``; ``where`` begins the message.
    """
    known = known_unit(unit)
    if known in UNITS[si]:
        return UNITS[si][known]
    words = tuple(UNITS[si])
    if known:
        raise InputError(f"{where}: {unit} is a unit of another kind; give {' or '.join(words)}")
    raise InputError(f"{where}: unit {unit} is unknown; give {' or '.join(words)}{did_you_mean(unit, words)}")
