"""The motion in the page: what is drawn from, where it comes from, and a browser that plays it."""

from __future__ import annotations

import base64
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.estimate.origins import Origins, told
from rig_identification.recording import Session
from rig_identification.report import write_report
from rig_identification.report.replay import MOST_FRAMES, replay_json
from rig_identification.result import BodyMotion, Identification
from rig_identification.rig import Rig

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def swing(recording: str = "run_1", start: float = 0.0, count: int = 250) -> BodyMotion:
    """A body of the rig of conftest that sways along x and turns about z."""
    time = start + 0.04 * np.arange(count)
    place = np.column_stack([0.2 * np.sin(3.0 * time), np.zeros(count), np.zeros(count)])
    turns = Rotation.from_rotvec(np.outer(0.1 * np.cos(2.0 * time), [0.0, 0.0, 1.0])).as_quat()
    return BodyMotion(recording, time, place, turns)


def test_parts_of_a_run_are_one_and_a_long_one_is_thinned(rig: Rig, identification: Identification) -> None:
    parts = (swing(start=10.0), swing())
    document = json.loads(replay_json(rig, identification.total, parts))
    poses = np.frombuffer(base64.b64decode(document["runs"]["run_1"]), "<f4").reshape(-1, 8)
    assert len(poses) == 500
    assert (np.diff(poses[:, 0]) >= 0.0).all()
    assert poses[:250, 1] == pytest.approx(parts[1].position[:, 0], abs=1e-6)
    long = json.loads(replay_json(rig, identification.total, [swing(count=3 * MOST_FRAMES)]))
    assert len(base64.b64decode(long["runs"]["run_1"])) <= 32 * MOST_FRAMES
    assert replay_json(rig, identification.total, ()) == ""


def test_every_frame_is_within_the_drawing(rig: Rig, identification: Identification) -> None:
    motion = swing()
    document = json.loads(replay_json(rig, identification.total, [motion]))
    axes, body = np.array(document["axes"]), np.array(document["body"])
    for place, turn in zip(motion.position, motion.orientation, strict=True):
        world = Rotation.from_quat(turn).apply(body) + place
        right, up = document["scale"] * (world @ axes.T - document["middle"]).T
        assert (np.abs(right) <= document["width"] / 2).all()
        assert (np.abs(up) <= document["height"] / 2).all()


def test_a_motion_is_told_about_the_given_origins(identification: Identification) -> None:
    """A point of the body is in the world where it was, whatever datum tells it."""
    origins = Origins(np.array([20.0, -3.0, 1.0]), np.array([5.0, 40.0, -2.0]))
    motion = swing()
    (given,) = told(replace(identification, motions=(motion,)), origins).motions
    point = np.array([1.0, 2.0, 3.0])  # in the axes used
    at = motion.position + Rotation.from_quat(motion.orientation).apply(point)
    same = given.position + Rotation.from_quat(given.orientation).apply(point + origins.body)
    assert same == pytest.approx(at + origins.world)


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_a_person_moves_the_slider_and_plays(
    identification: Identification, session: Session, tmp_path: Path
) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="pip install '.[browser]'")
    few = tuple(c for c in identification.channels if c.recording == "run_1")[:1]
    motions = (swing(), swing("run_2"))
    write_report(replace(identification, channels=few, motions=motions), session, tmp_path / "report.html")
    hinge = "+document.querySelector('#replay circle').getAttribute('cx')"
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 400, "height": 900})
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto((tmp_path / "report.html").as_uri())
        first = page.evaluate(hinge)
        page.locator("#replay input").fill("0.5236")  # a quarter of the sway's period: farthest along x
        far = page.evaluate(hinge)
        scale, axes = page.evaluate(
            "(r => [r.scale, r.axes])(JSON.parse(document.querySelector('#poses').textContent))"
        )
        said = page.locator("#replay output").inner_text()
        page.locator("#replay button").click()
        page.wait_for_function("!document.querySelector('#replay output').textContent.startsWith('0.5')")
        page.locator("#replay button").click()
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        browser.close()
    assert errors == []
    assert said == "0.52 s"
    corner = session.rig.cables[0].body_point
    motion = motions[0]
    now, then = (
        Rotation.from_quat(motion.orientation[i]).apply(corner) + motion.position[i] for i in (13, 0)
    )
    assert far - first == pytest.approx(scale * (np.array(axes[0]) @ (now - then)), abs=0.2)
    assert wide <= 0
