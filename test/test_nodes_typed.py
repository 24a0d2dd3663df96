"""The typed interface: the package is built, and a client in another process uses action and services."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import (
    PATIENCE,
    ROOT,
    SIMULATOR,
    Diagnostics,
    Graph,
    Probe,
    graph_of_the_test,
    probe_of_the_test,
)
from ruamel.yaml import YAML
from test_simulate_identify import shaken

from rig_identification.nodes.typed import TYPED
from rig_identification.session import write_session
from rig_identification.simulate import simulate_session

__all__ = ["graph_of_the_test", "probe_of_the_test"]

pytestmark = pytest.mark.long
#: A folder that holds a build already: it saves the minute that a build takes.
BUILT = "RIG_IDENTIFICATION_INTERFACES"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Prefix of the built interfaces."""
    if given := os.environ.get(BUILT):
        return Path(given)
    pytest.importorskip("ament_package", reason="pip install '.[interfaces]'")
    for tool in ("cmake", "c++"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    prefix = tmp_path_factory.mktemp("interfaces")
    made = subprocess.run(
        [str(ROOT / "interfaces" / "build.sh"), str(prefix), sys.executable], capture_output=True, text=True
    )
    assert made.returncode == 0, made.stdout + made.stderr
    assert made.stdout.count("export ") == 3
    return prefix


@pytest.fixture(scope="module")
def environment(built: Path) -> dict[str, str]:
    """What build.sh says to export."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    added = {
        "PYTHONPATH": [str(ROOT), str(built / "lib" / version / "site-packages")],
        "LD_LIBRARY_PATH": [str(built / "lib")],
        "AMENT_PREFIX_PATH": [str(built)],
    }
    return {key: os.pathsep.join([*new, os.environ.get(key, "")]) for key, new in added.items()}


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A car on four cables as the ideal model has it: runs of 4 s, so that a fit takes seconds."""
    made, truth = simulate_session(replace(shaken(14, 4.0), doubts=False), np.random.default_rng(3))
    folder = write_session(made, tmp_path_factory.mktemp("simulated") / "car")
    (folder / "mass").write_text(str(truth.elements[0]))
    return folder


class Client:
    """The client's process and what it told."""

    def __init__(
        self, graph: Graph, environment: dict[str, str], goal: dict[str, Any], cancel_at: str = ""
    ) -> None:
        program = str(Path(__file__).with_name("typed_client.py"))
        command = [sys.executable, program, "/rig/identifier/identify_inertia", json.dumps(goal), cancel_at]
        self.process = graph.run(command, **environment)
        self.events: list[dict[str, Any]] = []

    def until(self, *names: str) -> dict[str, Any]:
        """Read on to an event of one of these names."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            assert line.startswith("{"), line + self.process.stdout.read()
            self.events.append(json.loads(line))
            if self.events[-1]["event"] in names:
                return self.events[-1]
        raise AssertionError(f"{names} did not come after {self.events[-3:]}")

    def told(self, name: str) -> list[dict[str, Any]]:
        return [event for event in self.events if event["event"] == name]


@pytest.fixture(name="shared", scope="module")
def shared_by_the_tests(
    tmp_path_factory: pytest.TempPathFactory, environment: dict[str, str]
) -> Iterator[Graph]:
    """A graph with an identifier that several tests ask, one after the other."""
    graph = Graph(tmp_path_factory.mktemp("graph"))
    identifier = start_identifier(graph, environment)
    yield graph
    assert graph.end(identifier) == (0, "")
    graph.close()


def start_identifier(graph: Graph, environment: dict[str, str]) -> subprocess.Popen[str]:
    return graph.start("identifier", f"spool:={graph.folder / 'windows'}", **environment)


def fits_of(identifier: subprocess.Popen[str]) -> list[str]:
    """Processes of an identifier's own."""
    return Path(f"/proc/{identifier.pid}/task/{identifier.pid}/children").read_text().split()


def runs(process: str) -> bool:
    """Whether a process is there; one that has ended may wait for its parent to notice."""
    try:
        status = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


def test_a_goal_is_answered_with_progress_and_numbers(
    shared: Graph, environment: dict[str, str], session: Path
) -> None:
    goal = {"session": str(session), "work": 3.0}
    client = Client(shared, environment, goal)
    result = client.until("result", "gone")
    assert (result["state"], result["message"], result["interrupted"]) == ("succeeded", "", False)
    heard = client.told("feedback")
    fractions = [event["fraction"] for event in heard]
    assert fractions[-1] == 1.0
    assert len({event["stage"] for event in heard}) > 4
    known = [event["mass"] for event in heard if event["mass"] is not None]
    assert known
    assert heard[0]["mass"] is None
    mass = float((session / "mass").read_text())
    for number in (float(result["mass"]), known[-1]):  # a body's mass, in kg, and no other number
        assert number == pytest.approx(mass, rel=0.02)
    result_file, report_file = map(Path, result["files"])
    assert json.loads(result_file.read_text())["mass"]["value"] == float(result["mass"])
    assert report_file.is_file()
    listed = "".join(
        f"{d}  {n}\n" for n, d in json.loads(result_file.read_text())["provenance"]["files"].items()
    )
    summed = subprocess.run(["sha256sum"], input=listed, capture_output=True, text=True, check=True)
    assert result["sha256"] == summed.stdout.split()[0]
    # The same again: at once, with the same files
    again = Client(shared, environment, goal)
    begun = time.monotonic()
    assert again.until("result", "gone")["files"] == result["files"]
    assert not again.told("feedback")
    assert time.monotonic() - begun < 10.0 * PATIENCE


@pytest.mark.parametrize("stage", ["accepted", "reading", "fit", "search"])
def test_a_goal_can_be_cancelled_at_every_stage(
    shared: Graph, environment: dict[str, str], session: Path, stage: str
) -> None:
    client = Client(shared, environment, {"session": str(session)}, stage)
    client.until("cancelling", "result")
    begun = time.monotonic()
    result = client.until("result", "gone")
    assert result["state"] == "canceled"
    assert time.monotonic() - begun < 30.0
    if stage == "search":  # the ideal model is fitted: its numbers are not lost
        assert result["interrupted"]
        assert float(result["mass"]) > 0.0
        assert Path(result["files"][0]).is_file()
    elif stage in ("accepted", "reading"):
        assert "cancelled before there was an answer" in result["message"]
        assert result["mass"] == "nan"
    assert not fits_of(shared.processes[0])


def test_a_goal_that_cannot_be_met_is_told_why(
    shared: Graph, environment: dict[str, str], session: Path
) -> None:
    for goal, words in (
        ({"session": str(shared.folder / "none")}, "none"),
        ({"session": str(session), "work": -1.0}, "give units of work above 0"),
        ({"session": str(session), "windows": ["run_1"]}, "a session is taken whole"),
        ({}, "no window is complete"),
    ):
        told = Client(shared, environment, goal).until("result", "gone")
        assert told["state"] == "aborted"
        assert words in told["message"], told


def test_a_second_goal_is_told_what_runs_and_a_trigger_ends_the_first(
    shared: Graph, environment: dict[str, str], session: Path
) -> None:
    first = Client(shared, environment, {"session": str(session)})
    first.until("feedback")
    refused = Client(shared, environment, {"session": str(session)}).until("result", "gone")
    assert refused["state"] == "aborted"
    assert re.match(r"busy: identify_inertia, run \d+, is \d+ % done \(.+\)", refused["message"]), refused
    probe = Probe(shared)
    assert probe.call("identifier/cancel").success
    probe.close()
    ended = first.until("result", "gone")
    assert ended["state"] == "aborted"
    assert ended["message"].endswith("was cancelled")


def test_a_killed_identifier_is_noticed_and_a_new_one_answers(
    graph: Graph, environment: dict[str, str], session: Path
) -> None:
    identifier = start_identifier(graph, environment)
    client = Client(graph, environment, {"session": str(session)})
    client.until("feedback")
    (child,) = fits_of(identifier)
    identifier.send_signal(signal.SIGKILL)
    identifier.communicate()
    graph.processes.remove(identifier)
    assert client.until("gone", "result")["event"] == "gone"
    end = time.monotonic() + 10.0 * PATIENCE
    while runs(child):  # the fit outlives no node
        assert time.monotonic() < end
        time.sleep(0.05)
    anew = start_identifier(graph, environment)
    cancelled = Client(graph, environment, {"session": str(session)}, "accepted")
    assert cancelled.until("result", "gone")["state"] == "canceled"
    assert graph.end(anew)[0] == 0


SERVICES = """
import json, sys, time
import rclpy
from rig_identification_interfaces.srv import Check, GetCenterOfMass, GetInertia, StartWindow, StopWindow

rclpy.init()
node = rclpy.create_node("operator")

def ask(kind, name, /, **fields):
    client = node.create_client(kind, f"/rig/identifier/typed/{name}")
    assert client.wait_for_service(120.0), name
    time.sleep(0.5)
    future = client.call_async(kind.Request(**fields))
    rclpy.spin_until_future_complete(node, future, timeout_sec=120.0)
    answer = future.result()
    values = {field: getattr(answer, field) for field in answer.get_fields_and_field_types()}
    return {field: v.tolist() if hasattr(v, "tolist") else v for field, v in values.items()}

def tell(name, answer):
    answer["window"] = answer.get("name")
    print(json.dumps({**answer, "name": name}, default=str), flush=True)

tell("early", ask(GetInertia, "get_inertia"))
tell("early_com", ask(GetCenterOfMass, "get_center_of_mass"))
tell("wrong", ask(StartWindow, "start_window", kind="swinging"))
tell("odd", ask(StartWindow, "start_window", kind="static", holdout=True))
tell("heavy", ask(StartWindow, "start_window", kind="dynamic", dummy_mass=5.0))
tell("started", ask(StartWindow, "start_window", kind="static", dummy_mass=5.0))
time.sleep(float(sys.argv[2]))
tell("stopped", ask(StopWindow, "stop_window"))
for session in sys.argv[3:]:
    checked = ask(Check, "check", session=session)
    checked["faults"] = [[f.effect, f.statement, f.channel] for f in checked["faults"]]
    tell("checked", checked)
"""


def test_services_take_and_give_typed_values(
    graph: Graph, probe: Probe, environment: dict[str, str], session: Path
) -> None:
    identifier = start_identifier(graph, environment)
    graph.start("rig_simulator", *SIMULATOR)
    graph.start("load_cells", "simulation.rate:=100.0")
    turned = graph.folder / "turned"
    shutil.copytree(session, turned)
    rig = (turned / "rig.yaml").read_text()
    document = YAML(typ="safe").load(rig)
    document["/**"]["ros__parameters"]["imu"]["orientation"] = [0.0, 0.0, 1.0, 0.0]  # half a turn about z
    with (turned / "rig.yaml").open("w") as stream:
        YAML(typ="safe", pure=True).dump(document, stream)
    diagnostics = Diagnostics(probe)
    probe.spin_until(diagnostics.arrivals("identifier", 1, "cable_1/wrench"), 120.0, "the load cells")
    assert diagnostics.says("identifier: interface", TYPED)
    asking = graph.run(
        [sys.executable, "-c", SERVICES, "-", "3", str(session), str(turned), "nowhere"], **environment
    )
    output, _ = asking.communicate(timeout=240.0 * PATIENCE)
    assert asking.returncode == 0, output
    told = [json.loads(line) for line in output.splitlines()]
    by_name = {line["name"]: line for line in told}
    assert not by_name["early"]["success"]
    assert "nothing was identified" in by_name["early"]["message"]
    assert not by_name["early_com"]["success"]
    assert "give static or dynamic" in by_name["wrong"]["message"]
    assert "cannot be held out" in by_name["odd"]["message"]
    assert "dummy belongs to a static" in by_name["heavy"]["message"]
    assert (by_name["started"]["success"], by_name["started"]["window"]) == (True, "static_1")
    assert (by_name["stopped"]["success"], by_name["stopped"]["window"]) == (True, "static_1")
    counts = dict(zip(by_name["stopped"]["topics"], by_name["stopped"]["messages"], strict=True))
    assert {f"/rig/cable_{i}/wrench" for i in range(1, 5)} <= set(counts)
    assert min(counts.values()) > 50
    assert by_name["stopped"]["silent"] == []
    checks = [line for line in told if line["name"] == "checked"]
    assert [line["success"] for line in checks] == [True, True, False]
    assert "True" in str(checks[0]["sound"])
    assert checks[1]["faults"][0][2] == "imu"
    assert "nowhere" in checks[2]["message"]
    (entry,) = YAML(typ="safe").load((graph.folder / "windows" / "session.yaml").read_text())["recordings"]
    assert entry["dummy"]["mass"] == 5.0
    assert graph.end(identifier)[0] == 0


FRAMES = """
import json, time
import rclpy
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

rclpy.init()
node = rclpy.create_node("viewer")
late = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
heard = {"/tf_static": [], "/tf": [], "/rig/odometry": [], "/rig/robot_description": []}
kinds = dict(zip(heard, (TFMessage, TFMessage, Odometry, String)))
for topic, kind in kinds.items():
    qos = late if topic in ("/tf_static", "/rig/robot_description") else 1000
    node.create_subscription(kind, topic, heard[topic].append, qos)
end = time.monotonic() + 240.0
while time.monotonic() < end and not (all(heard.values()) and len(heard["/tf"]) > 20):
    rclpy.spin_once(node, timeout_sec=0.1)

def told(t):
    p = t.transform.translation
    return {"parent": t.header.frame_id, "child": t.child_frame_id, "at": [p.x, p.y, p.z],
            "stamp": [t.header.stamp.sec, t.header.stamp.nanosec]}

tracked = {(o.header.stamp.sec, o.header.stamp.nanosec): o.pose.pose.position for o in heard["/rig/odometry"]}
moving = [told(m.transforms[0]) for m in heard["/tf"]]
for one in moving:
    p = tracked.get(tuple(one["stamp"]))
    one["odometry"] = None if p is None else [p.x, p.y, p.z]
static = [told(t) for t in heard["/tf_static"][0].transforms]
print(json.dumps({"static": static, "moving": moving, "urdf": heard["/rig/robot_description"][0].data}))
"""


def test_frames_come_by_tf(graph: Graph, environment: dict[str, str]) -> None:
    graph.start("rig_simulator", *SIMULATOR)
    for sensor in ("load_cells", "imu", "inclinometer"):
        graph.start(sensor, "simulation.rate:=100.0")
    tracker = graph.start("tracker", **environment)
    viewing = graph.run([sys.executable, "-c", FRAMES], **environment)
    output, _ = viewing.communicate(timeout=300.0)
    told = json.loads(output)
    static = {one["child"]: one for one in told["static"]}
    assert set(static) == {
        "imu", "inclinometer", "exciter",
        *(f"cable_{i}_{end}" for i in range(1, 5) for end in ("body", "ceiling")),
    }  # fmt: skip
    assert static["cable_2_ceiling"]["parent"] == "world"
    assert static["cable_2_body"]["at"] == [1.48, 0.03, 0.01]
    assert {(one["parent"], one["child"]) for one in told["moving"]} == {("world", "body")}
    pairs = [(one["at"], one["odometry"]) for one in told["moving"] if one["odometry"]]
    assert len(pairs) > 10
    assert all(at == seen for at, seen in pairs)  # the same pose at the same stamp
    assert 'joint name="world_to_body" type="floating"' in told["urdf"]
    assert graph.end(tracker) == (0, "")


def test_the_program_of_the_documentation_runs(
    shared: Graph, environment: dict[str, str], session: Path
) -> None:
    page = (ROOT / "docs" / "how-to" / "typed-interface.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert program.count('session="/data/car"') == 1
    program = program.replace('session="/data/car"', f"session={str(session)!r}, work=2.0")
    running = shared.run([sys.executable, "-c", program], **environment)
    output, _ = running.communicate(timeout=300.0)
    assert running.returncode == 0, output
    *progress, last = output.splitlines()
    assert re.fullmatch(r"(none|explained|unexplained): \d+\.\d\d kg, report .*/report\.html", last), output
    assert any("mass so far nan" not in line for line in progress)
