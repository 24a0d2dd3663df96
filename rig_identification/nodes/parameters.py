"""A node's own parameters: declared with type and description, checked by name, before anything runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from rig_identification.errors import InputError

Value = bool | int | float | str | list[float] | list[int] | list[str]
#: Raises ValueError with what is wrong with a value.
Check = Callable[[Value], None]


@dataclass(frozen=True)
class OwnParameter:
    """One parameter of a node."""

    name: str
    default: Value
    description: str
    check: Check | None = None
    settable: bool = False  # while the node runs


@dataclass(frozen=True)
class Within:
    """Check for a number, or each of a list, from ``low`` to ``high``."""

    low: float
    high: float
    unit: str = ""

    def __call__(self, value: Value) -> None:
        """Raise ValueError for a number outside."""
        for number in value if isinstance(value, list) else [value]:
            if not (isinstance(number, int | float) and self.low <= number <= self.high):
                told = f"{number} {self.unit} is not within {self.low:g} and {self.high:g} {self.unit}"
                raise ValueError(told.replace("  ", " "))


def within(low: float, high: float, unit: str = "") -> Within:
    """Check for a number, or each of a list, from ``low`` to ``high``."""
    return Within(float(low), float(high), unit)


@dataclass(frozen=True)
class OneOf:
    """Check for one of ``words``."""

    words: tuple[str, ...]

    def __call__(self, value: Value) -> None:
        """Raise ValueError for another word."""
        if value not in self.words:
            raise ValueError(f"{value!r} is unknown; give {' or '.join(self.words)}")


def one_of(*words: str) -> OneOf:
    """Check for one of ``words``."""
    return OneOf(words)


def described(p: OwnParameter) -> ParameterDescriptor:
    """What ``ros2 param describe`` and rqt show: meaning, range or words, and whether it may be set.

    ROS 2 has ranges for single numbers alone; those of a list stand in the constraints' text.
    """
    descriptor = ParameterDescriptor(
        name=p.name, description=p.description, dynamic_typing=True, read_only=not p.settable
    )
    if isinstance(p.check, OneOf):
        descriptor.additional_constraints = f"one of {', '.join(p.check.words)}"
    elif isinstance(p.check, Within):
        low, high, unit = p.check.low, p.check.high, p.check.unit
        if type(p.default) is int:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
        elif type(p.default) is float:
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
        else:
            descriptor.additional_constraints = f"each number within {low:g} and {high:g} {unit}".rstrip()
    return descriptor


def _plain(value: object) -> Value:
    """ROS arrays as lists."""
    if isinstance(value, str | bool | int | float):
        return value
    return list(value)  # type: ignore[call-overload, no-any-return]


def _as_default(value: Value, default: Value) -> Value:
    """``value`` in the type of ``default``: whole numbers are numbers too.

    Raises ValueError where it is of another type.
    """
    if isinstance(default, bool) or isinstance(value, bool):
        if isinstance(value, bool) and isinstance(default, bool):
            return value
    elif isinstance(default, float) and isinstance(value, int | float):
        if math.isfinite(value):
            return float(value)
        raise ValueError(f"{value} is not a finite number")
    elif isinstance(default, list) and isinstance(value, list):
        if all(isinstance(item, str) for item in value) and (not default or isinstance(default[0], str)):
            return value
        if all(isinstance(item, int | float) and math.isfinite(item) for item in value):
            kind = (
                float if default and isinstance(default[0], float) else type(default[0]) if default else float
            )
            return [kind(item) for item in value]  # type: ignore[return-value]
    elif type(value) is type(default):
        return value
    raise ValueError(f"{value!r} is not a {_kind(default)}")


def _kind(default: Value) -> str:
    if isinstance(default, list):
        return f"list of {_kind(default[0])}s" if default else "list"
    return {bool: "truth value", int: "whole number", float: "number", str: "text"}[type(default)]


class OwnParameters:
    """Declares a node's parameters and keeps their checked values."""

    def __init__(self, node: Node, parameters: Sequence[OwnParameter]) -> None:
        self._node = node
        self._known = {p.name: p for p in parameters}
        self.values: dict[str, Value] = {}
        for p in parameters:
            descriptor = described(p)
            if node.has_parameter(p.name):
                # Checked first: what is refused is refused in the same words as a file's
                self.values[p.name] = self._checked(p, node.get_parameter(p.name).value)
                node.set_descriptor(p.name, descriptor)
            else:
                # rclpy cannot tell the type of an empty list: such a default stays undeclared in type
                default = p.default if p.default != [] else [""]
                self.values[p.name] = self._checked(
                    p, node.declare_parameter(p.name, default, descriptor).value
                )
        node.add_on_set_parameters_callback(self._on_set)

    def _checked(self, p: OwnParameter, given: object) -> Value:
        try:
            return check_value(p, given)
        except ValueError as error:
            raise InputError(f"parameter {p.name}: {error}") from error

    def _on_set(self, changes: list[Parameter]) -> SetParametersResult:
        accepted: dict[str, Value] = {}
        for change in changes:
            if (p := self._known.get(change.name)) is None:
                continue
            try:
                accepted[p.name] = check_value(p, change.value)
            except ValueError as error:
                return SetParametersResult(successful=False, reason=f"{p.name}: {error}")
        self.values.update(accepted)
        return SetParametersResult(successful=True)

    def number(self, name: str) -> float:
        """A number."""
        return float(self.values[name])  # type: ignore[arg-type]

    def whole(self, name: str) -> int:
        """A whole number."""
        return int(self.values[name])  # type: ignore[arg-type]

    def text(self, name: str) -> str:
        """A text."""
        return str(self.values[name])

    def flag(self, name: str) -> bool:
        """A truth value."""
        return bool(self.values[name])

    def words(self, name: str) -> tuple[str, ...]:
        """A list of texts."""
        return tuple(str(word) for word in self.values[name])  # type: ignore[union-attr]

    def vector(self, name: str, width: int | None = None) -> NDArray[np.float64]:
        """(width,) numbers; one number stands for all.

        Raises
        ------
        InputError
            Another count of numbers.
        """
        vector = np.array(self.values[name], dtype=float)
        if width is not None and vector.size == 1:
            vector = np.full(width, vector[0])
        if width is not None and vector.size != width:
            raise InputError(f"parameter {name}: has {vector.size} numbers; give 1 or {width}")
        return vector


def check_value(p: OwnParameter, given: object) -> Value:
    """``given`` as the parameter's type; ValueError where it cannot be used."""
    if given is None:
        raise ValueError("has no value")
    value = _plain(given)
    if value == [""]:
        value = []
    value = _as_default(value, p.default)
    if p.check is not None:
        p.check(value)
    return value
