"""``certificate.pdf``: the same tables on A4, by fpdf2 (extra ``pdf``)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification import __version__
from rig_identification.errors import InputError
from rig_identification.report.certificate import Certificate
from rig_identification.report.certificate_view import (
    REMARKS,
    Table,
    budget_table,
    correlation_table,
    numbers_table,
    origin_table,
    verdict_sentence,
)

if TYPE_CHECKING:
    from fpdf import FPDF

#: Points of headings, text and tables.
TITLE, HEADING, TEXT, CELL = 15, 11, 9, 7
#: What the fonts that every reader has (Latin-1) lack, and how it is written with them.
PLAIN = str.maketrans({"−": "-", "\u202f": " ", "–": "-", "σ": "sigma"})
#: A power of ten, and its exponent's digits in plain type.
POWER, RAISED = re.compile("×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)"), str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
#: The day of a document without a date. It holds no clock, so that the same result makes the same file.
NO_DATE = datetime(2000, 1, 1, tzinfo=timezone.utc)


def check_pdf() -> None:
    """Raise InputError where the package that writes PDF is not installed."""
    try:
        import fpdf  # noqa: F401
    except ImportError as error:
        raise InputError(
            "--pdf: needs the package fpdf2; pip install 'rig_identification[pdf]', or print certificate.html"
        ) from error


def write_certificate_pdf(certificate: Certificate, path: Path) -> None:
    """Write the certificate; the same one gives the same bytes."""
    from fpdf import FPDF

    pdf = FPDF(format="A4")
    pdf.set_creation_date(_date(str(certificate.provenance.get("recorded", ""))))
    pdf.set_auto_page_break(True, margin=14)
    pdf.add_page()
    session = str(certificate.provenance.get("session", "session"))
    pdf.set_title(_latin(f"{session}: mass properties"))
    _text(pdf, f"{session}: mass properties", TITLE, bold=True)
    _text(pdf, f"Certificate with uncertainty budget. rig_identification {__version__}.", TEXT)
    _text(pdf, verdict_sentence(certificate), TEXT)
    for finding in certificate.findings:
        _text(pdf, f"- {finding}", TEXT)
    for body in certificate.bodies:
        _table(pdf, numbers_table(body.heading, body.numbers), (3, 3, 3, 2, 2, 1, 3))
        _table(pdf, budget_table(body), (7, 3, *(2,) * 10))
        _table(pdf, correlation_table(body), (2,) * 11)
    if certificate.vehicle:
        _table(pdf, numbers_table("Vehicle", certificate.vehicle), (6, 3, 3, 2, 2, 1, 3))
    _text(pdf, "How to read it", HEADING, bold=True)
    for remark in REMARKS:
        _text(pdf, f"- {remark}", TEXT)
    _table(pdf, origin_table(certificate), (2, 4))
    pdf.output(str(path))


def _date(recorded: str) -> datetime:
    try:
        return datetime.strptime(recorded, "%Y-%m-%d %H:%M UTC").replace(tzinfo=timezone.utc)
    except ValueError:
        return NO_DATE


def _latin(text: str) -> str:
    text = POWER.sub(lambda power: f"e{power[1].translate(RAISED)}", text)
    return text.translate(PLAIN).encode("latin-1", "replace").decode("latin-1")


def _text(pdf: FPDF, text: str, size: int, *, bold: bool = False) -> None:
    pdf.set_font("helvetica", "B" if bold else "", size)
    pdf.multi_cell(0, 0.5 * size, _latin(text), new_x="LMARGIN", new_y="NEXT")
    pdf.ln(1)


def _table(pdf: FPDF, table: Table, widths: Sequence[int]) -> None:
    _text(pdf, table.title, HEADING, bold=True)
    pdf.set_font("helvetica", "", CELL)
    align = tuple("LEFT" if i < table.words else "RIGHT" for i in range(len(table.heads)))
    with pdf.table(
        col_widths=tuple(widths), text_align=align, line_height=3.6, borders_layout="HORIZONTAL_LINES"
    ) as drawn:
        for line in (table.heads, *table.lines):
            row = drawn.row()
            for cell in line:
                row.cell(_latin(cell))
    pdf.ln(3)
