"""The graph as processes: simulated rig up, motion recorded, body identified by service, session replayed."""

from __future__ import annotations

import json
import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import InertiaStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from node_processes import BODY, Diagnostics, Graph, Probe, stamp
from rclpy.serialization import deserialize_message
from ruamel.yaml import YAML
from scipy.stats import chi2
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64MultiArray, String
from visualization_msgs.msg import MarkerArray

from rig_identification.nodes.rig_node import LATCHED
from rig_identification.search.identify import identify
from rig_identification.session import read_session

DUMMY = [0.16, 0.2, -0.2]
#: Nodes that keep data, and how they are told to.
KEEPERS = {"recorder": ("start", "stop"), "identifier": ("start_window", "stop_window")}
#: s that a fit with its search for left-out physics may take on a busy machine.
FIT = 400.0


def ten_of(message: InertiaStamped) -> np.ndarray:
    i = message.inertia
    return np.array([i.m, i.com.x, i.com.y, i.com.z, i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz])


def decoded(raw: bytes) -> Odometry:
    return deserialize_message(raw, Odometry)


@dataclass(frozen=True)
class Heard:
    """What each device of the simulated rig sent, as it came."""

    devices: tuple[list[bytes], ...]

    @classmethod
    def by(cls, probe: Probe) -> Heard:
        """From now on. Each device hears the plant for itself, and on a busy machine one may lag behind."""
        topics = (
            (WrenchStamped, "cable_1/wrench"),
            (Imu, "imu/data_raw"),
            (Vector3Stamped, "inclinometer/angles"),
        )
        return cls(tuple(probe.listen(kind, topic, 20_000, raw=True) for kind, topic in topics))

    def pass_by(self, probe: Probe, moment: float) -> None:
        """Wait until every device sends what it sampled after ``moment``."""
        for raw in self.devices:
            probe.spin_until(
                lambda raw=raw: raw and raw_stamp(raw[-1]) > moment, 60.0, "the devices' samples"
            )


def raw_stamp(raw: bytes) -> float:
    """Stamp of a serialized message that begins with its header."""
    sec, nanosec = np.frombuffer(raw, "<u4", 2, offset=4)
    return float(int(sec) % 100_000 + 1e-9 * int(nanosec))


def come_to_rest(probe: Probe, heard: Heard) -> None:
    """The body hangs still, and every device samples it so."""
    answer = probe.call("rig_simulator/come_to_rest")
    assert answer.success, answer.message
    since = re.search(r"from stamp ([0-9.]+) on", answer.message)
    assert since is not None, answer.message
    heard.pass_by(probe, float(since[1]) % 100_000.0)


def is_likely(off: np.ndarray, covariance: np.ndarray) -> bool:
    """Whether an error is one that its covariance lets happen: all its components at once, by chi-square.

    The shift is recorded live, with other noise each time. Each of ten numbers within three of its own
    standard deviations would not be so in one shift of forty; this is not in one of ten thousand.
    """
    off = np.atleast_1d(off)
    return bool(off @ np.linalg.solve(np.atleast_2d(covariance), off) < chi2.ppf(1.0 - 1e-4, off.size))


def off_and_covariance(answer: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Error (9,) of c and J, and its covariance, of an answer to ``identify_inertia``."""
    J = np.array(answer["inertia"]["value"])[np.triu_indices(3)]
    found = np.concatenate([answer["center_of_mass"]["value"], J])
    return found - BODY[1:], np.array(answer["covariance"])[1:, 1:]


def record(probe: Probe, truth: list[bytes], seconds: float, **recording: object) -> float:
    """Record, and keep as a window, so many s by the rig's own clock; returns when it began."""
    for node, (start, stop) in KEEPERS.items():
        assert not probe.set(node, **{f"recording__{name}": value for name, value in recording.items()})
        probe.meet(f"{node}/{stop}")
        assert probe.call(f"{node}/{start}").success
    begun = stamp(decoded(truth[-1]))
    passed = begun + seconds
    probe.spin_until(lambda: stamp(decoded(truth[-1])) > passed, 10.0 * seconds, f"{seconds} s of motion")
    for node, (_, stop) in KEEPERS.items():
        answer = probe.call(f"{node}/{stop}")
        assert answer.success, answer.message
    return begun


@dataclass(frozen=True)
class Shift:
    """What a shift at the simulated rig left behind."""

    session: Path  # that the recorder wrote
    answers: dict[str, Any]  # of the identifier, by request


@pytest.fixture(scope="module")
def shift(tmp_path_factory: pytest.TempPathFactory) -> Shift:
    """One command brings the rig up; all else is asked for by service, from this process."""
    folder = tmp_path_factory.mktemp("shift")
    graph = Graph(folder)
    chosen = (
        f"recorder.folder={folder / 'session'}", "load_cells.simulation.rate=200.0",
        "imu.simulation.bias=[0.0, 0.0, 0.0, 0.01, 0.0, -0.01]",
    )  # fmt: skip
    command = [sys.executable, "-m", "rig_identification.cli.main", "rig", "simulated"]
    rig = graph.run(command + [part for one in chosen for part in ("--set", one)])
    try:
        probe = Probe(graph)
        odometry = probe.listen(Odometry, "odometry", 20_000, raw=True)
        truth = probe.listen(Odometry, "ground_truth/odometry", 20_000, raw=True)
        heard = Heard.by(probe)
        probe.spin_until(lambda: odometry and truth, 120.0, "the graph")
        probe.hear_once(WrenchStamped, "generalized_wrench")
        assert len(probe.hear_once(MarkerArray, "markers").markers) == 4
        sensed = (*(f"cable_{i}/wrench" for i in range(1, 5)), "exciter/wrench", "imu/data_raw")
        diagnostics = Diagnostics(probe)
        for node in KEEPERS:
            arrived = diagnostics.arrivals(node, 1, *sensed, "inclinometer/angles")
            probe.spin_until(arrived, 60.0, f"every device at the {node}")
        record(probe, truth, 2.0, kind="static")
        probe.set("rig_simulator", dummy__mass=50.0, dummy__position=DUMMY)
        come_to_rest(probe, heard)
        record(probe, truth, 2.0, kind="static", dummy_mass=50.0, dummy_position=DUMMY)
        probe.set("rig_simulator", dummy__mass=0.0)
        come_to_rest(probe, heard)
        probe.call("rig_simulator/shake")
        begun = record(probe, truth, 8.0, kind="dynamic", dummy_mass=0.0)
        # By the stamps: on a busy machine what is heard is seconds old, each topic's by another time
        over = begun + 8.1
        for sent in (odometry, truth):
            probe.spin_until(lambda sent=sent: stamp(decoded(sent[-1])) > over, 60.0, "all of it")
        last = [m for m in map(decoded, odometry) if begun + 4.0 < stamp(m) < begun + 8.0]
        check_tracking(last, [decoded(raw) for raw in truth])
        answers = {}
        for request in ("identify_center_of_mass", "identify_inertia", "get_center_of_mass", "get_inertia"):
            answer = probe.call(f"identifier/{request}", within=FIT)
            assert answer.success, answer.message
            answers[request] = json.loads(answer.message)
        assert graph.end(rig) == (0, "")
        probe.close()
    finally:
        graph.close()
    return Shift(folder / "session", answers)


@pytest.fixture(scope="module")
def recorded(shift: Shift) -> Path:
    """The session that the recorder wrote."""
    return shift.session


def test_the_body_asked_for_by_service_lies_within_its_deviations(shift: Shift) -> None:
    asked = shift.answers["identify_inertia"]
    assert asked["recordings"] == ["static_1", "static_2", "run_1"]
    assert asked["verdict"] == "none"
    off, covariance = off_and_covariance(asked)
    assert is_likely(off, covariance), off / np.sqrt(np.diag(covariance))
    std = np.sqrt(np.diag(covariance))
    assert np.all(std[:3] < 0.02)  # and these say something
    assert np.all(std[3:] < 0.05 * BODY[7])
    center = shift.answers["identify_center_of_mass"]["center_of_mass"]
    assert center == asked["center_of_mass"]
    for name in ("center_of_mass", "inertia"):
        assert shift.answers[f"get_{name}"][name] == shift.answers[f"identify_{name}"][name]


def check_tracking(odometry: list[Odometry], truth: list[Odometry]) -> None:
    """Tracked positions lie within 3 mm of the ground truth's, and within their own deviation's reach."""

    def place(m: Odometry) -> list[float]:
        p = m.pose.pose.position
        return [p.x, p.y, p.z]

    times, places = [stamp(m) for m in truth], np.array([place(m) for m in truth])
    expected = np.stack(
        [np.interp([stamp(m) for m in odometry], times, places[:, i]) for i in range(3)], axis=1
    )
    error = np.array([place(m) for m in odometry]) - expected
    std = np.sqrt(np.array([[m.pose.covariance[i * 7] for i in range(3)] for m in odometry]))
    assert len(odometry) > 797  # all that the IMU sampled in 4 s
    assert np.max(np.abs(error)) < 0.003
    assert np.mean(np.abs(error) < 3.0 * std) > 0.99


def test_the_recorder_lost_no_sample(recorded: Path) -> None:
    session = read_session(recorded)
    assert [(r.name, r.kind) for r in session.recordings] == [
        ("static_1", "static"),
        ("static_2", "static"),
        ("run_1", "dynamic"),
    ]
    assert session.recordings[1].dummy is not None
    assert session.recordings[1].dummy.mass == 50.0
    for recording in session.recordings:
        assert set(recording.tension) == {f"cable_{i}" for i in range(1, 5)}
        for quality in recording.quality:
            assert (quality.missing, quality.duplicated, quality.backward) == (0, 0, 0), quality
    assert session.rig.cables[1].length == 2.034


def test_a_session_replayed_gives_the_same_inertia_as_read_from_disk(recorded: Path, tmp_path: Path) -> None:
    """Windows of a replay and the offline estimate agree; so does, within its covariance, the truth."""
    offline = identify(read_session(recorded)).total
    graph = Graph(tmp_path)
    try:
        graph.start("tracker", "use_sim_time:=true")
        identifier = graph.start("identifier", "use_sim_time:=true", "running_rate:=2.0")
        probe = Probe(graph)
        running = probe.listen(Float64MultiArray, "identifier/running_covariance")
        early = probe.call("identifier/get_inertia")
        assert not early.success
        assert "nothing was identified" in early.message
        empty = probe.call("identifier/identify_inertia")
        assert not empty.success
        assert "no window is complete" in empty.message
        progress = probe.listen(String, "identifier/progress")
        told = probe.listen(Float64MultiArray, "identifier/covariance")
        graph.start("replay", f"session:={recorded}", "rate:=2.0", "operate:=identifier", "pause:=0.5")
        states: list[str] = []

        def hear(message: DiagnosticArray) -> None:
            states.extend(s.message for s in message.status if s.name.startswith("replay:"))

        probe.node.create_subscription(DiagnosticArray, "/diagnostics", hear, 50)
        probe.spin_until(lambda: states and states[-1] == "over", 60.0, "the end of the replay")
        probe.meet("identifier/explain_mismatch")
        future = probe.begin("identifier/identify_inertia")
        probe.spin_until(lambda: progress, 60.0, "a fit under way")
        second = probe.call("identifier/explain_mismatch")
        assert not second.success
        assert "busy: identify_inertia, run 1" in second.message
        probe.spin_until(future.done, FIT, "the fit")
        answer = future.result()
        assert answer.success, answer.message
        assert len({json.loads(message.data)["stage"] for message in progress}) > 3
        result = json.loads(answer.message)
        assert result["recordings"] == ["static_1", "static_2", "run_1"]
        live = np.array(result["inertia"]["value"])[np.triu_indices(3)]
        std = np.array(result["inertia"]["std"])[np.triu_indices(3)]
        assert np.all(np.abs(live - offline.values[4:]) < 0.1 * std)
        assert is_likely(*off_and_covariance(result))
        again = probe.call("identifier/identify_center_of_mass", within=5.0)  # the same data: at once
        assert json.loads(again.message)["center_of_mass"] == result["center_of_mass"]
        late = probe.listen(InertiaStamped, "identifier/inertia", LATCHED)
        probe.spin_until(lambda: late, 10.0, "the latched result")
        assert np.allclose(ten_of(late[-1])[4:], live)
        probe.spin_until(lambda: told, 5.0, "the covariance")
        assert json.loads(probe.call("identifier/explain_mismatch").message)["mismatch"]["verdict"] == "none"
        assert running, "no running estimate came while the window was open"
        assert graph.end(identifier) == (0, "")
        probe.close()
    finally:
        graph.close()


def test_a_wrong_description_is_answered_with_a_finding(recorded: Path, tmp_path: Path) -> None:
    """The IMU is described 50 mm off along body x; ``~/explain_mismatch`` says so, and by how much."""
    session = tmp_path / "session"
    shutil.copytree(recorded, session)
    reader = YAML(typ="safe")
    rig = reader.load(session / "rig.yaml")
    rig["/**"]["ros__parameters"]["imu"]["position"][0] += 0.05
    with (session / "rig.yaml").open("w") as file:
        YAML(typ="safe", pure=True).dump(rig, file)
    graph = Graph(tmp_path)
    try:
        identifier = graph.start("identifier", f"session:={session}")
        probe = Probe(graph)
        told = probe.listen(DiagnosticArray, "identifier/mismatch", LATCHED)
        answer = probe.call("identifier/explain_mismatch", within=FIT)
        assert answer.success, answer.message
        mismatch = json.loads(answer.message)["mismatch"]
        assert mismatch["verdict"] == "explained"
        assert [f["effect"] for f in mismatch["findings"]] == ["imu_position"], mismatch["findings"]
        (finding,) = mismatch["findings"]
        assert finding["effect"] == "imu_position"
        error = next(iter(finding["parameters"].values()))
        # A short live recording, another one each time: what it is off by, its own interval has to hold
        assert error["std"] < 0.01
        assert is_likely(np.array(abs(error["value"]) - 0.05), np.array(error["std"] ** 2))
        probe.spin_until(lambda: told, 10.0, "the latched findings")
        assert [line.name for line in told[-1].status] == ["mismatch", "mismatch: imu_position"]
        assert graph.end(identifier) == (0, "")
        probe.close()
    finally:
        graph.close()
