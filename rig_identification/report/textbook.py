"""Chapter of the report: what a formula that everyone knows makes of the runs, and what it leaves out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig_identification.quantity import significant, with_interval
from rig_identification.report.words import words
from rig_identification.result import ELEMENTS, Identification, TextbookAnswer


@dataclass(frozen=True)
class TextbookView:
    """One formula beside the model's answer."""

    element: str
    text: str
    ours: str  # the model's value with its interval, or why there is none
    apart: str  # how far apart both are
    shares: tuple[tuple[str, str], ...]  # what the interval comes from, largest first
    leaves_out: tuple[str, ...]  # of every session
    found: tuple[str, ...]  # effects that the search found in this one


def textbook_views(identification: Identification) -> list[TextbookView]:
    """One view a formula; nothing where none is for such a rig."""
    return [_view(answer, identification) for answer in identification.textbook]


def _view(answer: TextbookAnswer, identification: Identification) -> TextbookView:
    total, i = identification.total, ELEMENTS.index(answer.element)
    ours, apart = "not determinable", ""
    if answer.element not in total.unobservable:
        value, std = float(total.values[i]), float(np.sqrt(total.covariance[i, i]))
        ours = with_interval(value, std, answer.unit)
        share = 100.0 * (value / answer.value - 1.0)
        apart = f"The model's value is {significant(abs(share), 2)} % {'above' if share > 0 else 'below'} it."
    shares = sorted(answer.shares.items(), key=lambda item: -item[1])
    return TextbookView(
        answer.element,
        answer.text,
        ours,
        apart,
        tuple((name, f"{significant(100.0 * std / answer.value, 2)} %") for name, std in shares),
        answer.leaves_out,
        tuple(dict.fromkeys(words(f.effect) for f in identification.mismatch.findings)),
    )
