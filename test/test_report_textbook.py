"""The textbook's answer on the page and in ``result.json``: first its number, then what it leaves out."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rig_identification.recording import Session
from rig_identification.report import render_report, result_to_dict
from rig_identification.result import ELEMENTS, Identification, TextbookAnswer

ANSWER = TextbookAnswer(
    "trifilar", "Jzz", 0.0109, 4e-5, "kg*m^2", 0.8725, 8e-5, 0.117, 0.013,
    {"period": 2e-6, "distances": 4e-5}, "The trifilar formula makes Jzz 0.0109.", ("what damps it",),
)  # fmt: skip


def test_the_page_tells_the_formula_first_and_then_what_it_leaves_out(
    identification: Identification, session: Session
) -> None:
    text = render_report(replace(identification, textbook=(ANSWER,)), session)
    chapter = text[text.index('id="textbook"') :]
    assert (
        chapter.index(ANSWER.text) < chapter.index("The whole model makes it") < chapter.index("leaves out")
    )
    assert "distances (0.37 %)" in chapter
    assert chapter.index("distances") < chapter.index("period (0.018 %)")
    above = 100.0 * (identification.total.values[ELEMENTS.index("Jzz")] / 0.0109 - 1.0)
    assert ("above it" in chapter) == (above > 0.0)


def test_where_the_model_tells_no_such_number_the_formula_stands_alone(
    identification: Identification, session: Session
) -> None:
    blind = replace(identification.total, unobservable=("Jzz",))
    text = render_report(replace(identification, total=blind, textbook=(ANSWER,)), session)
    assert "The whole model makes it not determinable." in text


def test_no_chapter_and_no_key_without_a_formula(identification: Identification, session: Session) -> None:
    assert 'id="textbook"' not in render_report(identification, session)
    assert "textbook" not in result_to_dict(identification)
    (found,) = result_to_dict(replace(identification, textbook=(ANSWER,)))["textbook"]
    assert found["value"] == ANSWER.value
    assert found["period"] == {"value": pytest.approx(0.8725), "std": pytest.approx(8e-5), "unit": "s"}
    assert found["std_from"] == ANSWER.shares
