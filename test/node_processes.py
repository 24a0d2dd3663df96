"""Real node processes on a ROS domain of their own, and a probe that speaks to them."""

from __future__ import annotations

import functools
import itertools
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from ruamel.yaml import YAML
from std_srvs.srv import Trigger

import rig_identification
from rig_identification.live.body_tracker import BodyTracker
from rig_identification.live.plant import Plant
from rig_identification.model.motion import rig_model
from rig_identification.session.fields import Fields
from rig_identification.session.rig_description import rig_from_fields

with warnings.catch_warnings():  # the wheels' lark imports a deprecated module
    warnings.simplefilter("ignore", DeprecationWarning)
    import rosidl_generator_py  # noqa: F401

ROOT = Path(__file__).parents[1]
PACKAGE = Path(rig_identification.__file__).parents[1]  # where nodes find what the tests import


def _domains() -> Iterator[int]:
    """ROS domains 1 to 100, from anywhere: those of one test run's workers never meet."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    start = random.Random(os.environ.get("PYTEST_XDIST_TESTRUNUID")).randrange(100)
    span = 100 - 100 % workers  # else the second time round would shift one worker onto another
    return (1 + (start + worker + workers * count) % span for count in itertools.count())


_DOMAINS = _domains()

RIG = """\
/**:
  ros__parameters:
    gravity: 9.80665
    mass: 990.6
    mass_std: 0.5
    cables: [cable_1, cable_2, cable_3, cable_4]
    cable_1: {ceiling_point: [0.0, 0.0, 0.0], body_point: [0.0, 0.0, 0.0], length: 1.69}
    cable_2: {ceiling_point: [3.5, 0.0, 0.0], body_point: [1.48, 0.03, 0.01], length: 2.034}
    cable_3: {ceiling_point: [0.0, 5.0, 0.0], body_point: [0.01, 2.51, 0.01], length: 1.968}
    cable_4: {ceiling_point: [3.5, 5.0, 0.0], body_point: [1.51, 2.52, 0.01], length: 2.246}
    imu: {position: [0.54, 1.43, -0.43], orientation: [0.0, 0.0, 0.70710678, 0.70710678]}
    inclinometer: {orientation: [0.0, 0.0, 0.0, 1.0]}
    exciter: {position: [0.0, 0.0, -1.5], orientation: [0.0, 0.38268343, 0.0, 0.92387953]}
    noise: {tension: 2.0, exciter_force: 0.5, specific_force: 0.01, angular_rate: 0.0003, inclination: 0.0003}
"""
#: Times that a busy machine may take what an idle one needs: what is waited for ends a wait, not the clock.
PATIENCE = 4.0
#: s after which a request that nobody answered is made again: the one before it was lost, see ACQUAINTED.
AGAIN = 15.0
#: s between a service's first sight and a first request: ``service_is_ready`` tells that this side knows the
#: other, not that the other knows this one, and a request that comes before is lost (DDS-RPC 1.0, 7.6.2).
ACQUAINTED = 0.5
#: The simulated body: m, c, J (xx xy xz yy yz zz).
BODY = [990.2, 0.69, 1.08, -1.07, 1108.6, -1.4, 31.7, 338.3, 18.3, 1295.9]
SIMULATOR = [
    f"body.mass:={BODY[0]}", f"body.center_of_mass:={BODY[1:4]}", f"body.inertia:={BODY[4:]}",
    "shake.amplitude:=[150.0, 120.0, 60.0]", "shake.frequency:=[0.42, 0.71, 1.1]",
]  # fmt: skip


def stamp(message: Any) -> float:
    """s of a message's header, within a day or so: a clock's whole seconds take its digits."""
    return float(message.header.stamp.sec % 100_000 + 1e-9 * message.header.stamp.nanosec)


def compile_plant_and_tracker() -> None:
    """Run once through what the nodes run, so that its machine code lies in the package's cache."""
    top = YAML(typ="safe").load(RIG)["/**"]["ros__parameters"]
    rig = rig_from_fields(Fields(Path("rig"), "", top))
    plant = Plant(rig_model(rig, np.array(BODY)), 1)
    plant.advance(0.01)
    tracker = BodyTracker(rig)
    tracker.add_inclination(np.array([1_000_000]), np.zeros((1, 2)))
    for cable in rig.cables:
        tracker.add_tension(cable.name, np.array([1_000_000]), np.array([[2500.0]]))
    tracker.add_imu(1_000_000 * np.arange(1, 60), np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 9.8], (59, 1)))


def _environment(**more: str) -> dict[str, str]:
    path = os.pathsep.join([str(PACKAGE), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1", **more}


@functools.cache
def compile_once() -> None:
    """Compile before the first graph: its processes would all compile the same, at the same time.

    In a process like theirs: what this one holds in memory says nothing about what they will find.
    """
    subprocess.run([sys.executable, __file__], cwd=tempfile.gettempdir(), env=_environment(), check=True)


class Graph:
    """Nodes as processes, all in namespace ``/rig`` with the same rig description."""

    def __init__(self, folder: Path) -> None:
        compile_once()
        self.folder = folder
        self.domain = next(_DOMAINS)
        self.rig_file = folder / "rig.yaml"
        self.rig_file.write_text(RIG)
        self.processes: list[subprocess.Popen[str]] = []

    def start(
        self, name: str, *parameters: str, remaps: Sequence[str] = (), **environment: str
    ) -> subprocess.Popen[str]:
        """Start a node; that it is there is for the probe to see."""
        command = [sys.executable, "-m", "rig_identification.nodes", name, "--ros-args"]
        command += ["--params-file", str(self.rig_file)]
        for remap in ("__ns:=/rig", *remaps):
            command += ["-r", remap]
        for parameter in parameters:
            command += ["-p", parameter]
        return self.run(command, **environment)

    def run(self, command: Sequence[str], **environment: str) -> subprocess.Popen[str]:
        """Start any process that is to meet the graph's nodes; ``environment`` on top of the usual one."""
        process = subprocess.Popen(
            command,
            cwd=self.folder,  # ``-m`` looks in the working directory first: a checkout would hide PACKAGE
            env=_environment(
                ROS_DOMAIN_ID=str(self.domain),
                ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST",
                ROS_LOG_DIR=str(self.folder / "log"),
                **environment,
            ),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.processes.append(process)
        return process

    def end(
        self, process: subprocess.Popen[str], number: int = signal.SIGINT, within: float = 60.0
    ) -> tuple[int, str]:
        """Send a signal; returns exit status and output, without what it told for information."""
        process.send_signal(number)
        self.processes.remove(process)
        output, hung = _end_of(process, within)
        assert not hung, f"{process.args!r} did not end within {within} s:\n{output}"
        return process.returncode, without_information(output)

    def close(self) -> None:
        """End what still runs; a process that has others of its own gets the time to end them.

        One that does not end fails the test.
        """
        for process in self.processes:
            process.terminate()
        ends = [(process.args, *_end_of(process, 60.0)) for process in self.processes]
        self.processes.clear()
        stuck = [f"{arguments!r} did not end:\n{output}" for arguments, output, hung in ends if hung]
        assert not stuck, "\n".join(stuck)


def run_code(folder: Path, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run ``code``, which makes a node of the rig, to its end in a domain of its own.

    Rig description, logs and temporary files lie in ``folder``. arguments: further ROS arguments.
    """
    (folder / "rig.yaml").write_text(RIG)
    given = ["--ros-args", "--params-file", str(folder / "rig.yaml"), "-r", "__ns:=/rig", *arguments]
    own = {"ROS_DOMAIN_ID": str(next(_DOMAINS)), "ROS_LOG_DIR": str(folder / "log"), "TMPDIR": str(folder)}
    done = subprocess.run(
        [sys.executable, "-c", code, *given], cwd=folder, env=_environment(**own), capture_output=True,
        text=True, timeout=240.0, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done


def without_information(output: str) -> str:
    """A node's output without its log's lines for information: a warning or an error is worth a look."""
    return "".join(line for line in output.splitlines(keepends=True) if not line.startswith("[INFO] "))


def _end_of(process: subprocess.Popen[str], within: float) -> tuple[str, bool]:
    """Output of a process that was told to end, and whether it hung: then with the stacks of its threads.

    rclpy's events executor has Python's faulthandler write them when the process is aborted.
    """
    try:
        return process.communicate(timeout=within)[0], False
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGABRT)
    try:
        return process.communicate(timeout=within)[0], True
    except subprocess.TimeoutExpired:
        process.kill()
        return process.communicate()[0], True


class Probe:
    """A node of the test's own in the graph's domain."""

    def __init__(self, graph: Graph) -> None:
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        self.context = Context()
        rclpy.init(context=self.context, domain_id=graph.domain)
        self.node = rclpy.create_node("probe", namespace="/rig", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._clients: dict[str, Any] = {}

    def spin_until(self, predicate: Callable[[], Any], timeout: float, what: str = "it") -> None:
        """Spin until ``predicate``; AssertionError after ``timeout`` s of an idle machine."""
        end = time.monotonic() + PATIENCE * timeout
        while not predicate():
            assert time.monotonic() < end, f"{what} did not happen within {PATIENCE * timeout} s"
            self.executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds: float) -> None:
        """Let the graph run while the probe listens."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.05)

    def listen(self, kind: Any, topic: str, qos: Any = 1000, raw: bool = False) -> list[Any]:
        """List that a topic's messages are appended to; ``raw``: as bytes, for fast topics."""
        heard: list[Any] = []
        self.node.create_subscription(kind, topic, heard.append, qos, raw=raw)
        return heard

    def hear_once(self, kind: Any, topic: str, within: float = 120.0) -> Any:
        """One message of a topic that is not listened to any longer."""
        heard: list[Any] = []
        subscription = self.node.create_subscription(kind, topic, heard.append, 10)
        self.spin_until(lambda: heard, within, topic)
        self.node.destroy_subscription(subscription)
        return heard[-1]

    def begin(self, service: str, within: float = 30.0) -> Any:
        """Future of a Trigger request."""
        return self._client(service, within).call_async(Trigger.Request())

    def _client(self, service: str, within: float) -> Any:
        client = self._clients.get(service)
        if client is None:
            client = self._clients[service] = self.node.create_client(Trigger, service)
            self.spin_until(client.service_is_ready, within, f"service {service}")
            self.spin_for(ACQUAINTED)
        self.spin_until(client.service_is_ready, within, f"service {service}")
        return client

    def meet(self, service: str) -> None:
        """Find a service now, so that a request for it goes out at once later."""
        self._client(service, 30.0)

    def call(self, service: str, within: float = 30.0) -> Trigger.Response:
        """Answer to a Trigger request, made again only where the first was lost on its way."""
        futures = [self.begin(service)]
        asked = time.monotonic()

        def answered() -> bool:
            nonlocal asked
            # What takes longer than a request's way there and back is waited for
            if within <= 30.0 and time.monotonic() > asked + AGAIN:
                asked = time.monotonic()
                futures.append(self.begin(service))
            return any(future.done() for future in futures)

        self.spin_until(answered, within, f"answer of {service}")
        return next(future for future in futures if future.done()).result()

    def set(self, node: str, **values: Any) -> list[str]:
        """Set parameters (``__`` stands for a dot); reasons of refusals."""
        client = self.node.create_client(SetParameters, f"{node}/set_parameters")
        self.spin_until(client.service_is_ready, 30.0, f"parameters of {node}")
        self.spin_for(ACQUAINTED)
        messages: list[ParameterMessage] = [
            Parameter(name.replace("__", "."), value=value).to_parameter_msg()
            for name, value in values.items()
        ]
        future = client.call_async(SetParameters.Request(parameters=messages))
        self.spin_until(future.done, 20.0, f"answer of {node}")
        return [result.reason for result in future.result().results if not result.successful]

    def close(self) -> None:
        """Leave the graph."""
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)


class Diagnostics:
    """The latest line of each name on /diagnostics."""

    def __init__(self, probe: Probe) -> None:
        self.lines: dict[str, DiagnosticStatus] = {}
        probe.node.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 50)

    def _hear(self, message: DiagnosticArray) -> None:
        self.lines.update({line.name: line for line in message.status})

    def value(self, name: str, key: str) -> str:
        """What a line says of ``key``; empty: nothing yet."""
        line = self.lines.get(name)
        return next((pair.value for pair in line.values if pair.key == key), "") if line else ""

    def says(self, name: str, words: str) -> bool:
        """Whether a line's message holds ``words``."""
        return name in self.lines and words in self.lines[name].message

    def arrivals(self, node: str, count: int, *topics: str) -> Callable[[], bool]:
        """Whether ``count`` messages more than now have reached a node on each topic, by its own account.

        Now: the first line that comes after this call. One heard before tells of a second ago, and none
        heard yet of nothing, while the node may have listened for long.
        """
        names = [f"{node}: /rig/{topic}" for topic in topics]
        old = {name: self.lines.get(name) for name in names}
        first: dict[str, int] = {}

        def arrived(name: str) -> bool:
            if self.lines.get(name) is old[name]:
                return False
            received = int(self.value(name, "received") or 0)
            return received >= first.setdefault(name, received) + count

        return lambda: all(arrived(name) for name in names)


@pytest.fixture(name="graph")
def graph_of_the_test(tmp_path: Path) -> Iterator[Graph]:
    """A graph that ends with the test."""
    made = Graph(tmp_path)
    yield made
    made.close()


@pytest.fixture(name="probe")
def probe_of_the_test(graph: Graph) -> Iterator[Probe]:
    """A probe in the test's graph."""
    made = Probe(graph)
    yield made
    made.close()


if __name__ == "__main__":
    compile_plant_and_tracker()
