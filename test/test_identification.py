"""What a set-up's faults make of an answer: findings, ties, warnings, and a verdict that is not none."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from test_check_command import make_examination, make_fault
from test_report import KEYS, Page

from rig_identification.identification import fault_text, with_examination
from rig_identification.recording import Session
from rig_identification.report import render_report, result_to_dict, write_result
from rig_identification.result import Identification


def test_without_faults_the_verdict_stands(identification: Identification) -> None:
    told = with_examination(identification, make_examination(faults=()))
    assert told.mismatch == identification.mismatch
    assert told.notes == ("imu: a word of warning.", "the index was missing", *identification.notes)


@pytest.mark.parametrize(
    ("before", "after"),
    [("none", "explained"), ("explained", "explained"), ("unexplained", "unexplained")],
)
def test_all_noise_once_corrected_is_explained(
    identification: Identification, before: str, after: str
) -> None:
    found = replace(identification, mismatch=replace(identification.mismatch, verdict=before))
    told = with_examination(found, make_examination())
    assert told.mismatch.verdict == after
    assert told.mismatch.explanation.startswith(
        "One fault of the set-up was found before anything was fitted. "
    )
    assert told.mismatch.explanation.endswith(identification.mismatch.explanation)


def test_faults_come_before_what_the_fit_found(explained: Identification) -> None:
    told = with_examination(explained, make_examination())
    first, second = told.mismatch.findings
    assert second == explained.mismatch.findings[0]
    assert first.effect == "unit"
    assert first.evidence == {
        "log_likelihood_gain": 812.5,
        "holdout_error_before": None,
        "holdout_error_after": None,
    }
    tie, rival = told.mismatch.alternatives
    assert (tie["effect"], tie["log_likelihood_gap"]) == ("load_cell_gain", 2.5)
    assert rival == explained.mismatch.alternatives[0]


def test_a_statement_says_what_to_change_in_one_line() -> None:
    text = fault_text(make_fault())
    assert text == (
        "The load cell of cable_2 writes kilogram-force where newtons are due. Set its amplifier to newtons. "
        "Corrected: cable_2: scale: 9.80665."
    )
    assert fault_text(make_fault(advice="", correction="")) == make_fault().statement


def test_result_json_holds_the_fault_and_the_check(identification: Identification, tmp_path: Path) -> None:
    write_result(with_examination(identification, make_examination()), tmp_path / "result.json")
    result = json.loads((tmp_path / "result.json").read_text(), parse_constant=pytest.fail)
    assert list(result) == [*KEYS, "check"]
    assert list(result["check"]) == ["faults", "warnings", "topics"]
    assert result["check"]["faults"][0]["correction"] == "cable_2:\n  scale: 9.80665"
    finding = result["mismatch"]["findings"][0]
    assert list(finding) == ["effect", "where", "parameters", "evidence", "statement", "advice", "correction"]
    assert finding["evidence"]["holdout_error_after"] is None
    assert "check" not in result_to_dict(identification)


def test_the_report_has_the_set_up_before_the_findings(explained: Identification, session: Session) -> None:
    page = Page(render_report(with_examination(explained, make_examination()), session))
    assert page.stack == []
    assert {link[1:] for link in page.links} <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    assert page.ids.index("setup") < page.ids.index("fault-1") < page.ids.index("findings")
    assert page.text.count("imu: a word of warning.") == 1  # in its chapter, and not among the notes again
    assert page.text.count("cable_2: scale: 9.80665") == 1
    assert "Cable elasticity" in page.text
    assert page.ids.count("finding-1") == 1
    assert "finding-2" not in page.ids  # the fault has its chapter of its own


def test_a_sound_set_up_takes_one_line_of_the_report(
    identification: Identification, session: Session
) -> None:
    told = with_examination(identification, make_examination(faults=(), warnings=()))
    text = render_report(told, session)
    chapter = text[text.index('id="setup"') : text.index('id="channels"')]
    assert "No fault of the set-up was found." in chapter
    assert "<details open" not in chapter
    assert "faulty" not in chapter
    assert 'id="setup"' not in render_report(identification, session)


def test_the_verdict_names_the_fault_and_links_to_it(
    identification: Identification, session: Session
) -> None:
    text = render_report(with_examination(identification, make_examination()), session)
    verdict = text[text.index('id="verdict"') : text.index('id="setup"')]
    assert '<a href="#fault-1">Unit</a>' in verdict
    assert "once the findings are in the model" in verdict
    assert "Nothing beside the set-up was found" in text
