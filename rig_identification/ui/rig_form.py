"""The form of a rig description, made from its JSON Schema: nothing is stated twice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

#: Names of the numbers of a vector by their count.
COMPONENTS = {3: ("x", "y", "z"), 4: ("x", "y", "z", "w"), 6: ("xx", "xy", "xz", "yy", "yz", "zz")}
#: What a vector begins with where its part is switched on: level, and at the body's origin.
BEGINNINGS = {3: [0.0, 0.0, 0.0], 4: [0.0, 0.0, 0.0, 1.0]}
#: Sections that many leave as they are.
SELDOM = ("noise", "tolerance")


@dataclass(frozen=True)
class Field:
    """One value that is typed."""

    kind: str  # "number", "vector" or "words"
    key: str
    label: str
    value: Any  # None: nothing yet
    hint: str
    required: bool = False
    names: tuple[str, ...] = ()  # of a vector's numbers
    options: tuple[str, ...] = ()
    least: float | None = None
    most: float | None = None


@dataclass(frozen=True)
class Section:
    """A part of the description that may be left out."""

    key: str
    label: str
    hint: str
    there: bool
    seldom: bool
    fields: tuple[Field, ...]


@dataclass(frozen=True)
class CableForm:
    """One cable with its name."""

    name: str
    fields: tuple[Field, ...]


@dataclass(frozen=True)
class RigForm:
    """All of a description's form."""

    fields: tuple[Field, ...]
    cables: tuple[CableForm, ...]
    new_cable: tuple[Field, ...]
    sections: tuple[Section, ...]
    kept: Mapping[str, Any]  # what the description holds and the form has no place for


def rig_form(schema: Mapping[str, Any], values: Mapping[str, Any]) -> RigForm:
    """The form with a description's parameters in it.

    schema: definitions of ``rig`` and ``cable``, as ``api.describing.rig_schema`` has them.
    """
    parts, cable = schema["rig"]["properties"], schema["cable"]
    names = list(values.get("cables", ()))
    sections = {key: part for key, part in parts.items() if part.get("type") == "object"}
    plain = {key: part for key, part in parts.items() if key not in sections and key != "cables"}
    known = {*parts, *names}
    return RigForm(
        fields=_fields({**schema["rig"], "properties": plain}, values),
        cables=tuple(CableForm(name, _fields(cable, values[name])) for name in names),
        new_cable=_fields(cable, {}),
        sections=tuple(_section(key, part, values.get(key)) for key, part in sections.items()),
        kept={key: value for key, value in values.items() if key not in known},
    )


def _section(key: str, part: Mapping[str, Any], values: Mapping[str, Any] | None) -> Section:
    begun = (
        {}
        if key in SELDOM
        else {k: BEGINNINGS.get(p.get("minItems", 0)) for k, p in part["properties"].items()}
    )
    return Section(
        key=key,
        label=_label(key),
        hint=part.get("description", ""),
        there=values is not None,
        seldom=key in SELDOM,
        fields=_fields(part, begun if values is None else values),
    )


def _fields(part: Mapping[str, Any], values: Mapping[str, Any]) -> tuple[Field, ...]:
    required = part.get("required", ())
    return tuple(
        _field(key, one, values.get(key), key in required) for key, one in part["properties"].items()
    )


def _field(key: str, part: Mapping[str, Any], value: Any, required: bool) -> Field:
    hint, label = part.get("description", ""), _label(key)
    if "enum" in part:
        chosen = value if value is not None else part.get("default", part["enum"][0])
        return Field("words", key, label, chosen, hint, options=tuple(part["enum"]))
    if part["type"] == "array":
        return Field("vector", key, label, value, hint, required, names=COMPONENTS[part["minItems"]])
    if value is None and "default" in part:
        value = part["default"]
    return Field(
        "number", key, label, value, hint, required, least=part.get("minimum"), most=part.get("maximum")
    )


def _label(key: str) -> str:
    return (
        key.replace("_", " ").capitalize()
        if key not in ("imu", "mocap")
        else {"imu": "IMU", "mocap": "Motion capture"}[key]
    )
