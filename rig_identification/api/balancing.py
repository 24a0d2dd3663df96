"""``center_of_mass``: what angles, lengths and a known mass tell of a body at rest (thesis, chapter 2)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rig_identification.recording import Dummy
    from rig_identification.rig import Rig
    from rig_identification.session.fields import Fields
    from rig_identification.statics import StaticObservation, StaticSolution

#: What faults of readings begin with.
READINGS = Path("readings")
#: kg, m, N: beyond is a wrong unit (rig descriptions have the same limit of lengths).
MOST_MASS, MOST_LENGTH, MOST_FORCE = 1e6, 100.0, 1e7


@dataclass(frozen=True)
class Balance:
    """A rig whose lengths and mass are as read, and what its readings at rest tell."""

    rig: Rig
    solution: StaticSolution


def center_of_mass(rig: Rig, readings: Mapping[str, Any]) -> Balance:
    """Find pose, cable forces and centre of mass of a body at rest.

    Parameters
    ----------
    rig : Rig
        Hinges and tolerances.
    readings : mapping
        ``mass`` (kg, of all but the known mass), ``lengths`` (m, by cable), ``rest``, a list of recordings:
        ``name``, ``inclination_deg`` (two, of the inclinometer's x and y axis above the horizontal plane),
        ``inclination_std_deg``, and where there are such ``tension`` and ``tension_std`` (N, by cable) and
        ``dummy``: ``mass`` (kg) and ``position`` (m, body) of the known mass.

    Raises
    ------
    FieldError
        A reading that cannot be used; its ``key`` names it.
    InputError
        The readings do not fit together.
    """
    from rig_identification.session.fields import Fields
    from rig_identification.statics import solve_center_of_mass

    top = Fields(READINGS, "", readings)
    top.refuse_unknown(("mass", "lengths", "rest"))
    read = _as_read(rig, top)
    entries = top.entries("rest", "the recordings at rest", "{inclination_deg: ...}")
    return Balance(read, solve_center_of_mass(read, *(_observed(read, entry) for entry in entries)))


def example() -> tuple[Rig, Mapping[str, Any]]:
    """Table 2.1 of the thesis, and what an inclinometer reads there bare and with the known mass."""
    from rig_identification.statics import find_equilibria, observe_equilibrium
    from rig_identification.thesis.static_case import load_static_case

    case = load_static_case()
    assert case.rig.mass is not None
    rest = []
    for name, dummy in (("bare", None), ("with the known mass", case.dummy)):
        hung = find_equilibria(case.rig, case.rig.mass, case.combined, dummy).equilibria[0]
        seen = observe_equilibrium(case.rig, hung, name, dummy)
        angles = [round(math.degrees(angle), 5) for angle in seen.inclination]
        entry: dict[str, Any] = {"name": name, "inclination_deg": angles, "inclination_std_deg": 0.001}
        if dummy is not None:
            entry["dummy"] = {"mass": float(dummy.mass), "position": dummy.position.tolist()}
        rest.append(entry)
    lengths = {cable.name: float(cable.length) for cable in case.rig.cables}
    return case.rig, {"mass": case.rig.mass, "lengths": lengths, "rest": rest}


def _as_read(rig: Rig, top: Fields) -> Rig:
    """The rig with the mass and the lengths that were read."""
    lengths = top.section("lengths", "a length by cable")
    lengths.refuse_unknown([cable.name for cable in rig.cables])
    cables = tuple(
        replace(cable, length=lengths.number(cable.name, "m", above=0.0, at_most=MOST_LENGTH))
        if lengths.has(cable.name)
        else cable
        for cable in rig.cables
    )
    mass = top.number("mass", "kg", above=0.0, at_most=MOST_MASS) if top.has("mass") else None
    if mass is not None and rig.frame is not None and mass <= rig.frame.mass:
        raise top.fault("mass", f"{mass:g} kg is not above the carrying frame's {rig.frame.mass:g} kg")
    return replace(rig, cables=cables, mass=mass)


def _observed(rig: Rig, entry: Fields) -> StaticObservation:
    import numpy as np

    from rig_identification.statics import StaticObservation

    entry.refuse_unknown(
        ("name", "inclination_deg", "inclination_std_deg", "tension", "tension_std", "dummy")
    )
    angles = entry.vector("inclination_deg", 2, "°", limit=89.0)
    if np.sum(np.sin(np.radians(angles)) ** 2) >= 1.0:
        raise entry.fault("inclination_deg", "no attitude has both angles; check them")
    std = entry.number("inclination_std_deg", "°", at_least=0.0, at_most=10.0)
    tension = np.full(len(rig.cables), np.nan)
    tension_std = tension.copy()
    if entry.has("tension"):
        forces = entry.section("tension", "a force by cable")
        for place, cable in enumerate(rig.cables):
            if forces.has(cable.name):
                tension[place] = forces.number(cable.name, "N", at_least=0.0, at_most=MOST_FORCE)
                tension_std[place] = entry.number("tension_std", "N", above=0.0, at_most=MOST_FORCE)
    return StaticObservation(
        name=entry.text("name", "a name"),
        inclination=np.radians(angles),
        inclination_std=np.full(2, math.radians(std)),
        tension=tension,
        tension_std=tension_std,
        dummy=_dummy(entry) if entry.has("dummy") else None,
    )


def _dummy(entry: Fields) -> Dummy:
    from rig_identification.recording import Dummy

    fields = entry.section("dummy", "mass and position of the known mass")
    fields.refuse_unknown(("mass", "position"))
    mass = fields.number("mass", "kg", above=0.0, at_most=MOST_MASS)
    return Dummy(mass, fields.vector("position", 3, "m", limit=MOST_LENGTH))
