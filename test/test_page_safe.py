"""The page against those who are not its user: other sites, other names, other folders, too much."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="pip install '.[ui]'")
pytest.importorskip("starlette", reason="pip install '.[ui]'")

from page_client import TOKEN, Client, served

from rig_identification.ui.folder import Folder, Outside
from rig_identification.ui.guard import LARGEST_BODY

HOSTILE = '<img src=x onerror="alert(1)">'
#: Every page and what a program may ask.
PAGES = ("/", "/rig", "/check", "/plan", "/simulate", "/balance", "/identify", "/live", "/history")
POSTS = (
    "/rig/drawing", "/rig/save", "/check/start", "/identify/start", "/plan/start", "/simulate/start",
    "/balance/solve", "/live/window", "/jobs/none/stop",
)  # fmt: skip
#: Names that lead out of a folder, each in its own way.
OUTWARD = (
    "../secret.yaml", "a/../../secret.yaml", "/etc/passwd", "..", "//etc/passwd", "..\\secret.yaml",
    "C:/secret.yaml", "link/secret.yaml", "straight.yaml", "loop/x.yaml", "a\0b.yaml", "", "x" * 2000,
)  # fmt: skip


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    outside = tmp_path_factory.mktemp("outside")
    (outside / "secret.yaml").write_text("secret: of somebody else\n")
    folder = outside / "folder"
    folder.mkdir()
    (folder / "link").symlink_to(outside)
    (folder / "straight.yaml").symlink_to(outside / "secret.yaml")
    (folder / "loop").symlink_to(folder / "loop")
    hostile = folder / HOSTILE.replace("/", "")
    hostile.mkdir()
    (hostile / "session.yaml").write_text("rig: ../../secret.yaml\nrecordings: [{bag: run, kind: dynamic}]\n")
    (hostile / "run").mkdir()
    (folder / ".hidden.yaml").write_text("hidden: true\n")
    (folder / "report.html").write_text("<script>parent.taken = 1</script>")
    with served(folder) as found:
        yield found


@pytest.mark.parametrize(
    "path", [*PAGES, "/static/ui.js", "/files/report.html", "/jobs/none/state", "/live/events"]
)
def test_nothing_is_shown_without_the_token(client: Client, path: str) -> None:
    for cookie in ({}, {"Cookie": f"rig_identification_{client.port}=wrong"}, {"Cookie": f"other={TOKEN}"}):
        assert client.ask(path, known=False, **cookie).status == 403
    wrong = client.ask(f"{path}?token={TOKEN}x", known=False)
    assert wrong.status == 403
    assert TOKEN not in wrong.text


@pytest.mark.parametrize("path", POSTS)
def test_nothing_is_done_without_the_token(client: Client, path: str) -> None:
    assert client.ask(path, "POST", b"{}", known=False, Content_Type="application/json").status == 403


def test_the_link_gives_a_cookie_that_scripts_and_other_sites_do_not_get(client: Client) -> None:
    answer = client.ask(f"/?token={TOKEN}", known=False)
    assert (answer.status, answer.headers["location"]) == (303, "/")
    kept = answer.headers["set-cookie"]
    assert {"HttpOnly", "SameSite=Strict"} <= set(kept.split("; "))
    assert client.ask("/", known=False, Cookie=kept.partition(";")[0]).status == 200


@pytest.mark.parametrize("path", PAGES)
def test_every_page_is_shown_to_its_user(client: Client, path: str) -> None:
    answer = client.ask(path)
    assert answer.status == 200, answer.text
    policy = answer.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "unsafe" not in policy
    assert answer.headers["x-content-type-options"] == "nosniff"
    # Under that policy an inline script or style would not run: there is none
    scripts = re.findall(r"<script(?![^>]*(?:src=|application/json))[^>]*>", answer.text)
    assert not scripts
    assert not re.search(r"<[^>]+\son\w+=|<style|\sstyle=", answer.text)


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:{port}",
        "127.0.0.1",
        "127.0.0.1:1",
        "127.0.0.1.evil.example:{port}",
        "192.168.0.7:{port}",
        "",
    ],
)
def test_another_name_is_not_this_page(client: Client, host: str) -> None:
    """A site that lets its own name point here (DNS rebinding) sends its name, and may have the cookie."""
    answer = client.ask("/", Host=host.format(port=client.port))
    assert answer.status in (400, 421)
    assert "Overview" not in answer.text


@pytest.mark.parametrize("name", ["localhost", "127.0.0.1", "[::1]"])
def test_its_own_names_are_this_page(client: Client, name: str) -> None:
    assert client.ask("/", Host=f"{name}:{client.port}").status == 200


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "null", "https://{host}", "http://localhost:{port}", "http://{host}.evil"],
)
@pytest.mark.parametrize("path", ["/", *POSTS])
def test_another_site_asks_for_nothing(client: Client, path: str, origin: str) -> None:
    sent = origin.format(host=client.host, port=client.port)
    method = "GET" if path == "/" else "POST"
    answer = client.ask(
        path, method, b"{}" if method == "POST" else None, Origin=sent, Content_Type="application/json"
    )
    assert answer.status == 403
    assert "access-control-allow-origin" not in answer.headers


def test_a_form_of_another_site_is_refused_by_its_kind_too(client: Client) -> None:
    """A browser sends text/plain across sites without asking first."""
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"):
        assert client.ask("/balance/solve", "POST", b"{}", Content_Type=kind).status == 415
    assert client.post("/rig/drawing", {}, Sec_Fetch_Site="cross-site").status == 403


def test_too_large_a_request_is_refused(client: Client) -> None:
    told = client.ask("/rig/drawing", "POST", b" " * (LARGEST_BODY + 1), Content_Type="application/json")
    assert told.status == 413
    assert client.ask("/rig/drawing", "POST", b"{}", Content_Length="1e9").status in (400, 413)


@pytest.mark.parametrize(
    "body",
    [b"", b"[]", b"{", b"[" * 100_000, b'{"a":' * 40_000, b'{"mass": NaN}', b'{"m": Infinity}', b"\xff\xfe"],
    ids=["empty", "list", "open", "deep", "deep mapping", "NaN", "infinite", "no text"],
)  # fmt: skip
@pytest.mark.parametrize("path", POSTS[:-1])
def test_a_body_that_is_no_object_is_told(client: Client, path: str, body: bytes) -> None:
    assert client.ask(path, "POST", body, Content_Type="application/json").status == 400


@pytest.mark.parametrize("path", POSTS[:-1])
@pytest.mark.parametrize(
    "values",
    [
        {}, {"rig": 7}, {"session": ["x"]}, {"cables": "x"}, {"cables": ["a"] * 9999, "a": {}},
        {"rig": {"x": 1}, "lengths": [], "rest": 3}, {"file": {}, "cables": None},
        {"a": [[[[[[[[[[]]]]]]]]]]},
    ],
    ids=range(8),
)  # fmt: skip
def test_values_of_a_wrong_kind_are_told(client: Client, path: str, values: dict[str, object]) -> None:
    answer = client.post(path, values)
    assert answer.status == 422, answer.text
    assert answer.json["fault"]["problem"]
    assert len(answer.text) < 2000


@pytest.mark.parametrize("name", OUTWARD)
def test_no_name_leads_out_of_the_folder(client: Client, name: str) -> None:
    with pytest.raises(Outside):
        Folder(client.folder.resolve()).below(name)
    from urllib.parse import quote

    for path in (
        f"/files/{quote(name, safe='')}",
        f"/files/{quote(name)}",
        f"/rig?file={quote(name, safe='')}",
    ):
        if len(path) < 5000:
            assert "somebody else" not in client.ask(path).text
    for path, key in (
        ("/check/start", "session"),
        ("/plan/start", "rig"),
        ("/balance/solve", "rig"),
        ("/rig/save", "file"),
    ):
        answer = client.post(path, {key: name, "namespace": "/rig", "work": 1})
        assert answer.status == 422
        assert "somebody else" not in answer.text


def test_nothing_is_written_outside(client: Client) -> None:
    before = sorted(client.folder.parent.iterdir())
    rig = {"gravity": 9.81, "cables": ["a", "b"]} | {
        name: {"ceiling_point": [x, 0, 3], "body_point": [x, 0, 1], "length": 2}
        for name, x in (("a", 0), ("b", 1))
    }
    for name in (
        "../rig.yaml",
        "link/rig.yaml",
        str(client.folder.parent / "rig.yaml"),
        ".rig.yaml",
        "session.yaml",
    ):
        assert client.post("/rig/save", {**rig, "file": name}).json["fault"]["key"] == "file"
    assert client.post("/rig/save", {**rig, "file": "own/rig.yaml"}).status == 200
    assert sorted(client.folder.parent.iterdir()) == before
    assert not (client.folder / "session.yaml").exists()


def test_files_are_shown_apart_from_the_page(client: Client) -> None:
    """A report may be anybody's: its scripts run without an origin, so they cannot ask this page anything."""
    answer = client.ask("/files/report.html")
    assert answer.status == 200
    policy = answer.headers["content-security-policy"]
    assert "sandbox" in policy
    assert "allow-same-origin" not in policy
    assert "connect-src" not in policy
    assert "default-src 'none'" in policy
    for name in (".hidden.yaml", "link", "none.html", "run"):
        assert client.ask(f"/files/{name}").status == 404


def test_a_session_that_names_files_elsewhere_is_not_read(client: Client) -> None:
    name = HOSTILE.replace("/", "")
    go = client.post("/check/start", {"session": name, "namespace": "/rig"}).json["go"]
    assert client.ended(go)["state"] == "failed"
    page = client.ask(go).text
    assert "outside of the page" in page
    assert "somebody else" not in page


def test_every_name_is_escaped(client: Client) -> None:
    for path in (
        "/",
        "/check",
        "/identify",
        "/check?session=%3Cimg%3E",
        "/rig?file=%3Cimg%20src%3Dx%3E.yaml",
    ):
        assert "<img" not in client.ask(path).text
    answer = client.post("/rig/drawing", {
        "gravity": 9.81, "cables": [HOSTILE, "b"],
        HOSTILE: {"ceiling_point": [0, 0, 3], "body_point": [0, 0, 1], "length": 2},
        "b": {"ceiling_point": [1, 0, 3], "body_point": [1, 0, 1], "length": 2},
    })  # fmt: skip
    drawing = answer.json["html"]["drawing"]
    assert "<svg" in drawing
    assert "<img" not in drawing
    assert "&lt;img" in drawing


def test_a_hostile_result_in_the_folder_is_a_line(client: Client) -> None:
    folder = client.folder / "answers" / "bad"
    folder.mkdir(parents=True)
    for text in ("[" * 200_000, "{}", "nothing", json.dumps({"mass": {"value": "<b>"}})):
        (folder / "result.json").write_text(text)
        page = client.ask("/history").text
        assert "Not read" in page
        assert client.ask("/").status == 200


def test_a_pipe_in_the_folder_is_no_description(tmp_path: Path) -> None:
    """Reading one waits for ever."""
    import os

    for name in ("rig.yaml", "other.yaml", "session.yaml", "result.json"):
        os.mkfifo(tmp_path / name)
    (tmp_path / "zero.yaml").symlink_to("/dev/zero")
    (tmp_path / "true.yaml").write_text("/**:\n  ros__parameters:\n    cables: [a]\n")
    (tmp_path / "again.yaml").symlink_to("true.yaml")
    folder = Folder(tmp_path.resolve())
    assert folder.rigs() == ["again.yaml", "true.yaml"]
    assert folder.sessions() == folder.results() == []
