"""The rig description: a ROS 2 parameter file in, a validated :class:`~rig_identification.rig.Rig` out."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from rig_identification.errors import InputError, did_you_mean
from rig_identification.rig import (
    DEFAULT_TOLERANCE,
    NOISE_NAMES,
    Cable,
    CarryingFrame,
    Mount,
    Rig,
    WheelContacts,
)
from rig_identification.session.fields import Fields, load_fields
from rig_identification.topics import DEVICES

#: No rig of this kind is larger; a value beyond is in mm.
LARGEST_LENGTH = 100.0  # m
#: A room may be surveyed from outside of it.
FARTHEST_ORIGIN = 10_000.0  # m
LENGTH_HINT = "is it in mm? lengths are in m"
_CABLE_KEYS = ("ceiling_point", "body_point", "length", "load_cell")
_MOUNTS = ("imu", "inclinometer", "exciter", "mocap")
#: Six cables hold a body in place; no lab hangs one on ten times as many.
MOST_CABLES = 64
_WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
#: m: wheels nearer to each other than this span no ground plane.
LEAST_TRACK = 0.05
_TOP_KEYS = (
    "gravity",
    "mass",
    "mass_std",
    "cable_linear_density",
    "frame",
    "cables",
    *_MOUNTS,
    "vehicle",
    "noise",
    "tolerance",
)


def read_rig(file: Path) -> Rig:
    """Read and validate a rig description.

    Parameters
    ----------
    file : Path
        ROS 2 parameter file: ``/**`` or a node's name, then ``ros__parameters``.

    Raises
    ------
    InputError
        The first fault, as one line with file, key path, value and limit.
    """
    return rig_from_fields(_parameters(load_fields(file, "rig description")))


def rig_from_fields(top: Fields) -> Rig:
    """Validate the parameters of a rig description, wherever they were read.

    Raises
    ------
    InputError
        The first fault, as for :func:`read_rig`.
    """
    top.refuse_misspelt(_TOP_KEYS)
    cables = tuple(_cable(top, name) for name in _cable_names(top))
    _check_distinct_hinges(top, cables)
    _check_ceiling(top, cables)
    _check_closure(top, cables)
    return Rig(
        gravity=top.number("gravity", "m/s^2", above=0.0, at_most=30.0, hint="give its magnitude"),
        cables=cables,
        mass=top.number("mass", "kg", above=0.0) if top.has("mass") else None,
        mass_std=top.number("mass_std", "kg", above=0.0) if top.has("mass_std") else None,
        cable_linear_density=_linear_density(top),
        frame=_frame(top) if top.has("frame") else None,
        imu=_mount(top, "imu"),
        inclinometer=_mount(top, "inclinometer", with_position=False),
        exciter=_mount(top, "exciter"),
        mocap=_marker_mount(top),
        vehicle=_vehicle(top) if top.has("vehicle") else None,
        noise=_noise(top),
        tolerance=_tolerance(top),
    )


def _linear_density(top: Fields) -> float | None:
    if not top.has("cable_linear_density"):
        return None
    return top.number(
        "cable_linear_density", "kg/m", at_least=0.0, at_most=20.0, hint="weigh a metre of the cable"
    )


def _parameters(root: Fields) -> Fields:
    nodes = [
        key for key, value in root.values.items() if isinstance(value, dict) and "ros__parameters" in value
    ]
    if not nodes:
        raise InputError(
            f"{root.file}: ros__parameters: missing; a rig description starts '/**:' 'ros__parameters:'"
            f"{_underscores(root)}"
        )
    if len(nodes) > 1:
        raise InputError(f"{root.file}: ros__parameters: given for {', '.join(map(str, nodes))}; keep one")
    section = root.section(nodes[0], "a node's parameters").section("ros__parameters", "the parameters")
    return Fields(root.file, "", section.values)


def _underscores(root: Fields) -> str:
    """Ending of a message where ``ros__parameters`` is misspelt, mostly with one underscore."""
    keys = [str(key) for value in root.values.values() if isinstance(value, dict) for key in value]
    near = did_you_mean("ros__parameters", keys).partition("mean ")[2].rstrip("?")
    return f"; {near} has another spelling" if near else ""


def _cable_names(top: Fields) -> list[str]:
    names = top.names(
        "cables", "the list of the cables' names", at_least=2, few="cable(s); the body hangs on at least 2"
    )
    if len(names) > MOST_CABLES:
        raise top.fault("cables", f"{len(names)} cables; give at most {MOST_CABLES}")
    for name in names:
        if name in DEVICES or name in _TOP_KEYS:
            raise top.fault("cables", f"{name} is the name of another part of the rig; rename the cable")
        if not top.has(name):
            raise top.fault(
                "cables",
                f"{name} is listed but not described; add {name} with {', '.join(_CABLE_KEYS)}"
                f"{did_you_mean(name, set(map(str, top.values)) - set(names))}",
            )
    for key, value in top.values.items():
        if (
            isinstance(value, dict)
            and key not in names
            and {"ceiling_point", "body_point", "length"} & value.keys()
        ):
            raise top.fault(str(key), "described but not listed; add it to cables or remove it")
    return names


def _cable(top: Fields, name: str) -> Cable:
    fields = top.section(name, f"a mapping of {', '.join(_CABLE_KEYS)}")
    fields.refuse_misspelt(_CABLE_KEYS)
    return Cable(
        name=name,
        ceiling_point=fields.vector("ceiling_point", 3, "m", limit=FARTHEST_ORIGIN, hint=LENGTH_HINT),
        body_point=fields.vector("body_point", 3, "m", limit=LARGEST_LENGTH, hint=LENGTH_HINT),
        length=fields.number("length", "m", above=0.0, at_most=LARGEST_LENGTH, hint=LENGTH_HINT),
        load_cell=fields.choice("load_cell", ("ceiling", "body"), default="ceiling"),
    )


def _check_distinct_hinges(top: Fields, cables: tuple[Cable, ...]) -> None:
    """Two cables may share a hinge at one end; the same pair of hinges twice is a copy left unedited."""
    for one, other in itertools.combinations(cables, 2):
        same_ceiling = np.allclose(one.ceiling_point, other.ceiling_point, rtol=0.0, atol=1e-6)
        same_body = np.allclose(one.body_point, other.body_point, rtol=0.0, atol=1e-6)
        if same_ceiling and same_body:
            raise top.fault(other.name, f"has the same hinge points as {one.name}; give its own")


def _check_ceiling(top: Fields, cables: tuple[Cable, ...]) -> None:
    """Where the world's origin lies is free; how far the ceiling points lie apart is not."""
    first = cables[0]
    for cable in cables[1:]:
        apart = np.abs(cable.ceiling_point - first.ceiling_point)
        a = int(np.argmax(apart))
        if apart[a] > LARGEST_LENGTH:
            raise top.fault(
                f"{cable.name}.ceiling_point[{a}]",
                f"{cable.ceiling_point[a]:g} m is {apart[a]:g} m from that of {first.name}, "
                f"beyond {LARGEST_LENGTH:g} m; {LENGTH_HINT}",
            )


def _check_closure(top: Fields, cables: tuple[Cable, ...]) -> None:
    """Hinges of two cables can be no further apart at one end than at the other plus both lengths."""
    for one, other in itertools.combinations(cables, 2):
        ceiling = float(np.linalg.norm(one.ceiling_point - other.ceiling_point))
        body = float(np.linalg.norm(one.body_point - other.body_point))
        reach = one.length + other.length
        if abs(ceiling - body) > 1.01 * reach:
            raise top.fault(
                other.name,
                f"no pose holds it and {one.name}: hinges {ceiling:g} m apart at the ceiling and {body:g} m "
                f"on the body differ by more than both lengths, {reach:g} m; is one of them in mm?",
            )


def _frame(top: Fields) -> CarryingFrame:
    fields = top.section("frame", "mass, center_of_mass and inertia of the carrying frame")
    fields.refuse_misspelt(("mass", "center_of_mass", "inertia"))
    mass = fields.number("mass", "kg", above=0.0)
    if top.has("mass") and mass >= (total := top.number("mass", "kg", above=0.0)):
        raise fields.fault(
            "mass", f"{mass:g} kg is not below {total:g} kg, the mass of body and frame together"
        )
    xx, xy, xz, yy, yz, zz = fields.vector("inertia", 6, "kg m^2 (xx xy xz yy yz zz)")
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    _check_inertia(fields, inertia, mass)
    return CarryingFrame(
        mass=mass,
        center_of_mass=fields.vector("center_of_mass", 3, "m", limit=LARGEST_LENGTH, hint=LENGTH_HINT),
        inertia=inertia,
    )


def _check_inertia(fields: Fields, inertia: np.ndarray, mass: float) -> None:
    moments = np.linalg.eigvalsh(inertia)
    listed = ", ".join(f"{moment:g}" for moment in moments)
    if moments[0] <= 0.0:
        raise fields.fault(
            "inertia", f"principal moments {listed} kg m^2 must be positive; order is xx xy xz yy yz zz"
        )
    # A flat body reaches equality; a scale's rounding may cross it.
    if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-6):
        raise fields.fault(
            "inertia",
            f"principal moments {listed} kg m^2: the largest exceeds the sum of the others; "
            "check xx xy xz yy yz zz",
        )
    if moments[2] > mass * LARGEST_LENGTH**2:
        raise fields.fault(
            "inertia", f"{moments[2]:g} kg m^2 is too large for {mass:g} kg; is it in kg mm^2?"
        )


def _mount(top: Fields, name: str, *, with_position: bool = True) -> Mount | None:
    if not top.has(name):
        return None
    fields = top.section(name, "position and orientation")
    fields.refuse_misspelt(("position", "orientation"))
    if with_position:
        position = fields.vector("position", 3, "m", limit=LARGEST_LENGTH, hint=LENGTH_HINT)
    else:
        position = np.zeros(3)
    return Mount(position, fields.quaternion("orientation"))


def _marker_mount(top: Fields) -> Mount | None:
    """Motion capture's mount; half of one is taken as not given, since all that is not given is estimated."""
    if not top.has("mocap"):
        return None
    fields = top.section("mocap", "position and orientation")
    fields.refuse_misspelt(("position", "orientation"))
    whole = fields.has("position") and fields.has("orientation")
    return _mount(top, "mocap") if whole else None


def _vehicle(top: Fields) -> WheelContacts:
    fields = top.section("vehicle", f"the points where its wheels touch the ground: {', '.join(_WHEELS)}")
    fields.refuse_unknown(_WHEELS)
    wheels = WheelContacts(
        *(fields.vector(w, 3, "m", limit=LARGEST_LENGTH, hint=LENGTH_HINT) for w in _WHEELS)
    )
    ahead = wheels.front_left + wheels.front_right - wheels.rear_left - wheels.rear_right
    left = wheels.front_left + wheels.rear_left - wheels.front_right - wheels.rear_right
    for name, between in (("front and rear", ahead), ("left and right", left)):
        if (apart := 0.5 * float(np.linalg.norm(between))) < LEAST_TRACK:
            raise top.fault("vehicle", f"{name} wheels are {apart:.3g} m apart; check the four points")
    if float(np.linalg.norm(np.cross(ahead, left))) < 4.0 * LEAST_TRACK**2:
        raise top.fault("vehicle", "its wheels lie on one line; check the four points")
    return wheels


def _noise(top: Fields) -> dict[str, float]:
    if not top.has("noise"):
        return {}
    fields = top.section("noise", "standard deviations by name")
    fields.refuse_unknown(NOISE_NAMES)
    hint = "leave it out to have it estimated"
    return {name: fields.number(name, "SI", above=0.0, hint=hint) for name in NOISE_NAMES if fields.has(name)}


def _tolerance(top: Fields) -> dict[str, float]:
    tolerance = dict(DEFAULT_TOLERANCE)
    if top.has("tolerance"):
        fields = top.section("tolerance", "standard deviations by name")
        fields.refuse_unknown(DEFAULT_TOLERANCE)
        given = [name for name in DEFAULT_TOLERANCE if fields.has(name)]
        tolerance.update({name: fields.number(name, "SI", at_least=0.0) for name in given})
    return tolerance
