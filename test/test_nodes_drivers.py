"""Pages of docs/drivers: what a driver sends under its own name is heard by the command that its page gives.

No driver runs here. A publisher stands in for each, with the topic, type and reliability of the page's table.
"""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import run_code
from test_docs_pages import DOCS
from test_nodes_views import message_of

PAGES = sorted((DOCS / "drivers").glob("*.md"))
RECORDER = "ros2 run rig_identification recorder"
#: A recorder for each command, and beside it a publisher as the page's table has it.
CODE = """\
import importlib, json, sys, tempfile, time
import rclpy
from rclpy.context import Context
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rig_identification.nodes.recorder import RecorderNode
told = []
own = [a for a in sys.argv[1:] if not a.startswith("@")]
for case in json.loads(next(a for a in sys.argv if a.startswith("@"))[1:]):
    folder = f"folder:={tempfile.mkdtemp()}/session"
    rclpy.init(args=[*own, *case["arguments"], "-p", folder])
    node = RecorderNode()
    package, kind, name = case["type"].split("/")
    message = getattr(importlib.import_module(f"{package}.{kind}"), name)
    level = ReliabilityPolicy.BEST_EFFORT if case["sent"] == "best effort" else ReliabilityPolicy.RELIABLE
    outlet = node.create_publisher(message, case["topic"], QoSProfile(depth=10, reliability=level))
    end = time.monotonic() + 5.0
    while not outlet.get_subscription_count() and time.monotonic() < end:
        time.sleep(0.02)
    told.append(outlet.get_subscription_count())
    node.close()
    node.destroy_node()
    rclpy.try_shutdown()
print(json.dumps(told))
"""


def table(page: Path) -> dict[str, tuple[str, str]]:
    """Topic -> type and reliability, as a page's table has them."""
    rows = re.findall(r"^\| `(/[^`]+)` \| (\w+/msg/\w+) \| ([^|]+) \|", page.read_text(), re.MULTILINE)
    return {topic: (kind, sent.strip()) for topic, kind, sent in rows}


def remapped(page: Path) -> list[dict[str, Any]]:
    """The page's commands: the driver's topic, what it sends, and the ROS arguments of the command."""
    joined = re.sub(r"\\\n\s*", "", page.read_text())
    found = []
    for line in re.findall(rf"^{RECORDER} --ros-args (.*)$", joined, re.MULTILINE):
        words = shlex.split(line)
        (remap,) = [w for w in words if ":=/" in w and not w.startswith(("__ns", "qos_"))]
        topic = remap.partition(":=")[2]
        kind, sent = table(page)[topic]
        arguments = [w for i, w in enumerate(words) if "--params-file" not in words[max(0, i - 1) : i + 1]]
        found.append({"topic": topic, "type": kind, "sent": sent, "arguments": arguments})
    return found


def heard(cases: list[dict[str, Any]], folder: Path) -> list[int]:
    """How many listeners of the recorder each stand-in meets."""
    done = run_code(folder, CODE, f"@{json.dumps(cases)}")
    counts: list[int] = json.loads(done.stdout.splitlines()[-1])
    return counts


def test_every_driver_is_heard_by_its_pages_command(tmp_path: Path) -> None:
    cases = [case for page in PAGES for case in remapped(page)]
    assert {"/imu/data", "/netft_data", "/vrpn_mocap/BODY/pose"} <= {case["topic"] for case in cases}
    # The last one lacks its override: a reliable listener does not hear what is sent best effort
    deaf = next(case for case in cases if case["sent"] == "best effort")
    plain = [w for w in deaf["arguments"] if not w.startswith("qos_overrides")]
    plain = [w for i, w in enumerate(plain) if not (w == "-p" and plain[i + 1 : i + 2] in ([], ["-p"]))]
    counts = heard([*cases, {**deaf, "arguments": plain}], tmp_path)
    assert counts == [1] * len(cases) + [0]


@pytest.mark.parametrize("page", [p for p in PAGES if p.stem != "mocap4r2"], ids=lambda page: page.stem)
def test_a_page_says_how_bags_are_read(page: Path) -> None:
    names = re.findall(r"`--topic ([\w/]+)=([\w/]+)`", page.read_text())
    assert names
    assert {topic for _, topic in names} <= set(table(page))


def test_one_body_is_picked_out_of_a_list_by_its_name() -> None:
    """The expressions of the page, on stand-ins of the messages with the fields that they have."""
    text = (DOCS / "drivers" / "mocap4r2.md").read_text()
    expressions = re.findall(r"^  '(geometry_msgs[^']+)'", text, re.MULTILINE)
    assert len(expressions) == 2
    header = message_of("std_msgs/msg/Header")
    header.stamp.sec = 17
    poses = [message_of("geometry_msgs/msg/Pose") for _ in range(2)]
    poses[1].position.x = 0.25
    named = list(zip(("bar", "van"), poses, strict=True))
    lists = SimpleNamespace(
        header=header,
        rigidbodies=[SimpleNamespace(rigid_body_name=n, pose=p) for n, p in named],
        poses=[SimpleNamespace(name=n, pose=p) for n, p in named],
    )
    import geometry_msgs.msg

    for expression in expressions:
        picked = eval(expression, {"geometry_msgs": geometry_msgs, "m": lists})
        assert (picked.header.stamp.sec, picked.pose.position.x) == (17, 0.25)
