"""The page's own charts, driven by a browser: zoom, hover, one time axis; and what they are drawn from."""

from __future__ import annotations

import base64
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import make_channel

from rig_identification.recording import Session
from rig_identification.report import write_report
from rig_identification.report.samples import BUDGET, samples_json
from rig_identification.result import Identification

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def unpacked(channel: dict[str, object], key: str) -> np.ndarray:
    held = channel[key]
    assert isinstance(held, dict)
    steps = np.frombuffer(base64.b64decode(held["steps"]), "<u2")
    return np.asarray(held["low"] + (held["high"] - held["low"]) * steps / 65535)


def test_samples_are_the_channels() -> None:
    fit = make_channel("run_1", "imu", "angular_rate", "x", "rad/s", 3e-4, 0.03, 3)
    (channel,) = json.loads(samples_json([fit]))["run_1"]
    assert channel["all"]
    assert np.frombuffer(base64.b64decode(channel["time"]), "<f4") == pytest.approx(fit.time, abs=1e-5)
    for key, values in (("measured", fit.measured), ("predicted", fit.predicted)):
        assert unpacked(channel, key) == pytest.approx(values, abs=np.ptp(values) / 65535)


def test_of_too_many_samples_every_peak_is_kept() -> None:
    fit = make_channel("run_1", "imu", "angular_rate", "x", "rad/s", 3e-4, 0.03, 3)
    measured = fit.measured.copy()
    measured[4321] += 1.0
    fits = [replace(fit, measured=measured, axis=str(i)) for i in range(60)]
    text = samples_json(fits)
    assert len(text) < 1.1 * BUDGET
    channel = json.loads(text)["run_1"][0]
    assert not channel["all"]
    assert unpacked(channel, "measured").max() == pytest.approx(measured.max())


def test_a_name_cannot_end_the_script() -> None:
    fit = make_channel("</script><b>", "imu", "angular_rate", "x", "rad/s", 3e-4, 0.03, 3)
    text = samples_json([fit])
    assert "<" not in text
    assert list(json.loads(text)) == ["</script><b>"]


def test_the_library_is_in_the_page_with_its_licence(
    identification: Identification, session: Session, tmp_path: Path
) -> None:
    write_report(identification, session, tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "var uPlot=function()" in text
    assert not re.search(r"(src|href)=.https?:", text)
    import rig_identification.report as report

    licence = Path(report.__file__).parent / "vendored" / "uplot" / "LICENSE"
    assert licence.read_text(encoding="utf-8").startswith("The MIT License")


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("width", [400, 1400])
def test_a_person_zooms_and_reads(
    width: int, identification: Identification, session: Session, tmp_path: Path
) -> None:
    """Dragging in one chart zooms all of them, hovering reads all of them, a double click shows the whole."""
    playwright = pytest.importorskip("playwright.sync_api", reason="pip install '.[browser]'")
    few = tuple(c for c in identification.channels if c.recording == "run_1")[:3]
    write_report(replace(identification, channels=few), session, tmp_path / "report.html")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": width, "height": 900})
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto((tmp_path / "report.html").as_uri())
        page.locator("#explore > summary").click()
        over = page.locator("#explore .u-over").first
        over.scroll_into_view_if_needed()
        limits = "document.querySelector('#explore').plots().map(p => [p.scales.x.min, p.scales.x.max])"
        whole = page.evaluate(limits)
        box = over.bounding_box()
        y = box["y"] + box["height"] / 2
        page.mouse.move(box["x"] + 0.25 * box["width"], y)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.5 * box["width"], y, steps=4)
        page.mouse.up()
        zoomed = page.evaluate(limits)
        page.mouse.move(box["x"] + 0.4 * box["width"], y, steps=2)
        read = page.evaluate("document.querySelector('#explore').plots().map(p => p.cursor.idx)")
        page.mouse.dblclick(box["x"] + 0.4 * box["width"], y)
        again = page.evaluate(limits)
        page.locator("#explore select").nth(1).select_option("residual")
        labels = page.locator("#explore .u-legend").first.inner_text()
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        browser.close()
    assert errors == []
    assert len(whole) == 3
    start, end = few[0].time[0], few[0].time[-1]
    assert whole[0] == pytest.approx([start, end], abs=0.1)
    for low, high in zoomed:
        assert (low, high) == pytest.approx((0.25 * end, 0.5 * end), abs=0.03 * end)
    assert None not in read
    at = few[0].time[read[0]]
    assert at == pytest.approx(0.25 * end + 0.4 * 0.25 * end, abs=0.03 * end)
    assert again == whole
    assert "residual" in labels
    assert wide <= 0
