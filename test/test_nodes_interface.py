"""Without the built interfaces the identifier says so; how a request for a window becomes a plan."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import (  # noqa: F401
    ACQUAINTED,
    ROOT,
    Diagnostics,
    Graph,
    Probe,
    graph_of_the_test,
    probe_of_the_test,
)
from rcl_interfaces.srv import DescribeParameters
from ruamel.yaml import YAML
from test_nodes_colcon import NAMES

from rig_identification.errors import InputError
from rig_identification.nodes.recording_parameters import plan_of
from rig_identification.nodes.typed import TRIGGER_ONLY


def test_an_identifier_without_the_interfaces_says_so(graph: Graph, probe: Probe) -> None:
    identifier = graph.start("identifier")
    diagnostics = Diagnostics(probe)
    told = lambda: diagnostics.says("identifier: interface", TRIGGER_ONLY)  # noqa: E731
    probe.spin_until(told, 60.0, "what the interface is")
    assert not probe.call("identifier/get_inertia").success
    services = {name for name, _ in probe.node.get_service_names_and_types()}
    assert "/rig/identifier/start_window" in services
    assert not [name for name in services if "/typed/" in name or "/_action/" in name]
    assert graph.end(identifier) == (0, "")


def test_a_plan_takes_the_next_free_name() -> None:
    plan = plan_of("", "dynamic", True, 0.0, [0.0, 0.0, 0.0], {"run_1", "run_2", "static_1"})
    assert (plan.name, plan.kind, plan.holdout, plan.dummy) == ("run_3", "dynamic", True, None)
    heavy = plan_of("loaded", "static", False, 50.0, [0.3, 0.2, 0.1], set())
    assert heavy.dummy is not None
    assert (heavy.name, heavy.dummy.mass, heavy.dummy.position.tolist()) == ("loaded", 50.0, [0.3, 0.2, 0.1])


@pytest.mark.parametrize(
    ("kind", "holdout", "mass", "position", "words"),
    [
        ("swinging", False, 0.0, [0.0, 0.0, 0.0], "kind: 'swinging' is unknown"),
        ("static", True, 0.0, [0.0, 0.0, 0.0], "cannot be held out"),
        ("dynamic", False, 5.0, [0.0, 0.0, 0.0], "belongs to a static"),
        ("static", False, -1.0, [0.0, 0.0, 0.0], "dummy_mass: -1.0"),
        ("static", False, float("nan"), [0.0, 0.0, 0.0], "dummy_mass: nan"),
        ("static", False, 5.0, [float("inf"), 0.0, 0.0], "dummy_position"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused(
    kind: str, holdout: bool, mass: float, position: list[float], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        plan_of("", kind, holdout, mass, position, set())


def test_parameters_are_described_with_ranges_and_what_may_be_set(graph: Graph, probe: Probe) -> None:
    identifier = graph.start("identifier")
    client = probe.node.create_client(DescribeParameters, "identifier/describe_parameters")
    probe.spin_until(client.service_is_ready, 60.0, "parameters")
    probe.spin_for(ACQUAINTED)
    names = [
        "running_rate",
        "depth",
        "storage",
        "recording.dummy_mass",
        "recording.dummy_position",
        "session",
    ]
    future = client.call_async(DescribeParameters.Request(names=names))
    probe.spin_until(future.done, 30.0, "descriptors")
    rate, depth, storage, mass, position, session = future.result().descriptors
    assert (rate.floating_point_range[0].from_value, rate.floating_point_range[0].to_value) == (0.0, 10.0)
    assert (depth.integer_range[0].from_value, depth.integer_range[0].to_value) == (10, 100_000)
    assert storage.additional_constraints == "one of mcap, sqlite3"
    assert position.additional_constraints == "each number within -100 and 100 m"
    assert [d.read_only for d in (rate, depth, storage)] == [True] * 3
    assert [d.read_only for d in (mass, position, session)] == [False] * 3
    assert all(d.description for d in future.result().descriptors)
    (reason,) = probe.set("identifier", recording__dummy_mass=-1.0)
    assert "out of range" in reason
    assert graph.end(identifier) == (0, "")


def test_every_line_of_diagnostics_has_its_place_in_the_aggregator(graph: Graph, probe: Probe) -> None:
    """Names as diagnostic_updater makes them, "<node>: <what>", and one analyzer for each."""
    names = ("rig_simulator", "imu", "tracker", "preprocessor", "identifier", "recorder")
    for name in names:
        graph.start(name)
    diagnostics = Diagnostics(probe)
    there = lambda: all(f"{name}: node" in diagnostics.lines for name in names)  # noqa: E731
    probe.spin_until(there, 90.0, "every node's line")
    document = YAML(typ="safe").load(ROOT / "config" / "diagnostics.yaml")["analyzers"]["ros__parameters"]
    starts = [start for part in document.values() if isinstance(part, dict) for start in part["startswith"]]
    assert {start.removesuffix(": ") for start in starts} == set(NAMES)
    for line in diagnostics.lines.values():
        assert sum(line.name.startswith(start) for start in starts) == 1, line.name
        assert line.hardware_id
