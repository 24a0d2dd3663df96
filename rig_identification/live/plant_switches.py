"""The switches of every effect that a simulated plant can have: name, range and meaning, in one table.

``rig_simulator`` takes them as parameters ``effect.NAME``, ``rig-identification simulate`` as
``--effect NAME=VALUE``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError, did_you_mean
from rig_identification.live.plant_effects import PlantEffects, Rider, YieldingCeiling
from rig_identification.live.push import Push
from rig_identification.model import layout
from rig_identification.model.body import can_exist, elements_from_linear, linear_from_elements
from rig_identification.model.motion import RigModel
from rig_identification.own import own_effects

Array = NDArray[np.float64]
#: Widths that the rig decides: one number each cable, three each cable, or as many as one likes.
CABLE, POINTS, ANY = -1, -3, 0


@dataclass(frozen=True)
class Switch:
    """One number, or a list of them, of an effect."""

    name: str
    default: float | tuple[float, ...]  # of an effect's first switch: the effect is off
    meaning: str
    low: float
    high: float
    unit: str = ""
    width: int = 1

    def checked(self, given: object, cables: int, prefix: str) -> Array:
        """Values (w,) of this switch. One number stands for all cables, three for all cables' points.

        Raises InputError where a number is out of range, or their count is not the rig's.
        """
        try:
            values = np.atleast_1d(np.array(given, dtype=float))
        except (TypeError, ValueError) as error:
            raise InputError(f"{prefix}{self.name}: {given!r} is no number") from error
        for value in values:
            if not self.low <= value <= self.high:
                limits = f"{self.low:g} and {self.high:g} {self.unit}".strip()
                told = f"{value:g} {self.unit}".strip()
                raise InputError(f"{prefix}{self.name}: {told} is not within {limits}")
        widths = {CABLE: (1, cables), POINTS: (1, 3, 3 * cables), ANY: ()}.get(self.width, (self.width,))
        if widths and values.size not in widths:
            allowed = " or ".join(map(str, widths))
            raise InputError(f"{prefix}{self.name}: has {values.size} numbers; give {allowed}")
        return values


_PLACE = (-100.0, 100.0, "m", 3)
_METRE = (-1.0, 1.0, "m")
_NOWHERE, _X = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)
SWITCHES = (
    Switch("hinge_damping", (0.0,), "N m s/rad of hinges, each cable's or all", 0.0, 1e6, "", CABLE),
    Switch("hinge_friction", (0.0,), "N m of hinges, each cable's or all", 0.0, 1e6, "", CABLE),
    Switch("hinge_bending", (0.0, 0.0), "N m s/rad of bending hinges: ceiling, body", 0.0, 1e6, "", 2),
    Switch("held_ends", (0.0,), "N m/rad: xx, xy, yy of upper ends, each or all", -1e9, 1e9, "", POINTS),
    Switch("air_drag", 0.0, "Cd A, m^2", 0.0, 1e4, "m^2"),
    Switch("air_plates", (0.0, 0.0), "Cd A of the sides that face the body's x and y", 0.0, 1e4, "m^2", 2),
    Switch("air_plates.reach", 0.5, "m from the centre of mass to the body's sides", 0.0, 100.0, "m"),
    Switch("air_plate", 0.0, "Cd A of one flat side", 0.0, 1e4, "m^2"),
    Switch("air_plate.normal", (0.0, 0.0), "azimuth and elevation of its normal in the body", -7.0, 7.0,
    "rad", 2), Switch("air_plate.point", (0.0, 0.0, 0.0), "its place in the body", -100.0, 100.0, "m", 3),
    Switch("air_plate.along", 0.0, "share of the speed along it that counts: 0 to 1", 0.0, 1.0),
    Switch("spin", (0.0, 0.0, 0.0), "angular momentum of what spins on the body, body axes", -1e6, 1e6,
    "N m s", 3), Switch("turning_cube", 0.0, "N m against the cube of the turn's sine; softens below 0",
    -1e6, 1e6), Switch("air_added_mass", 0.0, "kg of entrained air", 0.0, 1e4, "kg"),
    Switch("air_carried", (0.0, 0.0, 0.0), "kg of air that a side carries along the body's axes", 0.0, 1e4,
    "kg", 3), Switch("air_carried.point", (0.0, 0.0, 0.0), "its place in the body", -100.0, 100.0, "m", 3),
    Switch("gyroscopic_share", 0.0, "share of the gyroscopic moment left out: the thesis' 1", 0.0, 1.0),
    Switch("exciter_rotor", 0.0, "kg that the exciter moves", 0.0, 1e4, "kg"),
    Switch("exciter_gain", 0.0, "0.01: the true force is 1 % above the measured", -0.5, 0.5),
    Switch("cable_mass", 0.0, "kg/m of the cables", 0.0, 1e3, "kg/m"),
    Switch("cable_torsion", 0.0, "N m/rad with which each cable resists being twisted", 0.0, 1e6),
    Switch("cable_torsion.twist", _NOWHERE, "N m, world, that twist each cable at rest", -1e6, 1e6, "N m", 3),
    Switch("cable_elasticity", 0.0, "EA of the cables, N; 0: inextensible", 0.0, 1e12, "N"),
    Switch("cable_damping_ratio", 0.03, "of the body's bounce on its cables", 0.0, 2.0),
    Switch("cable_length", (0.0,), "m that cables are longer than described, each or all", *_METRE, CABLE),
    Switch("hinge_position.ceiling", (0.0,), "m, world: error of upper hinges, each or all", *_METRE, POINTS),
    Switch("hinge_position.body", (0.0,), "m, body: error of lower hinges, each or all", *_METRE, POINTS),
    Switch("cable_edge", 0.0, "m, radius of what every cable bends over at the ceiling", 0.0, 1.0, "m"),
    Switch("level_error", (0.0, 0.0), "rad, ceiling tilted about world x and y", -0.5, 0.5, "rad", 2),
    Switch("ceiling_compliance.stiffness", _NOWHERE, "N/m along world axes; 0: stiff", 0.0, 1e12, "N/m", 3),
    Switch("ceiling_compliance.mass", 100.0, "kg of the ceiling that move with the hinges", 0.1, 1e6, "kg"),
    Switch("ceiling_compliance.damping_ratio", 0.03, "of the ceiling's own swing", 0.0, 2.0),
    Switch("tether", _NOWHERE, "N/m along world axes, or of the hose along its reach", 0.0, 1e9, "N/m", 3),
    Switch("tether_point", _NOWHERE, "m, body frame", *_PLACE),
    Switch("tether_pull", _NOWHERE, "N along world axes where the rig hangs without it", -1e6, 1e6, "N", 3),
    Switch("tether_reach", _NOWHERE, "m, world: from there to a wall; 0: on each axis a spring", *_PLACE),
    Switch("tether_damping", 0.0, "N s/m of a hose along its reach", 0.0, 1e6, "N s/m"),
    Switch("point_law.spring", _NOWHERE, "N/m, N/m^2, N/m^3 against a point's travel", -1e12, 1e12, "N/m", 3),
    Switch("point_law.brake", (0.0, 0.0), "N s/m, N s^2/m^2 against its velocity", 0.0, 1e9, "N s/m", 2),
    Switch("point_law.position", _NOWHERE, "m, body frame: the point", *_PLACE),
    Switch("point_law.line", (0.0, 0.0), "rad, world: the law's azimuth, elevation", -7.0, 7.0, "rad", 2),
    Switch("point_law.across", 1.0, "1: how far the brake counts what is across its line", 0.0, 1.0),
    Switch("point_law.upright", 1.0, "1: how far the brake counts the vertical; 0: on a plane", 0.0, 1.0),
    Switch("point_law.saturation", 0.0, "s^2/m^2: it saturates as 1/(1 + w v^2)", 0.0, 1e9, "s^2/m^2"),
    Switch("point_law.narrow", 0.0, "1/m^2: the brake fades as exp(-n u^2) with travel u", 0.0, 1e9, "1/m^2"),
    Switch("liquid_slosh.mass", 0.0, "kg of the body that swing in a tank", 0.0, 1e5, "kg"),
    Switch("liquid_slosh.frequency", 0.8, "Hz of the liquid's first mode", 0.2, 10.0, "Hz"),
    Switch("liquid_slosh.damping_ratio", 0.02, "of the liquid's first mode", 0.0, 1.0),
    Switch("liquid_slosh.position", _NOWHERE, "m, body frame: where the swinging liquid rests", *_PLACE),
    Switch("sprung_mass.mass", 0.0, "kg of the body that stand on springs", 0.0, 1e5, "kg"),
    Switch("sprung_mass.frequency", 2.0, "Hz of the part against a body held still", 0.1, 20.0, "Hz"),
    Switch("sprung_mass.along", _NOWHERE, "Hz along body axes; 0: along its line alone", 0.0, 20.0, "Hz", 3),
    Switch("sprung_mass.damping_ratio", 0.03, "of the part on its springs", 0.0, 2.0),
    Switch("sprung_mass.position", _NOWHERE, "m, body frame: where the part rests", *_PLACE),
    Switch("sprung_mass.direction", _X, "body axes: line along which the part moves", -1e3, 1e3, "", 3),
    Switch("loose_mass.mass", 0.0, "kg of the body that slide between stops", 0.0, 1e5, "kg"),
    Switch("loose_mass.travel", 0.02, "m from the middle to either stop", 1e-4, 10.0, "m"),
    Switch("loose_mass.frequency", 0.2, "Hz of its slow way back to the middle", 0.0, 5.0, "Hz"),
    Switch("loose_mass.damping_ratio", 0.05, "of its slow way back to the middle", 0.0, 2.0),
    Switch("loose_mass.stop_damping", 0.3, "damping ratio of its stops", 0.0, 2.0),
    Switch("loose_mass.position", _NOWHERE, "m, body frame: middle between the stops", *_PLACE),
    Switch("loose_mass.direction", _X, "body axes: line along which it slides", -1e3, 1e3, "", 3),
    Switch("external_force.peak_force", 0.0, "N at the peak of a push, half a sine", 0.0, 1e6, "N"),
    Switch("external_force.start", (1.0,), "s after shaking starts, of each push", 0.0, 1e6, "s", ANY),
    Switch("external_force.duration", 0.3, "s of each push", 0.005, 100.0, "s"),
    Switch("external_force.direction", _X, "body axes: where the push points to", -1e3, 1e3, "", 3),
    Switch("external_force.position", _NOWHERE, "m, body frame: where the push acts", *_PLACE),
)  # fmt: skip


def switches() -> tuple[Switch, ...]:
    """Every switch, those of the lab's own effects last."""
    return (
        *SWITCHES,
        *(
            Switch(f"{effect.name}.{n.name}", 0.0, f"{n.name} of {effect.name}", -1e12, 1e12, n.unit)
            for effect in own_effects()
            for n in effect.numbers
        ),
    )


def effects_of(
    given: Mapping[str, float | Sequence[float] | Array], model: RigModel, prefix: str = ""
) -> PlantEffects:
    """Effects that switches ask for; what is not given stays off.

    given: switch name -> its number or numbers. prefix: what stands before a name in refusals.

    Raises
    ------
    InputError
        A name is unknown, a number makes no sense, or so much of the body rides that none is left.
    """
    known = {switch.name for switch in switches()}
    for name in given:
        if name not in known:
            near = did_you_mean(name, known)
            raise InputError(f"{prefix}{name}: is unknown; known are {', '.join(sorted(known))}{near}")
    values = {s.name: s.checked(given.get(s.name, s.default), model.cables, prefix) for s in switches()}

    def number(name: str) -> float:
        return float(values[name][0])

    riders = _riders(values, model, prefix)
    stiffness = values["ceiling_compliance.stiffness"]
    ceiling = YieldingCeiling(
        stiffness, number("ceiling_compliance.mass"), number("ceiling_compliance.damping_ratio")
    )
    push = Push(
        number("external_force.peak_force"),
        _direction(values, "external_force", prefix),
        values["external_force.position"],
        values["external_force.start"],
        number("external_force.duration"),
    )
    return PlantEffects(
        hinge_damping=values["hinge_damping"],
        hinge_friction=values["hinge_friction"],
        hinge_bending=values["hinge_bending"],
        held_ends=_tensors(values["held_ends"]),
        air_drag=number("air_drag"),
        air_plates=values["air_plates"],
        plate_reach=number("air_plates.reach"),
        air_plate=number("air_plate"),
        air_plate_normal=values["air_plate.normal"],
        air_plate_point=values["air_plate.point"],
        air_plate_along=number("air_plate.along"),
        spin=values["spin"],
        turning_cube=number("turning_cube"),
        air_added_mass=number("air_added_mass"),
        air_carried=values["air_carried"],
        air_carried_point=values["air_carried.point"],
        exciter_rotor=number("exciter_rotor"),
        exciter_gain=number("exciter_gain"),
        cable_mass=number("cable_mass"),
        cable_torsion=number("cable_torsion"),
        cable_twist=values["cable_torsion.twist"],
        axial_stiffness=number("cable_elasticity"),
        axial_damping_ratio=number("cable_damping_ratio"),
        tether=values["tether"],
        tether_point=values["tether_point"],
        tether_pull=values["tether_pull"],
        tether_reach=values["tether_reach"],
        tether_damping=number("tether_damping"),
        law_spring=values["point_law.spring"],
        law_brake=values["point_law.brake"],
        law_point=values["point_law.position"],
        law_line=values["point_law.line"],
        law_narrow=number("point_law.narrow"),
        law_saturation=number("point_law.saturation"),
        law_upright=number("point_law.upright"),
        law_across=number("point_law.across"),
        cable_length=values["cable_length"],
        ceiling_points=_points(values["hinge_position.ceiling"]),
        body_points=_points(values["hinge_position.body"]),
        level_error=values["level_error"],
        cable_edge=number("cable_edge"),
        gyroscopic_share=number("gyroscopic_share"),
        riders=riders,
        ceiling=ceiling if np.any(stiffness > 0.0) else None,
        own=tuple(
            tuple(number(f"{effect.name}.{n.name}") for n in effect.numbers) for effect in own_effects()
        ),
        push=push if push.peak_force > 0.0 else None,
    )


def _points(values: Array) -> Array:
    return values.reshape(-1, 3) if values.size > 1 else np.full((1, 3), values[0])


def _tensors(values: Array) -> Array:
    """(1 or n, 3) xx, xy, yy; one number is alike to all sides."""
    return values.reshape(-1, 3) if values.size > 1 else np.array([[values[0], 0.0, values[0]]])


def _direction(values: Mapping[str, Array], effect: str, prefix: str) -> Array:
    direction = values[f"{effect}.direction"]
    if not np.linalg.norm(direction) > 0.0:
        raise InputError(f"{prefix}{effect}.direction: is zero; give a direction in body axes")
    return np.asarray(direction / np.linalg.norm(direction))


def _riders(values: Mapping[str, Array], model: RigModel, prefix: str) -> tuple[Rider, ...]:
    """Riders that have a mass. Raises InputError where the body without them cannot exist."""
    left = model.physics[layout.INERTIAL : layout.INERTIAL + 10].copy()
    riders = []
    for effect in ("liquid_slosh", "sprung_mass", "loose_mass"):
        mass, position = float(values[f"{effect}.mass"][0]), values[f"{effect}.position"]
        if not mass > 0.0:
            continue
        left -= linear_from_elements(np.array([mass, *position, *np.zeros(6)]))
        if not (left[0] > 0.0 and can_exist(elements_from_linear(left))):
            raise InputError(
                f"{prefix}{effect}.mass: {mass:g} kg at {position.tolist()} is more than the body has there; "
                "take less, or nearer its centre of mass"
            )
        liquid = effect == "liquid_slosh"
        axes = np.zeros((0, 3)) if liquid else _direction(values, effect, prefix)[None]
        stops = (0.0, 0.0)
        if effect == "loose_mass":
            stops = float(values["loose_mass.travel"][0]), float(values["loose_mass.stop_damping"][0])
        frequency, damping = values[f"{effect}.frequency"][0], values[f"{effect}.damping_ratio"][0]
        along = values["sprung_mass.along"] if effect == "sprung_mass" else np.zeros(3)
        riders.append(Rider(mass, position, axes, float(frequency), float(damping), *stops, along))
    return tuple(riders)
