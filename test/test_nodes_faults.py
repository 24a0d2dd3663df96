"""What goes wrong on a rig, each with real processes: no node dies or hangs, no wrong number goes unsaid."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from node_processes import (  # noqa: F401
    ACQUAINTED,
    PATIENCE,
    SIMULATOR,
    Diagnostics,
    Graph,
    Probe,
    graph_of_the_test,
    probe_of_the_test,
    stamp,
)
from sensor_msgs.msg import Imu

from rig_identification.session import read_session

NODES = (
    "rig_simulator", "load_cells", "imu", "inclinometer", "tracker", "preprocessor", "identifier", "recorder",
)  # fmt: skip

#: Topics of the simulated rig's sensors at 100 Hz.
SENSED = (*(f"cable_{i}/wrench" for i in range(1, 5)), "exciter/wrench", "imu/data_raw")


def simulated(graph: Graph, *others: str) -> dict[str, subprocess.Popen[str]]:
    processes = {
        "rig_simulator": graph.start("rig_simulator", *SIMULATOR),
        "load_cells": graph.start("load_cells", "simulation.rate:=100.0"),
        "imu": graph.start("imu", "simulation.rate:=100.0"),
    }
    return processes | {name: graph.start(name) for name in others}


def has_taken_signals(process: subprocess.Popen[str]) -> bool:
    """Whether the process handles SIGTERM itself (its mask of caught signals)."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    caught = int(next(line.split()[1] for line in status.splitlines() if line.startswith("SigCgt")), 16)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("delay", [0.0, 0.6, 1.5])
def test_a_signal_while_starting_ends_every_node_quietly(graph: Graph, number: int, delay: float) -> None:
    """From the moment a node takes its signals, in the middle of imports, and shortly after."""
    processes = [graph.start(name) for name in NODES]
    end = time.monotonic() + 30.0 * PATIENCE
    for process in processes:
        while not has_taken_signals(process):
            assert time.monotonic() < end
            time.sleep(0.002)
        if delay == 0.0:
            process.send_signal(number)
    if delay:
        time.sleep(delay)
    for name, process in zip(NODES, processes, strict=True):
        assert (name, *graph.end(process, number)) == (name, 0, "")


@pytest.mark.parametrize("name", ["rig_simulator", "tracker"])
def test_a_signal_during_the_first_start_after_installation_is_heeded_at_once(
    graph: Graph, name: str
) -> None:
    """Nothing lies compiled yet: compiling takes minutes, and longer than launch waits before it kills."""
    compiled = graph.folder / "compiled"
    process = graph.start(name, NUMBA_CACHE_DIR=str(compiled))
    end = time.monotonic() + 180.0
    while not list(compiled.rglob("*.nbi")):
        assert time.monotonic() < end, "nothing is compiled"
        time.sleep(0.05)
    status, output = graph.end(process, within=15.0)
    assert status == 0
    assert output in ("", f"{name}: compiles its machine code, once after installation: some minutes\n")


@pytest.mark.parametrize(("number", "storage"), [(signal.SIGINT, "mcap"), (signal.SIGTERM, "sqlite3")])
def test_a_signal_while_recording_leaves_the_recording_whole(
    graph: Graph, probe: Probe, number: int, storage: str
) -> None:
    simulated(graph)
    folder = graph.folder / "session"
    recorder = graph.start("recorder", f"folder:={folder}", f"storage:={storage}", "recording.kind:=dynamic")
    diagnostics = Diagnostics(probe)
    assert probe.call("recorder/start").success
    probe.spin_until(diagnostics.arrivals("recorder", 300, *SENSED), 60.0, "three seconds of data")
    recorder.send_signal(number)
    recorder.send_signal(number)  # an impatient operator
    assert graph.end(recorder, number) == (0, "")
    (run,) = read_session(folder).recordings
    quality = {q.topic: q for q in run.quality}
    assert quality["/rig/cable_1/wrench"].used > 150
    assert quality["/rig/cable_1/wrench"].missing == 0


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_a_signal_while_data_flows_ends_every_node_and_keeps_the_open_window(
    graph: Graph, probe: Probe, number: int
) -> None:
    """All eight nodes at work, a recording and a window open: all end quietly, both are whole."""
    folder, spool = graph.folder / "session", graph.folder / "windows"
    processes = simulated(graph, "inclinometer", "tracker", "preprocessor")
    processes["identifier"] = graph.start("identifier", f"spool:={spool}")
    processes["recorder"] = graph.start("recorder", f"folder:={folder}", "record_at_start:=true")
    wrenches = probe.listen(WrenchStamped, "generalized_wrench")
    diagnostics = Diagnostics(probe)
    assert probe.call("identifier/start_window").success
    probe.spin_until(lambda: len(wrenches) > 100, 120.0, "a graph at work")
    # More than the second that a dynamic run has to last
    for node in ("recorder", "identifier"):
        probe.spin_until(diagnostics.arrivals(node, 300, *SENSED), 60.0, f"three seconds in the {node}")
    for process in processes.values():
        process.send_signal(number)
    for name, process in processes.items():
        assert (name, *graph.end(process, number)) == (name, 0, "")
    for written in (folder, spool):
        (run,) = read_session(written).recordings
        quality = {q.topic: q for q in run.quality}
        assert quality["/rig/cable_1/wrench"].used > 50
        assert quality["/rig/cable_1/wrench"].missing == 0
        assert run.imu is not None


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_a_signal_while_replaying_ends_the_replay(graph: Graph, probe: Probe, number: int) -> None:
    folder = graph.folder / "session"
    processes = simulated(graph)
    recorder = graph.start("recorder", f"folder:={folder}", "record_at_start:=true")
    heard = probe.listen(WrenchStamped, "cable_1/wrench")
    probe.spin_until(lambda: len(heard) > 800, 120.0, "eight seconds of data")
    for process in (*processes.values(), recorder):
        assert graph.end(process) == (0, "")
    replay = graph.start("replay", f"session:={folder}", "rate:=0.5")
    count = len(heard)
    probe.spin_until(lambda: len(heard) > count + 20, 60.0, "the replay")
    assert replay.poll() is None
    assert graph.end(replay, number) == (0, "")


def keep_a_window(probe: Probe, diagnostics: Diagnostics, seconds: float = 1.0) -> None:
    """A window of the identifier that holds so much of every sensor at 100 Hz."""
    probe.spin_until(diagnostics.arrivals("identifier", 1, *SENSED), 120.0, "the sensors")
    assert probe.call("identifier/start_window").success
    enough = diagnostics.arrivals("identifier", round(100.0 * (seconds + 1.0)), *SENSED)
    probe.spin_until(enough, 60.0, "the window's data")
    assert probe.call("identifier/stop_window").success


@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.long), signal.SIGTERM])
def test_a_signal_while_fitting_ends_fit_and_node(graph: Graph, probe: Probe, number: int) -> None:
    simulated(graph)
    identifier = graph.start("identifier", "recording.kind:=static")
    keep_a_window(probe, Diagnostics(probe))
    probe.begin("identifier/identify_center_of_mass")
    children = Path(f"/proc/{identifier.pid}/task/{identifier.pid}/children")
    probe.spin_until(lambda: children.read_text().split(), 10.0, "the fit's process")
    (child,) = children.read_text().split()
    assert graph.end(identifier, number) == (0, "")
    assert not Path(f"/proc/{child}").exists()


def test_a_recording_holds_what_was_sent_while_it_ran(graph: Graph, probe: Probe) -> None:
    """A recorder and an identifier held up for seconds before the start, and again before the stop."""
    simulated(graph)
    folder, spool = graph.folder / "session", graph.folder / "windows"
    nodes = {
        "recorder": graph.start("recorder", f"folder:={folder}"),
        "identifier": graph.start("identifier", f"spool:={spool}"),
    }
    services = {"recorder": ("start", "stop"), "identifier": ("start_window", "stop_window")}
    diagnostics = Diagnostics(probe)
    for node in nodes:
        probe.meet(f"{node}/{services[node][1]}")
        probe.spin_until(diagnostics.arrivals(node, 200, *SENSED), 120.0, f"the sensors at the {node}")
    heard = probe.listen(Imu, "imu/data_raw")

    def after(seconds: float) -> float:
        """Stamp of a sample that was taken so many s from now."""
        probe.spin_until(lambda: heard, 20.0, "the imu")
        begun = stamp(heard[-1])
        probe.spin_until(lambda: stamp(heard[-1]) > begun + seconds, 20.0 * seconds, "the imu")
        return stamp(heard[-1])

    bounds = []
    for number in (0, 1):
        for process in nodes.values():
            process.send_signal(signal.SIGSTOP)
        held = after(2.5)
        futures = [probe.begin(f"{node}/{services[node][number]}") for node in nodes]
        probe.spin_for(ACQUAINTED)
        for process in nodes.values():
            process.send_signal(signal.SIGCONT)
        probe.spin_until(lambda futures=futures: all(f.done() for f in futures), 30.0, "the answers")
        assert all(future.result().success for future in futures)
        bounds.append((held, after(0.5)))
        after(2.0)
    for written in (folder, spool):
        (run,) = read_session(written).recordings
        begins = 1e-9 * run.start_ns % 100_000.0
        assert bounds[0][0] <= begins <= bounds[0][1]
        quality = {q.topic: q for q in run.quality}
        for topic in SENSED:
            found = quality[f"/rig/{topic}"]
            assert found.missing == 0
            assert found.start < 0.3  # s: a busy machine lets one sensor's samples wait
            assert bounds[1][0] < begins + found.end < bounds[1][1]


def test_a_sensor_killed_and_restarted_leaves_a_gap_with_a_name(graph: Graph, probe: Probe) -> None:
    nodes = simulated(graph)
    folder = graph.folder / "session"
    recorder = graph.start("recorder", f"folder:={folder}")
    identifier = graph.start("identifier", f"spool:={graph.folder / 'windows'}")
    diagnostics = Diagnostics(probe)
    assert probe.call("recorder/start").success
    assert probe.call("identifier/start_window").success
    for node in ("recorder", "identifier"):
        probe.spin_until(diagnostics.arrivals(node, 200, *SENSED), 120.0, f"the sensors at the {node}")
    nodes["imu"].kill()
    line = "recorder: /rig/imu/data_raw"
    probe.spin_until(lambda: diagnostics.says(line, "silent"), 10.0, "the word of silence")
    again = [diagnostics.arrivals(node, 300, "imu/data_raw") for node in ("recorder", "identifier")]
    graph.start("imu", "simulation.rate:=100.0")
    probe.spin_until(lambda: all(came() for came in again), 60.0, "the imu again")
    answer = probe.call("recorder/stop")
    assert answer.success, answer.message
    assert probe.call("identifier/stop_window").success
    for written in (folder, graph.folder / "windows"):
        quality = {q.topic: q for q in read_session(written).recordings[0].quality}
        assert quality["/rig/imu/data_raw"].gaps == 1
        assert quality["/rig/imu/data_raw"].longest_gap > 1.0
        assert quality["/rig/cable_1/wrench"].missing == 0
    assert graph.end(recorder) == (0, "")
    assert graph.end(identifier) == (0, "")


def test_a_node_started_twice_and_one_started_late_are_named(graph: Graph, probe: Probe) -> None:
    simulated(graph)
    graph.start("imu", "simulation.rate:=100.0", "simulation.seed:=7")
    diagnostics = Diagnostics(probe)
    heard = probe.listen(Imu, "imu/data_raw")
    probe.spin_until(lambda: len(heard) > 50, 120.0, "the imu")
    late = graph.start("identifier")
    probe.spin_until(
        lambda: diagnostics.says("identifier: /rig/imu/data_raw", "2 publishers"), 20.0, "the word"
    )
    probe.spin_until(lambda: diagnostics.says("imu: node", "two nodes of this name"), 10.0, "the nodes' word")
    assert graph.end(late) == (0, "")


def test_a_clock_that_was_never_set_is_said(graph: Graph, probe: Probe) -> None:
    graph.start("rig_simulator", *SIMULATOR)
    graph.start("load_cells", "simulation.rate:=100.0")
    graph.start("imu", "simulation.rate:=100.0", "simulation.clock_offset:=5.0")
    recorder = graph.start("recorder")
    diagnostics = Diagnostics(probe)
    line = "recorder: /rig/imu/data_raw"
    probe.spin_until(lambda: diagnostics.says(line, "s off the other devices'"), 40.0, "the word")

    def told() -> bool:
        # On a busy machine a batch arrives late, and late by as much is what its clock then seems
        return float(diagnostics.value(line, "clock_difference")) == pytest.approx(5.0, abs=0.1)

    probe.spin_until(told, 20.0, "a difference of 5 s")
    cable = "recorder: /rig/cable_1/wrench"
    probe.spin_until(lambda: diagnostics.lines[cable].level == DiagnosticStatus.OK, 20.0, "an honest clock")
    assert graph.end(recorder) == (0, "")


def test_a_silent_cable_and_a_still_window_are_said(graph: Graph, probe: Probe) -> None:
    graph.start("rig_simulator", *SIMULATOR)
    graph.start("load_cells", "simulation.rate:=100.0", remaps=["cable_3/wrench:=elsewhere"])
    graph.start("imu", "simulation.rate:=100.0")
    identifier = graph.start("identifier", "recording.kind:=dynamic")
    diagnostics = Diagnostics(probe)
    there = [topic for topic in SENSED if topic != "cable_3/wrench"]
    probe.spin_until(diagnostics.arrivals("identifier", 1, *there), 120.0, "the sensors")
    assert probe.call("identifier/start_window").success
    probe.spin_until(diagnostics.arrivals("identifier", 350, *there), 60.0, "the window's data")
    stopped = probe.call("identifier/stop_window")
    assert stopped.success
    assert "silent: /rig/cable_3/wrench" in stopped.message
    answer = probe.call("identifier/identify_inertia", within=60.0)
    assert not answer.success
    assert "run_1: the body does not move" in answer.message
    assert not probe.call("identifier/get_inertia").success
    assert graph.end(identifier) == (0, "")


def test_odd_stamps_and_numbers_are_refused_and_counted(graph: Graph, probe: Probe) -> None:
    """Backwards, zero, from the future, NaN: on a cable and on the IMU, while tracker and window run."""
    simulated(graph)
    tracker, identifier = graph.start("tracker"), graph.start("identifier")
    diagnostics = Diagnostics(probe)
    poses = probe.listen(Odometry, "odometry")
    probe.spin_until(lambda: len(poses) > 100, 120.0, "the tracker")
    cable = probe.node.create_publisher(WrenchStamped, "cable_2/wrench", 10)
    imu = probe.node.create_publisher(Imu, "imu/data_raw", 10)
    probe.spin_until(lambda: cable.get_subscription_count() >= 2 and imu.get_subscription_count() >= 2, 10.0)
    assert probe.call("identifier/start_window").success
    line = "identifier: /rig/cable_2/wrench"

    def counted(*keys: str) -> bool:
        return all(int(diagnostics.value(line, key) or 0) >= 1 for key in keys)

    def send(seconds: float, number: float) -> None:
        for publisher, message in ((cable, WrenchStamped()), (imu, Imu())):
            message.header.stamp.sec = int(seconds)
            message.header.stamp.nanosec = int(seconds % 1 * 1e9)
            if isinstance(message, WrenchStamped):
                message.wrench.force.z = number
            else:
                message.linear_acceleration.z = number
            publisher.publish(message)

    def now() -> float:
        """By the plant's clock, which falls behind the wall's on a busy machine."""
        return float(poses[-1].header.stamp.sec + 1e-9 * poses[-1].header.stamp.nanosec)

    for seconds, number in ((0.0, 1.0), (now() - 100.0, 9e9), (now() + 3600.0, 9e9)):
        send(seconds, number)
    sent = 0.0

    def refused() -> bool:
        # What is not a number is looked at only where its stamp is in order, and not overtaken
        nonlocal sent
        if not counted("not_finite") and time.monotonic() > sent + 3.0:
            sent = time.monotonic()
            send(now() + 0.2, float("nan"))
        return counted("zero", "backward", "ahead", "not_finite")

    probe.spin_until(refused, 20.0, "the account of oddities")
    count = len(poses)
    probe.spin_until(lambda: len(poses) > count + 100, 10.0, "tracking that goes on")
    after = np.array([[p.pose.pose.position.x, p.pose.pose.position.z] for p in poses[-50:]])
    before = np.array([[p.pose.pose.position.x, p.pose.pose.position.z] for p in poses[count - 50 : count]])
    assert np.max(np.abs(after.mean(axis=0) - before.mean(axis=0))) < 0.005  # the body hangs still
    assert probe.call("identifier/stop_window").success
    assert graph.end(tracker) == (0, "")
    assert graph.end(identifier) == (0, "")


def test_a_client_that_dies_while_it_waits_harms_no_one(graph: Graph, probe: Probe) -> None:
    simulated(graph)
    identifier = graph.start("identifier", "recording.kind:=static")
    diagnostics = Diagnostics(probe)
    keep_a_window(probe, diagnostics)
    for service in ("identify_inertia", "cancel", "stop_window"):
        probe.meet(f"identifier/{service}")
    client = (
        "import os, time, rclpy; from std_srvs.srv import Trigger; rclpy.init()\n"
        "n = rclpy.create_node('client')\n"
        "c = n.create_client(Trigger, '/rig/identifier/identify_center_of_mass')\n"
        f"assert c.wait_for_service({20.0 * PATIENCE}); time.sleep({ACQUAINTED})\n"
        "f = c.call_async(Trigger.Request()); rclpy.spin_once(n, timeout_sec=1.0)\n"
        "print('asked', flush=True)\n"
        "os.kill(os.getpid(), 9)"
    )
    dying = graph.run([sys.executable, "-c", client])
    output, _ = dying.communicate(timeout=40.0 * PATIENCE)
    assert output == "asked\n"
    probe.spin_until(
        lambda: diagnostics.says("identifier: windows", "identify_center_of_mass, run 1"), 30.0, "the fit"
    )
    busy = probe.call("identifier/identify_inertia")
    assert "busy: identify_center_of_mass, run 1" in busy.message
    assert "is cancelled" in probe.call("identifier/cancel").message
    assert "no window is open" in probe.call("identifier/stop_window").message
    assert graph.end(identifier) == (0, "")


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_full_disk_ends_a_recording_in_good_order(graph: Graph, probe: Probe, storage: str) -> None:
    disk = graph.folder / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=5m", "tmpfs", str(disk)], capture_output=True
    )
    if mounted.returncode:
        pytest.skip("a small disk cannot be mounted without privileges: " + mounted.stderr.decode().strip())
    try:
        simulated(graph)
        graph.start("inclinometer", "simulation.rate:=4000.0")
        recorder = graph.start("recorder", f"folder:={disk / 'session'}", f"storage:={storage}")
        diagnostics = Diagnostics(probe)
        assert probe.call("recorder/start").success
        probe.spin_until(
            lambda: diagnostics.says("recorder: recording", "free the disk"), 40.0, "a full disk"
        )
        stopped = probe.call("recorder/stop")
        assert not stopped.success
        assert "recording run_1 ended" in stopped.message
        (run,) = read_session(disk / "session").recordings
        assert run.duration > 1.0
        assert graph.end(recorder)[0] == 0
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)
