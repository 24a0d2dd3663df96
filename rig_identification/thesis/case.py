"""The case studies of chapter 4 as rigs, bodies, force programs and published results.

Conventions, and where each comes from:

* World: z up, origin at ceiling hinge 1. The printed centres of gravity lie at negative z.
* Body: axes as printed, parallel to world in the upright pose; origin at body hinge 1, a
  datum that a tape measure reaches, so the centre of mass is not at the origin.
* Inertia: the printed matrices are the tensor itself, with the printed signs. With the other
  sign of the products (thesis eq. 3.10) neither case 7's pose nor case 14's errors come back.
* Attitude: the printed T takes world vectors into body, R_world_body = T^T; the printed
  Euler angles are those of R_world_body = Rz(a1) Ry(a2) Rx(a3).
* Force: components along world axes, at a point fixed to the body (see ``reading`` and
  ``remarks`` of the tables for the evidence). Gravity is not printed: 9.81 m/s^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.thesis.force import ForceProgram, HarmonicForce, StepForce
from rig_identification.thesis.initial_pose import hang_on_cables
from rig_identification.thesis.tables import CASE_NUMBERS, read_case_table

Array = NDArray[np.float64]

GRAVITY = 9.81  # m/s^2, the simulation tool's default; the thesis prints none
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
ELEMENT = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}


@dataclass(frozen=True)
class Published:
    """What the thesis reports for one case."""

    error: Array  # (3, 3) percent, but kg m^2 where ``absolute``
    absolute: NDArray[np.bool_]  # (3, 3) printed with a plus-minus sign: the true element is zero
    identified: Array | None  # (3, 3) kg m^2; None: only errors are printed (case 18)


@dataclass(frozen=True)
class Case:
    """One case study: what was hung, how it was moved, and what the thesis made of it."""

    number: int
    variant: str  # "" but for case 18: "a" to "d"
    title: str
    rig: Rig
    mass: float  # kg
    center_of_mass: Array  # (3,) m, body
    inertia: Array  # (3, 3) kg m^2, about the centre of mass, body axes
    position: Array  # (3,) m, body origin in world at t = 0
    orientation: Array  # (4,) quaternion xyzw, rotates body vectors into world at t = 0
    force: ForceProgram
    duration: float  # s
    sampling: float  # s
    window: tuple[float, float]  # s, the part that the thesis identifies from
    force_measured: bool  # False: the thesis leaves the applied force out of the wrench
    initial_guess: Array  # (3, 3) kg m^2
    published: Published | None
    remarks: tuple[str, ...]

    @property
    def label(self) -> str:
        """The case's number with its variant, e.g. ``"18b"``."""
        return f"{self.number}{self.variant}"


def symmetric(xx: float, xy: float, xz: float, yy: float, yz: float, zz: float) -> Array:
    """(3, 3) tensor of six elements in the order of the thesis' initial guess."""
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)


def load_case(number: int, variant: str = "") -> Case:
    """Return one case study; case 18 takes a variant from ``"a"`` to ``"d"`` (default ``"a"``).

    Raises ``InputError`` for a number or a variant that the thesis does not have.
    """
    table = read_case_table(number)
    if number != 18:
        if variant:
            raise InputError(
                f"case study {number}: variant {variant!r} is unknown; only case 18 has variants"
            )
        return _case(table, table["printed"], table["reading"], "", table.get("published"))
    variant = variant or "a"
    if variant not in table["published"]:
        raise InputError(f"case study 18: variant {variant!r} is unknown; choose one of a, b, c, d")
    return _variant_of_18(table, variant)


def load_cases() -> tuple[Case, ...]:
    """Return every case study in the thesis' order, the four variants of case 18 last."""
    plain = tuple(load_case(number) for number in CASE_NUMBERS[:-1])
    return plain + tuple(load_case(18, variant) for variant in "abcd")


def _variant_of_18(table: dict[str, Any], variant: str) -> Case:
    base = read_case_table(table["printed"]["same_as_case"])
    published = table["published"][variant]
    frequency = table["reading"]["frequency"].get(variant, published["frequency"])
    harmonic = base["printed"]["harmonic_force"] | {
        "amplitude": table["printed"]["amplitude"],
        "frequency": frequency,
    }
    printed = base["printed"] | {"harmonic_force": harmonic}
    reading = base["reading"] | {"force_plane": published["plane"]}
    return _case(table, printed, reading, variant, published)


def _case(
    table: dict[str, Any],
    printed: dict[str, Any],
    reading: dict[str, Any],
    variant: str,
    published: dict[str, Any] | None,
) -> Case:
    from_center = _hinges_from_center(printed, reading)
    rig, position, orientation = _rig_and_pose(printed, reading, from_center)
    inertia = symmetric(**{name: printed["inertia"][name] for name in ELEMENT})
    window = printed.get("identified_window", [0.0, printed["length"]])
    return Case(
        number=table["case"],
        variant=variant,
        title=table["title"],
        rig=rig,
        mass=float(printed["mass"]),
        center_of_mass=-from_center[0],
        inertia=inertia,
        position=position,
        orientation=orientation,
        force=_force_program(printed, reading, from_center[0]),
        duration=float(printed["length"]),
        sampling=float(printed["sampling"]),
        window=(float(window[0]), float(window[1])),
        force_measured=bool(reading["force_measured"]),
        initial_guess=symmetric(*printed["initial_guess"]),
        published=_published(published, reading),
        remarks=tuple(remark.strip() for remark in table["remarks"]),
    )


def _hinges_from_center(printed: dict[str, Any], reading: dict[str, Any]) -> Array:
    """(n, 3) m, body hinges as seen from the centre of mass, in the order of the ceiling's."""
    points = np.array(printed["body_points"], dtype=float)
    if printed["body_points_relative_to"] == "center_of_mass":
        return points
    ordered = points[np.array(reading["body_point_order"]) - 1]
    upright_center = np.array(reading["upright_center_of_gravity"], dtype=float)
    return np.asarray(np.array(printed["ceiling_points"], dtype=float) + ordered - upright_center)


def _rig_and_pose(
    printed: dict[str, Any], reading: dict[str, Any], from_center: Array
) -> tuple[Rig, Array, Array]:
    ceiling = np.array(printed["ceiling_points"], dtype=float)
    body = from_center - from_center[0]
    angles = printed["euler_angles"]
    turned = Rotation.identity() if angles is None else Rotation.from_euler("ZYX", angles)
    center = np.array(printed["center_of_gravity"], dtype=float)
    if printed["cable_length"] is None:
        lengths = np.linalg.norm(center + turned.apply(from_center) - ceiling, axis=1)
    else:
        lengths = np.full(len(ceiling), float(printed["cable_length"]))
        # Printed to four digits, the pose misses the cables by up to 0.1 mm.
        center, turned = hang_on_cables(center, turned, ceiling, from_center, lengths)
    position = center + turned.apply(from_center[0])
    cables = tuple(
        Cable(f"cable_{i + 1}", ceiling[i], body[i], float(lengths[i])) for i in range(len(ceiling))
    )
    exciter = _force_point(printed, reading) - from_center[0]
    rig = Rig(
        gravity=GRAVITY,
        cables=cables,
        mass=float(printed["mass"]),
        imu=Mount(-from_center[0], UPRIGHT),
        inclinometer=Mount(np.zeros(3), UPRIGHT),
        exciter=Mount(exciter, UPRIGHT),
    )
    return rig, position, turned.as_quat()


def _force_point(printed: dict[str, Any], reading: dict[str, Any]) -> Array:
    """(3,) m from the centre of mass along body axes; zero where no force acts."""
    return np.array(reading.get("force_point") or printed["harmonic_force"]["point"], dtype=float)


def _force_program(printed: dict[str, Any], reading: dict[str, Any], first_hinge: Array) -> ForceProgram:
    segments: list[StepForce | HarmonicForce] = []
    for step in printed.get("step_forces", []):
        start, end = step["interval"]
        segments.append(StepForce(np.array(step["force"], dtype=float), float(start), float(end)))
    harmonic = printed.get("harmonic_force")
    if harmonic:
        start, end = reading["force_interval"] or (0.0, np.inf)
        amplitude, frequency = float(harmonic["amplitude"]), float(harmonic["frequency"])
        segments.append(HarmonicForce(amplitude, frequency, reading["force_plane"], float(start), float(end)))
    point = _force_point(printed, reading) - first_hinge
    return ForceProgram(point, reading["force_axes"], tuple(segments))


def _published(published: dict[str, Any] | None, reading: dict[str, Any]) -> Published | None:
    if published is None:
        return None
    absolute = np.zeros((3, 3), dtype=bool)
    for name in published["absolute"]:
        i, j = ELEMENT[name]
        absolute[i, j] = absolute[j, i] = True
    key = "original" if reading.get("matrices_exchanged") else "identified"
    identified = np.array(published[key], dtype=float) if key in published else None
    return Published(np.array(published["error"], dtype=float), absolute, identified)
