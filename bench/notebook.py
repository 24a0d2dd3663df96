"""Makes docs/notebook/car.ipynb of docs/notebook/car.py: its cells, run by Jupyter, with what they show.

The script is the source, in the percent format: it runs as it stands, and an editor shows its cells. The
notebook is committed with its outputs, and the site shows it as a page (docs/site_hooks.py).

    pip install '.[notebook]'
    python -m bench.notebook
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

SOURCE = Path(__file__).parents[1] / "docs" / "notebook" / "car.py"
NOTEBOOK = SOURCE.with_suffix(".ipynb")
#: s that one cell may take: the search of a busy machine.
LONGEST = 1800


def cells(source: str) -> list[tuple[str, str]]:
    """Kind (``markdown`` or ``code``) and text of each cell of a script in the percent format."""
    found = []
    for part in re.split(r"^# %%", source, flags=re.MULTILINE)[1:]:
        head, _, text = part.partition("\n")
        if head.strip() == "[markdown]":
            found.append(("markdown", re.sub(r"^# ?", "", text.strip(), flags=re.MULTILINE)))
        else:
            found.append(("code", text.strip()))
    return found


def notebook_of(source: str) -> Any:
    """The notebook of a script, not run yet."""
    from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

    made = {"markdown": new_markdown_cell, "code": new_code_cell}
    every = [made[kind](text, id=f"cell-{i}") for i, (kind, text) in enumerate(cells(source))]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return new_notebook(cells=every, metadata={"kernelspec": kernel, "language_info": {"name": "python"}})


def executed(source: str) -> Any:
    """The notebook of a script with its outputs. Raises nbclient's CellExecutionError where a cell fails."""
    from nbclient import NotebookClient

    notebook = notebook_of(source)
    with tempfile.TemporaryDirectory() as folder:
        NotebookClient(
            notebook, timeout=LONGEST, record_timing=False, resources={"metadata": {"path": folder}}
        ).execute()
    return notebook


def main() -> None:
    """Run the script's cells, and write the notebook beside it."""
    import nbformat

    notebook = executed(SOURCE.read_text(encoding="utf-8"))
    notebook.metadata["language_info"] = {"name": "python"}  # no version of the machine that ran it
    nbformat.write(notebook, NOTEBOOK)


if __name__ == "__main__":
    main()
