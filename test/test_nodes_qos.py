"""A driver that sends best effort, under a name of its own, is heard once remap and override say so."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import _DOMAINS, PACKAGE, RIG

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
    (folder / "rig.yaml").write_text(RIG)
    given = ["--ros-args", "--params-file", str(folder / "rig.yaml"), "-r", "__ns:=/rig", *arguments]
    path = os.pathsep.join([str(PACKAGE), os.environ.get("PYTHONPATH", "")])
    more = {"PYTHONPATH": path, "ROS_DOMAIN_ID": str(next(_DOMAINS)), "ROS_LOG_DIR": str(folder / "log")}
    done = subprocess.run(
        [sys.executable, "-c", CODE, *given], cwd=folder, env={**os.environ, **more}, capture_output=True,
        text=True, timeout=240.0, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
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
