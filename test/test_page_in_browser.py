"""The page as a person uses it, in a real browser, on a wide screen and on a telephone."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("uvicorn", reason="pip install '.[ui]'")
pytest.importorskip("starlette", reason="pip install '.[ui]'")

from page_client import PATIENCE, Client, served

from rig_identification.session.rig_description import read_rig

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
CONFIG = Path(__file__).parents[1] / "config"
WIDTHS = [400, 1400]
#: ms until a task has ended.
LONG = 1000.0 * PATIENCE

pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    folder = tmp_path_factory.mktemp("lab")
    (folder / "trifilar.yaml").write_bytes((CONFIG / "trifilar.yaml").read_bytes())
    with served(folder) as found:
        yield found


@contextmanager
def page_of(client: Client, width: int) -> Iterator[Any]:
    """The overview in a browser; nothing may go wrong in it or lie wider than the screen."""
    playwright = pytest.importorskip("playwright.sync_api", reason="pip install '.[browser]'")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": width, "height": 900})
        page.set_default_timeout(180_000)
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        # A fault that is told is an answer of 422, which a browser lists as an error too
        page.on(
            "console", lambda m: errors.append(m.text) if m.type == "error" and "422" not in m.text else None
        )
        page.goto(client.link)
        yield page
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        browser.close()
    assert errors == []
    assert wide <= 0


@pytest.mark.parametrize("width", WIDTHS)
def test_a_rig_is_described(width: int, client: Client) -> None:
    with page_of(client, width) as page:
        page.get_by_role("link", name="Rig", exact=True).click()
        drawing = page.locator("#drawing svg").first
        drawing.wait_for()
        before = page.locator("#drawing").inner_html()
        length = page.locator("[data-cable] .field[data-key=length]").first
        length.locator("input").fill("2000")
        fault = length.locator(".fault")
        fault.wait_for()
        assert "is it in mm?" in fault.inner_text()
        length.locator("input").fill("1.8")
        fault.wait_for(state="hidden")
        page.wait_for_function("text => document.querySelector('#drawing').innerHTML !== text", arg=before)
        page.get_by_role("button", name="Add a cable").click()
        added = page.locator("[data-cable]").last
        assert added.locator("[data-kind=name] input").input_value() == "cable_5"
        added.locator(".fault:visible").first.wait_for()  # it has no hinges yet
        added.get_by_role("button", name="Remove").click()
        page.locator("fieldset[data-section=imu] .switch input").check()
        page.locator("[data-section=imu] .field[data-key=position] input").first.fill("0.4")
        page.locator(".field[data-key=file] input").fill(f"described_{width}.yaml")
        page.get_by_role("button", name="Save").click()
        page.get_by_role("link", name=f"described_{width}.yaml").wait_for()
    rig = read_rig(client.folder / f"described_{width}.yaml")
    assert [cable.length for cable in rig.cables] == [1.8, 2.0, 2.0, 2.0]
    assert rig.imu is not None
    assert rig.imu.position.tolist() == [0.4, 0.0, 0.0]


@pytest.mark.parametrize("width", WIDTHS)
def test_a_center_of_mass_is_solved(width: int, client: Client) -> None:
    with page_of(client, width) as page:
        page.get_by_role("link", name="Centre of mass").click()
        page.get_by_role("button", name="Solve").click()
        page.locator("#answer svg").first.wait_for()
        assert "1.771" in page.locator("#answer").inner_text()
        angle = page.locator("[data-entry=rest] .field[data-key=inclination_deg]").first
        angle.locator("input").first.fill("95")
        page.get_by_role("button", name="Solve").click()
        angle.locator(".fault").wait_for()
        assert "beyond 89" in angle.locator(".fault").inner_text()
        angle.locator("input").first.fill("0.41143")
        page.locator(".field[data-key=mass] input").first.fill("")
        page.get_by_role("button", name="Solve").click()
        angle.locator(".fault").wait_for(state="hidden")


@pytest.mark.long  # test_page_tasks.py asks the same without a browser
@pytest.mark.parametrize("width", WIDTHS)
def test_a_session_is_simulated_checked_identified_and_has_a_history(width: int, client: Client) -> None:
    name = f"car_{width}"
    with page_of(client, width) as page:
        page.get_by_role("link", name="Simulate", exact=True).click()
        page.locator(".field[data-key=duration] input").fill("5")
        page.locator(".field[data-key=keep] input").fill(name)
        page.get_by_role("button", name="Simulate").click()
        page.locator("#replay svg path").first.wait_for(timeout=LONG)
        page.locator("#charts .u-over").first.wait_for()
        time_told = page.locator("#replay output")
        begin = time_told.inner_text()
        page.locator("#replay button").click()
        page.wait_for_function(
            "text => document.querySelector('#replay output').textContent !== text", arg=begin
        )
        page.get_by_role("link", name="Overview").click()
        page.locator("tr", has_text=f"simulated/{name}").get_by_role("link", name="check").click()
        page.get_by_role("button", name="Check").click()
        page.frame_locator("iframe").get_by_text("What is wrong, and what to do").wait_for(timeout=LONG)
        page.get_by_role("link", name="Identify", exact=True).click()
        page.locator(".field[data-key=session] select").select_option(f"simulated/{name}")
        page.locator(".field[data-key=work] input").fill("0.01")
        page.get_by_role("button", name="Identify").click()
        page.locator("#job progress").wait_for()
        page.locator("#job .stages li").first.wait_for(timeout=LONG)
        report = page.frame_locator("iframe")
        report.get_by_role("heading", name="The ten numbers").wait_for(timeout=LONG)
        page.get_by_role("link", name="History").click()
        assert f"answers/simulated/{name}" in page.locator("table").inner_text()
        if width != WIDTHS[0]:  # two sessions by now
            page.frame_locator("iframe").get_by_text("Session by session").wait_for()


@pytest.mark.long  # test_page_tasks.py asks the same without a browser
@pytest.mark.parametrize("width", WIDTHS)
def test_a_fit_is_stopped(width: int, client: Client) -> None:
    """After the test above, whose session is there."""
    with page_of(client, width) as page:
        page.get_by_role("link", name="Identify", exact=True).click()
        if not page.locator(".field[data-key=session] option").count():
            pytest.skip("no session was simulated before")
        page.locator(".field[data-key=work] input").fill("1000")
        page.get_by_role("button", name="Identify").click()
        page.locator("#job .stages li").first.wait_for(timeout=LONG)
        page.get_by_role("button", name="Stop").click()
        # A fit that is told to stop may have its answer within the second, and its page then shows that
        page.locator("#job").wait_for(state="detached", timeout=LONG)
        told = page.locator("body").inner_text()
        assert "the best answer until then" in told or "Back to the form" in told


@pytest.mark.long  # test_page_tasks.py asks the same without a browser
@pytest.mark.parametrize("width", WIDTHS)
def test_a_session_is_planned(width: int, client: Client) -> None:
    with page_of(client, width) as page:
        page.get_by_role("link", name="Plan", exact=True).click()
        page.locator(".field[data-key=rig] select").select_option("trifilar.yaml")
        for axis, edge in enumerate(("0.6", "0.4", "0.3")):
            page.locator(".field[data-key=box] input").nth(axis).fill(edge)
        page.locator(".field[data-key=mass] input").fill("42")
        page.locator(".field[data-key=minutes] input").fill("1")
        page.get_by_role("button", name="Plan").click()
        page.frame_locator("iframe").locator("h1").wait_for(timeout=LONG)


def test_a_report_can_ask_the_page_nothing(client: Client) -> None:
    """Scripts of a hostile report run without an origin: no cookie, no answer, no reach into the page."""
    hostile = """<p id="told">waiting</p><script>
    const told = text => document.querySelector("#told").textContent += " " + text;
    try { parent.document.title; told("reached"); } catch { told("kept out"); }
    try { told(document.cookie || "no cookie"); } catch { told("no cookie"); }
    fetch("/rig/save", {method: "POST", headers: {"content-type": "application/json"}, body: "{}"})
      .then(() => told("answered"), () => told("not answered"));
    </script>"""
    folder = client.folder / "answers" / "hostile"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "report.html").write_text(hostile)
    playwright = pytest.importorskip("playwright.sync_api", reason="pip install '.[browser]'")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        page = browser.new_page()
        page.goto(client.link)
        page.goto(f"http://{client.host}/files/answers/hostile/report.html")
        page.wait_for_function("document.querySelector('#told').textContent.includes('answered')")
        told = page.locator("#told").inner_text()
        browser.close()
    assert "no cookie" in told
    assert "not answered" in told
