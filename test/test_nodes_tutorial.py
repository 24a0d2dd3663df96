"""docs/tutorials/live-rig.md: its commands, in turn, at the simulated rig that its first one starts."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from diagnostic_msgs.msg import DiagnosticArray
from node_processes import Graph, Probe
from ruamel.yaml import YAML
from test_docs_pages import blocks

PAGE = Path(__file__).parents[1] / "docs" / "tutorials" / "live-rig.md"
CONFIG = Path(__file__).parents[1] / "config"
SIMULATED = "rig-identification rig simulated"
#: s that a fit with its search for left-out physics may take on a busy machine.
FIT = 400.0


def lines() -> list[list[str]]:
    """Words of each command of the page, less those that start the graph."""
    every = [shlex.split(line) for block in blocks(PAGE, "sh") for line in block.splitlines()]
    return [words for words in every if words[:2] != ["ros2", "launch"] and words[0] != "rig-identification"]


def services() -> list[str]:
    """Services that the page calls, in its order."""
    return [words[3].removeprefix("/rig/") for words in lines() if words[:3] == ["ros2", "service", "call"]]


def test_the_page_says_nothing_that_cannot_be_played() -> None:
    """Each command is a parameter, a service of the graph's page, or a wait."""
    graph = (PAGE.parents[1] / "graph.md").read_text(encoding="utf-8")
    for words in lines():
        assert words[0] == "sleep" or words[:3] in (["ros2", "param", "set"], ["ros2", "service", "call"]), (
            words
        )
    assert [name for name in services() if f"`{name}`" not in graph] == []
    assert services()[-3:] == [
        f"identifier/{what}" for what in ("identify_center_of_mass", "identify_inertia", "explain_mismatch")
    ]
    assert SIMULATED in PAGE.read_text(encoding="utf-8")


def truth() -> dict[str, list[float]]:
    """Body of the simulated rig as it is shipped."""
    nodes = YAML(typ="safe").load((CONFIG / "simulated_rig_nodes.yaml").read_text(encoding="utf-8"))
    told: dict[str, list[float]] = nodes["/**/rig_simulator"]["ros__parameters"]
    return told


@pytest.mark.long
def test_the_page_leads_to_centre_of_mass_and_inertia(tmp_path: Path) -> None:
    graph = Graph(tmp_path)
    rig = graph.run([sys.executable, "-m", "rig_identification.cli.main", "rig", "simulated"])
    answers = {}
    try:
        probe = Probe(graph)
        probe.hear_once(DiagnosticArray, "/diagnostics")
        for name in sorted(set(services())):
            probe.meet(name)
        for words in lines():
            if words[0] == "sleep":
                probe.spin_for(float(words[1]))
            elif words[1] == "param":
                name, value = words[4].replace(".", "__"), YAML(typ="safe").load(words[5])
                assert probe.set(words[3].removeprefix("/rig/"), **{name: value}) == []
            else:
                name = words[3].removeprefix("/rig/")
                answer = probe.call(name, within=FIT if "identif" in name.split("/")[1] else 30.0)
                assert answer.success, answer.message
                answers[name] = answer.message
        assert graph.end(rig) == (0, "")
        probe.close()
    finally:
        graph.close()
    told = json.loads(answers["identifier/identify_inertia"])
    assert json.loads(answers["identifier/explain_mismatch"])["verdict"] == told["verdict"] == "none"
    center, std = told["center_of_mass"]["value"], np.array(told["center_of_mass"]["std"])
    assert np.all(np.abs(np.subtract(center, truth()["body.center_of_mass"])) < 5.0 * std)
    assert (
        abs(told["inertia"]["value"][2][2] - truth()["body.inertia"][5]) < 5.0 * told["inertia"]["std"][2][2]
    )
