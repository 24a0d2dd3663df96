"""Physics that the ideal model leaves out: one entry for each file of model/effects."""

from __future__ import annotations

import numpy as np

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import AXES, Parameter, ParameterSet
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.rig import Rig


def _added(name: str, unit: str, std: float, entry: int, nominal: float = 0.0) -> Parameter:
    return Parameter(name, unit, nominal, std, "physics", entry, bounded=False)


def _tether(
    axes: str, block: int, mass: float, gravity: float, length: float, size: float, middle: np.ndarray
) -> Candidate:
    """A tether that pulls along ``axes``: along one as a taut hose does, along all as one that hangs."""
    spring, pull = 0.2 * mass * gravity / length, 0.02 * mass * gravity
    parts = [
        _added(f"tether.{what}.{a}", unit, std, block + entry + AXES.index(a))
        for what, unit, std, entry in (
            ("stiffness", "N/m", spring, place.TETHER_STIFFNESS),
            ("pull", "N", pull, place.TETHER_PULL),
        )
        for a in axes
    ]
    parts += [
        _added(f"tether.point.{a}", "m", size, block + place.TETHER_POINT + i, float(middle[i]))
        for i, a in enumerate(AXES)
    ]

    def told(values: dict[str, float], stds: dict[str, float]) -> Told:
        stiff = {a: values[f"tether.stiffness.{a}"] for a in axes}
        main = max(stiff, key=lambda a: abs(stiff[a]))
        out: Told = {"stiffness": (stiff[main], stds[f"tether.stiffness.{main}"], "N/m")}
        for p in parts:
            _, what, a = p.name.split(".")
            if what == "point" or len(axes) > 1:
                out[f"{what}_{a}"] = (values[p.name], stds[p.name], p.unit)
            elif what == "pull":
                out["preload"] = (abs(values[p.name]), stds[p.name], p.unit)
        return out

    return Candidate(
        "tether",
        tuple(parts),
        "A hose or wire pulls on the body with a stiffness of {value}.",
        "Let cables and hoses hang free in a long loop, or take them off.",
        {"channel": None, "axis": axes if len(axes) == 1 else None},
        positive=len(axes),
        tell=told,
    )


def left_out_physics(rig: Rig, parameters: ParameterSet, mass: float) -> list[Candidate]:
    """Every effect on the motion, with priors scaled to this rig and body.

    mass: kg, roughly. A prior's std is what such rigs can plausibly show: a tenth of
    critical damping, friction of a dry bearing of a centimetre's radius, a body's frontal
    area, percents of its mass.
    """
    n = len(rig.cables)
    block = layout.effects_offset(n)
    length = float(np.mean([c.length for c in rig.cables]))
    size = float(np.max(extent(rig)))
    speed = np.sqrt(rig.gravity * length)
    middle = np.mean([c.body_point for c in rig.cables], axis=0) - [0.0, 0.0, 0.3 * size]
    out = [
        Candidate(
            "hinge_damping",
            (
                _added(
                    "hinge.damping", "N*m*s/rad", 0.1 * mass * length * speed / (2 * n), block + place.DAMPING
                ),
            ),
            "The cables' hinges damp the motion: each puts {value} against the rate at which it turns.",
            "Use knife edges or ball joints, or keep the damping in the model.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="damping",
        ),
        Candidate(
            "hinge_friction",
            (_added("hinge.friction", "N*m", 0.003 * mass * rig.gravity / n, block + place.FRICTION),),
            "The cables' hinges rub: each holds against turning with {value}.",
            "Grease or replace the hinges; dry friction spoils small motions most.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="torque",
        ),
        Candidate(
            "air_drag",
            (_added("air.drag_area", "m^2", 3.0 * size**2, block + place.DRAG_AREA),),
            "The air resists with the square of speed: a drag area of {value}.",
            "Keep speeds low, or keep the drag in the model.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="drag_area",
        ),
        Candidate(
            "air_added_mass",
            (_added("air.added_mass", "kg", 0.02 * mass, block + place.ADDED_MASS),),
            "Air that moves with the body adds {value} to its inertia but not to its weight.",
            "Motion alone cannot tell entrained air from inertia: it shows against scale and statics.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="added_mass",
        ),
        Candidate(
            "cable_mass",
            (_added("cable.linear_density", "kg/m", 0.002 * mass / n, block + place.LINEAR_DENSITY),),
            "The cables weigh {value}.",
            "Weigh a length of the cable and enter it.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="linear_density",
        ),
        *(_tether(axes, block, mass, rig.gravity, length, size, middle) for axes in (*AXES, AXES)),
    ]
    if rig.exciter is not None:
        out.append(
            Candidate(
                "exciter_rotor",
                (_added("exciter.rotor_mass", "kg", 0.03 * mass, block + place.ROTOR_MASS),),
                "The exciter's moving mass of {value} rides on the body, unweighed.",
                "Weigh the motor with its unbalance and add it to the body.",
                {"channel": "exciter", "axis": None},
                positive=1,
                name_in_result="rotor_mass",
            )
        )
    _ = parameters
    return out
