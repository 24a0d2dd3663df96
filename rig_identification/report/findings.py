"""What the ideal model left out: each finding with its place, its size, its evidence and its price."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.quantity import amount, number, significant, unit_text
from rig_identification.report.ten_numbers import Element, elements
from rig_identification.report.words import title, words
from rig_identification.result import ELEMENTS, Finding, Identification, Mismatch


@dataclass(frozen=True)
class FindingView:
    """One finding, written out."""

    title: str
    anchor: str
    statement: str
    where: tuple[tuple[str, str], ...]
    parameters: tuple[tuple[str, str, str, str], ...]  # name, value, half-width, unit
    gain: str | None
    before: float | None  # held-out error
    after: float | None


@dataclass(frozen=True)
class AlternativeView:
    """One explanation that was not told, written out."""

    effect: str
    where: str
    amount: str  # of its first parameter, with its half-width
    gap: str  # how much less likely it is, in log likelihood
    experiment: str


@dataclass(frozen=True)
class Shift:
    """One of the ten numbers in the ideal model and with the findings in it."""

    before: Element
    after: Element
    shift: str  # in standard deviations of the second


def finding_views(mismatch: Mismatch, set_up: int = 0) -> list[FindingView]:
    """Write out every finding but the first ``set_up`` ones, which are faults of the set-up."""
    return [_view(finding, index) for index, finding in enumerate(mismatch.findings[set_up:], start=1)]


def alternative_views(mismatch: Mismatch) -> list[AlternativeView]:
    """Write out what else it could be."""
    return [_alternative(alternative) for alternative in mismatch.alternatives]


def placed_findings(findings: Sequence[Finding]) -> list[tuple[str, NDArray[np.float64]]]:
    """Findings that have a place on the body: name and position, (3,) m in body."""
    placed = [(f.effect, f.where.get("position")) for f in findings]
    return [
        (words(effect), np.asarray(position, dtype=float))
        for effect, position in placed
        if isinstance(position, (Sequence, np.ndarray)) and np.all(np.isfinite(position))
    ]


def shifts(identification: Identification) -> list[Shift]:
    """What the findings did to the ten numbers.

    ``figures["ideal"]`` is the :class:`Identification` of the ideal model, where there are findings.
    """
    ideal = identification.figures.get("ideal")
    if not isinstance(ideal, Identification):
        return []
    rows = []
    pairs = zip(elements(ideal.total), elements(identification.total), strict=True)
    for i, (before, after) in enumerate(pairs):
        std = float(np.sqrt(max(identification.total.covariance[i, i], 0.0)))
        moved = float(identification.total.values[i] - ideal.total.values[i])
        known = before.observable and after.observable and std > 0.0
        rows.append(Shift(before, after, number(moved / std, 1) if known else "–"))
    assert len(rows) == len(ELEMENTS)
    return rows


def _view(finding: Finding, index: int) -> FindingView:
    return FindingView(
        title=title(finding.effect),
        anchor=f"finding-{index}",
        statement=finding.statement,
        where=tuple(
            (key, place_text(key, value)) for key, value in finding.where.items() if value is not None
        ),
        parameters=tuple(_parameter(name, entry) for name, entry in finding.parameters.items()),
        gain=_number(finding.evidence.get("log_likelihood_gain")),
        before=_finite(finding.evidence.get("holdout_error_before")),
        after=_finite(finding.evidence.get("holdout_error_after")),
    )


def _alternative(alternative: Mapping[str, object]) -> AlternativeView:
    where, parameters = alternative.get("where"), alternative.get("parameters")
    places = where.values() if isinstance(where, Mapping) else ()
    amount = ""
    if isinstance(parameters, Mapping) and parameters:
        name, value, half, unit = _parameter(*next(iter(parameters.items())))
        amount = f"{name} {value} ± {half} {unit}" if half else f"{name} {value} {unit}"
    elif alternative.get("statement"):
        amount = str(alternative["statement"])
    return AlternativeView(
        effect=words(str(alternative.get("effect", ""))),
        where=", ".join(place for place in places if isinstance(place, str)),
        amount=amount,
        gap=_number(alternative.get("log_likelihood_gap")),
        experiment=str(alternative.get("experiment") or ""),
    )


def _parameter(name: str, entry: Mapping[str, object]) -> tuple[str, str, str, str]:
    value, std = _finite(entry.get("value")), _finite(entry.get("std"))
    unit = unit_text(str(entry.get("unit") or ""))
    if value is None:
        return words(name), str(entry.get("value", "–")), "", unit
    if std is None or std <= 0.0:
        return words(name), significant(value, 4), "", unit
    text, half, power = amount(value, std)
    return words(name), text, half, f"{power} {unit}".strip()


def place_text(key: str, value: object) -> str:
    """What a finding's ``where`` says under one key."""
    if key == "times" and isinstance(value, Sequence):
        return "; ".join(_time(t) for t in value if isinstance(t, Mapping))
    if key == "position" and isinstance(value, (Sequence, np.ndarray)):
        return "(" + ", ".join(number(float(v), 2) for v in value) + ") m in body"
    if isinstance(value, (list, tuple)):
        return ", ".join(str(item) for item in value)
    if isinstance(value, Mapping):
        return ", ".join(f"{name}: {item}" for name, item in value.items())
    return str(value)


def _time(span: Mapping[str, object]) -> str:
    return f"{span.get('recording')}, {_number(span.get('start'))} s to {_number(span.get('end'))} s"


def _finite(value: object) -> float | None:
    if isinstance(value, (int, float, np.number)) and np.isfinite(value):
        return float(value)
    return None


def _number(value: object) -> str:
    finite = _finite(value)
    return "–" if finite is None else significant(finite, 3)
