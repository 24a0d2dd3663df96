"""docs/graph.md names every parameter and service that the nodes offer."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

ROOT = Path(__file__).parents[1]
NODES = ("sensor_node", "rig_simulator", "tracker", "preprocessor", "identifier", "recorder", "replay")


@pytest.mark.parametrize("node", NODES)
def test_every_parameter_is_documented(node: str) -> None:
    text = (ROOT / "docs" / "graph.md").read_text(encoding="utf-8")
    parameters = importlib.import_module(f"rig_identification.nodes.{node}").PARAMETERS
    assert parameters
    for parameter in parameters:
        assert f"| `{parameter.name}` |" in text, f"{node}: {parameter.name} is not in docs/graph.md"
        assert parameter.description in text, (
            f"{node}: {parameter.name} means something else in docs/graph.md"
        )


def test_every_service_is_documented() -> None:
    text = (ROOT / "docs" / "graph.md").read_text(encoding="utf-8")
    for file in (ROOT / "rig_identification" / "nodes").glob("*.py"):
        for service in re.findall(r'serve\("~/(\w+)"', file.read_text(encoding="utf-8")):
            assert f"{file.stem}/{service}`" in text, f"{file.stem}/{service} is not in docs/graph.md"
