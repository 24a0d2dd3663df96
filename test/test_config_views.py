"""The shipped views of Foxglove and RViz: they can be read, and what they show is there."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]
#: Topics and services as docs/graph.md lists them; ``<cable>`` stands for any name.
OFFERED = set(re.findall(r"`([\w/<>]+)`", (ROOT / "docs" / "graph.md").read_text(encoding="utf-8")))


def is_offered(path: str) -> bool:
    """Whether a path below /rig is a topic or service, or a field of one."""
    name = re.sub(r"^cable_\d+/", "<cable>/", path.removeprefix("/rig/").partition(".")[0])
    return name in OFFERED


@pytest.mark.parametrize("file", ["foxglove_layout.json", "rig.rviz"])
def test_what_a_view_shows_is_there(file: str) -> None:
    text = (ROOT / "config" / file).read_text(encoding="utf-8")
    named = set(re.findall(r"/rig/[\w/]+(?:\.[\w.\[\]]+)?", text))
    assert len(named) >= 3
    assert [path for path in sorted(named) if not is_offered(path)] == []
    assert not is_offered("/rig/cable_1/force")


def test_every_panel_of_the_layout_is_placed_once() -> None:
    layout = json.loads((ROOT / "config" / "foxglove_layout.json").read_text(encoding="utf-8"))

    def placed(part: object) -> list[str]:
        if isinstance(part, str):
            return [part]
        assert isinstance(part, dict)
        return [*placed(part["first"]), *placed(part["second"])]

    assert sorted(placed(layout["layout"])) == sorted(layout["configById"])


def test_rviz_looks_from_the_world() -> None:
    view = YAML(typ="safe").load((ROOT / "config" / "rig.rviz").read_text(encoding="utf-8"))
    manager = view["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "world"
    latched = next(d for d in manager["Displays"] if d["Class"].endswith("RobotModel"))["Description Topic"]
    assert latched["Durability Policy"] == "Transient Local"
