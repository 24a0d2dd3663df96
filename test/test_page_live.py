"""The live page: what is heard of a graph arrives as events, windows are opened by it, no graph is a line."""

from __future__ import annotations

import http.client
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("uvicorn", reason="pip install '.[ui]'")
pytest.importorskip("starlette", reason="pip install '.[ui]'")

from page_client import Client, served
from test_page_in_browser import BROWSER, WIDTHS, page_of

from rig_identification.errors import InputError
from rig_identification.ui import graph
from rig_identification.ui.graph import MOST, Graphs

STAND_IN = (sys.executable, str(Path(__file__).with_name("graph_stand_in.py")))


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(graph, "PROGRAM", STAND_IN)
        with served(tmp_path_factory.mktemp("lab")) as found:
            yield found


def events(client: Client, namespace: str, count: int, within: float = 20.0) -> list[dict[str, Any]]:
    """The first events of a namespace; fewer where no more come."""
    connection = http.client.HTTPConnection("127.0.0.1", client.port, timeout=within)
    connection.request("GET", f"/live/events?namespace={namespace}", headers={"Cookie": client.cookie})
    answer = connection.getresponse()
    assert answer.status == 200
    assert (answer.getheader("content-type") or "").startswith("text/event-stream")
    out: list[dict[str, Any]] = []
    while len(out) < count and (line := answer.readline()):
        if line.startswith(b"data: "):
            out.append(json.loads(line[6:]))
    connection.close()
    return out


def test_what_is_heard_arrives_in_order_and_often_enough(client: Client) -> None:
    begun = time.monotonic()
    heard = events(client, "/rig", 80)
    kinds = [one["kind"] for one in heard]
    assert {"graph", "window", "diagnostic", "watch", "tension", "rig", "running"} <= set(kinds)
    times = [one["time"] for one in heard if one["kind"] == "running"]
    assert times == sorted(times)
    assert kinds.count("rig") / (time.monotonic() - begun) > 8.0
    # Who comes later is told what is still true
    assert {"graph", "watch", "diagnostic"} <= {one["kind"] for one in events(client, "/rig", 12)}


def test_windows_are_opened_and_closed(client: Client) -> None:
    start = {"do": "start", "namespace": "/rig", "window": "dynamic", "name": "", "holdout": False}
    assert "run_1 (dynamic) is open" in client.post("/live/window", start).json["told"]
    assert "123 messages" in client.post("/live/window", {"do": "stop", "namespace": "/rig"}).json["told"]
    refused = client.post("/live/window", {**start, "name": "taken"})
    assert refused.status == 422
    assert "is there already" in refused.json["fault"]["problem"]
    still = {**start, "window": "static", "dummy_mass": 40.0, "dummy_position": [0.1, 0.2, 0.0]}
    assert client.post("/live/window", still).status == 200


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("do", {"do": "shake"}),
        ("window", {"window": "both"}),
        ("dummy_mass", {"window": "static", "dummy_mass": -1.0}),
        ("dummy_position", {"window": "static", "dummy_mass": 1.0, "dummy_position": [0.0]}),
        ("", {"namespace": "/rig; rm -rf /"}),
    ],
)
def test_what_no_window_can_be_is_told_at_its_field(client: Client, key: str, change: dict[str, Any]) -> None:
    values = {"do": "start", "namespace": "/rig", "window": "dynamic", "name": "", "holdout": False, **change}
    answer = client.post("/live/window", values)
    assert answer.status == 422
    assert answer.json["fault"]["key"] == key


def test_no_ros_is_one_line(client: Client) -> None:
    assert [one["kind"] for one in events(client, "/none", 2)] == ["missing"]


def test_without_ros_the_program_says_so_and_ends_well() -> None:
    code = (
        "import sys, runpy; sys.modules['rclpy'] = None; "
        "runpy.run_module('rig_identification.nodes.view_program', run_name='__main__')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60.0, check=False
    )
    assert done.returncode == 0, done.stderr
    (line,) = done.stdout.splitlines()
    assert json.loads(line)["kind"] == "missing"
    assert "rclpy" in json.loads(line)["message"]


@pytest.mark.parametrize("namespace", ["rig", "/../x", "/rig//", "/" + "x" * 200, "/1", "/rig\n"])
def test_what_is_no_namespace_starts_nothing(client: Client, namespace: str) -> None:
    graphs = Graphs()
    with pytest.raises(InputError, match="is no namespace"):
        graphs.of(namespace)


def test_so_many_graphs_are_looked_at_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(graph, "PROGRAM", STAND_IN)
    graphs = Graphs()
    found = [graphs.of(f"/silent_{k}") for k in range(MOST)]
    assert graphs.of("/silent_0") is found[0]
    with pytest.raises(InputError, match="close a page first"):
        graphs.of("/one_more")
    graphs.end()
    for one in found:
        assert one._process.wait(10.0) != 0


def test_a_program_nobody_looks_at_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(graph, "PROGRAM", STAND_IN)
    monkeypatch.setattr(graph, "LINGER", 0.2)
    found = Graphs().of("/silent")
    assert found.running
    until = time.monotonic() + 15.0
    while found.running and time.monotonic() < until:
        time.sleep(0.1)
    assert not found.running


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
@pytest.mark.long
@pytest.mark.parametrize("width", WIDTHS)
def test_the_live_page_shows_it_all(width: int, client: Client) -> None:
    with page_of(client, width) as page:
        page.get_by_role("link", name="Live", exact=True).click()
        page.get_by_text("Connected below /rig: 3 load cells and the identifier.").wait_for()
        page.get_by_text("it reads that share too high").wait_for()
        page.get_by_text("<b>cable_3</b> is wired").wait_for()  # a text, whatever it holds
        page.get_by_text("Enough at 47 s").wait_for()
        page.get_by_text("imu: source: no samples for 2 s").wait_for()
        page.locator("#tensions .bar").nth(2).get_by_text("88.13 N").wait_for()
        page.locator("#inertia .u-over").wait_for()
        page.locator("#forecast .u-over").wait_for()
        assert "follow its plan" in page.locator("#forecast .text").inner_text()
        assert "1108 ± 16" in page.locator("#inertia table").inner_text()
        page.locator(".scene canvas").scroll_into_view_if_needed()
        page.wait_for_function(
            "() => document.querySelector('.scene .rate').textContent.includes('pictures')"
        )
        inked = """() => { const c = document.querySelector('.scene canvas');
            return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some(v => v); }"""
        assert page.evaluate(inked)
        page.get_by_role("button", name="Start").click()
        page.locator("#window .told", has_text="window run_1 (dynamic) is open").wait_for()
        page.get_by_role("button", name="Stop").click()
        page.locator("#window .told", has_text="123 messages").wait_for()
        page.locator("#window [data-key=name] input").fill("taken")
        page.get_by_role("button", name="Start").click()
        page.locator("#window .fault.whole", has_text="is there already").wait_for()


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_without_ros_the_page_says_so(client: Client) -> None:
    with page_of(client, WIDTHS[0]) as page:
        page.goto(f"http://{client.host}/live?namespace=/none")
        page.get_by_text("ROS 2 is not there").wait_for()
