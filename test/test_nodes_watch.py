"""The live verdict in the graph: what a window holds goes to the program that watches; its word is out."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import (  # noqa: F401
    RIG,
    SIMULATOR,
    Diagnostics,
    Graph,
    Probe,
    graph_of_the_test,
    probe_of_the_test,
    run_code,
)
from std_msgs.msg import String

from rig_identification.nodes.gathered import Gathered, read_gathered, write_gathered
from rig_identification.nodes.intake import Batch
from rig_identification.nodes.rig_node import LATCHED
from rig_identification.nodes.session_folder import RecordingPlan
from rig_identification.recording import Dummy
from rig_identification.topics import Topic, expected_topics

SECOND = 1_000_000_000
TOPICS = expected_topics(("cable_1",), "/rig")


def batch(topic: Topic, first: float, count: int, width: int) -> Batch:
    """A tenth of a second of samples."""
    stamps = round(first * SECOND) + np.arange(count) * (SECOND // 10 // count)
    values = np.random.default_rng(count).standard_normal((count, width))
    arrival = stamps + 2_000_000
    return Batch(topic, [b""] * count, arrival, arrival, stamps[1:], values[1:], stamps, values)


def test_what_a_window_holds_is_read_as_it_came(tmp_path: Path) -> None:
    cell, imu = TOPICS["/rig/cable_1/wrench"], TOPICS["/rig/imu/data_raw"]
    still = Gathered(RecordingPlan("static_1", "static", dummy=Dummy(40.0, np.array([0.1, 0.2, 0.3]))), 30.0)
    run = Gathered(RecordingPlan("run_1", "dynamic"), 2.0)
    pieces = [batch(cell, 0.1 * k, 20, 1) for k in range(50)]
    for k, piece in enumerate(pieces):
        still.add(piece)
        run.add(piece)
        run.add(batch(imu, 0.1 * k, 10, 6))
    assert still.whole
    assert still.seconds == pytest.approx(5.0, abs=0.1)
    assert not run.whole  # 2 s are held
    assert run.seconds == pytest.approx(2.0, abs=0.25)
    file = tmp_path / "gathered.npz"
    write_gathered(file, [still, run])
    rest, motion = read_gathered(file)
    assert (rest.name, rest.kind, motion.kind) == ("static_1", "static", "dynamic")
    assert rest.dummy is not None
    assert (rest.dummy.mass, rest.dummy.position.tolist()) == (40.0, [0.1, 0.2, 0.3])
    (tension,) = rest.channels
    assert (tension.topic, tension.cable, tension.channel) == ("/rig/cable_1/wrench", "cable_1", "tension")
    # Every message, the one that the gate refused as well
    assert np.array_equal(tension.stamp_ns, np.concatenate([p.heard_ns for p in pieces]))
    assert np.array_equal(tension.received_ns, np.concatenate([p.arrival_ns for p in pieces]))
    assert np.array_equal(tension.values, np.concatenate([p.heard for p in pieces]))
    assert [c.channel for c in motion.channels] == ["tension", "imu"]
    assert motion.counts["/rig/imu/data_raw"] == motion.channels[1].stamp_ns.size


def test_the_program_that_watches_takes_a_planned_force(tmp_path: Path) -> None:
    """It ends with its input; a file that holds no commands is refused before."""
    rig, commands = tmp_path / "rig.yaml", tmp_path / "exciter.csv"
    rig.write_text(RIG)
    run = [sys.executable, "-m", "rig_identification.nodes.watch_program", str(rig), "60", "0.01", "/rig"]

    def ended() -> subprocess.CompletedProcess[str]:
        return subprocess.run([*run, str(commands)], input="", capture_output=True, text=True, check=False)

    commands.write_text("recording,time_s,force_x_N,force_y_N,force_z_N\nrun_1,0,1,2,3\nrun_1,0.02,1,2,3\n")
    assert (ended().returncode, ended().stdout) == (0, "")
    commands.write_text("nothing\n")
    assert "column recording is missing" in ended().stderr


#: An identifier whose window is long enough to be looked at ends, and works off what had come in by then.
ENDED = """\
import sys, tempfile
import numpy as np
import rclpy
from rig_identification.nodes.gathered import Gathered
from rig_identification.nodes.identifier import IdentifierNode
from rig_identification.nodes.intake import Batch
from rig_identification.nodes.session_folder import RecordingPlan
from rig_identification.topics import expected_topics
rclpy.init(args=sys.argv)
node = IdentifierNode()
watcher = node.watcher
watcher.start(RecordingPlan("run_1", "dynamic"))
topic = expected_topics(("cable_1",), "/rig")["/rig/cable_1/wrench"]
stamps = np.arange(60) * 500_000_000
values = np.zeros((60, 1))
watcher.add(Batch(topic, [b""] * 60, stamps, stamps, stamps, values, stamps, values))
watcher.look()
first = watcher._process.pid
node.close()
watcher.look()
print(first, watcher._process, watcher._folder)
node.destroy_node()
rclpy.try_shutdown()
"""


def test_a_node_that_ends_starts_no_other_look(tmp_path: Path) -> None:
    done = run_code(tmp_path, ENDED)
    assert done.stdout.splitlines()[-1].split()[1:] == ["None", "None"]
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob("rig_watch_*"))


@pytest.mark.long  # a graph with a cell that reads high, watched until it is told
def test_a_cell_that_reads_high_is_told_while_the_window_is_open(graph: Graph, probe: Probe) -> None:
    graph.start("rig_simulator", *SIMULATOR)
    high = "simulation.gain:=[0.0, 0.015, 0.0, 0.0, 0.0, 0.0, 0.0]"
    graph.start("load_cells", "simulation.rate:=200.0", high)
    graph.start("imu", "simulation.rate:=200.0")
    graph.start("inclinometer", "simulation.rate:=50.0")
    graph.start("tracker", "marker_rate:=0.0", "tf_rate:=0.0")
    commands = graph.folder / "exciter.csv"
    commands.write_text("recording,time_s,force_x_N,force_y_N,force_z_N\nrun_1,0,1,2,3\nrun_1,0.02,1,2,3\n")
    graph.start("identifier", "planned_seconds:=40.0", f"planned_force:={commands}")
    lines = Diagnostics(probe)
    heard = probe.listen(String, "identifier/watch", LATCHED)
    probe.spin_until(lines.arrivals("identifier", 50, "cable_1/wrench", "imu/data_raw"), 120.0, "samples")
    assert not probe.set("identifier", recording__kind="static")
    probe.call("identifier/start_window")
    probe.spin_for(4.0)
    probe.call("identifier/stop_window")
    assert not probe.set("identifier", recording__kind="dynamic")
    probe.call("rig_simulator/shake")
    probe.call("identifier/start_window")
    told: list[dict[str, object]] = []

    def found() -> bool:
        told[:] = [json.loads(message.data) for message in heard]
        return any(one.get("cause") == "load_cell_gain cable_2" for one in told)

    probe.spin_until(found, 120.0, "the verdict")
    word = next(one for one in told if one.get("cause") == "load_cell_gain cable_2")
    assert word["recording"] == "run_1"
    assert word["verdict"] == "explained"
    parameters = word["parameters"]
    assert isinstance(parameters, dict)
    assert parameters["gain"]["value"] == pytest.approx(0.015, abs=0.004)
    assert "static_1" not in str(word["faults"])
    probe.call("identifier/stop_window")
