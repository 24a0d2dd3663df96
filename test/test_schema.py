"""JSON Schema of the descriptions: it takes what the validation takes, and refuses what it refuses."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from rig_identification.cli.main import main
from rig_identification.errors import InputError
from rig_identification.session import described
from rig_identification.session.fields import Fields
from rig_identification.session.rig_description import rig_from_fields
from rig_identification.session.schema import _RIG, _SESSION, SCHEMAS, rig_schema, session_schema
from rig_identification.session.session_description import session_from_fields

jsonschema = pytest.importorskip("jsonschema", reason="pip install '.[test]'")

ROOT = Path(__file__).parents[1]
Edit = Callable[[dict[str, Any]], object]


def accepts(schema: dict[str, Any], document: object) -> bool:
    return bool(jsonschema.Draft7Validator(schema).is_valid(document))


def as_file(parameters: dict[str, Any]) -> dict[str, Any]:
    return {"/**": {"ros__parameters": parameters}}


@pytest.mark.parametrize("schema", SCHEMAS.values(), ids=SCHEMAS)
def test_it_is_a_schema(schema: Callable[[], dict[str, Any]]) -> None:
    jsonschema.Draft7Validator.check_schema(schema())
    json.dumps(schema(), allow_nan=False)


@pytest.mark.parametrize("name", ["bifilar", "trifilar", "car_four_cables"])
def test_it_takes_the_rigs_of_the_repository(name: str) -> None:
    file = ROOT / "config" / f"{name}.yaml"
    assert accepts(rig_schema(), YAML(typ="safe", pure=True).load(file.read_text(encoding="utf-8")))


FAULTS: dict[str, Edit] = {
    "a mass of nothing": lambda d: d.update(mass=0.0),
    "a mass that is a text": lambda d: d.update(mass="1240 kg"),
    "no gravity": lambda d: d.pop("gravity"),
    "gravity of Jupiter's core": lambda d: d.update(gravity=300.0),
    "one cable": lambda d: d.update(cables=["cable_1"]),
    "a cable twice": lambda d: d.update(cables=["cable_1", "cable_1"]),
    "a hinge in two numbers": lambda d: d["cable_1"].update(body_point=[0.0, 1.0]),
    "a hinge in mm": lambda d: d["cable_1"].update(body_point=[1200.0, 0.0, 1500.0]),
    "a cable without length": lambda d: d["cable_2"].pop("length"),
    "a cell at the side": lambda d: d["cable_1"].update(load_cell="side"),
    "an IMU without orientation": lambda d: d["imu"].pop("orientation"),
    "a noise of another name": lambda d: d["noise"].update(temperature=1.0),
    "a tolerance below nothing": lambda d: d["tolerance"].update(clock=-1.0),
    "a frame of five numbers": lambda d: d["frame"].update(inertia=[1.0, 0.0, 0.0, 1.0, 0.0]),
}
TAKEN: dict[str, Edit] = {
    "no mass": lambda d: (d.pop("mass"), d.pop("mass_std"), d.pop("frame")),
    "no IMU": lambda d: d.pop("imu"),
    "no noise": lambda d: d.pop("noise"),
    "a key of another tool": lambda d: d.update(use_sim_time=True),
    "a mount of motion capture by half": lambda d: d["mocap"].pop("orientation"),
    "a cable without a cell's end": lambda d: d["cable_1"].pop("load_cell"),
}


@pytest.mark.parametrize("case", [*FAULTS, *TAKEN])
def test_it_and_the_validation_agree_on_a_rig(case: str) -> None:
    sound = case in TAKEN
    parameters = copy.deepcopy(_RIG)
    (TAKEN if sound else FAULTS)[case](parameters)
    assert accepts(rig_schema(), as_file(parameters)) is sound
    if sound:
        rig_from_fields(Fields(Path("rig.yaml"), "", parameters))
    else:
        with pytest.raises(InputError):
            rig_from_fields(Fields(Path("rig.yaml"), "", parameters))


@pytest.mark.parametrize(
    ("edit", "sound"),
    [
        (lambda d: None, True),
        (lambda d: d["recordings"][1].update(holdout=True), True),
        (lambda d: d.pop("rig"), False),
        (lambda d: d.update(recordings=[]), False),
        (lambda d: d["recordings"][0].update(kind="rest"), False),
        (lambda d: d["recordings"][0].pop("kind"), False),
        (lambda d: d["recordings"][1].update(holdout="yes"), False),
        (lambda d: d["recordings"][0]["dummy"].pop("mass"), False),
        (lambda d: d["recordings"][0].update(bags="x"), False),
    ],
)
def test_it_and_the_validation_agree_on_a_session(edit: Edit, sound: bool) -> None:
    document = copy.deepcopy(_SESSION)
    edit(document)
    assert accepts(session_schema(), document) is sound
    if sound:
        session_from_fields(Fields(Path("session.yaml"), "", document))
    else:
        with pytest.raises(InputError):
            session_from_fields(Fields(Path("session.yaml"), "", document))


def test_every_key_is_described() -> None:
    """By a sentence of its own, or, of noise and tolerance, by its unit."""
    rig = rig_schema()["definitions"]
    found = set(rig["rig"]["properties"]) | {f"CABLE.{key}" for key in rig["cable"]["properties"]}
    assert found <= set(described.RIG)
    assert "Unit: m." in rig["cable"]["properties"]["length"]["description"]
    assert rig["rig"]["properties"]["tolerance"]["properties"]["cable_length"]["default"] == 0.0005
    items = session_schema()["properties"]["recordings"]["items"]["properties"]
    assert {f"recordings.{key}" for key in items} <= set(described.SESSION)


def test_the_command_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "rig"]) == 0
    assert json.loads(capsys.readouterr().out) == rig_schema()
