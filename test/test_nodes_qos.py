"""A driver that sends best effort, under a name of its own, is heard once remap and override say so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import run_code

#: A tracker with its rig, whose subscriptions are looked at.
CODE = """\
import json, sys
import rclpy
from rig_identification.errors import InputError
rclpy.init(args=sys.argv)
from rig_identification.nodes.tracker import TrackerNode
try:
    node = TrackerNode()
except InputError as error:
    print(json.dumps({"refused": str(error)}))
    sys.exit(0)
found = {}
for held in node._by_hand:
    one = held.subscription
    qos = node.get_subscriptions_info_by_topic(one.topic_name)[0].qos_profile
    found[one.topic_name] = [qos.reliability.name, qos.depth]
print(json.dumps(found))
node.close()
node.destroy_node()
rclpy.try_shutdown()
"""


def subscriptions(folder: Path, *arguments: str) -> dict[str, list[object]]:
    """Topic -> reliability and depth of a tracker that is started with ROS arguments."""
    done = run_code(folder, CODE, *arguments)
    found: dict[str, list[object]] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_a_driver_of_its_own_is_heard_in_place(tmp_path: Path) -> None:
    override = "qos_overrides./vectornav/imu_uncompensated.subscription"
    found = subscriptions(
        tmp_path, "-r", "imu/data_raw:=/vectornav/imu_uncompensated",
        "-p", f"{override}.reliability:=best_effort", "-p", f"{override}.depth:=500",
    )  # fmt: skip
    assert found["/vectornav/imu_uncompensated"][0] == "BEST_EFFORT"
    assert found["/rig/cable_1/wrench"][0] == "RELIABLE"
    assert "/rig/imu/data_raw" not in found


def test_an_override_that_is_none_is_refused_by_name(tmp_path: Path) -> None:
    override = "qos_overrides./rig/imu/data_raw.subscription"
    found = subscriptions(tmp_path, "-p", f"{override}.reliability:=certain")
    assert f"{override}" in str(found["refused"])
