"""``compare.html`` and the page of a fusion: sessions beside each other on one self-contained page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from rig_identification import __version__
from rig_identification.quantity import Z_95, significant, value_and_half_width
from rig_identification.report.line_chart import Curve, Panel, chart_svg, padded_limits
from rig_identification.report.page import page_environment
from rig_identification.report.ten_numbers import UNITS, Element, elements
from rig_identification.result import ELEMENTS
from rig_identification.several.compare import Comparison, Test
from rig_identification.several.fuse import Fused

Array = NDArray[np.float64]

#: ns: stamps before the year 2000 are no date.
_FIRST_DATE = 946_684_800 * 10**9
#: Half the width of the tick at a session's value, as a share of the distance between two sessions.
_TICK = 0.12
#: p below which a test is marked as unlikely though the sessions agree.
UNLIKELY = 0.05


@dataclass(frozen=True)
class SessionRow:
    """One session of the table."""

    number: int
    name: str
    date: str
    rig: str
    verdict: str
    findings: str
    p: str  # of the session against all others


@dataclass(frozen=True)
class NumberRow:
    """One of the ten numbers: what the sessions make of it, and whether they agree."""

    element: Element
    chi_square: str
    freedom: int
    p: str
    grade: str  # class of the style sheet
    gain: str  # best session's std over the fused one
    chart: Markup


def render_comparison(found: Comparison, fused: Fused | None = None) -> str:
    """HTML that loads nothing from anywhere; with ``fused`` the page of the fusion."""
    environment, style = page_environment()
    return environment.get_template("several.html.j2").render(
        style=style,
        version=__version__,
        comparison=found,
        fused=fused,
        together=_told(found.together),
        p=_p(found.p),
        level=f"{100.0 * found.level:g} %",
        named=[f"{name[0]}{name[1:]}" for name in found.disagreeing],
        sessions=_sessions(found),
        rows=_numbers(found, fused),
        unknown=[r.name for r in found.results if r.joint is None],
        vehicle=None if fused is None or fused.without_frame is None else elements(fused.without_frame),
    )


def write_comparison_page(found: Comparison, path: Path) -> None:
    """Write :func:`render_comparison` to a file."""
    path.write_text(render_comparison(found), encoding="utf-8")


def write_fused_page(fused: Fused, path: Path) -> None:
    """Write the page of a fusion to a file."""
    path.write_text(render_comparison(fused.comparison, fused), encoding="utf-8")


def _sessions(found: Comparison) -> list[SessionRow]:
    rows = []
    for k, (result, rig) in enumerate(zip(found.results, found.rigs, strict=True), start=1):
        effects = ", ".join(dict.fromkeys(str(finding.get("effect")) for finding in result.findings))
        against = found.sessions.get(result.name)
        start = 0 if result.joint is None else result.joint.start_ns
        p = "–" if against is None else _p(against.p)
        rows.append(SessionRow(k, result.name, date_of(start), rig, result.verdict, effects or "–", p))
    return rows


def _numbers(found: Comparison, fused: Fused | None) -> list[NumberRow]:
    out = []
    told = None if fused is None else elements(fused.total)
    for k, name in enumerate(ELEMENTS):
        mean = found.mean.get(name)
        if mean is None and told is None:
            continue
        element = _mean_element(k, mean) if told is None else told[k]
        test = found.numbers.get(name)
        gain = "–" if fused is None or name not in fused.gain else significant(fused.gain[name], 3)
        band = mean if fused is None or name in fused.total.unobservable else _of_fused(fused, k)
        grade = "bad" if name in found.disagreeing else "fair" if test and test.p < UNLIKELY else ""
        chi, freedom, p = ("–", 0, "–") if test is None else (*_told(test), _p(test.p))
        out.append(NumberRow(element, chi, freedom, p, grade, gain, Markup(_chart(found, k, band))))
    return out


def _mean_element(k: int, mean: tuple[float, float] | None) -> Element:
    value, half = ("", "") if mean is None else value_and_half_width(*mean)
    return Element(ELEMENTS[k][0], ELEMENTS[k][1:], value, half, UNITS[k], mean is not None)


def _of_fused(fused: Fused, k: int) -> tuple[float, float]:
    return float(fused.total.values[k]), float(np.sqrt(fused.total.covariance[k, k]))


def _chart(found: Comparison, k: int, band: tuple[float, float] | None) -> str:
    """The number in each session with its 95 % interval, over the interval of all of them."""
    curves, ends = [], []
    for x, result in enumerate(found.results, start=1):
        if not result.observed[k]:
            continue
        value = float(result.values[k])
        half = Z_95 * float(np.sqrt(result.estimate.covariance[k, k]))
        ends.append(np.array([value - half, value + half]))
        curves.append(Curve(np.array([x, x], dtype=float), ends[-1], "predicted"))
        curves.append(Curve(np.array([x - _TICK, x + _TICK]), np.array([value, value]), "predicted"))
    if band is not None:
        half = Z_95 * band[1]
        ends.append(np.array([band[0] - half, band[0] + half]))
    if not ends:
        return ""
    bands = () if band is None else ((float(ends[-1][0]), float(ends[-1][1]), "band"),)
    panel = Panel(tuple(curves), 120, padded_limits(*ends), bands, f"{ELEMENTS[k]}, {UNITS[k]}")
    return chart_svg(
        [panel],
        x_limits=(0.5, len(found.results) + 0.5),
        x_label="session",
        title=f"{ELEMENTS[k]} by session",
    )


def _told(test: Test) -> tuple[str, int]:
    return significant(test.chi_square, 3), test.freedom


def _p(p: float) -> str:
    return "below 10⁻¹²" if p < 1e-12 else significant(p, 2)


def date_of(start_ns: int) -> str:
    """Date and time (UTC) of a stamp, or a dash where it tells none."""
    if start_ns < _FIRST_DATE:
        return "–"
    return datetime.fromtimestamp(start_ns / 1e9, tz=timezone.utc).strftime("%Y-%m-%d %H:%M")


def in_time(starts: Sequence[int]) -> list[int]:
    """Order of sessions by their first stamps; as given where one has no date."""
    if any(start < _FIRST_DATE for start in starts):
        return list(range(len(starts)))
    return sorted(range(len(starts)), key=lambda k: starts[k])
