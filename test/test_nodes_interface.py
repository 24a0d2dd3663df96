"""Without the built interfaces the identifier says so; how a request for a window becomes a plan."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import Diagnostics, Graph, Probe, graph_of_the_test, probe_of_the_test  # noqa: F401

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
