"""The launch files by the real launch system, and what they name, without it."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import os
import re
import shlex
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import RIG, ROOT, Graph, Probe, graph_of_the_test, probe_of_the_test  # noqa: F401
from ruamel.yaml import YAML

from rig_identification.nodes.parameters import check_value
from rig_identification.session import read_rig, write_session
from rig_identification.simulate import AtRest, RunSpec, SessionSpec, simulate_session

NODES = (
    "rig_simulator", "load_cells", "imu", "inclinometer", "tracker", "preprocessor", "identifier", "recorder",
    "replay",
)  # fmt: skip
LISTENERS = ("tracker", "preprocessor", "identifier")
SENSORS = ("load_cells", "imu", "inclinometer")
STARTED = {
    "simulated_rig": ("rig_simulator", *SENSORS, *LISTENERS, "recorder"),
    "rig": (*SENSORS, *LISTENERS, "recorder"),
    "replay": (*LISTENERS, "replay"),
}
#: What ``ros2 launch FILE ARGUMENT:=VALUE ...`` does.
LAUNCH = """\
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
file, *given = sys.argv[1:]
given = [tuple(text.split(":=", 1)) for text in given]
service = LaunchService()
source = PythonLaunchDescriptionSource(file)
service.include_launch_description(
    LaunchDescription([IncludeLaunchDescription(source, launch_arguments=given)])
)
sys.exit(service.run())
"""


def parameters_of(name: str) -> dict[str, object]:
    """Parameters of a node by name."""
    module = importlib.import_module(f"rig_identification.nodes.{'sensor_node' if name in SENSORS else name}")
    return {parameter.name: parameter for parameter in module.PARAMETERS}


@pytest.mark.parametrize("file", ["rig_nodes", "simulated_rig_nodes"])
def test_parameter_files_name_nodes_and_parameters_that_exist(file: str) -> None:
    """And values that the nodes take."""
    tree = YAML(typ="safe").load(ROOT / "config" / f"{file}.yaml")
    assert tree
    for pattern, content in tree.items():
        name = pattern.removeprefix("/**/")
        assert name in NODES
        known = parameters_of(name)
        for parameter, value in content["ros__parameters"].items():
            assert parameter in known, f"{file}: {name} has no parameter {parameter}"
            check_value(known[parameter], value)


@pytest.mark.parametrize("name", STARTED)
def test_launch_files_give_parameters_that_exist(name: str) -> None:
    """Each dictionary of parameters in a launch file, against the nodes that it goes to."""
    text = (ROOT / "launch" / f"{name}.launch.py").read_text(encoding="utf-8")
    assert set(re.findall(r'executable="(\w+)"', text)) <= set(NODES)
    calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    nodes = [call for call in calls if isinstance(call.func, ast.Name) and call.func.id == "Node"]
    assert nodes
    for call in nodes:
        given = {word.arg: word.value for word in call.keywords}
        executable = given["executable"]
        targets = [executable.value] if isinstance(executable, ast.Constant) else STARTED[name]
        for part in ast.walk(given["parameters"]):
            for key in part.keys if isinstance(part, ast.Dict) else []:
                assert isinstance(key, ast.Constant)
                for target in targets:
                    known = parameters_of(target)
                    assert key.value == "use_sim_time" or key.value in known, (target, key.value)


@pytest.fixture(name="prefix")
def installed_prefix(tmp_path: Path) -> Path:
    """A folder as ``colcon build`` leaves it: executables, share, and the index's entry."""
    prefix = tmp_path / "prefix"
    (prefix / "share" / "ament_index" / "resource_index" / "packages").mkdir(parents=True)
    (prefix / "share" / "ament_index" / "resource_index" / "packages" / "rig_identification").touch()
    (prefix / "lib" / "rig_identification").mkdir(parents=True)
    for name in NODES:
        executable = prefix / "lib" / "rig_identification" / name
        command = f"{shlex.quote(sys.executable)} -m rig_identification.nodes {name}"
        executable.write_text(f'#!/bin/sh\nexec {command} "$@"\n')
        executable.chmod(0o755)
    share = prefix / "share" / "rig_identification"
    share.mkdir()
    (share / "config").symlink_to(ROOT / "config")
    (share / "launch").symlink_to(ROOT / "launch")
    return prefix


def small_session(folder: Path) -> list[str]:
    """A session of a body at rest, and the arguments that name it."""
    rig_file = folder / "described.yaml"
    rig_file.write_text(RIG)
    elements = np.array([990.2, 0.69, 1.08, -1.07, 1108.6, -1.4, 31.7, 338.3, 18.3, 1295.9])
    spec = SessionSpec("rest", read_rig(rig_file), elements, runs=(RunSpec("run_1", 120.0, AtRest()),))
    write_session(simulate_session(spec, np.random.default_rng(0))[0], folder / "session")
    return [f"session:={folder / 'session'}", f"rig:={folder / 'session' / 'rig.yaml'}"]


@pytest.mark.skipif(
    importlib.util.find_spec("launch_ros") is None,
    reason="launch_ros is not installed: it comes with a full ROS 2 alone; THE LAUNCH FILES ARE NOT RUN HERE",
)
@pytest.mark.parametrize("name", STARTED)
def test_a_launch_file_starts_its_nodes_and_ends_them_cleanly(
    graph: Graph, probe: Probe, prefix: Path, name: str
) -> None:
    file = prefix / "share" / "rig_identification" / "launch" / f"{name}.launch.py"
    arguments = [f"rig:={graph.rig_file}"] if name == "rig" else []
    if name == "replay":
        arguments = small_session(graph.folder)
    launched = graph.run(
        [sys.executable, "-c", LAUNCH, str(file), *arguments],
        AMENT_PREFIX_PATH=f"{prefix}{os.pathsep}{os.environ.get('AMENT_PREFIX_PATH', '')}",
    )
    wanted = {(node, "/rig") for node in STARTED[name]}
    probe.spin_until(lambda: wanted <= set(probe.node.get_node_names_and_namespaces()), 180.0, "all nodes")
    if name != "rig":  # no amplifier is plugged in here
        probe.spin_until(lambda: probe.node.count_publishers("/rig/odometry") == 1, 60.0, "the tracker")
    status, output = graph.end(launched, signal.SIGINT, within=60.0)
    assert output.count("process has finished cleanly") == len(wanted), output
    assert "Traceback" not in output
    assert status == 0, output
