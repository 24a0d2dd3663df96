"""A certificate as tables of text: what page and PDF print alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rig_identification.quantity import decimals, number, significant, unit_text
from rig_identification.report.certificate import KINDS, Certificate, CertifiedBody, Number
from rig_identification.result import ELEMENTS

#: Rows of a budget whose largest share is below this are printed as one: all of them together are no tenth.
PRINTED = 0.003
#: A correlation below this is printed as a dot.
WEAK = 0.005

NOT_DETERMINED = "not determined"
HEADS = ("quantity", "value", "U (95 %)", "unit", "u", "k", "degrees of freedom")
#: What a certificate says of its numbers; each one idea.
REMARKS = (
    "U = k u is the expanded uncertainty for a coverage probability of 95 %; u is the standard uncertainty.",
    "Inertia is the tensor about the centre of mass in body axes; Jxy is minus the integral of x y dm.",
    "The uncertainty holds the noise of every channel, the tolerances of the rig description, and the other "
    "explanations of the recordings that the search found. It holds no effect that acts exactly as inertia.",
    "A share is the part of u² that a source accounts for. Shares of a column add up to 100 %.",
)


@dataclass(frozen=True)
class Table:
    """Heads and lines of text; the first ``words`` columns are words, the others figures."""

    title: str
    heads: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]
    words: int = 1


def numbers_table(title: str, numbers: Sequence[Number]) -> Table:
    """Values with their uncertainties."""
    return Table(title, HEADS, tuple(_line(n) for n in numbers))


def _line(n: Number) -> tuple[str, ...]:
    name = n.name.replace("_", " ")
    if n.value is None or n.u is None or n.expanded is None or n.k is None:
        return (name, NOT_DETERMINED, "", unit_text(n.unit), "", "", "")
    places = decimals(n.expanded)
    freedom = "infinite" if n.freedom is None or n.freedom > 1e5 else significant(n.freedom, 3)
    return (
        name,
        number(n.value, places),
        number(n.expanded, places),
        unit_text(n.unit),
        significant(n.u, 3),
        f"{n.k:.2f}",
        freedom,
    )


def budget_table(body: CertifiedBody) -> Table:
    """Share of each source in u² of each number, in per cent; small ones as one row."""
    lines, rest = [], [0.0] * len(ELEMENTS)
    small = 0
    for row in body.rows:
        shares = [body.share(row, i) for i in range(len(ELEMENTS))]
        if max((abs(s) for s in shares if s is not None), default=0.0) < PRINTED:
            rest = [r + (s or 0.0) for r, s in zip(rest, shares, strict=True)]
            small += 1
            continue
        lines.append((row.source, KINDS.get(row.kind, row.kind), *(_percent(s) for s in shares)))
    if small:
        told = [_percent(r if n.u else None) for r, n in zip(rest, body.numbers, strict=True)]
        lines.append((f"{small} smaller sources", "", *told))
    return Table("Budget: share of u², %", ("source", "kind", *ELEMENTS), tuple(lines), words=2)


def _percent(share: float | None) -> str:
    return "" if share is None else number(100.0 * share, 1)


def correlation_table(body: CertifiedBody) -> Table:
    """Correlations of the ten numbers."""
    lines = tuple(
        (name, *("" if c is None else "·" if abs(c) < WEAK else number(c, 2) for c in line))
        for name, line in zip(ELEMENTS, body.correlation, strict=True)
    )
    return Table("Correlations", ("", *ELEMENTS), lines)


def origin_table(certificate: Certificate) -> Table:
    """Which recordings the numbers come from."""
    origin = certificate.provenance
    told = [
        (key, str(origin.get(key) or "not recorded")) for key in ("session", "recorded", "digest", "version")
    ]
    told += [(f"SHA-256 of {name}", str(digest)) for name, digest in dict(origin.get("files") or {}).items()]
    return Table("Origin", ("what", "which"), tuple(told), words=2)


def verdict_sentence(certificate: Certificate) -> str:
    """Whether the model explains the recordings."""
    meaning = {
        "none": "The ideal model explains the recordings to within their noise.",
        "explained": "The model explains the recordings with these findings in it.",
        "unexplained": "The model does not explain the recordings: the numbers rest on a fit with what is "
        "missing taken as random.",
    }
    broken = " The search was interrupted before its end." if certificate.interrupted else ""
    return f"Verdict {certificate.verdict}. {meaning.get(certificate.verdict, '')}{broken}"
