"""Live graph under load: seven topics at 1 kHz through tracker, identifier and recorder, counted by stamp.

``python bench/live.py --minutes 10`` starts the simulated rig's nodes as processes on two cores, records and
keeps a window for the whole time, and prints what was lost, the tracker's latency, and what each node costs.
Exit status 1 where a sample was lost, more than 1 % of the odometry came later than 20 ms after its IMU
sample (its 99th percentile exceeds 20 ms), the simulated rig did not keep pace, or a node did not end well.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from std_srvs.srv import Trigger

from rig_identification.session import read_session

ROOT = Path(__file__).resolve().parents[1]
CONFIG = ROOT / "config"
#: Share of the odometry that may come later than 20 ms: what a 99th percentile of 20 ms says.
LATE_LIMIT = 0.01
#: Share of the measured time that the recordings' stamps have to span: else the load was less than asked for.
PACE_LIMIT = 0.99
#: Topics without the ground truth, which no node needs.
MEASURED = 7


class Watcher(Node):
    """Calls services and keeps what the tracker says of its latency."""

    def __init__(self) -> None:
        super().__init__("bench", namespace="/rig")
        self.latency: list[tuple[float, float]] = []
        self.restarts = self.surprises = "0"
        self.tracked, self.late = 0, 0  # IMU samples since the tracker's start, and those tracked late
        self.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 50)

    def _hear(self, message: DiagnosticArray) -> None:
        for line in message.status:
            if line.name == "tracker: tracking":
                values = {pair.key: pair.value for pair in line.values}
                if "latency_p99_ms" in values:
                    self.latency.append((float(values["latency_p50_ms"]), float(values["latency_p99_ms"])))
                    self.restarts, self.surprises = values["restarts"], values["surprises"]
                    self.tracked, self.late = int(values["tracked"]), int(values["late"])

    def call(self, service: str) -> str:
        """Answer of a Trigger service."""
        client = self.create_client(Trigger, service)
        if not client.wait_for_service(60.0):
            raise SystemExit(f"{service} is not there")
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future, timeout_sec=60.0)
        answer = future.result()
        if answer is None or not answer.success:
            raise SystemExit(f"{service}: {answer.message if answer else 'no answer'}")
        return str(answer.message)

    def wait(self, seconds: float) -> None:
        """Listen for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self, timeout_sec=0.5)


def commands(folder: Path, rate: float) -> dict[str, list[str]]:
    """Node -> its parameters."""
    sensor = [f"simulation.rate:={rate}"]
    return {
        "rig_simulator": ["shake.at_start:=true", "ground_truth_rate:=10.0"],
        "load_cells": sensor,
        "imu": sensor,
        "inclinometer": sensor,
        "tracker": ["marker_rate:=0.0"],
        "identifier": [f"spool:={folder / 'windows'}", "running_rate:=0.2"],
        "recorder": [f"folder:={folder / 'session'}"],
    }


def start(folder: Path, rate: float, cores: str) -> dict[str, subprocess.Popen[bytes]]:
    """All nodes as processes on the given cores."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    rig, nodes = CONFIG / "simulated_rig_node_description.yaml", CONFIG / "simulated_rig_nodes.yaml"
    processes = {}
    for name, parameters in commands(folder, rate).items():
        command = [
            "taskset",
            "-c",
            cores,
            sys.executable,
            "-m",
            "rig_identification.nodes",
            name,
            "--ros-args",
        ]
        command += ["-r", "__ns:=/rig", "--params-file", str(rig)]
        if name == "rig_simulator":
            command += ["--params-file", str(nodes)]
        for parameter in parameters:
            command += ["-p", parameter]
        processes[name] = subprocess.Popen(command, env=environment)
    return processes


def processor_seconds(process: subprocess.Popen[bytes]) -> float:
    """CPU time that a process used, s."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident(process: subprocess.Popen[bytes]) -> float:
    """MiB of memory that a process holds."""
    return int(Path(f"/proc/{process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def lost(folder: Path) -> tuple[int, int, float]:
    """(samples, samples missing by stamp, s) of the one recording in a session, ground truth aside."""
    (run,) = read_session(folder).recordings
    measured = [q for q in run.quality if "ground_truth" not in q.topic]
    if len(measured) != MEASURED:
        raise SystemExit(f"{folder}: {len(measured)} topics were recorded, not {MEASURED}")
    return sum(q.count for q in measured), sum(q.missing for q in measured), run.duration


def main() -> int:
    """Run the bench."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rate", type=float, default=1000.0, help="Hz of each topic")
    parser.add_argument("--cores", default="0,1", help="as taskset takes them")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="live_bench_") as name:
        folder = Path(name)
        processes = start(folder, arguments.rate, arguments.cores)
        try:
            return measure(folder, processes, arguments.minutes)
        finally:
            for process in processes.values():
                process.kill()
                process.wait()


def measure(folder: Path, processes: dict[str, subprocess.Popen[bytes]], minutes: float) -> int:
    """Record, keep a window, and report."""
    rclpy.init()
    watcher = Watcher()
    watcher.call("recorder/start")
    watcher.call("identifier/start_window")
    watcher.wait(5.0)
    watcher.latency.clear()
    tracked, late = watcher.tracked, watcher.late
    before = {name: processor_seconds(process) for name, process in processes.items()}
    begun = time.monotonic()
    watcher.wait(60.0 * minutes)
    seconds = time.monotonic() - begun
    costs = {name: (processor_seconds(p) - before[name]) / seconds for name, p in processes.items()}
    memory = {name: resident(process) for name, process in processes.items()}
    print(watcher.call("identifier/stop_window"))
    print(watcher.call("recorder/stop"))
    for process in processes.values():
        process.send_signal(signal.SIGINT)
    endings = {name: process.wait(60.0) for name, process in processes.items()}
    rclpy.try_shutdown()
    print(f"\n{'node':<14}{'CPU %':>7}{'MiB':>7}{'exit':>6}")
    for name in processes:
        print(f"{name:<14}{100.0 * costs[name]:7.1f}{memory[name]:7.0f}{endings[name]:6}")
    misses, slow = 0, False
    for what in ("session", "windows"):
        count, missing, duration = lost(folder / what)
        misses += missing
        slow = slow or duration < PACE_LIMIT * seconds
        print(f"{what}: {count} samples of {MEASURED} topics in {duration:.1f} s, {missing} lost")
    p50, p99 = (np.array(column) for column in zip(*watcher.latency, strict=True))
    tracked, late = watcher.tracked - tracked, watcher.late - late
    share = late / max(tracked, 1)
    print(f"tracker latency: {late} of {tracked} samples ({100.0 * share:.2f} %) later than 20 ms; over 20 s")
    print(f"each, the median is {np.median(p50):.2f} ms, the 99th percentile mostly {np.median(p99):.2f} ms,")
    print(f"{np.max(p99):.2f} ms at worst; {watcher.restarts} restarts, {watcher.surprises} surprises;")
    print(f"load {os.getloadavg()[0]:.1f}")
    if slow:
        print("the simulated rig did not keep pace: the load was less than asked for")
    return int(misses > 0 or share > LATE_LIMIT or slow or tracked == 0 or any(endings.values()))


if __name__ == "__main__":
    sys.exit(main())
