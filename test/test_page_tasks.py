"""Each task of the page by its requests: what goes in, what comes out, and what is written where."""

from __future__ import annotations

import base64
import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("uvicorn", reason="pip install '.[ui]'")
pytest.importorskip("starlette", reason="pip install '.[ui]'")

from page_client import Client, served

from rig_identification.api.balancing import center_of_mass, example
from rig_identification.api.describing import read_rig, rig_parameters, rig_schema
from rig_identification.errors import FieldError, InputError
from rig_identification.thesis.static_case import load_static_case
from rig_identification.ui.jobs import MOST_RUNNING, Jobs
from rig_identification.ui.rig_form import rig_form

CONFIG = Path(__file__).parents[1] / "config"
TRIFILAR = CONFIG / "trifilar.yaml"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    folder = tmp_path_factory.mktemp("lab")
    (folder / "trifilar.yaml").write_bytes(TRIFILAR.read_bytes())
    with served(folder) as found:
        yield found


@pytest.fixture(scope="module")
def kept(client: Client) -> str:
    """Name of a session that the page simulated: case 14, short."""
    values = {
        "rig": "case 14", "start": "pulled aside", "pull": 0.05, "force": "unbalanced mass", "newton": 300.0,
        "frequency": 0.8, "plane": "xy", "duration": 6.0, "seed": 3, "real": True, "keep": "short",
    }  # fmt: skip
    go = client.post("/simulate/start", values).json["go"]
    assert client.ended(go)["state"] == "done", client.ask(go).text
    page = client.ask(go).text
    assert 'id="poses"' in page
    assert "/identify?session=simulated/short" in page
    return "simulated/short"


def trifilar() -> dict[str, Any]:
    return json.loads(json.dumps(rig_parameters(read_rig(TRIFILAR))))


def test_a_description_survives_the_form() -> None:
    """Every value of every shipped description has a field, and the field has its value."""
    for file in sorted(CONFIG.glob("*.yaml")):
        try:
            rig = read_rig(file)
        except InputError:
            continue  # parameters of nodes
        values = rig_parameters(rig)
        form = rig_form(rig_schema(), values)
        held: dict[str, Any] = {field.key: field.value for field in form.fields if field.value is not None}
        held |= {"cables": [cable.name for cable in form.cables], **form.kept}
        held |= {cable.name: {f.key: f.value for f in cable.fields} for cable in form.cables}
        for section in form.sections:
            if section.there:
                held[section.key] = {f.key: f.value for f in section.fields if f.value is not None}
        assert held == values, file.name


def test_a_rig_is_drawn_as_it_is_typed(client: Client) -> None:
    answer = client.post("/rig/drawing", trifilar()).json
    drawing = answer["html"]["drawing"]
    assert drawing.count("<svg") == 4
    longer = trifilar()
    longer[longer["cables"][0]]["length"] *= 1.05
    assert client.post("/rig/drawing", longer).json["html"]["drawing"] != drawing


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("gravity", lambda rig: rig.update(gravity=-9.81)),
        ("gravity", lambda rig: rig.pop("gravity")),
        ("{cable}.length", lambda rig: rig[rig["cables"][0]].update(length=1900.0)),
        ("{cable}.body_point[2]", lambda rig: rig[rig["cables"][0]].update(body_point=[0.0, 0.0, 900.0])),
        (
            "{cable}.ceiling_point[1]",
            lambda rig: rig[rig["cables"][0]].update(ceiling_point=[0.0, None, 2.0]),
        ),
        ("imu.orientation", lambda rig: rig.update(imu={"position": [0, 0, 0], "orientation": [1, 1, 0, 0]})),
        ("cables", lambda rig: rig.update(cables=[])),
        ("{other}", lambda rig: rig.update({rig["cables"][1]: rig[rig["cables"][0]]})),
    ],
)
def test_a_fault_is_told_at_its_field(client: Client, key: str, change: Any) -> None:
    rig = trifilar()
    cable, other = rig["cables"][:2]
    change(rig)
    answer = client.post("/rig/drawing", rig)
    assert answer.status == 422
    assert answer.json["fault"]["key"] == key.format(cable=cable, other=other)
    assert answer.json["fault"]["problem"]


def test_a_rig_is_saved_once(client: Client) -> None:
    rig = {**trifilar(), "mass": 43.5, "file": "mine/rig.yaml"}
    assert client.post("/rig/save", rig).status == 200
    file = client.folder / "mine" / "rig.yaml"
    assert read_rig(file).mass == 43.5
    again = {**rig, "mass": 44.5}
    assert client.post("/rig/save", again).json["fault"]["key"] == "file"
    assert read_rig(file).mass == 43.5
    assert client.post("/rig/save", {**again, "replace": True}).status == 200
    assert read_rig(file).mass == 44.5
    assert [path.name for path in file.parent.iterdir()] == ["rig.yaml"]
    assert 'value="44.5"' in client.ask("/rig?file=mine/rig.yaml").text


def test_the_example_is_table_2_1() -> None:
    """The centre of mass without the frame is the table's to a millimetre, from angles of five digits."""
    rig, readings = example()
    exact = dict.fromkeys(rig.tolerance, 0.0)
    from dataclasses import replace

    from rig_identification.statics import without_frame

    found = center_of_mass(replace(rig, tolerance=exact), readings)
    assert found.solution.status == "determined"
    assert rig.frame is not None
    _, center, _ = without_frame(found.solution, rig.frame)
    assert center == pytest.approx(load_static_case().body, abs=1e-3)


def test_the_center_of_mass_is_solved_and_shown(client: Client) -> None:
    _, readings = example()
    page = client.post("/balance/solve", dict(readings)).json["html"]["answer"]
    assert "determined" in page
    assert "1.771" in page  # of the body without its frame, as the thesis prints it in mm
    assert page.count("<svg") == 4
    assert all(f"cable_{i}</td>" in page for i in range(1, 5))


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("mass", {"mass": -3.0}),
        ("mass", {"mass": 100.0}),  # less than the carrying frame
        ("lengths.cable_1", {"lengths": {"cable_1": 1500.0}}),
        ("lengths.cable_9", {"lengths": {"cable_9": 1.5}}),
        ("rest[0].inclination_deg", {"rest": [{"name": "bare", "inclination_std_deg": 0.01}]}),
        (
            "rest[0].inclination_deg",
            {"rest": [{"name": "bare", "inclination_deg": [80.0, 80.0], "inclination_std_deg": 0.01}]},
        ),
        ("rest", {"rest": []}),
    ],
)
def test_a_reading_that_cannot_be_is_told_by_its_key(key: str, change: dict[str, Any]) -> None:
    rig, readings = example()
    with pytest.raises(FieldError) as told:
        center_of_mass(rig, {**readings, **change})
    assert told.value.key == key


def test_lengths_are_those_that_were_read() -> None:
    rig, readings = example()
    found = center_of_mass(rig, {**readings, "lengths": {"cable_2": 1.51}})
    assert [cable.length for cable in found.rig.cables] == [1.5, 1.51, 1.5, 1.5]


def test_a_session_is_checked(client: Client, kept: str) -> None:
    go = client.post("/check/start", {"session": kept, "namespace": "/rig"}).json["go"]
    assert client.ended(go)["state"] == "done", client.ask(go).text
    assert (client.folder / "answers" / kept / "check.html").is_file()
    assert "/files/answers/simulated/short/check.html" in client.ask(go).text
    assert client.ask("/files/answers/simulated/short/check.html").status == 200


def test_a_session_is_identified_and_has_a_history(client: Client, kept: str) -> None:
    values = {"session": kept, "namespace": "/rig", "work": 0.01}
    go = client.post("/identify/start", values).json["go"]
    told = client.ended(go)
    assert told["state"] == "done", client.ask(go).text
    assert {"reading run_1", "writing the report"} & {*told["stages"], told["stage"]}
    folder = client.folder / "answers" / kept
    document = json.loads((folder / "result.json").read_text())
    truth = json.loads((client.folder / kept / "truth.json").read_text())
    assert document["mass"]["value"] == pytest.approx(truth["mass"], rel=0.01)
    assert "report.html" in client.ask(go).text
    page = client.ask("/history").text
    assert "answers/simulated/short" in page
    assert "A trend takes two results" in page
    other = client.folder / "answers" / "later"
    other.mkdir()
    (other / "result.json").write_text((folder / "result.json").read_text())
    page = client.ask("/history").text
    (query,) = re.findall(r'src="(/history/compare\?[^"]+)"', page)
    compared = client.ask(query.replace("&amp;", "&").partition("#")[0])
    assert compared.status == 200
    assert "They agree" in compared.text
    assert "sandbox" in compared.headers["content-security-policy"]


def test_a_stopped_task_leaves_no_half_of_an_answer(client: Client, kept: str) -> None:
    folder = client.folder / "answers" / kept
    before = {path.name: path.read_bytes() for path in folder.iterdir()} if folder.exists() else {}
    go = client.post("/identify/start", {"session": kept, "namespace": "/rig", "work": 1000.0}).json["go"]
    while client.ask(f"{go}/state").json["stage"] == "starting":
        time.sleep(0.05)
    told = client.ask(f"{go}/stop", "POST", b"", Origin=f"http://{client.host}").json
    assert told["stopping"] or told["state"] != "running"
    ended = client.ended(go)
    assert ended["state"] in ("stopped", "done")
    after = {path.name: path.read_bytes() for path in folder.iterdir()} if folder.exists() else {}
    assert after == before or ended["state"] == "done"
    assert not list(client.folder.rglob("*.part"))


def test_a_stop_asked_twice_ends_at_once(client: Client, kept: str) -> None:
    go = client.post("/identify/start", {"session": kept, "namespace": "/rig", "work": 1000.0}).json["go"]
    for _ in range(2):
        client.ask(f"{go}/stop", "POST", b"", Origin=f"http://{client.host}")
    begun = time.monotonic()
    assert client.ended(go)["state"] == "stopped"
    assert time.monotonic() - begun < 20.0


def test_so_many_tasks_run_and_no_more() -> None:
    jobs = Jobs()
    nowhere = {"session": "/nowhere", "root": "/nowhere", "namespace": "/rig", "out": "/nowhere/out"}
    begun = [jobs.start("check", "check", nowhere) for _ in range(MOST_RUNNING)]
    with pytest.raises(InputError, match="tasks are running"):
        jobs.start("check", "check", nowhere)
    until = time.monotonic() + 120.0
    while any(job.state == "running" for job in begun) and time.monotonic() < until:
        time.sleep(0.05)
    assert {job.state for job in begun} == {"failed"}
    assert all("/nowhere" in job.message for job in begun)
    jobs.end()


def test_a_worker_that_is_killed_is_told(client: Client, kept: str) -> None:
    jobs = Jobs()
    where = {"session": str(client.folder / kept), "root": str(client.folder), "namespace": "/rig"}
    job = jobs.start("identify", "identify", {**where, "work": 100.0, "out": str(client.folder / "never")})
    job.process.kill()
    until = time.monotonic() + 60.0
    while job.state == "running" and time.monotonic() < until:
        time.sleep(0.05)
    assert job.state == "failed"
    assert "ended with" in job.message
    assert not (client.folder / "never").exists()


def first_pose(client: Client, shift: list[float], turn: list[float]) -> Any:
    """(8,) time, position and quaternion with which a run begins, or the message where it cannot."""
    values = {
        "rig": "case 1", "start": "off its rest", "shift": shift, "turn_deg": turn,
        "force": "none", "duration": 1.0, "seed": 0, "real": False,
    }  # fmt: skip
    go = client.post("/simulate/start", values).json["go"]
    if client.ended(go)["state"] != "done":
        return client.ask(go).text
    (text,) = re.findall(r'id="poses">([^<]+)<', client.ask(go).text)
    return np.frombuffer(base64.b64decode(json.loads(text)["runs"]["run_1"]), "<f4").reshape(-1, 8)[0]


def test_a_body_is_let_go_off_its_rest(client: Client) -> None:
    """It sways along x, and pitches as its cables make it; four cables that converge hold it against yaw."""
    rest = first_pose(client, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    aside = first_pose(client, [0.1, 0.0, 0.0], [0.0, 0.0, 0.0])
    assert 0.05 < aside[1] - rest[1] < 0.11
    assert abs(aside[2] - rest[2]) < 0.01
    assert "displace it along a direction in which it swings" in first_pose(
        client, [0.0, 0.0, 0.0], [0.0, 0.0, 3.0]
    )


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("rig", {"rig": "case 99"}),
        ("start", {"start": "thrown"}),
        ("pull", {"pull": 3.0}),
        ("frequency", {"frequency": 0.0}),
        ("duration", {"duration": 1e9}),
        ("keep", {"keep": "../outside"}),
    ],
)
def test_a_simulation_that_cannot_be_is_told_at_its_field(
    client: Client, key: str, change: dict[str, Any]
) -> None:
    values = {
        "rig": "case 14", "start": "pulled aside", "pull": 0.05, "force": "unbalanced mass", "newton": 300.0,
        "frequency": 0.8, "plane": "xy", "duration": 6.0, "seed": 3, "real": True,
    }  # fmt: skip
    answer = client.post("/simulate/start", {**values, **change})
    assert answer.status == 422
    fault = answer.json["fault"]
    assert fault["key"] == key or "body" in fault["key"]
    assert not (client.folder.parent / "outside").exists()


def test_a_plan_is_written(client: Client) -> None:
    values = {
        "rig": "trifilar.yaml", "box": [0.6, 0.4, 0.3], "mass": 42.0, "exciter": "motor", "minutes": 1.0,
        "force": 0.05, "pull": 0.06, "highest": 2.0, "travel": 0.15, "taut": 0.1, "rest": 5.0,
    }  # fmt: skip
    assert client.post("/plan/start", {**values, "box": [0.6, -0.4, 0.3]}).json["fault"]["key"] == "box"
    go = client.post("/plan/start", values).json["go"]
    assert client.ended(go)["state"] == "done", client.ask(go).text
    written = sorted(path.name for path in (client.folder / "plans" / "trifilar").iterdir())
    assert written == ["exciter.csv", "plan.html", "plan.json", "rig.yaml", "session.yaml"]
    assert "standard deviation" in client.ask(go).text
