"""A report as PDF, as a browser prints it: no cell is lost, no table's heads stand alone at a page's end."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from test_report_photographed import BROWSER, browser

from rig_identification.recording import Session
from rig_identification.report import write_report
from rig_identification.result import Identification

PDFTOTEXT = shutil.which("pdftotext")
pytestmark = [
    pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine"),
    pytest.mark.skipif(PDFTOTEXT is None, reason="no pdftotext on this machine: it comes with poppler-utils"),
]

#: Words of all cells, and of the rows that are a table's heads, as on paper.
CELLS = """() => {
  const shown = e => e.getClientRects().length > 0;
  const words = e => e.innerText.split(/\\s+/).filter(Boolean);
  const tables = [...document.querySelectorAll("table")].filter(shown);
  return {words: tables.flatMap(t => [...t.querySelectorAll("td, th")].flatMap(words)),
    heads: tables.map(t => words(t.rows[0]).join(""))};
}"""


def printed(report: Path, folder: Path) -> tuple[list[str], dict[str, list[object]]]:
    """Text of each page without its white space, and what the page's tables hold."""
    with browser() as started:
        page = started.new_page()
        page.goto(report.as_uri())
        page.emulate_media(media="print")
        page.pdf(path=str(folder / "report.pdf"), format="A4", prefer_css_page_size=True)
        page.set_viewport_size({"width": 703, "height": 900})
        page.evaluate("() => document.querySelectorAll('details').forEach(d => d.open = true)")
        told = page.evaluate(CELLS)
    command = [str(PDFTOTEXT), "-layout", str(folder / "report.pdf"), "-"]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return ["".join(page.split()) for page in text.split("\f") if page.strip()], told


def test_nothing_of_a_table_is_cut(explained: Identification, session: Session, tmp_path: Path) -> None:
    write_report(explained, session, tmp_path / "report.html")
    pages, told = printed(tmp_path / "report.html", tmp_path)
    assert len(pages) > 3
    assert len(told["words"]) > 100
    whole = "".join(pages)
    assert [word for word in told["words"] if str(word) not in whole and len(str(word)) < 12] == []
    assert [head for head in told["heads"] if any(p.endswith(str(head)) for p in pages[:-1])] == []


def test_what_is_cut_is_seen(tmp_path: Path) -> None:
    """The measure itself: a cell that is cut off, and heads that end a page."""
    table = """<table><tr><th>alone</th></tr><tr><td>below</td></tr></table>
      <div style="overflow: hidden; width: 90px; position: relative"><table style="position: absolute;
      left: 95px"><tr><td>outside</td></tr></table>&nbsp;</div>"""
    (tmp_path / "bad.html").write_text(
        f"<!doctype html><style>tr + tr {{ break-before: page }}</style>{table}", encoding="utf-8"
    )
    pages, told = printed(tmp_path / "bad.html", tmp_path)
    assert pages[0].endswith("alone")
    assert "outside" in told["words"]
    assert "outside" not in "".join(pages)
