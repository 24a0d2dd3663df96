"""Reports of six sessions in a real browser: on a desk, on a telephone, in the dark, and on paper.

In each view nothing is wider than the window, no two labels of a drawing cover each other, no chart is empty,
and text stands out from what it stands on. The pictures go to ``RIG_PHOTOGRAPHS``, where that names a folder.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import make_finding
from test_check_command import make_examination, make_fault
from test_report_textbook import ANSWER

import rig_identification as ri
from rig_identification.recording import Session
from rig_identification.report import write_report
from rig_identification.result import Identification, Quantity, UncertaintySource

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
ROOT = Path(__file__).parents[1]

#: Name, media, colours, and width of the window, px. Paper: A4 less its margins at 96 px an inch.
VIEWS = (
    ("desk", "screen", "light", 1400),
    ("desk_dark", "screen", "dark", 1400),
    ("telephone", "screen", "light", 400),
    ("telephone_dark", "screen", "dark", 400),
    ("paper", "print", "light", 703),
)
#: Contrast (WCAG 2) that text needs at least; mirrored elements of the tensor are grey on purpose.
CONTRAST = 3.0
#: ms that a busy machine may take for one thing.
PATIENCE = 120_000
#: px by which labels may touch.
TOUCH = 3.0

MEASURE = """() => {
  document.querySelectorAll("details").forEach(d => d.open = true);
  const printed = matchMedia("print").matches;
  const shown = e => e.getClientRects().length > 0;
  const wide = [...document.querySelectorAll("body *")].filter(e => shown(e) && !e.closest("svg, pre")
    && (printed || !e.closest(".scroll")) && e.getBoundingClientRect().right
    > document.documentElement.clientWidth + 1).map(e => e.outerHTML.slice(0, 100));
  const labels = [...document.querySelectorAll("svg.rig")].filter(shown).map(s =>
    [...s.querySelectorAll("text")].map(t => { const b = t.getBBox();
      return [b.x, b.y, b.x + b.width, b.y + b.height, t.textContent]; }));
  const charts = [...document.querySelectorAll(".channel svg")].filter(shown);
  const empty = charts.filter(s => ![...s.querySelectorAll("path.measured")]
    .some(p => p.getAttribute("d").includes("l"))).length;
  const channels = c => (c.match(/[\\d.]+/g) || []).map(Number);
  const light = c => { const [r, g, b] = c.map(v => { v /= 255;
    return v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const ground = e => {
    for (; e; e = e.parentElement) {
      const c = channels(getComputedStyle(e).backgroundColor);
      if (c.length === 3 || c[3] > 0.99) return c;
    }
    return [255, 255, 255];
  };
  const pale = [...document.querySelectorAll("h1, h2, h3, p, td, th, li, b, code")].filter(e => shown(e)
    && e.textContent.trim()).map(e => { const a = light(channels(getComputedStyle(e).color)),
    b = light(ground(e));
    return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), e.outerHTML.slice(0, 100)]; })
    .filter(([contrast]) => contrast < CONTRAST).map(([contrast, text]) => contrast.toFixed(1) + " " + text);
  return {wide, labels, charts: charts.length, empty, pale, height: document.documentElement.scrollHeight,
    ground: light(ground(document.body)), page: document.documentElement.scrollWidth,
    window: document.documentElement.clientWidth};
}""".replace("CONTRAST", str(CONTRAST))


@contextmanager
def browser() -> Iterator[Any]:
    """Debian's Chromium, driven."""
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=BROWSER, args=["--no-sandbox", "--disable-gpu"])
        try:
            yield started
        finally:
            started.close()


def photographed(started: Any, report: Path, name: str) -> None:
    """Look at a report in every view."""
    page = started.new_page()
    page.set_default_timeout(PATIENCE)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    for view, media, colours, width in VIEWS:
        page.emulate_media(media=media, color_scheme=colours)
        page.set_viewport_size({"width": width, "height": 900})
        page.goto(report.as_uri())
        seen = page.evaluate(MEASURE)
        if folder := os.environ.get("RIG_PHOTOGRAPHS"):
            page.screenshot(path=f"{folder}/{name}_{view}.png", full_page=True)
        where = f"{name}, {view}"
        assert seen["wide"] == [], where
        assert seen["page"] <= seen["window"], where
        assert seen["empty"] == 0, where
        assert seen["pale"] == [], where
        assert (seen["ground"] < 0.1) == (colours == "dark"), where
        assert seen["height"] > 1000, where
        assert covered(seen["labels"]) == [], where
    assert errors == []
    page.close()


def covered(drawings: list[list[tuple[float, float, float, float, str]]]) -> list[tuple[str, str]]:
    """Pairs of labels that cover each other."""
    return [
        (a[4], b[4])
        for labels in drawings
        for i, a in enumerate(labels)
        for b in labels[:i]
        if min(a[2], b[2]) - max(a[0], b[0]) > TOUCH and min(a[3], b[3]) - max(a[1], b[1]) > TOUCH
    ]


def made_up(identification: Identification, explained: Identification) -> dict[str, Identification]:
    """Six answers that fill the page differently."""
    total = identification.total
    sources = tuple(
        UncertaintySource(name, kind, share * total.covariance)
        for name, kind, share in (("imu rate", "noise", 0.6), ("tolerance.cable_length", "tolerance", 0.4))
    )
    fault = make_fault(corrected=False, advice="Swap the plugs of the cells.", gain=50.0)
    long_name = replace(make_finding(), effect="unknown", where={"law": "a law " + 12 * "with a long name "})
    vehicle = tuple(Quantity(f"{n}_axle_load", 6e3, 2.0, "N") for n in ("front", "rear"))
    rivals = ({"effect": "cable_mass", "where": {}, "log_likelihood_gap": 1.0, "experiment": "weigh it"},)
    return {
        "clean": replace(identification, total=replace(total, sources=sources), vehicle=vehicle),
        "explained": explained,
        "unexplained": replace(
            identification,
            mismatch=replace(explained.mismatch, verdict="unexplained", findings=(long_name, make_finding())),
        ),
        "set_up": replace(identification, examination=make_examination(faults=(fault,))),
        "textbook": replace(identification, textbook=(ANSWER,)),
        "tied": replace(identification, mismatch=replace(identification.mismatch, alternatives=rivals)),
    }


@pytest.mark.parametrize(
    "name",
    [
        "clean",
        *(
            pytest.param(n, marks=pytest.mark.long)
            for n in ("set_up", "explained", "unexplained", "textbook", "tied")
        ),
    ],
)
def test_six_answers_in_five_views(
    name: str, identification: Identification, explained: Identification, session: Session, tmp_path: Path
) -> None:
    write_report(made_up(identification, explained)[name], session, tmp_path / "report.html")
    with browser() as started:
        photographed(started, tmp_path / "report.html", name)


def simulated() -> dict[str, ri.Simulated]:
    """Six sessions: rigs, devices and what was left out differ."""
    trifilar = ROOT / "config" / "trifilar.yaml"
    small = [42.0, 0.3, 0.18, -0.12, 1.9, 0.03, -0.05, 2.4, 0.02, 3.6]
    return {
        "car": ri.simulate(case="14", start="pulled", duration=8.0, rest=4.0),
        "damped": ri.simulate(
            case="1", start="pulled", duration=8.0, rest=4.0, effects={"hinge_damping": 0.5}
        ),
        "rods": ri.simulate(case="10", duration=8.0, rest=4.0),
        "watched": ri.simulate(
            trifilar, body=small, mocap=120.0, without=["tension"], duration=12.0, rest=0.0
        ),
        "trifilar": ri.simulate(trifilar, body=small, mocap=120.0, duration=8.0, rest=4.0),
        "without_force": ri.simulate(case="1", start="pulled", duration=8.0, rest=4.0, without=["exciter"]),
    }


@pytest.mark.long
@pytest.mark.parametrize("name", ["car", "damped", "rods", "watched", "trifilar", "without_force"])
def test_six_sessions_in_five_views(name: str, tmp_path: Path) -> None:
    ri.identify(simulated()[name]).write(tmp_path)
    with browser() as started:
        photographed(started, tmp_path / "report.html", name)


def test_what_is_wrong_is_seen(tmp_path: Path) -> None:
    """The measure itself: labels on each other, something wide, and pale words."""
    label = '<text x="10" y="20">one</text><text x="12" y="21">other</text>'
    text = f"""<!doctype html><html><body style="background:#fff"><p style="color:#eee">pale</p>
      <div style="width:2000px">wide</div>
      <svg class="rig" width="90" height="40">{label}</svg></body></html>"""
    (tmp_path / "bad.html").write_text(text, encoding="utf-8")
    with browser() as started:
        page = started.new_page()
        page.goto((tmp_path / "bad.html").as_uri())
        seen = page.evaluate(MEASURE)
    assert len(seen["wide"]) == 1
    assert len(seen["pale"]) == 1
    assert covered(seen["labels"]) == [("other", "one")]
    assert np.isfinite(seen["height"])
