"""The one place that maps named free parameters to the optimiser's vector and to the model's numbers.

Every doubt about the rig is a parameter with the description's value and tolerance as its
Gaussian prior. The optimiser sees each in units of its tolerance, so that its vector is
dimensionless and of order one; the ten inertial parameters come first, in log-Cholesky
form (model/body.py), with no prior of their own.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.mounting import Answer
from rig_identification.model import layout
from rig_identification.model import sensors as devices
from rig_identification.model.body import (
    can_exist,
    complex_step_jacobian,
    elements_from_linear,
    linear_from_elements,
    linear_from_log_cholesky,
    linear_in_log_cholesky,
    log_cholesky_from_linear,
)
from rig_identification.model.integrate import EXCITER_CLOCK
from rig_identification.model.motion import RigModel
from rig_identification.rig import Rig

Array = NDArray[np.float64]

INERTIAL = 10
#: Logarithms of a body's spreads within its vector, and the factor by which a straight step may shrink one.
_SPREADS = slice(1, 4)
THINNER = 3.0
AXES = "xyz"
#: A mount that the description leaves out: position within 10 m, orientation within 1.5 rad.
UNKNOWN_POSITION = 10.0
UNKNOWN_ROTATION = 1.5

# Devices and where their numbers start in the flat array ``device`` (see DeviceLayout)
CLOCK = "clock"


@dataclass(frozen=True)
class Stretch:
    """A part of a recording."""

    recording: str
    start: float = 0.0  # s after its start
    end: float = np.inf  # s

    def holds(self, recording: str, time: float) -> bool:
        """Whether ``time`` s after the start of a recording is in it."""
        return recording == self.recording and self.start <= time < self.end


@dataclass(frozen=True)
class Parameter:
    """One free number beside the inertial ones."""

    name: str  # "cable_1.length", "imu.gyroscope_bias.x", ...
    unit: str
    nominal: float  # what the description says
    prior_std: float  # what the lab believes
    kind: str  # "physics": entry of the model's flat array; "device": entry of DeviceLayout's
    index: int
    bounded: bool = True  # the ideal model keeps it within a few of its prior std
    also: tuple[int, ...] = ()  # further entries that hold the same number
    ratio: bool = False  # positive: prior_std is that of its logarithm about the nominal's
    freed: bool = False  # a doubt of the ideal model that is believed no longer
    unknown: bool = False  # of a mount that the description leaves out
    #: Entries that it moves, and by how much each, beside what others say of them; ``index`` is none then
    shifts: tuple[tuple[int, float], ...] = ()
    #: Stretches in which it counts, of any recording; none: it always does
    during: tuple[Stretch, ...] = ()

    @property
    def written(self) -> tuple[int, ...]:
        """Entries that hold the number itself."""
        return () if self.shifts else (self.index, *self.also)

    def counts(self, recording: str, time: float) -> bool:
        """Whether it counts ``time`` s after the start of a recording."""
        return not self.during or any(s.holds(recording, time) for s in self.during)

    @property
    def described(self) -> bool:
        """Whether the description states it: how a tracker stands in the room has no tolerance to leave."""
        return self.bounded and not self.unknown

    def value(self, position: float) -> float:
        """The number at ``position`` (units of the prior's std) of the optimiser's vector."""
        if self.ratio:
            return self.nominal * float(np.exp(self.prior_std * position))
        return self.nominal + self.prior_std * float(position)

    def position(self, value: float) -> float:
        """Inverse of :meth:`value`."""
        if self.ratio:
            return float(np.log(value / self.nominal) / self.prior_std)
        return (value - self.nominal) / self.prior_std

    def slope(self, position: float) -> float:
        """Derivative of :meth:`value`."""
        return self.prior_std * (self.value(position) if self.ratio else 1.0)


#: Numbers and axes of the devices that are no load cell, in the order in which they stand.
_SIZES = {"imu": devices.IMU_SIZE, "inclinometer": devices.INCLINOMETER_SIZE, "mocap": devices.MOCAP_SIZE}
_AXES = {"imu": 6, "inclinometer": 2, "mocap": 0}
#: Quantities of the IMU that a soft mount changes, each by its own resonance.
MOUNTED = ("specific_force", "angular_rate")
MOUNT_SIZE = len(Answer._fields)


@dataclass(frozen=True)
class DeviceLayout:
    """Where each device's own numbers stand in one flat array."""

    cables: tuple[str, ...]

    @property
    def load_cells(self) -> int:
        """First entry of the load cells, of which each has as many (model/sensors.py)."""
        return 0

    def load_cell(self, cable: str) -> int:
        """First entry of one cable's load cell: its numbers, and its drift."""
        return self.load_cells + self._a_cell * self.cables.index(cable)

    @property
    def _a_cell(self) -> int:
        return devices.load_cell_size(len(self.cables)) + devices.DRIFT_SIZE

    def own(self, device: str) -> slice:
        """Entries of what a device's reading (model/sensors.py) depends on, less its drift."""
        first = self.first(device)
        return slice(first, first + self._size(device))

    def drift(self, device: str) -> slice:
        """Entries of a device's drift (sensors.drift); of motion capture there is none."""
        first = self.first(device) + self._size(device)
        return slice(first, self._end(device))

    def laws(self) -> dict[str, int]:
        """Entries, by name, of what a reading may follow beside gains and zeros (model/sensors.py).

        ``cable_1.load_cell_curve``, ``_hysteresis`` and ``_play``, ``cable_1.feels.cable_2``,
        ``imu.gyroscope.x.feels.accelerometer.y``, and
        ``cable_1.drift``, ``imu.angular_rate.drift.x``, each with ``.settling`` and ``.gain``.
        """
        out: dict[str, int] = {}
        drifting = {c: [f"{c}.drift"] for c in self.cables}
        for cable in self.cables:
            out[f"{cable}.load_cell_curve"] = self.load_cell(cable) + devices.LOAD_CELL_CURVE
            out[f"{cable}.load_cell_hysteresis"] = self.load_cell(cable) + devices.LOAD_CELL_HYSTERESIS
            out[f"{cable}.load_cell_play"] = self.load_cell(cable) + devices.LOAD_CELL_PLAY
            for i, other in enumerate(self.cables):
                if other != cable:
                    out[f"{cable}.feels.{other}"] = self.load_cell(cable) + devices.LOAD_CELL_OWN + i
        axes = [(unit, a) for unit in ("gyroscope", "accelerometer") for a in AXES]
        for i, (unit, axis) in enumerate(axes):
            for j, (other, felt) in enumerate(axes):
                if i != j:
                    name = f"imu.{unit}.{axis}.feels.{other}.{felt}"
                    out[name] = self.imu + devices.IMU_OWN + len(axes) * i + j
        drifting["imu"] = [f"imu.{q}.drift.{a}" for q in ("angular_rate", "specific_force") for a in AXES]
        drifting["inclinometer"] = [f"inclinometer.inclination.drift.{a}" for a in AXES[:2]]
        for device, names in drifting.items():
            for i, name in enumerate(names):
                out[name] = self.drift(device).start + devices.DRIFT_SIZE * i
                out[f"{name}.settling"] = out[name] + 1
                out[f"{name}.gain"] = out[name] + devices.DRIFT_GAIN
        return out

    def first(self, device: str) -> int:
        """First entry of a device's numbers."""
        return self._firsts[device] if device in self._firsts else self.load_cell(device)

    def _size(self, device: str) -> int:
        return _SIZES[device] if device in _SIZES else devices.load_cell_size(len(self.cables))

    def _end(self, device: str) -> int:
        """Entry after a device's numbers and its drift."""
        return self.first(device) + self._size(device) + devices.DRIFT_SIZE * _AXES.get(device, 1)

    @cached_property
    def _firsts(self) -> dict[str, int]:
        """First entry of each device that is no load cell; behind each lies its clock offset."""
        out, entry = {}, self._a_cell * len(self.cables)
        for device, size in _SIZES.items():
            out[device] = entry
            entry += size + devices.DRIFT_SIZE * _AXES[device] + 1
        out["exciter"] = entry
        return out

    @property
    def imu(self) -> int:
        """First entry of the IMU: its numbers (model/sensors.py), its drift, its clock offset."""
        return self._firsts["imu"]

    @property
    def inclinometer(self) -> int:
        """First entry of the inclinometer: its numbers, its drift, its clock offset."""
        return self._firsts["inclinometer"]

    @property
    def mocap(self) -> int:
        """First entry of motion capture: 12 numbers, then its clock offset."""
        return self._firsts["mocap"]

    @property
    def exciter_clock(self) -> int:
        """Entry of the exciter's clock offset."""
        return self._firsts["exciter"]

    @property
    def size(self) -> int:
        """Length of the flat array."""
        return self.mount(MOUNTED[-1]) + MOUNT_SIZE

    def clock(self, device: str) -> int:
        """Entry of a device's clock offset."""
        if device == "exciter":
            return self.exciter_clock
        if device in _SIZES:
            return self._end(device)
        return self.exciter_clock + 1 + self.cables.index(device)

    def lag(self, device: str) -> int:
        """Entry of a device's time constant (s) as a first-order low-pass."""
        order = (*self.cables, "imu", "inclinometer", "mocap", "exciter")
        return self.exciter_clock + 1 + len(self.cables) + order.index(device)

    def mount(self, quantity: str) -> int:
        """First entry of the IMU's mount as a ``quantity`` shows it: 1/w^2 (s^2), damping, delay (s)."""
        return self.lag("exciter") + 1 + MOUNT_SIZE * MOUNTED.index(quantity)


@dataclass
class _Collector:
    parameters: list[Parameter] = field(default_factory=list)

    def physics(self, name: str, unit: str, nominal: float, std: float, index: int) -> None:
        self._add(Parameter(name, unit, float(nominal), std, "physics", index))

    def device(self, name: str, unit: str, std: float, index: int, *, unknown: bool = False) -> None:
        self._add(Parameter(name, unit, 0.0, std, "device", index, unknown=unknown))

    def _add(self, parameter: Parameter) -> None:
        # What the lab is certain of is not free
        if parameter.prior_std > 0.0:
            self.parameters.append(parameter)


def _rig_parameters(c: _Collector, rig: Rig, model: RigModel) -> None:
    tolerance = rig.tolerance
    for i, cable in enumerate(rig.cables):
        o = layout.cable_offset(i)
        for a in range(3):
            for end, start, point in (
                ("ceiling_point", layout.CEILING_POINT, cable.ceiling_point),
                ("body_point", layout.BODY_POINT, cable.body_point),
            ):
                name = f"{cable.name}.{end}.{AXES[a]}"
                c.physics(name, "m", point[a], tolerance["hinge_position"], o + start + a)
        c.physics(f"{cable.name}.length", "m", cable.length, tolerance["cable_length"], o + layout.LENGTH)
    for a in range(2):
        # Ceiling tilted by t about the axis that lifts world axis a: gravity gains g t along it
        c.physics(f"level.{AXES[a]}", "m/s^2", 0.0, rig.gravity * tolerance["level"], layout.GRAVITY + a)


def _exciter_parameters(c: _Collector, rig: Rig, places: DeviceLayout) -> None:
    tolerance = rig.tolerance
    if rig.exciter is None:
        return
    for a in range(3):
        position, turn = layout.EXCITER_POSITION + a, layout.EXCITER_ROTATION + a
        c.physics(
            f"exciter.position.{AXES[a]}",
            "m",
            rig.exciter.position[a],
            tolerance["exciter_position"],
            position,
        )
        c.physics(f"exciter.orientation.{AXES[a]}", "rad", 0.0, tolerance["exciter_orientation"], turn)
    c.physics("exciter.gain", "1", 1.0, tolerance["exciter_gain"], layout.EXCITER_GAIN)
    c.device("exciter.clock", "s", tolerance["clock"], places.exciter_clock)


def _sensor_parameters(c: _Collector, rig: Rig, places: DeviceLayout, channels: set[str]) -> None:
    tolerance = rig.tolerance
    for cable in rig.cables:
        if cable.name in channels:
            start = places.load_cell(cable.name)
            c.device(f"{cable.name}.load_cell_gain", "1", tolerance["load_cell_gain"], start)
            c.device(f"{cable.name}.load_cell_zero", "N", tolerance["load_cell_zero"], start + 1)
    if "imu" in channels:
        blocks = (
            ("position", "m", "imu_position"),
            ("orientation", "rad", "imu_orientation"),
            ("gyroscope_bias", "rad/s", "gyroscope_bias"),
            ("gyroscope_scale", "1", "gyroscope_scale"),
            ("accelerometer_bias", "m/s^2", "accelerometer_bias"),
            ("accelerometer_scale", "1", "accelerometer_scale"),
        )
        for b, (name, unit, key) in enumerate(blocks):
            for a in range(3):
                c.device(f"imu.{name}.{AXES[a]}", unit, tolerance[key], places.imu + 3 * b + a)
    if "inclinometer" in channels:
        for a in range(3):
            c.device(
                f"inclinometer.orientation.{AXES[a]}",
                "rad",
                tolerance["inclinometer_orientation"],
                places.inclinometer + a,
            )
    if "mocap" in channels:
        known = rig.mocap is not None
        stds = (
            ("marker_position", "m", tolerance["imu_position"] if known else UNKNOWN_POSITION, not known),
            (
                "marker_orientation",
                "rad",
                tolerance["imu_orientation"] if known else UNKNOWN_ROTATION,
                not known,
            ),
            ("tracker_position", "m", UNKNOWN_POSITION, True),
            ("tracker_orientation", "rad", UNKNOWN_ROTATION, True),
        )
        for b, (name, unit, std, unknown) in enumerate(stds):
            for a in range(3):
                c.device(f"mocap.{name}.{AXES[a]}", unit, std, places.mocap + 3 * b + a, unknown=unknown)
    keeps_time = next((n for n in (*places.cables, "imu", "mocap", "inclinometer") if n in channels), None)
    for name in ("imu", "inclinometer", "mocap"):
        entry = places.clock(name)
        if name in channels and name != keeps_time and entry is not None:
            c.device(f"{name}.clock", "s", tolerance["clock"], entry)


@dataclass(frozen=True)
class ParameterSet:
    """Free parameters of one session: 10 inertial ones, then ``free`` in units of their priors."""

    model: RigModel  # described rig; its inertial block is only a placeholder
    places: DeviceLayout
    free: tuple[Parameter, ...]
    silent: frozenset[int] = frozenset()  # of ``free``, those that do not count (:meth:`at`)

    def at(self, recording: str, time: float) -> ParameterSet:
        """The same vector as it is read ``time`` s after the start of a recording.

        What does not count there is written nowhere, and moves nothing.
        """
        if not any(p.during for p in self.free):
            return self
        silent = frozenset(i for i, p in enumerate(self.free) if not p.counts(recording, time))
        if silent not in self._silenced:
            self._silenced[silent] = replace(self, silent=silent)
        return self._silenced[silent]

    @cached_property
    def _silenced(self) -> dict[frozenset[int], ParameterSet]:
        """Sets that :meth:`at` has made."""
        return {}

    @cached_property
    def _heard(self) -> tuple[tuple[int, Parameter], ...]:
        """Index in ``free`` and parameter of all that count."""
        return tuple((i, p) for i, p in enumerate(self.free) if i not in self.silent)

    @property
    def size(self) -> int:
        """Length of the optimiser's vector without start states."""
        return INERTIAL + len(self.free)

    def index_of(self, name: str) -> int:
        """Column of a free parameter in the vector."""
        return INERTIAL + next(i for i, p in enumerate(self.free) if p.name == name)

    def having(self, others: tuple[Parameter, ...]) -> ParameterSet:
        """The same set with ``others`` added, or put in place of those of the same name."""
        new = {p.name: p for p in others}
        kept = tuple(new.pop(p.name, p) for p in self.free)
        return replace(self, free=kept + tuple(new.values()))

    def converted(self, theta: Array, other: ParameterSet) -> Array:
        """The vector in this set of what ``theta`` says in ``other``; what that set lacks is as described."""
        told = other.named(theta)
        out = np.zeros(self.size)
        out[:INERTIAL] = theta[:INERTIAL]
        for i, p in enumerate(self.free, start=INERTIAL):
            out[i] = p.position(told.get(p.name, p.nominal))
        return out

    def start(self, elements: Array) -> Array:
        """Vector of a body given by its ``elements``, everything else as described."""
        theta = np.zeros(self.size)
        theta[:INERTIAL] = log_cholesky_from_linear(linear_from_elements(elements))
        return theta

    def values(self, theta: Array) -> Array:
        """Free parameters in their own units."""
        nominal, std, ratio = self._scales
        moved = std * theta[INERTIAL:]
        return np.where(ratio, nominal * np.exp(np.where(ratio, moved, 0.0)), nominal + moved)

    @cached_property
    def _scales(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Nominal, prior_std and ratio of each free parameter."""
        return (
            np.array([p.nominal for p in self.free]),
            np.array([p.prior_std for p in self.free]),
            np.array([p.ratio for p in self.free], dtype=bool),
        )

    @cached_property
    def _entries(self) -> dict[str, tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """By kind of array: which free parameter is written where."""
        out = {}
        for kind in ("physics", "device"):
            written = [(i, entry) for i, p in self._heard if p.kind == kind for entry in p.written]
            pairs = np.array(written, dtype=np.int64).reshape(-1, 2)
            out[kind] = pairs[:, 0], pairs[:, 1]
        return out

    @cached_property
    def _shifts(self) -> dict[str, tuple[NDArray[np.int64], NDArray[np.int64], Array]]:
        """By kind of array: which free parameter moves which entry, and by how much."""
        out = {}
        for kind in ("physics", "device"):
            moved = [(i, *s) for i, p in self._heard if p.kind == kind for s in p.shifts]
            table = np.array(moved, dtype=np.float64).reshape(-1, 3)
            out[kind] = table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2]
        return out

    def _write(self, kind: str, array: Array, theta: Array) -> None:
        """Put the free parameters' values into the flat ``array`` of a kind."""
        values = self.values(theta)
        which, entries = self._entries[kind]
        array[entries] = values[which]
        which, entries, weights = self._shifts[kind]
        np.add.at(array, entries, weights * values[which])

    def named(self, theta: Array) -> dict[str, float]:
        """Free parameters in their own units, by name."""
        return {p.name: float(v) for p, v in zip(self.free, self.values(theta), strict=True)}

    def physics(self, theta: Array) -> Array:
        """The forward model's flat array."""
        physics: Array = self.model.physics.copy()
        physics[layout.INERTIAL : layout.INERTIAL + INERTIAL] = linear_from_log_cholesky(theta[:INERTIAL])
        self._write("physics", physics, theta)
        tilt = physics[layout.GRAVITY : layout.GRAVITY + 2]
        gravity = -self.model.physics[layout.GRAVITY + 2]
        physics[layout.GRAVITY + 2] = -np.sqrt(gravity**2 - tilt @ tilt)
        return physics

    def device(self, theta: Array) -> Array:
        """The devices' flat array (:class:`DeviceLayout`)."""
        device = np.zeros(self.places.size)
        self._write("device", device, theta)
        return device

    def directions(self) -> NDArray[np.int64]:
        """Entries of ``physics`` that any parameter moves, and the exciter's clock where it is free."""
        return self._directions

    @cached_property
    def _directions(self) -> NDArray[np.int64]:
        moved = set(range(layout.INERTIAL, layout.INERTIAL + INERTIAL))
        moved |= {*self._entries["physics"][1].tolist(), *self._shifts["physics"][1].tolist()}
        if any(layout.GRAVITY <= p < layout.INERTIAL for p in moved):
            moved.add(layout.GRAVITY + 2)
        clock = [EXCITER_CLOCK] if any(self._exciter_time(p) for _, p in self._heard) else []
        return np.array(sorted(moved) + clock, dtype=np.int64)

    def _exciter_time(self, parameter: Parameter) -> float:
        """By how much a unit of a parameter shifts the exciter's force in time (prediction.drive), s.

        To first order its clock and its low-pass shift alike.
        """
        if parameter.kind != "device":
            return 0.0
        times = (self.places.exciter_clock, self.places.lag("exciter"))
        written = [1.0 for entry in parameter.written if entry in times]
        return sum([*written, *(weight for entry, weight in parameter.shifts if entry in times)])

    def physics_jacobian(self, theta: Array) -> Array:
        """(len(directions), size): derivative of the chosen physics entries in the vector."""
        directions = self.directions()
        row_of = {int(d): r for r, d in enumerate(directions)}
        out = np.zeros((directions.size, self.size))
        inertial = linear_in_log_cholesky(theta[:INERTIAL])
        for i in range(INERTIAL):
            out[row_of[layout.INERTIAL + i], :INERTIAL] = inertial[i]
        physics = self.physics(theta)
        for i, p in self._heard:
            column = INERTIAL + i
            if p.kind == "physics":
                for entry in p.written:
                    out[row_of[entry], column] = p.slope(theta[column])
                for entry, weight in p.shifts:
                    out[row_of[entry], column] += weight * p.slope(theta[column])
                for entry in (*p.written, *(e for e, _ in p.shifts)):
                    if layout.GRAVITY <= entry < layout.GRAVITY + 2:
                        # A tilt takes from the vertical what it gives to the side
                        slope = -physics[entry] / physics[layout.GRAVITY + 2]
                        out[row_of[layout.GRAVITY + 2], column] += out[row_of[entry], column] * slope
            elif shift := self._exciter_time(p):
                out[row_of[EXCITER_CLOCK], column] = shift * p.prior_std
        return out

    def device_columns(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        """(columns of the vector, entries of ``device``, scale) of the device parameters."""
        which, entries = self._entries["device"]
        moving, moved, weights = self._shifts["device"]
        std = self._scales[1]
        return (
            INERTIAL + np.concatenate([which, moving]),
            np.concatenate([entries, moved]),
            np.concatenate([std[which], weights * std[moving]]),
        )

    def elements(self, theta: Array) -> Array:
        """Mass, centre of mass, inertia about it."""
        return elements_from_linear(linear_from_log_cholesky(theta[:INERTIAL]))

    def moved(self, theta: Array, change: Array) -> Array:
        """(n,) the vector after a step, the body along the straight line that its ten numbers make.

        Motion is nearly linear in mass, centre of mass and inertia; in logarithms of spreads, two large
        steps that leave what is observable alone to first order would not do so to second. Where that line
        leads to no body, or to one far thinner, the step is made in the vector itself.
        """
        moved = theta + change
        line = self.elements(theta) + self.elements_jacobian(theta) @ change[:INERTIAL]
        straight = _body_of(line)
        if straight is not None and np.all(straight[_SPREADS] - theta[_SPREADS] > -np.log(THINNER)):
            moved[:INERTIAL] = straight
        return moved

    def elements_jacobian(self, theta: Array) -> Array:
        """(10, 10) derivative of :meth:`elements` in the first ten entries."""

        def elements(log_cholesky: Array) -> Array:
            return elements_from_linear(linear_from_log_cholesky(log_cholesky))

        return np.asarray(complex_step_jacobian(elements, theta[:INERTIAL]))


def _body_of(elements: Array) -> Array | None:
    """(10,) log-Cholesky vector of a body; None where there is none, or one thinner than digits can hold."""
    if not can_exist(elements):
        return None
    try:
        return log_cholesky_from_linear(linear_from_elements(elements))
    except np.linalg.LinAlgError:
        return None


def parameter_set(rig: Rig, model: RigModel, channels: set[str]) -> ParameterSet:
    """Free parameters of a rig whose recordings hold ``channels`` (cable names, imu, inclinometer, mocap)."""
    places = DeviceLayout(tuple(cable.name for cable in rig.cables))
    collector = _Collector()
    _rig_parameters(collector, rig, model)
    _exciter_parameters(collector, rig, places)
    _sensor_parameters(collector, rig, places, channels)
    return ParameterSet(model, places, tuple(collector.parameters))
