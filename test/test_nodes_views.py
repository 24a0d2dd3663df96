"""The shipped views of Foxglove and RViz hold against the nodes: topics, types, fields, services."""

from __future__ import annotations

import importlib
import json
import re
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import run_code

CONFIG = Path(__file__).parents[1] / "config"
#: What the nodes that a view shows offer, told by themselves.
CODE = """\
import json, sys
import rclpy
rclpy.init(args=sys.argv)
from rig_identification.nodes import identifier, load_cells, tracker
topics, services = {}, {}
for module in (tracker, identifier, load_cells):
    node = module.create()
    for topic, types in node.get_publisher_names_and_types_by_node(node.get_name(), node.get_namespace()):
        held = node.get_publishers_info_by_topic(topic)
        topics[topic] = [types[0], held[0].qos_profile.durability.name]
    for name, types in node.get_service_names_and_types_by_node(node.get_name(), node.get_namespace()):
        services[name] = types[0]
    node.close()
    node.destroy_node()
rclpy.try_shutdown()
print(json.dumps([topics, services]))
"""
#: The message that each display of RViz, and each panel of Foxglove that takes one kind, shows.
SHOWN_BY = {
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "RobotModel": "std_msgs/msg/String",
    "Odometry": "nav_msgs/msg/Odometry",
    "DiagnosticSummary": "diagnostic_msgs/msg/DiagnosticArray",
    "foxglove.Urdf": "std_msgs/msg/String",
}
#: What Foxglove's 3D panel draws under ``topics``; a URDF that is not /robot_description is a layer.
DRAWN = {"visualization_msgs/msg/MarkerArray", "nav_msgs/msg/Odometry"}


@pytest.fixture(scope="module", name="offered")
def offered_by_the_nodes(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Topic -> type and durability; service -> type."""
    done = run_code(tmp_path_factory.mktemp("views"), CODE, "-p", "source:=simulation")
    return json.loads(done.stdout.splitlines()[-1])


def message_of(kind: str) -> Any:
    """An empty message of a type such as ``std_msgs/msg/String``."""
    package, folder, name = kind.split("/")
    return getattr(importlib.import_module(f"{package}.{folder}"), name)()


def check_path(path: str, topics: dict[str, list[str]]) -> None:
    """Foxglove's message path leads to a number: each field is there, an index stands behind a sequence."""
    topic, *fields = path.split(".")
    assert topic in topics, path
    message: Any = message_of(topics[topic][0])
    for field in fields:
        name, _, index = field.partition("[")
        kind = message.get_fields_and_field_types().get(name)
        assert kind is not None, path
        assert ("sequence" in kind) == bool(index), path
        if index:
            assert kind == "sequence<double>", path
            return
        message = getattr(message, name)
    assert isinstance(message, float | str), path


def test_every_display_of_rviz_gets_what_it_draws(offered: Any) -> None:
    topics, _ = offered
    view = YAML(typ="safe").load((CONFIG / "rig.rviz").read_text(encoding="utf-8"))
    shown = 0
    for display in view["Visualization Manager"]["Displays"]:
        asked = display.get("Topic") or display.get("Description Topic")
        if asked is None:
            continue
        shown += 1
        kind, durability = topics[asked["Value"]]
        assert kind == SHOWN_BY[display["Class"].rpartition("/")[2]], display
        if asked["Durability Policy"] == "Transient Local":  # such a listener hears latched topics alone
            assert durability == "TRANSIENT_LOCAL", display
    assert shown == 3


def test_every_panel_of_foxglove_gets_what_it_shows(offered: Any) -> None:
    topics, services = offered
    layout = json.loads((CONFIG / "foxglove_layout.json").read_text(encoding="utf-8"))
    shown = 0
    for name, panel in layout["configById"].items():
        for path in [p["value"] for p in panel.get("paths", [])] + [panel.get("topicPath")]:
            if path:
                check_path(path, topics)
                shown += 1
        for topic in panel.get("topics", {}):
            assert topics[topic][0] in DRAWN, topic
        for layer in panel.get("layers", {}).values():
            if layer.get("sourceType") == "topic":
                assert topics[layer["topic"]][0] == SHOWN_BY[layer["layerId"]]
                shown += 1
        if "topicToRender" in panel:
            assert topics[panel["topicToRender"]][0] == SHOWN_BY[name.partition("!")[0]]
        if "serviceName" in panel:
            assert services[panel["serviceName"]] == "std_srvs/srv/Trigger"
            assert json.loads(panel["requestPayload"]) == {}
    assert shown >= 12


def test_a_path_that_leads_nowhere_is_seen(offered: Any) -> None:
    topics, _ = offered
    for wrong in (
        "/rig/cable_1/wrench.wrench.force.zz",
        "/rig/cable_1/wrench.wrench.force.z[0]",
        "/rig/identifier/running_covariance.data",
        "/rig/cable_9/wrench.wrench.force.z",
    ):
        with pytest.raises(AssertionError, match=re.escape(wrong)):
            check_path(wrong, topics)


def test_the_covariances_are_those_of_the_moments() -> None:
    """The layout's indices are the diagonal of the 10 x 10 matrix at Jxx, Jyy, Jzz."""
    from rig_identification.result import ELEMENTS

    layout = json.loads((CONFIG / "foxglove_layout.json").read_text(encoding="utf-8"))
    paths = {p["label"]: p["value"] for p in layout["configById"]["Plot!variance"]["paths"]}
    for name, path in paths.items():
        assert path.endswith(f".data[{11 * ELEMENTS.index(name)}]")
    assert set(paths) == {"Jxx", "Jyy", "Jzz"}
