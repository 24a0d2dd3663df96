"""The JSON calls of the pages, taken by rosbridge's own protocol as its server takes them from a socket.

rosbridge_suite is not on the package index. Name a checkout of it (branch ros2) in $ROSBRIDGE_SOURCES; its
protocol needs pymongo and Pillow. The socket itself is not part of this.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")
SOURCES = os.environ.get("ROSBRIDGE_SOURCES", "")
if not SOURCES:
    pytest.skip("name a checkout of rosbridge_suite in $ROSBRIDGE_SOURCES", allow_module_level=True)
pytest.importorskip("bson", reason="pip install pymongo")

from node_processes import PATIENCE, Graph, graph_of_the_test  # noqa: E402
from test_docs_pages import DOCS, blocks  # noqa: E402

__all__ = ["graph_of_the_test"]
pytestmark = pytest.mark.long

#: rosbridge between lines of standard input and of standard output, with the parameters of its server.
BRIDGE = """\
import sys, threading
import rclpy
from rclpy.executors import MultiThreadedExecutor
from rosbridge_library.rosbridge_protocol import RosbridgeProtocol
rclpy.init()
node = rclpy.create_node("rosbridge")
for name, value in (("call_services_in_new_thread", True), ("send_action_goals_in_new_thread", True),
                    ("default_call_service_timeout", 0.0)):
    node.declare_parameter(name, value)
executor = MultiThreadedExecutor()
executor.add_node(node)
threading.Thread(target=executor.spin, daemon=True).start()
limits = {"fragment_timeout": 600, "delay_between_messages": 0.0, "max_message_size": 10_000_000,
          "unregister_timeout": 10.0, "bson_only_mode": False}
protocol = RosbridgeProtocol("test", node, limits)
protocol.outgoing = lambda message, *_, **__: print("@" + message, flush=True)
for line in sys.stdin:
    protocol.incoming(line)
"""


def calls(page: Path) -> list[dict[str, Any]]:
    """The JSON lines of a page's blocks that are calls."""
    text = "\n".join(blocks(page, "json"))
    joined = re.sub(r",\n\s+", ", ", text)
    return [json.loads(line) for line in joined.splitlines() if line.startswith('{"op"')]


def say(bridge: subprocess.Popen[str], message: dict[str, Any]) -> None:
    """What a client writes into the socket."""
    assert bridge.stdin is not None
    bridge.stdin.write(json.dumps(message) + "\n")
    bridge.stdin.flush()


def test_a_service_is_called_and_a_topic_heard(graph: Graph) -> None:
    """The identifier holds nothing yet and says so; what is published on the topic comes out."""
    told = calls(DOCS / "graph.md")
    assert [call["op"] for call in told] == ["call_service", "subscribe"]
    graph.start("identifier")
    library = Path(SOURCES) / "rosbridge_library" / "src"
    path = os.pathsep.join([str(library), os.environ.get("PYTHONPATH", "")])
    bridge = subprocess.Popen(
        [sys.executable, "-c", BRIDGE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": path, "ROS_DOMAIN_ID": str(graph.domain),
             "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
    )  # fmt: skip
    assert bridge.stdin is not None
    assert bridge.stdout is not None
    try:
        for call in told:
            say(bridge, call)
        inertia = {"header": {"frame_id": "body"}, "inertia": {"m": 990.5}}
        kind = "geometry_msgs/msg/InertiaStamped"
        say(bridge, {"op": "advertise", "topic": told[1]["topic"], "type": kind})
        answers: dict[str, Any] = {}
        end = time.monotonic() + 60.0 * PATIENCE
        while {"service_response", "publish"} - answers.keys():
            assert time.monotonic() < end, answers
            line = bridge.stdout.readline()
            assert line, "rosbridge ended"
            if not line.startswith("@"):
                continue
            message = json.loads(line[1:])
            if "does not exist" in str(message.get("values")):  # the node still starts: rosbridge asks once
                time.sleep(1.0)
                say(bridge, told[0])
            else:
                answers[message["op"]] = message
                say(bridge, {"op": "publish", "topic": told[1]["topic"], "msg": inertia})
    finally:
        bridge.kill()
        bridge.wait()
    response = answers["service_response"]
    assert response["result"] is True
    assert response["values"]["success"] is False
    assert "window" in response["values"]["message"]
    assert answers["publish"]["msg"]["inertia"]["m"] == 990.5
