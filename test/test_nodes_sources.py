"""Sensor nodes on a serial line that is pulled out and on a logger's file; refusals by name; one command."""

from __future__ import annotations

import itertools
import os
import pty
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")
pytest.importorskip("serial", reason="pyserial is not installed: pip install '.[ros]'")

from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from node_processes import (  # noqa: F401
    ACQUAINTED,
    Diagnostics,
    Graph,
    Probe,
    graph_of_the_test,
    probe_of_the_test,
)

from rig_identification.session import read_session


class Amplifier:
    """Sends a line each 10 ms over a pseudo-terminal that stands at ``port``."""

    def __init__(self, port: Path, line: bytes) -> None:
        self._master, slave = pty.openpty()
        self._slave = slave
        port.unlink(missing_ok=True)
        port.symlink_to(os.ttyname(slave))
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._send, args=(line,))
        self._thread.start()

    def _send(self, line: bytes) -> None:
        while not self._ending.wait(0.01):
            os.write(self._master, line)

    def unplug(self) -> None:
        self._ending.set()
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)


def test_a_serial_amplifier_is_read_unplugged_and_plugged_in_again(graph: Graph, probe: Probe) -> None:
    port = graph.folder / "ttyUSB0"
    amplifier = Amplifier(port, b"7;1.0;2.0;3.0;4.0;5.0;6.0;-7.5\r\n12;nonsense\r\n")
    node = graph.start(
        "load_cells", "source:=serial", f"serial.port:={port}", "line.separator:=';'",
        "line.columns:=[1, 2, 3, 4, 5, 6, 7]", "line.scale:=[1000.0]", "line.offset:=[0.5]",
    )  # fmt: skip
    cable, exciter = (
        probe.listen(WrenchStamped, "cable_4/wrench"),
        probe.listen(WrenchStamped, "exciter/wrench"),
    )
    probe.spin_until(lambda: len(cable) > 50 and len(exciter) > 50, 120.0, "the amplifier's lines")
    assert cable[-1].wrench.force.z == pytest.approx(4000.5)
    assert [getattr(exciter[-1].wrench.force, axis) for axis in "xyz"] == pytest.approx(
        [5000.5, 6000.5, -7499.5]
    )
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in cable]
    assert all(b > a for a, b in itertools.pairwise(stamps))
    assert abs(stamps[-1] - time.time_ns()) < 10e9  # heard late on a busy machine
    diagnostics = Diagnostics(probe)
    amplifier.unplug()
    probe.spin_until(
        lambda: diagnostics.says("load_cells: source", str(port)), 20.0, "the word of the lost port"
    )
    count = len(cable)
    amplifier = Amplifier(port, b"7;1.5;2.0;3.0;4.25;5.0;6.0;-7.5\r\n")
    probe.spin_until(lambda: len(cable) > count + 50, 10.0, "the amplifier's return")
    assert cable[-1].wrench.force.z == pytest.approx(4250.5)
    probe.spin_until(
        lambda: not diagnostics.says("load_cells: source", str(port)), 20.0, "no word of a lost port"
    )
    assert graph.end(node) == (0, "")
    amplifier.unplug()


def asking(probe: Probe, kind: Any, service: str) -> Callable[[Any], Any]:
    """Asks a service of any type for its answer."""
    client = probe.node.create_client(kind, service)
    probe.spin_until(client.service_is_ready, 120.0, service)
    probe.spin_for(ACQUAINTED)

    def ask(request: Any) -> Any:
        future = client.call_async(request)
        probe.spin_until(future.done, 20.0, f"answer of {service}")
        return future.result()

    return ask


def test_a_lifecycle_manager_opens_starts_and_stops_a_sensor(graph: Graph, probe: Probe) -> None:
    port = graph.folder / "ttyUSB0"
    node = graph.start("inclinometer", "autostart:=false", "source:=serial", f"serial.port:={port}")
    angles = probe.listen(Vector3Stamped, "inclinometer/angles")

    get = asking(probe, GetState, "inclinometer/get_state")
    set_to = asking(probe, ChangeState, "inclinometer/change_state")

    def state() -> str:
        return str(get(GetState.Request()).current_state.label)

    def change(label: str = "", number: int = 0) -> bool:
        return bool(set_to(ChangeState.Request(transition=Transition(id=number, label=label))).success)

    def opened() -> bool:
        return any("/pts/" in os.readlink(file) for file in Path(f"/proc/{node.pid}/fd").iterdir())

    assert not change("configure")  # there is no port
    assert state() == "unconfigured"
    amplifier = Amplifier(port, b"0.25,-0.5\r\n")
    assert not change("activate")  # not from here
    assert not change(number=Transition.TRANSITION_ACTIVATE)
    assert not opened()
    assert probe.node.count_publishers("/rig/inclinometer/angles") == 0
    assert change("configure")
    assert state() == "inactive"
    assert opened()
    probe.spin_until(lambda: probe.node.count_publishers("/rig/inclinometer/angles"), 20.0, "its topic")
    probe.spin_for(0.5)
    assert not angles
    assert change("activate")
    begun = time.time_ns()
    probe.spin_until(lambda: len(angles) > 20, 20.0, "samples")
    first = angles[0].header.stamp
    assert first.sec * 10**9 + first.nanosec > begun - 2e9  # what came before is not sent later
    assert angles[0].vector.x == 0.25
    assert change("deactivate")
    probe.spin_for(0.3)
    count = len(angles)
    probe.spin_for(0.3)
    assert len(angles) == count
    assert change("cleanup")
    assert not opened()
    assert state() == "unconfigured"
    status, output = graph.end(node)
    assert status == 0
    assert "plug the device in" in output
    assert "Traceback" not in output
    amplifier.unplug()


def test_a_loggers_file_is_played_in_real_time(graph: Graph, probe: Probe) -> None:
    file = graph.folder / "logger.csv"
    rows = [f"{1000 + 20 * k},{0.001 * k},{-0.002 * k}" for k in range(750)]
    file.write_text("time ms,x,y\n" + "\n".join(rows) + "\n")
    angles = probe.listen(Vector3Stamped, "inclinometer/angles")
    graph.start(
        "inclinometer", "source:=file", f"file.path:={file}", "line.time_column:=0", "line.time_scale:=0.001",
        "line.columns:=[1, 2]",
    )  # fmt: skip
    # Long enough to be met while it plays, however late the two find each other
    probe.spin_until(lambda: len(angles) > 10, 120.0, "some of the file's lines")
    told = asking(probe, GetState, "inclinometer/get_state")(GetState.Request())
    assert told.current_state.label == "active"  # without anybody's doing
    probe.spin_until(lambda: angles[-1].vector.x > 0.7485, 25.0, "the file's last line")
    now = time.time_ns()
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in angles]
    assert {b - a for a, b in itertools.pairwise(stamps)} == {20_000_000}
    assert 0 <= now - stamps[-1] < 10e9  # no line comes before it is due
    assert angles[-1].vector.y == pytest.approx(-2.0 * angles[-1].vector.x)


@pytest.mark.parametrize(
    ("name", "parameter", "words"),
    [
        ("imu", "source:=bluetooth", "parameter source: 'bluetooth' is unknown; give simulation or"),
        ("imu", "simulation.rate:=0.0", "parameter simulation.rate: 0.0 Hz is not within 1 and 10000 Hz"),
        ("load_cells", "source:=serial", "parameter serial.port: is empty"),
        ("tracker", "cable_2.length:=-2.0", "cable_2.length: -2 m must be above 0 m"),
        ("tracker", "marker_rat:=9.8", "parameter marker_rat: unknown; did you mean marker_rate?"),
        ("rig_simulator", "speed:=4.0", "parameter publish_clock"),
        ("inclinometer", "simulation.position_error:=[0.1, 0.0, 0.0]", "reads the same at any position"),
        ("imu", "simulation.gain:=[-1.5]", "parameter simulation.gain: -1.5 is not within"),
        ("rig_simulator", "effect.hinge_dampin:=1.0", "did you mean effect.hinge_damping?"),
        ("rig_simulator", "effect.sprung_mass.mass:=1e4", "parameter effect.sprung_mass.mass: 10000 kg at"),
        ("rig_simulator", "effect.air_drag:=-3.0", "parameter effect.air_drag: -3.0 m^2 is not within"),
        ("rig_simulator", "body.inertia:=[1.0, 0.0, 0.0, 1.0, 0.0, 900.0]", "no body has"),
        ("replay", "session:=/nowhere", "/nowhere: session does not exist"),
        ("identifier", "planned_force:=/nowhere.csv", "parameter planned_force: /nowhere.csv: No such file"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_by_name(graph: Graph, name: str, parameter: str, words: str) -> None:
    process = graph.start(name, parameter)
    output, _ = process.communicate(timeout=240.0)
    assert process.returncode == 2
    assert words in output
    assert output.count("\n") == 1


def test_a_parameter_set_while_running_is_checked(graph: Graph, probe: Probe) -> None:
    recorder = graph.start("recorder")
    (reason,) = probe.set("recorder", recording__kind="dynmic")
    assert reason == "recording.kind: 'dynmic' is unknown; give static or dynamic"
    (reason,) = probe.set("recorder", storage="sqlite3")
    assert reason == "Trying to set a read-only parameter: storage."
    assert probe.set("recorder", recording__kind="static", recording__dummy_mass=50) == []
    assert graph.end(recorder) == (0, "")


def test_one_command_brings_the_simulated_rig_up_and_down(graph: Graph, probe: Probe) -> None:
    folder = graph.folder / "session"
    command = [
        sys.executable, "-m", "rig_identification.cli.main", "rig", "simulated", "--without", "identifier",
        "--set", f"recorder.folder={folder}", "--set", "recorder.record_at_start=true",
        "--set", "rig_simulator.shake.at_start=true", "--set", "imu.simulation.rate=100",
    ]  # fmt: skip
    process = graph.run(command)
    diagnostics = Diagnostics(probe)
    recorded = diagnostics.arrivals(
        "recorder", 300, "cable_1/wrench", "cable_4/wrench", "exciter/wrench", "imu/data_raw"
    )
    probe.spin_until(recorded, 120.0, "three seconds of the simulated rig")
    assert graph.end(process, signal.SIGINT) == (0, "")
    (run,) = read_session(folder).recordings
    assert len(run.tension) == 4
    assert run.exciter_force is not None
    assert run.exciter_force.values.std(axis=0).max() > 10.0
