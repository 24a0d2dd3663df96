"""Pages of docs/recordings: the logger's files are written, and the page's commands lead to the number."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from logged_kinds import KINDS, Kind
from ruamel.yaml import YAML
from test_docs_pages import DOCS

from rig_identification.cli.main import main
from rig_identification.report.result_json import INERTIA_INDEX
from rig_identification.result import ELEMENTS

PAGES = DOCS / "recordings"
#: Kinds whose simulation takes seconds of its own.
SLOW = {"load-cells", "everything"}


def text_of(kind: Kind) -> str:
    return (PAGES / f"{kind.page}.md").read_text(encoding="utf-8")


def commands(kind: Kind) -> list[list[str]]:
    """Arguments of each command of a page, in its order."""
    (block,) = re.findall(r"^```console\n(.*?)^```$", text_of(kind), re.DOTALL | re.MULTILINE)
    lines = [shlex.split(line.removeprefix("$ ")) for line in block.splitlines()]
    assert all(program == "rig-identification" for program, *_ in lines)
    return [arguments for _, *arguments in lines]


def element(result: dict[str, Any], name: str) -> tuple[float, float]:
    """Value and std of one of the ten numbers."""
    i = ELEMENTS.index(name)
    if i == 0:
        return result["mass"]["value"], result["mass"]["std"]
    if i < 4:
        return tuple(result["center_of_mass"][key][i - 1] for key in ("value", "std"))  # type: ignore[return-value]
    row, column = next((r, c) for r, line in enumerate(INERTIA_INDEX) for c, k in enumerate(line) if k == i)
    return tuple(result["inertia"][key][row][column] for key in ("value", "std"))  # type: ignore[return-value]


def prepared(kind: Kind, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The logger's files in a folder that the commands run in; what was simulated."""
    made = kind.make()
    kind.write(made, folder)
    monkeypatch.chdir(folder)
    return made


def test_every_page_has_its_kind_and_stands_in_the_table() -> None:
    names = {page.stem for page in PAGES.glob("*.md")} - {"index"}
    assert names == set(KINDS)
    assert len(names) >= 10
    table = (PAGES / "index.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\]\(([\w-]+)\.md\)", table)) == names


@pytest.mark.parametrize("kind", [k for k in KINDS.values() if k.heads], ids=lambda kind: kind.page)
def test_a_page_shows_how_its_file_begins(kind: Kind) -> None:
    shown, *_ = re.findall(r"^```text\n([^\n]*)\n", text_of(kind), re.MULTILINE)
    parts = [re.escape(part) for part in shown.split(",...,")]
    assert re.fullmatch(",.*,".join(parts), kind.heads), kind.heads


@pytest.mark.parametrize(
    "kind",
    [pytest.param(k, id=k.page, marks=[pytest.mark.long] if k.page in SLOW else []) for k in KINDS.values()],
)
def test_the_files_become_a_session(kind: Kind, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every recording is in it, one is held out, and nothing that was logged is lost."""
    if kind.page == "drone":
        pytest.importorskip("pyulog", reason="pip install '.[ulog]'")
    made = prepared(kind, tmp_path, monkeypatch)
    for line in commands(kind):
        if line[0] in ("import", "init"):
            assert main(line) == 0, line
    told = YAML(typ="safe").load((tmp_path / "session" / "session.yaml").read_text(encoding="utf-8"))
    kinds = {Path(str(r["bag"])).stem: r["kind"] for r in told["recordings"]}
    assert kinds == {r.name: r.kind for r in made.session.recordings if r.dummy is None}
    assert [bool(r.get("holdout")) for r in told["recordings"]].count(True) == 1
    if kind.heads:
        columns = YAML(typ="safe").load((tmp_path / "session" / "columns.yaml").read_text(encoding="utf-8"))
        used = columns["tables"]["table"]["columns"]
        assert len(used) == len(kind.heads.split(",")) - 1


@pytest.mark.parametrize("page", ["gyroscope", "motion-capture"])
def test_nothing_is_wrong_with_what_a_page_describes(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Any scale of the description's lengths gives such a body the same motion: no unit is told."""
    prepared(KINDS[page], tmp_path, monkeypatch)
    for line in commands(KINDS[page])[:-1]:
        assert main(line) == 0, line
    assert "No fault of the set-up was found." in capsys.readouterr().out


#: Pages that say themselves that their search ends unexplained.
OPEN = {"load-cells": pytest.mark.xfail(strict=True, reason="cells alone lose the start of a swing")}


@pytest.mark.long
@pytest.mark.parametrize(
    "kind", [pytest.param(k, id=k.page, marks=OPEN.get(k.page, ())) for k in KINDS.values()]
)
def test_a_page_leads_to_the_number(kind: Kind, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if kind.page == "drone":
        pytest.importorskip("pyulog", reason="pip install '.[ulog]'")
    made = prepared(kind, tmp_path, monkeypatch)
    for line in commands(kind):
        assert main(line) == 0, line
    result = json.loads((tmp_path / "answer" / "result.json").read_text(encoding="utf-8"))
    assert result["mismatch"]["verdict"] in ("none", "explained")
    for name in kind.known:
        value, std = element(result, name)
        assert value is not None, name
        truth = made.values[ELEMENTS.index(name)]
        assert abs(value - truth) < 3.0 * std, name
        assert std < 0.1 * truth, name  # it says something
