"""docs/notebook: the notebook is its script's, was run, and its page holds what it showed."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any

import pytest

from bench.notebook import NOTEBOOK, SOURCE, cells, executed

DOCS = SOURCE.parents[1]
#: bytes of a notebook that loads at once.
MOST = 400_000


def hooks() -> Any:
    """docs/site_hooks.py, which mkdocs alone imports."""
    spec = importlib.util.spec_from_file_location("site_hooks", DOCS / "site_hooks.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def stored() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    return found


def test_the_notebook_is_its_scripts() -> None:
    """python -m bench.notebook after a change of the script."""
    told = [(cell["cell_type"], "".join(cell["source"])) for cell in stored()]
    assert told == cells(SOURCE.read_text(encoding="utf-8"))
    assert NOTEBOOK.stat().st_size < MOST


def test_every_cell_was_run_in_turn_and_none_failed() -> None:
    code = [cell for cell in stored() if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    outputs = [output for cell in code for output in cell["outputs"]]
    assert [output for output in outputs if output["output_type"] in ("error", "stream")] == []
    kinds = [kind for output in outputs for kind in output.get("data", {})]
    assert "image/png" in kinds
    assert kinds.count("text/html") >= 4


def test_the_notebook_uses_the_whole_interface() -> None:
    source = "\n".join(text for kind, text in cells(SOURCE.read_text(encoding="utf-8")) if kind == "code")
    for name in (
        "ri.simulate(",
        "ri.read(",
        "ri.check(",
        "ri.identify(",
        ".numbers",
        ".findings",
        ".channel(",
    ):
        assert name in source


def test_a_notebooks_page_holds_text_code_tables_and_pictures() -> None:
    page = hooks().notebook_page(NOTEBOOK.read_text(encoding="utf-8"))
    assert page.startswith("# ")
    assert page.count("```python\n") == len([c for c in stored() if c["cell_type"] == "code"])
    assert "<table" in page
    assert "data:image/png;base64," in page
    assert "<style" not in page


def test_what_a_cell_shows_is_escaped() -> None:
    cell = {
        "cell_type": "code",
        "source": ["x"],
        "outputs": [
            {"output_type": "execute_result", "data": {"text/plain": ["<Rig> & more"]}},
            {"output_type": "stream", "text": ["told\n"]},
        ],
    }
    page = hooks().notebook_page(json.dumps({"cells": [cell]}))
    assert page == "```python\nx\n```\n\n<pre>&lt;Rig&gt; &amp; more</pre>\n\n```text\ntold\n```"


@pytest.mark.long
def test_the_notebook_runs(tmp_path: Path) -> None:
    """Its last cell holds its own results against the truth."""
    for needed in ("nbclient", "nbformat", "ipykernel", "matplotlib", "pandas"):
        pytest.importorskip(needed, reason="pip install '.[notebook]'")
    notebook = executed(SOURCE.read_text(encoding="utf-8"))
    assert [c["cell_type"] for c in notebook.cells] == [
        kind for kind, _ in cells(SOURCE.read_text(encoding="utf-8"))
    ]
