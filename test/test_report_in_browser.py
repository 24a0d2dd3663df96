"""The page as a browser lays it out: nothing wider than its window, labels apart, a curve in every chart."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rig_identification.recording import Session
from rig_identification.report import write_report
from rig_identification.result import Identification

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")

#: What is measured, in the page itself; it opens every folded part first.
MEASURE = """
addEventListener("load", () => {
  document.querySelectorAll("details").forEach(d => d.open = true);
  const wide = [...document.querySelectorAll("body *")].filter(e => !e.closest(".scroll, svg, pre")
    && e.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
    .map(e => e.outerHTML.slice(0, 80));
  const labels = [...document.querySelectorAll("svg.rig")].map(s => [...s.querySelectorAll("text")]
    .map(t => { const b = t.getBBox(); return [b.x, b.y, b.x + b.width, b.y + b.height, t.textContent]; }));
  const empty = [...document.querySelectorAll(".channel svg")].filter(s =>
    ![...s.querySelectorAll("path.measured")].some(p => p.getAttribute("d").includes("l"))).length;
  document.title = JSON.stringify({wide, labels, empty, page: document.documentElement.scrollWidth,
    window: document.documentElement.clientWidth});
});
"""


def laid_out(page: Path, width: int) -> dict[str, Any]:
    """What the browser measures in a window of a width (px)."""
    text = page.read_text(encoding="utf-8").replace("</body>", f"<script>{MEASURE}</script></body>")
    page.write_text(text, encoding="utf-8")
    frame = page.with_name("frame.html")
    frame.write_text(
        f'<iframe src="{page.name}" style="width:{width}px;height:900px;border:0" onload="setTimeout(() => '
        'document.title = this.contentDocument.title, 300)"></iframe>'
    )
    command = [
        str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files",
        "--window-size=1500,900", "--virtual-time-budget=4000", "--dump-dom", frame.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
    assert title is not None, done.stdout[:2000]
    measured: dict[str, Any] = json.loads(html.unescape(title[1]))
    return measured


@pytest.mark.parametrize("width", [400, 1400])
def test_the_page_fits_its_window(
    width: int, identification: Identification, explained: Identification, session: Session, tmp_path: Path
) -> None:
    """A finding, a set-up without examination, a frame, and doubts, on a telephone and on a desk."""
    both = replace(identification, mismatch=explained.mismatch)
    write_report(both, session, tmp_path / "report.html")
    page = laid_out(tmp_path / "report.html", width)
    assert page["wide"] == []
    assert page["page"] <= page["window"]
    assert page["empty"] == 0
    assert len(page["labels"]) == 5
    for labels in page["labels"]:
        for i, a in enumerate(labels):
            for b in labels[:i]:
                across, down = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
                assert min(across, down) <= 3.0, (a, b)
