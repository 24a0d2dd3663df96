"""The ten numbers for a terminal."""

from __future__ import annotations

from rig_identification.report.quantity import NOT_DETERMINED
from rig_identification.report.ten_numbers import elements
from rig_identification.result import Identification, InertialEstimate


def summary(identification: Identification) -> str:
    """Table of the ten numbers with the half-widths of their 95 % intervals, and the verdict."""
    if identification.without_frame is None:
        tables = [_table("95 % intervals", identification.total)]
    else:
        tables = [
            _table("with the carrying frame, 95 % intervals", identification.total),
            _table("without the carrying frame, 95 % intervals", identification.without_frame),
        ]
    mismatch = identification.mismatch
    verdict = f"verdict: {mismatch.verdict}. {mismatch.explanation}"
    return "\n\n".join([*tables, verdict])


def _table(title: str, estimate: InertialEstimate) -> str:
    ten = elements(estimate)
    texts = [(e.symbol + e.index, _plain(e.value), _plain(e.half_width), e.unit) for e in ten]
    width = max((len(value) for _, value, _, _ in texts), default=0)
    doubt = max((len(half) for _, _, half, _ in texts), default=0)
    lines = [title]
    for element, (name, value, half, unit) in zip(ten, texts, strict=True):
        known = f"{value:>{width}} ± {half:<{doubt}} {unit}"
        lines.append(f"  {name:<4}{known if element.observable else NOT_DETERMINED}")
    return "\n".join(lines)


def _plain(number: str) -> str:
    """Digits that can be pasted into a calculation."""
    return number.replace("\u202f", "").replace("−", "-")
