"""What the page shows of the graph: a node that listens, and calls the identifier's windows.

``python -m rig_identification.nodes.view_program NAMESPACE``. Lines of JSON on standard output, each with its
``kind``; requests are lines of JSON on standard input, ``{"id", "do": "start" or "stop", ...}``. It ends with
its input. The page starts it in a process of its own: the page itself knows no ROS.

The rig and the body come as the tracker's markers, ten times a second. Of each load cell the latest message
alone is kept, and looked at as often: nothing here is in proportion to the sensors' rates.
"""

from __future__ import annotations

import json
import math
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

try:
    import rclpy
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from geometry_msgs.msg import InertiaStamped, WrenchStamped
    from rcl_interfaces.msg import Parameter as ParameterMessage
    from rcl_interfaces.srv import SetParameters
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node
    from rclpy.parameter import Parameter
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from rclpy.serialization import deserialize_message
    from rclpy.subscription import Subscription
    from std_msgs.msg import Float64MultiArray, String
    from std_srvs.srv import Trigger
    from visualization_msgs.msg import Marker, MarkerArray

    from rig_identification.nodes.by_hand import ByHand
    from rig_identification.nodes.rig_node import LATCHED
except ImportError as missing:
    MISSING = str(missing)
else:
    MISSING = ""

#: Hz of what moves, and s between looks for cables that came or went.
RATE, SEARCH = 12.0, 2.0
#: s that a service has to answer; stop_window waits for the last messages.
PATIENCE = 12.0
#: The latest message alone, whoever sends it.
LATEST = None if MISSING else QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
_LOCK = threading.Lock()


def say(kind: str, **content: object) -> None:
    """Write a line; what is no number is null."""
    with _LOCK:
        print(json.dumps({"kind": kind, **content}, allow_nan=False), flush=True)


def number(value: float) -> float | None:
    """A number as JSON has it, to six digits."""
    return float(f"{value:.6g}") if math.isfinite(value) else None


def _view_node(namespace: str) -> Any:
    """A node whose executor leaves alone what is taken by hand."""

    class ViewNode(Node):
        def __init__(self) -> None:
            self.by_hand: set[int] = set()
            super().__init__("page", namespace=namespace, use_global_arguments=False)

        @property
        def subscriptions(self) -> Iterator[Subscription]:
            yield from (one for one in super().subscriptions if id(one) not in self.by_hand)

    return ViewNode()


class View:
    """One node over the graph below a namespace."""

    def __init__(self, namespace: str) -> None:
        self.node = _view_node(namespace)
        self._namespace = self.node.get_namespace().rstrip("/")
        self._cells: dict[str, ByHand] = {}
        self._last: dict[str, tuple[float, float | None]] = {}  # cable -> arrival, N
        self._running: InertiaStamped | None = None
        self._told: dict[str, tuple[bytes, str]] = {}
        listen = self.node.create_subscription
        listen(MarkerArray, "markers", self._draw, 2)
        listen(InertiaStamped, "identifier/running_inertia", self._hear_inertia, 10)
        listen(Float64MultiArray, "identifier/running_covariance", self._hear_covariance, 10)
        listen(String, "identifier/watch", lambda m: say("watch", watch=json.loads(m.data)), LATCHED)
        listen(String, "identifier/progress", lambda m: say("fit", fit=json.loads(m.data)), 10)
        listen(DiagnosticArray, "/diagnostics", self._diagnose, 50)
        self._clients = {
            "set": self.node.create_client(SetParameters, "identifier/set_parameters"),
            "start": self.node.create_client(Trigger, "identifier/start_window"),
            "stop": self.node.create_client(Trigger, "identifier/stop_window"),
        }
        self.node.create_timer(1.0 / RATE, self._look)
        self.node.create_timer(SEARCH, self._search)
        self._search()

    # What is seen

    def _search(self) -> None:
        """Listen to every cable's topic that is there."""
        prefix, ending = f"{self._namespace}/", "/wrench"
        for topic, kinds in self.node.get_topic_names_and_types():
            name = topic.removeprefix(prefix).removesuffix(ending)
            wanted = topic == f"{prefix}{name}{ending}" and "/" not in name and name != "exciter"
            if wanted and name not in self._cells and "geometry_msgs/msg/WrenchStamped" in kinds:
                made = self.node.create_subscription(WrenchStamped, topic, lambda _: None, LATEST, raw=True)
                self.node.by_hand.add(id(made))
                self._cells[name] = ByHand(made)
        ready = self._clients["start"].service_is_ready()
        say("graph", identifier=ready, cells=sorted(self._cells), namespace=self._namespace or "/")

    def _look(self) -> None:
        now = time.monotonic()
        for name, cell in self._cells.items():
            taken = cell.take()
            if taken:
                force = deserialize_message(taken[-1].message, WrenchStamped).wrench.force.z
                self._last[name] = (now, number(force))
        said = {name: value for name, (at, value) in self._last.items() if now - at < 1.0}
        if self._cells:
            say("tension", tension=said)

    def _draw(self, message: MarkerArray) -> None:
        shapes = []
        for marker in message.markers:
            points = [[number(p.x), number(p.y), number(p.z)] for p in marker.points]
            colours = [[round(255 * c) for c in (k.r, k.g, k.b)] for k in marker.colors]
            lines = marker.type == Marker.LINE_LIST
            shapes.append({"name": marker.ns, "lines": lines, "points": points, "colours": colours})
        say("rig", shapes=shapes)

    def _hear_inertia(self, message: InertiaStamped) -> None:
        self._running = message

    def _hear_covariance(self, message: Float64MultiArray) -> None:
        if self._running is None or len(message.data) != 100:
            return
        i = self._running.inertia
        values = [i.m, i.com.x, i.com.y, i.com.z, i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz]
        stds = [math.sqrt(max(0.0, message.data[11 * k])) for k in range(10)]
        stamp = self._running.header.stamp
        say(
            "running", time=stamp.sec + 1e-9 * stamp.nanosec, values=[number(v) for v in values],
            std=[number(s) for s in stds],
        )  # fmt: skip

    def _diagnose(self, message: DiagnosticArray) -> None:
        for line in message.status:
            if line.name == "identifier: windows":
                say("window", window=line.message)
            known = self._told.get(line.name)
            if known == (line.level, line.message) or (known is None and line.level == DiagnosticStatus.OK):
                continue
            self._told[line.name] = (line.level, line.message)
            say(
                "diagnostic", name=line.name, level=int.from_bytes(line.level, "little"), message=line.message
            )

    # What is asked

    def ask(self, request: dict[str, Any]) -> None:
        """Start or stop a window; the answer is a line of its own."""
        answer: Callable[[bool, str], None] = lambda ok, text: say(  # noqa: E731
            "answer", id=request["id"], success=ok, message=text
        )
        name = "start" if request["do"] == "start" else "stop"
        if not self._clients[name].service_is_ready():
            answer(False, f"no identifier answers below {self._namespace or '/'}")
        elif name == "stop":
            self._call("stop", Trigger.Request(), lambda r: answer(r.success, r.message), answer)
        else:
            self._start(request, answer)

    def _start(self, request: dict[str, Any], answer: Callable[[bool, str], None]) -> None:
        wanted = {
            "recording.kind": str(request["window"]),
            "recording.name": str(request["name"]),
            "recording.holdout": bool(request["holdout"]),
            "recording.dummy_mass": float(request["dummy_mass"]),
            "recording.dummy_position": [float(x) for x in request["dummy_position"]],
        }
        asked = SetParameters.Request(
            parameters=[
                ParameterMessage(name=key, value=Parameter(key, value=value).get_parameter_value())
                for key, value in wanted.items()
            ]
        )

        def set_(response: Any) -> None:
            refused = [r.reason for r in response.results if not r.successful]
            if refused:
                answer(False, refused[0])
            else:
                self._call("start", Trigger.Request(), lambda r: answer(r.success, r.message), answer)

        self._call("set", asked, set_, answer)

    def _call(
        self, name: str, request: object, then: Callable[[Any], None], answer: Callable[[bool, str], None]
    ) -> None:
        future = self._clients[name].call_async(request)
        done = threading.Event()

        def came(of: Any) -> None:
            done.set()
            timer.cancel()
            then(of.result())

        def late() -> None:
            if not done.is_set():
                answer(False, f"the identifier did not answer within {PATIENCE:.0f} s")

        timer = threading.Timer(PATIENCE, late)
        timer.daemon = True
        timer.start()
        future.add_done_callback(came)


def main(namespace: str = "/rig") -> None:
    """Listen until the input ends."""
    if MISSING:
        say("missing", message=MISSING)
        return
    rclpy.init(args=[])
    view = View(namespace)
    executor = SingleThreadedExecutor()
    executor.add_node(view.node)

    def read() -> None:
        for line in sys.stdin:
            request = json.loads(line)
            executor.create_task(view.ask, request)
            executor.wake()
        os._exit(0)  # the page is gone: nothing here has to be put in order

    threading.Thread(target=read, daemon=True).start()
    executor.spin()


if __name__ == "__main__":
    main(*sys.argv[1:2])
