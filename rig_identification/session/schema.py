"""JSON Schema of rig.yaml and session.yaml, written down by their own validation.

Nothing is stated twice. An example that has every key passes through the validation, which asks a
:class:`Traced` for each value. That notes what is asked for, of which type and within which limits, and the
notes are the schema. What the validation checks of several values together, a schema cannot say.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import DEFAULT_TOLERANCE, NOISE_NAMES
from rig_identification.session import described
from rig_identification.session.fields import Fields
from rig_identification.session.rig_description import rig_from_fields
from rig_identification.session.session_description import session_from_fields

#: Version of JSON Schema that editors' YAML plugins know best.
DRAFT = "http://json-schema.org/draft-07/schema#"
_INFINITE = float("inf")
_OPTIONAL = "optional"  # in a schema under construction: keys that may be missing
_LEVEL = [0.0, 0.0, 0.0, 1.0]
_CABLE = "cable_1"
#: A rig description that has every key, for the validation to ask for.
_RIG: dict[str, Any] = {
    "gravity": 9.80665,
    "mass": 1240.0,
    "mass_std": 0.5,
    "cable_linear_density": 0.2,
    "frame": {
        "mass": 168.0,
        "center_of_mass": [1.9, 1.0, 0.9],
        "inertia": [90.0, 0.0, 0.0, 210.0, 0.0, 260.0],
    },
    "cables": [_CABLE, "cable_2"],
    **{
        name: {
            "ceiling_point": [x, 0.0, 4.0],
            "body_point": [x, 0.0, 1.5],
            "length": 2.5,
            "load_cell": "ceiling",
        }
        for name, x in ((_CABLE, 0.0), ("cable_2", 2.0))
    },
    **{name: {"position": [0.0, 0.0, 0.0], "orientation": _LEVEL} for name in ("imu", "exciter", "mocap")},
    "inclinometer": {"orientation": _LEVEL},
    "noise": dict.fromkeys(NOISE_NAMES, 0.001),
    "tolerance": dict(DEFAULT_TOLERANCE),
}
_SESSION: dict[str, Any] = {
    "rig": "rig.yaml",
    "recordings": [
        {"bag": "still", "kind": "static", "dummy": {"mass": 50.0, "position": [0.3, 0.2, 0.1]}},
        {"bag": "run_1", "kind": "dynamic", "holdout": False},
    ],
}


@dataclass(frozen=True)
class Traced(Fields):
    """Fields that note in ``node``, a schema of their mapping, all that they are asked for."""

    node: dict[str, Any] = field(default_factory=dict)

    @property
    def optional(self) -> set[str]:
        """Keys that may be missing, of every mapping that this schema describes."""
        found: set[str] = self.node.setdefault(_OPTIONAL, set())
        return found

    def note(self, key: str, **schema: Any) -> dict[str, Any]:
        """Add to the schema of ``key``, and return it."""
        self.node["type"] = "object"
        found: dict[str, Any] = self.node.setdefault("properties", {}).setdefault(key, {})
        found.update(schema)
        return found

    def has(self, key: str) -> bool:
        """Note that ``key`` may be missing."""
        self.optional.add(key)
        required = self.node.get("required", [])
        if key in required:
            required.remove(key)
        return super().has(key)

    def require(self, key: str, what: str) -> object:
        """Note that ``key`` is required, unless it was asked before whether it is there."""
        self.note(key)
        if key not in self.optional and key not in self.node.setdefault("required", []):
            self.node["required"].append(key)
        return super().require(key, what)

    def number(
        self,
        key: str,
        unit: str,
        *,
        above: float = -_INFINITE,
        at_least: float = -_INFINITE,
        at_most: float = _INFINITE,
        hint: str = "",
    ) -> float:
        """Note a number with its limits and its unit."""
        limits = {"exclusiveMinimum": above, "minimum": at_least, "maximum": at_most}
        finite = {name: limit for name, limit in limits.items() if abs(limit) < _INFINITE}
        self.note(key, type="number", unit=unit, **finite)
        return super().number(key, unit, above=above, at_least=at_least, at_most=at_most, hint=hint)

    def vector(
        self, key: str, size: int, unit: str, *, limit: float = _INFINITE, hint: str = ""
    ) -> NDArray[np.float64]:
        """Note numbers of a count."""
        bounds = {"minimum": -limit, "maximum": limit} if limit < _INFINITE else {}
        items = {"type": "number", **bounds}
        self.note(key, type="array", unit=unit, items=items, minItems=size, maxItems=size)
        return super().vector(key, size, unit, limit=limit, hint=hint)

    def choice(self, key: str, allowed: Iterable[str], default: str | None = None) -> str:
        """Note words."""
        words = list(allowed)
        self.note(key, enum=words, **({} if default is None else {"default": default}))
        return super().choice(key, words, default)

    def text(self, key: str, what: str, kind: str = "text") -> str:
        """Note a text."""
        self.note(key, type="string")
        return super().text(key, what, kind)

    def flag(self, key: str) -> bool:
        """Note true or false."""
        self.note(key, type="boolean", default=False)
        return super().flag(key)

    def names(self, key: str, what: str, *, at_least: int, few: str) -> list[str]:
        """Note a list of names."""
        items = {"type": "string", "minLength": 1}
        self.note(key, type="array", items=items, minItems=at_least, uniqueItems=True)
        return super().names(key, what, at_least=at_least, few=few)

    def entries(self, key: str, what: str, form: str) -> list[Fields]:
        """Note a list of mappings: of several entries all that any is asked for."""
        node = self.note(key, type="array", minItems=1).setdefault("items", {})
        return [Traced(one.file, one.path, one.values, node) for one in super().entries(key, what, form)]

    def section(self, key: str, what: str) -> Fields:
        """Note a mapping, and go on inside it."""
        inner = super().section(key, what)
        return Traced(inner.file, inner.path, inner.values, self.note(key, type="object"))

    def refuse_unknown(self, known: Iterable[str]) -> None:
        """Note that no other keys are known."""
        self.node["additionalProperties"] = False
        super().refuse_unknown(known)


def rig_schema() -> dict[str, Any]:
    """Schema of a rig description: a ROS 2 parameter file."""
    top = Traced(Path("rig.yaml"), "", _RIG)
    rig_from_fields(top)
    rig = top.node
    cable = rig["properties"].pop(_CABLE)
    for name in _RIG["cables"]:
        rig["properties"].pop(name, None)
    for name, value in DEFAULT_TOLERANCE.items():
        rig["properties"]["tolerance"]["properties"][name]["default"] = value
    _describe(rig, "", described.RIG)
    _describe(cable, "CABLE", described.RIG)
    # A cable's key is the lab's own word. Other keys belong to other tools.
    marks = [{"required": [key]} for key in cable["required"]]
    rig["additionalProperties"] = {
        "if": {"type": "object", "anyOf": marks},
        "then": {"$ref": "#/definitions/cable"},
    }
    parameters = {"properties": {"ros__parameters": {"$ref": "#/definitions/rig"}}}
    return {
        "$schema": DRAFT,
        "title": "Rig description",
        "type": "object",
        "minProperties": 1,
        "properties": {"/**": {"type": "object", "required": ["ros__parameters"], **parameters}},
        "additionalProperties": parameters,
        "definitions": {"rig": rig, "cable": cable},
    }


def session_schema() -> dict[str, Any]:
    """Schema of a session.yaml."""
    top = Traced(Path("session.yaml"), "", _SESSION)
    session_from_fields(top)
    _describe(top.node, "", described.SESSION)
    return {"$schema": DRAFT, "title": "Session", **top.node}


#: Name -> schema.
SCHEMAS = {"rig": rig_schema, "session": session_schema}


def _describe(node: dict[str, Any], path: str, words: Mapping[str, str]) -> None:
    """Put a sentence to each key, ended by its unit, and remove what is no word of JSON Schema."""
    node.pop(_OPTIONAL, None)
    for key, inner in node.get("properties", {}).items():
        place = f"{path}.{key}" if path else key
        unit = inner.pop("unit", "")
        told = " ".join(filter(None, [words.get(place, ""), f"Unit: {unit}." if unit else ""]))
        if told:
            inner["description"] = told
        _describe(inner, place, words)
        _describe(inner.get("items", {}), place, words)
