"""What the rerun comes to, in a few sentences at the head of its page."""

from __future__ import annotations

import numpy as np

from rig_identification.model.modes import Mode
from rig_identification.thesis_report.table import worst_of_guesses
from rig_identification.thesis_rerun import (
    GIVEN_BACK,
    CaseResult,
    Rerun,
    points_apart,
    signed_error,
    worst_percent,
)

#: The case whose published errors the thesis' predictor gives back and the gyroscopic term explains.
EXPLAINED = 14


def summary(found: Rerun) -> tuple[str, ...]:
    """The sentences; none for what was not run."""
    told = []
    if found.statics is not None:
        s = found.statics
        told.append(
            f"Table 2.1 comes back to {1e3 * s.worst:.0e} mm without noise (thesis: "
            f"{1e3 * np.max(np.abs(s.published - s.actual)):.1f} mm)."
        )
    told += [_explained(result) for result in found.cases if result.case.number == EXPLAINED]
    told += _misses(found)
    if found.cases:
        worst = max(worst_of_guesses(result) for result in found.cases)
        told.append(
            f"(d) finds every element within {worst:.1g} percent from the thesis' own first guesses and from "
            "ones wrong by a factor of five either way."
        )
    for result in found.cases:
        if result.unknown_force is not None:
            off = worst_percent(result.case, result.unknown_force.inertia)
            told.append(
                f"Case {result.case.label}'s exciter is not measured: estimated with its time history, it "
                f"leaves every element within {off:.1g} percent."
            )
    if found.examination is not None:
        told.append(found.examination.statement)
    return tuple(told)


def _explained(result: CaseResult) -> str:
    case, tensors = result.case, result.comparison.tensors
    apart = points_apart(case, result.comparison)
    before, after = (float(np.max(np.abs(np.diag(signed_error(case, tensors[key]))))) for key in "ab")
    return (
        f"The thesis' predictor gives case {case.label}'s published diagonal errors back within {apart:.2f} "
        f"percentage points; the gyroscopic term that it lacks brings the largest from {before:.1f} to "
        f"{after:.1f} percent."
    )


def _misses(found: Rerun) -> list[str]:
    apart = {r.case.label: points_apart(r.case, r.comparison) for r in found.cases}
    off = {label: points for label, points in apart.items() if points is not None and points > GIVEN_BACK}
    if not off:
        return []
    listed = ", ".join(f"{label} ({points:.2g})" for label, points in sorted(off.items(), key=lambda i: i[1]))
    return [
        f"Published diagonals that (a) does not give back, with the percentage points between: {listed}. "
        "What was tried stands with each case."
    ]


def grouped_modes(cases: tuple[CaseResult, ...]) -> list[tuple[str, tuple[Mode, ...]]]:
    """(labels of the cases that swing alike, their modes)."""
    groups: dict[tuple[tuple[float, str], ...], tuple[list[str], tuple[Mode, ...]]] = {}
    for result in cases:
        key = tuple((round(mode.frequency, 3), mode.shape) for mode in result.modes)
        groups.setdefault(key, ([], result.modes))[0].append(result.case.label)
    return [(", ".join(labels), modes) for labels, modes in groups.values()]
