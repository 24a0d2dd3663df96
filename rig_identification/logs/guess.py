"""What the columns of a log are, guessed from their names and units, for a person to confirm."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from rig_identification.logs.columns import Chosen, Columns, TableColumns, TimeColumn
from rig_identification.logs.log import ONLY, Array, Column, Log, Table
from rig_identification.logs.quantities import quantity
from rig_identification.logs.units import UNITS, known_unit, si_unit
from rig_identification.topics import DEVICES

_BRACKET = re.compile(r"\s*[\[({]([^\[\](){}]*)[\])}]\s*$")
_TIME = {"time", "t", "timestamp", "timestamps", "seconds", "elapsed", "zeit", "stamp", "sec", "clock"}
#: Words of a name -> what is measured.
_KINDS = (
    ("none", {"gravity", "magnetic", "magnetometer", "temperature", "covariance"}),
    ("mocap", {"quaternion", "quat", "orientation"}),  # before the rates, one of whose names is w
    ("shaft", {"shaft", "encoder", "rpm"}),
    ("exciter", {"exciter", "shaker", "motor"}),
    ("angular_rate", {"gyro", "gyr", "gyroscope", "angular", "omega", "rate", "w", "rotation"}),
    ("specific_force", {"acc", "accel", "acceleration", "accelerometer", "specific", "a"}),
    ("inclination", {"incl", "inclination", "inclinometer", "tilt"}),
    ("tension", {"force", "load", "tension", "cell", "cable", "rope", "wire", "string", "f"}),
    ("mocap", {"mocap", "vicon", "optitrack", "marker", "pose", "pos", "position", "translation", "q",
               "orientation", "quaternion", "yaw", "heading", "roll", "pitch", "transform"}),
)  # fmt: skip
#: Words that say nothing of which cable it is.
_NO_NAME = frozenset(
    ("force", "load", "tension", "cell", "loadcell", "f", "z", "wrench", "rig", "n", "value", "data")
)
_AXIS = re.compile(r"(?:a|w|g|q|f|acc|accel|gyr|gyro|omega|rate|pos|quat|force)?([xyzw])")
#: Hz. No logger of a rig samples slower or faster; a factor of 1000, as between s and ms, tells its unit.
_SLOWEST = 20.0


@dataclass(frozen=True)
class Guess:
    """What the columns are taken for, and of each what there is to say."""

    columns: Columns
    remarks: dict[tuple[str, str], str]  # (table, column) -> why it is not used, or what to look at


def guess(log: Log) -> Guess:
    """Take each column for what its name and unit say. What says nothing is left out."""
    found: dict[str, TableColumns] = {}
    remarks: dict[tuple[str, str], str] = {}
    taken: set[str] = set()
    for table in log.tables:
        time = _time(table)
        chosen: dict[str, Chosen] = {}
        for column in table.columns:
            if time is not None and column.name == time.column:
                continue
            one, remark = _chosen(table, column)
            if one is not None and one.word in taken:
                remark = f"not used: another column is {one.word} already"
            elif one is not None:
                taken.add(one.word)
                chosen[column.name] = one
            if remark:
                remarks[table.name, column.name] = remark
        if chosen:
            found[table.name] = TableColumns(time, chosen)
    return Guess(Columns(found), remarks)


def words_of(text: str) -> list[str]:
    """Lower-case words of a name: ``GyroX_dps`` is gyro, x, dps."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    return [word for word in re.split(r"[^A-Za-z0-9]+", apart.lower()) if word]


def split_unit(column: Column) -> tuple[str, str]:
    """A column's name without its unit, and the unit; "" where none is stated that is known."""
    bracket = _BRACKET.search(column.name)
    name = column.name[: bracket.start()] if bracket else column.name
    unit = known_unit(column.unit) or (known_unit(bracket[1]) if bracket else "")
    if unit or bracket:
        return name, unit
    words = re.split(r"[_ .]+", name)
    for count in (2, 1):
        ending = "_".join(words[-count:])
        # One letter may be an axis or a name, as in force_g or pos_m: a unit where more stands before it.
        if len(words) > count and known_unit(ending) and ending.lower() not in ("x", "y", "z", "in"):
            return "_".join(words[:-count]), known_unit(ending)
    return name, ""


def _time(table: Table) -> TimeColumn | None:
    """The column of time, with its unit."""
    for column in table.columns:
        name, unit = split_unit(column)
        if unit and si_unit(unit) != "s":
            continue
        if set(words_of(name)) & _TIME and np.isfinite(column.values).sum() > 1:
            return TimeColumn(column.name, unit or _time_unit(column.values))
    return None


def _time_unit(values: Array) -> str:
    """The unit in which the rate of sampling is one that loggers have: 20 Hz to 20 kHz."""
    steps = np.diff(values[np.isfinite(values)])
    step = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    if step <= 0.0:
        return "s"
    return next(
        (unit for unit in ("s", "ms", "us", "ns") if 1.0 / (step * UNITS["s"][unit]) >= _SLOWEST), "ns"
    )


def _chosen(table: Table, column: Column) -> tuple[Chosen | None, str]:
    """What a column is, and what there is to say of it."""
    name, unit = split_unit(column)
    if not np.any(np.isfinite(column.values)):
        return None, "not used: holds no number"
    own, around = words_of(name), words_of(table.name) if table.name != ONLY else []
    word = _word(own, around, name, table.name, si_unit(unit))
    if word is None:
        return None, "not used: neither its name nor its unit says what it is"
    if word == "none":
        return None, "not used: no reading of the contract"
    wanted = quantity(word)
    if wanted is None:
        return None, "not used: its name does not say which axis or cable it is"
    if wanted.unit == "m/s^2" and _lacks_gravity(table, column, unit):
        return None, "not used: gravity is not in it"
    if not unit:
        assumed = _assumed(wanted.unit, column, table)
        remark = "" if wanted.unit == "1" else f"unit not stated: taken as {assumed}, please check"
        return Chosen(word, assumed), remark
    if si_unit(unit) != wanted.unit:
        return None, f"not used: {word} is not in {unit}"
    return Chosen(word, unit), ""


def _assumed(si: str, column: Column, table: Table) -> str:
    """The unit of a column that states none: of accelerations the one in which gravity is gravity."""
    if si != "m/s^2":
        return si
    return "g" if 0.5 < _size(_siblings(table, column)) < 2.0 else "m/s^2"


def _lacks_gravity(table: Table, column: Column, unit: str) -> bool:
    """Whether an acceleration in three axes is one without gravity: at rest less than half of it."""
    three = _siblings(table, column)
    # Without a unit it may be in g, the larger of the two that it is taken for.
    gravity = UNITS["m/s^2"]["g"] / UNITS["m/s^2"][unit] if unit in UNITS["m/s^2"] else 1.0
    return len(three) == 3 and _size(three) < 0.5 * gravity


def _siblings(table: Table, column: Column) -> list[Column]:
    """The columns of a table whose names differ by their axis alone."""

    def stem(one: Column) -> str:
        return re.sub(r"[xyz]$", "", "".join(words_of(split_unit(one)[0])))

    return [one for one in table.columns if stem(one) == stem(column)]


def _size(columns: list[Column]) -> float:
    return float(np.sqrt(sum(np.nanmedian(one.values) ** 2 for one in columns)))


def _word(own: list[str], around: list[str], name: str, table: str, si: str) -> str | None:
    """The quantity's word; None where nothing says it."""
    axis = _axis(own)
    kind = _kind(own, si) or _kind(around, si) or _of_unit(si, axis)
    if kind == "exciter" or (kind in ("tension", None) and _kind(around, "") == "exciter"):
        return f"exciter.force.{axis or '?'}"
    if kind == "shaft":
        return "exciter.rate" if si == "rad/s" else "exciter.angle"
    if kind in ("angular_rate", "specific_force"):
        return f"imu.{kind}.{axis or '?'}"
    if kind == "inclination":
        return f"inclinometer.{axis or '?'}"
    if kind == "tension":
        # Of a wrench the contract's tension is z.
        return f"{_cable(name, table)}.tension" if axis in ("", "z") else None
    return _pose_word(own, si, axis) if kind == "mocap" else kind


def _kind(words: list[str], si: str) -> str | None:
    """What the words of a name say is measured, in so far as the unit allows it."""
    allowed = {"angular_rate": ("", "rad/s"), "specific_force": ("", "m/s^2"), "tension": ("", "N")}
    bare = [re.sub(r"[0-9]+$", "", word) for word in words]
    bare += [word[:-1] for word in words if len(word) > 1 and word[-1] in "xyzw"]
    for kind, known in _KINDS:
        if known & set(bare) and si in allowed.get(kind, (si,)):
            return kind
    return None


def _of_unit(si: str, axis: str) -> str | None:
    """What a unit alone says is measured."""
    of_axes = {"rad/s": "angular_rate", "m/s^2": "specific_force", "m": "mocap"}
    kinds = of_axes if axis else {"N": "tension"}
    return kinds.get(si)


def _pose_word(own: list[str], si: str, axis: str) -> str | None:
    turn = next((word for word in own if word in ("roll", "pitch", "yaw", "heading")), None)
    if turn is not None:
        return f"mocap.{'yaw' if turn == 'heading' else turn}"
    if si == "rad" or not axis:
        return None
    turned = {"q", "qx", "qy", "qz", "qw", "quaternion", "orientation", "rotation", "quat"} & set(own)
    return f"mocap.quaternion.{axis}" if turned or axis == "w" else f"mocap.position.{axis}"


def _axis(words: list[str]) -> str:
    """x, y, z or w that a name ends with or holds; "" where it holds none."""
    for word in reversed(words):
        if found := _AXIS.fullmatch(word):
            return found[1]
    return ""


def _cable(name: str, table: str) -> str:
    """A cable's name from what is left of a column's name, or of its table's."""
    for text in (name, "" if table == ONLY else table):
        left = [word for word in words_of(text) if word not in _NO_NAME]
        joined = re.sub(r"^(?=[0-9])", "cable_", "_".join(left))
        if re.fullmatch(r"f\d+", joined):  # F1 is the force in the first cable
            joined = f"cable_{joined[1:]}"
        if joined and joined not in DEVICES:
            return joined
    return "cable_1"
