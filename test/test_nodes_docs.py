"""docs/graph.md names every parameter and service that the nodes offer."""

from __future__ import annotations

import ast
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


@pytest.mark.parametrize("name", ["simulated_rig", "rig", "replay"])
def test_launch_files_describe_nodes_that_exist(name: str) -> None:
    """Only where a full ROS 2 brings launch, which the package index has not."""
    pytest.importorskip("launch_ros", reason="launch_ros is not installed: it comes with a full ROS 2 alone")
    import importlib.util

    from launch_ros.actions import Node

    specification = importlib.util.spec_from_file_location(name, ROOT / "launch" / f"{name}.launch.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    nodes = [entity for entity in module.generate_launch_description().entities if isinstance(entity, Node)]
    assert len(nodes) >= 4


def test_launch_files_name_executables_of_the_package() -> None:
    process = importlib.import_module("rig_identification.nodes.process")
    named = set()
    for file in (ROOT / "launch").glob("*.launch.py"):
        named |= set(
            re.findall(
                r'"([a-z_]+)",?(?=[\s,)])',
                re.search(r"(?:NODES|LISTENERS) = \(.*?\)", file.read_text(), re.S)[0],
            )
        )
    assert {"tracker", "identifier", "rig_simulator"} <= named
    assert all(callable(getattr(process, name, None)) for name in named)


@pytest.mark.parametrize("file", sorted((ROOT / "launch").glob("*.launch.py")), ids=lambda file: file.stem)
def test_launch_files_parse_and_use_what_they_declare(file: Path) -> None:
    """Without launch itself: arguments that are used are declared, and named configurations are there."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    calls = [
        node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    ]

    def first(name: str) -> set[str]:
        return {
            str(c.args[0].value) for c in calls if c.func.id == name and isinstance(c.args[0], ast.Constant)
        }

    assert "generate_launch_description" in {n.name for n in tree.body if isinstance(n, ast.FunctionDef)}
    declared = first("DeclareLaunchArgument")
    assert first("LaunchConfiguration") <= declared
    assert "namespace" in declared
    named = {
        str(n.value) for n in ast.walk(tree) if isinstance(n, ast.Constant) and str(n.value).endswith(".yaml")
    }
    assert all((ROOT / "config" / name).is_file() for name in named), named
