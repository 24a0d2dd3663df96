"""Small tables for a notebook's output; the whole page is ``Result.write``'s report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from markupsafe import escape

from rig_identification.examination import Examination
from rig_identification.quantity import NOT_DETERMINED
from rig_identification.report.setup import setup_view
from rig_identification.report.ten_numbers import Element, elements
from rig_identification.result import Identification


def rows_html(caption: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """A table of mappings with the same keys."""
    cells = [[f"{v:.4g}" if isinstance(v, float) else str(v) for v in row.values()] for row in rows]
    return _table(caption, list(rows[0]) if rows else [], cells)


def check_html(examination: Examination) -> str:
    """Headline, then each fault with what to do, then the warnings."""
    view = setup_view(examination)
    faults = [[f.title, f.statement, f.advice] for f in view.faults]
    table = _table("Faults of the set-up", ["fault", "what is wrong", "what to do"], faults) if faults else ""
    return f"<p><b>{escape(f'{examination.session}: {view.headline}')}</b></p>{table}" + _list(view.warnings)


def result_html(identification: Identification, name: str) -> str:
    """Verdict, the ten numbers with their 95 % intervals, and the findings."""
    mismatch = identification.mismatch
    estimates = [("95 % intervals", identification.total)]
    if identification.without_frame is not None:
        estimates = [
            ("with the carrying frame, 95 % intervals", identification.total),
            ("without the carrying frame, 95 % intervals", identification.without_frame),
        ]
    tables = "".join(
        _table(caption, ["", "value", "±", "unit"], [_row(e) for e in elements(estimate)])
        for caption, estimate in estimates
    )
    verdict = f"{name}: verdict {mismatch.verdict}. {mismatch.explanation}"
    findings = _list(finding.statement for finding in mismatch.findings)
    return f"<p><b>{escape(verdict)}</b></p>{tables}{findings}"


def _row(element: Element) -> list[str]:
    name = element.symbol + element.index
    if not element.observable:
        return [name, NOT_DETERMINED, "", ""]
    return [name, element.value, element.half_width, element.unit]


def _table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><caption>{escape(caption)}</caption><tr>{head}</tr>{body}</table>"


def _list(texts: Iterable[str]) -> str:
    items = "".join(f"<li>{escape(text)}</li>" for text in texts)
    return f"<ul>{items}</ul>" if items else ""
