"""docs/effects: a page, a picture and a line for each effect; a page says what the package says."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_docs_pages import blocks

from bench.effect_pages import (
    PAGES,
    PICTURES,
    PLAIN,
    caption,
    command_of,
    effects,
    filled,
    has,
    rivals,
    simulated,
    stated,
)
from bench.effect_pictures import Shown, drawn
from rig_identification.api.effects import effect_of
from rig_identification.api.truth import truth_document
from rig_identification.cli.effects import effects_given
from rig_identification.cli.main import build_parser, main
from rig_identification.errors import InputError
from rig_identification.result import ChannelFit

DOCS = PAGES.parent
EFFECTS = effects()
#: Seen at once, or named without a switch of the effect's own: what simulates it instead.
OTHERWISE = {"cable_slack": {"pull"}}
#: In the contract's cells beside parameters.
WORDS = ("axis", "check", "where", "steps", "step")
#: All pictures together, bytes.
MOST = 2_000_000


def page_of(effect: str) -> str:
    return (PAGES / f"{effect}.md").read_text(encoding="utf-8")


def contract_rows() -> dict[str, str]:
    """Effect -> its parameters' cell, of the contract's table; those from ``unit`` on are faults."""
    text = (DOCS / "recording-contract.md").read_text(encoding="utf-8")
    table = text[text.index("| effect | what it is") : text.index("| `unit` |")]
    return dict(re.findall(r"^\| `(\w+)` \|[^|]*\|([^|]*)\|$", table, re.MULTILINE))


def test_every_effect_has_its_page_its_picture_and_its_line() -> None:
    """And nothing else has: no page is left behind."""
    assert set(contract_rows()) <= set(EFFECTS)
    assert len(EFFECTS) >= 33
    assert sorted(path.stem for path in PAGES.glob("*.md")) == EFFECTS
    assert sorted(path.stem for path in PICTURES.glob("*.svg")) == EFFECTS
    index = (DOCS / "effects.md").read_text(encoding="utf-8")
    assert sorted(set(re.findall(r"\[`(\w+)`\]\(effects/\w+\.md\)", index))) == EFFECTS
    assert re.findall(r"\[`(\w+)`\]\(effects/(?!\1\.md)", index) == []


def test_the_pictures_are_small() -> None:
    sizes = {path.stem: path.stat().st_size for path in PICTURES.glob("*.svg")}
    assert sum(sizes.values()) < MOST
    assert all(3_000 < size < 80_000 for size in sizes.values()), sizes


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_page_has_every_chapter_and_says_what_the_package_says(effect: str) -> None:
    page = page_of(effect)
    heads = re.findall(r"^## (.+)$", page, re.MULTILINE)
    for chapter in (
        "Parameters",
        "How it shows",
        "Confirm it without this tool",
        "What it is mistaken for",
        "Simulate it",
    ):
        assert chapter in heads
    assert page.startswith("# ")
    assert f"`{effect}`" in page
    assert f"](pictures/{effect}.svg)" in page
    assert stated(effect, page) == page, "python -m bench.effect_pages"
    # No part is empty, and none was left unmeasured
    parts = re.findall(r"<!-- (\w+) -->\n(.*?)<!-- end -->", page, re.DOTALL)
    assert {"picture"} <= {name for name, _ in parts}
    assert [name for name, text in parts if not text.strip()] == []


@pytest.mark.parametrize("effect", sorted(set(contract_rows())))
def test_a_page_names_the_parameters_of_the_contract(effect: str) -> None:
    """A shorthand as ``_y`` of the contract stands for a name that the page has in full."""
    names = re.findall(r"`([a-z][a-z_]*)`", contract_rows()[effect])
    page = page_of(effect)
    assert [name for name in names if name not in WORDS and name not in page] == []


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_page_simulates_its_own_effect(effect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its command parses, and every switch in it exists and belongs to the effect."""
    monkeypatch.chdir(DOCS.parent)  # a rig description of the repository
    command = command_of(page_of(effect))
    asked = build_parser().parse_args(shlex.split(command)[1:])
    given = effects_given(asked.effect)
    if effect in OTHERWISE:
        plain = build_parser().parse_args(PLAIN)
        assert all(getattr(asked, option) != getattr(plain, option) for option in OTHERWISE[effect])
        return
    # A law of a force has no word of its own in the contract
    assert {effect_of(name) for name in given} == {"point_law" if effect == "unknown" else effect}
    # Raises where a switch is unknown or a number makes no sense
    truth = simulated(command, duration=1.0, rest=0.0).truth
    assert truth.effects == given
    (told,) = truth_document(truth)["effects"]
    assert told["switches"] == {name: list(values) for name, values in given.items()}


def test_a_switch_that_does_not_exist_is_seen() -> None:
    command = command_of(page_of("hinge_damping")).replace("hinge_damping", "hinge_dampin")
    with pytest.raises(InputError, match="hinge_dampin: is unknown"):
        simulated(command)


def test_a_picture_shows_both_courses_and_both_residuals() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    swing = np.sin(2.0 * np.pi * time)
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(time.size)
    fit = ChannelFit(
        "run_1", "imu", "angular_rate", "y", "rad/s", 0.01, False, time, swing + 0.01 * noise, 0.95 * swing
    )
    gains = {"a": 40.0, "hinge_damping": 50.0, "b": 5.0}
    doubt = "cable_1.length", 9.0
    shown = Shown(fit, (time, 0.9 * swing), (time, noise), None, 1.7, doubt, gains)
    begin, end = shown.window
    assert end - begin == pytest.approx(4.0, rel=0.1)  # four periods of a residual of 1 Hz
    svg = drawn(shown, "hinge_damping")
    assert svg.count('class="effect"') == svg.count('class="without"') == 2
    assert "angular rate y (rad/s)" in svg
    assert "3.7 times the noise is left" in caption(shown)  # (0.05 / 0.01 / sqrt 2)^2 and 1
    assert rivals("hinge_damping", gains).splitlines()[2:] == ["| [`a`](a.md) | 80 % |"]
    assert "First order says little" in rivals("b", gains)
    assert "Nothing is left" in rivals("b", {"b": 3.0})
    # Where a number of the description takes all of it, what the effect changes is drawn instead
    taken = replace(shown, fit=replace(fit, predicted=swing))
    assert "moves `cable_1.length` by 9 of its tolerances" in caption(taken)
    assert np.std(taken.difference) == pytest.approx(np.hypot(0.1 / 0.01 / np.sqrt(2.0), 1.0), rel=0.05)


def test_what_is_filled_stays_between_its_marks() -> None:
    page = "a\n<!-- told -->\nold\n<!-- end -->\nb\n<!-- rivals -->\nkept\n<!-- end -->\n"
    assert has(page, "told")
    assert not has(page, "laws")
    assert filled(page, "told", "new") == page.replace("\nold\n", "\nnew\n")


@pytest.mark.long
@pytest.mark.parametrize("effect", ["hinge_damping", "sensor_lag", "load_cell_gain"])
def test_a_pages_session_is_answered_with_its_effect(
    effect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The two commands of a page as they stand; what is named first, or ties with it, is the effect."""
    monkeypatch.chdir(tmp_path)
    (block,) = blocks(PAGES / f"{effect}.md", "sh")
    for line in re.sub(r"\\\n\s*", "", block).splitlines():
        assert main(shlex.split(line)[1:]) == 0, line
    told = json.loads((tmp_path / "trial_answer" / "result.json").read_text(encoding="utf-8"))["mismatch"]
    named = [f["effect"] for f in (*told["findings"][:1], *told["alternatives"])]
    assert effect in named
