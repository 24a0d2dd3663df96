"""The one table: published errors beside those of (a) to (d), and the standard deviation of (d)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.thesis_rerun import (
    GIVEN_BACK,
    CaseResult,
    Rerun,
    points_apart,
    signed_error,
    worst_percent,
)

Array = NDArray[np.float64]

ELEMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
_AT = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))

NAMES = {
    "published": "thesis, published",
    "a": "(a) thesis' predictor",
    "b": "(b) with gyroscopic term",
    "c": "(c) momentum regression",
    "d": "(d) output error",
    "force": "(d) with unknown force",
    "sigma": "σ of (d), real sensors",
}


@dataclass(frozen=True)
class Row:
    """Six errors of one estimator on one case: percent, or kg m^2 where the true element is zero."""

    key: str  # of NAMES
    values: tuple[float, ...]  # in the order of ELEMENTS; empty: there are none
    note: str = ""

    @property
    def name(self) -> str:
        """What the row is."""
        return NAMES[self.key]


def absolute_elements(result: CaseResult) -> tuple[bool, ...]:
    """Elements whose error is in kg m^2, because the true one is zero."""
    return tuple(bool(result.case.inertia[i, j] == 0.0) for i, j in _AT)


def case_rows(result: CaseResult) -> tuple[Row, ...]:
    """Every row of one case."""
    case, tensors = result.case, result.comparison.tensors
    published = case.published
    rows = [
        Row("published", () if published is None else _six(published.error), _why_none(result)),
        Row("a", _six(signed_error(case, tensors["a"])), _why_apart(result)),
        *(Row(key, _six(signed_error(case, tensors[key]))) for key in "bc"),
        Row("d", _six(signed_error(case, tensors["d"])), _from_where(result)),
    ]
    if result.unknown_force is not None:
        unknown = result.unknown_force
        text = f"force to {unknown.force_rms:.1f} N rms"
        rows.append(Row("force", _six(signed_error(case, unknown.inertia)), text))
    if result.realistic is not None:
        spread = result.realistic.std
        percent = np.where(
            case.inertia == 0.0, spread, 100.0 * spread / np.where(case.inertia == 0.0, 1.0, case.inertia)
        )
        rows.append(Row("sigma", _six(percent), f"{result.realistic.seconds:.0f} s of motion"))
    return tuple(rows)


def _why_none(result: CaseResult) -> str:
    if result.case.published is not None:
        return ""
    return {
        5: "figures only, no numbers",
        6: "not identified in the thesis",
        7: "not identified in the thesis",
    }.get(result.case.number, "none printed")


def _why_apart(result: CaseResult) -> str:
    """How far (a) is from what the thesis publishes of it."""
    apart = points_apart(result.case, result.comparison)
    if apart is None:
        return ""
    if apart <= GIVEN_BACK:
        return f"given back within {apart:.2f} points"
    return f"{apart:.2g} points off, see the case"


def _from_where(result: CaseResult) -> str:
    """From which guesses (d) came where."""
    comparison = result.comparison
    fits = {1.0: comparison.output_error, **comparison.far_off}
    lost = [f"{factor:g}" for factor, fit in fits.items() if not fit.converged]
    if lost:
        return f"did not converge from guess × {', '.join(lost)}"
    times = ", ".join(f"{factor:g}" for factor in sorted(fits))
    return f"{worst_of_guesses(result):.1g} % at most, guess × {times}"


def worst_of_guesses(result: CaseResult) -> float:
    """Largest error of (d), percent, from any of the first guesses."""
    fits = (result.comparison.output_error, *result.comparison.far_off.values())
    return max(worst_percent(result.case, fit.inertia) for fit in fits)


def _six(matrix: Array) -> tuple[float, ...]:
    return tuple(float(matrix[i, j]) for i, j in _AT)


def number(value: float) -> str:
    """Absolute value with digits that an error needs."""
    size = abs(value)
    if size >= 100.0:
        return f"{size:.0f}"
    if size >= 0.095:
        return f"{size:.2f}"
    return f"{size:.4f}" if size >= 0.00005 else "0.0000"


def text_table(found: Rerun) -> str:
    """The table in Markdown, for a terminal and for the README."""
    lines = [
        "| case | estimator | " + " | ".join(f"J{name}" for name in ELEMENTS) + " |",
        "| --- | --- |" + " ---: |" * len(ELEMENTS),
    ]
    for result in found.cases:
        absolute = absolute_elements(result)
        for k, row in enumerate(case_rows(result)):
            cells = [number(v) + (" kg m²" if a else "") for v, a in zip(row.values, absolute, strict=False)]
            cells = cells or [row.note] + [""] * (len(ELEMENTS) - 1)
            lines.append(
                f"| {result.case.label if k == 0 else ''} | {row.name} | " + " | ".join(cells) + " |"
            )
    return "\n".join(lines)
