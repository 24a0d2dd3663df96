"""The ten numbers for a terminal."""

from __future__ import annotations

from rig_identification.cli.checked import setup_lines
from rig_identification.cli.plain_numbers import plain_number
from rig_identification.quantity import NOT_DETERMINED
from rig_identification.report.ten_numbers import elements
from rig_identification.result import Identification, InertialEstimate


def summary(identification: Identification) -> str:
    """What is wrong with the set-up, the ten numbers with half-widths of 95 % intervals, and the verdict.

    Below the numbers stands on which number of the description one of them rests, where it does.
    """
    if identification.without_frame is None:
        tables = [table("95 % intervals", identification.total)]
    else:
        tables = [
            table("with the carrying frame, 95 % intervals", identification.total),
            table("without the carrying frame, 95 % intervals", identification.without_frame),
        ]
    mismatch = identification.mismatch
    verdict = f"verdict: {mismatch.verdict}. {mismatch.explanation}"
    examination = identification.examination
    set_up = [] if examination is None else ["\n".join(setup_lines(examination))]
    return "\n\n".join(filter(None, [*set_up, *tables, identification.tie, verdict]))


def table(title: str, estimate: InertialEstimate) -> str:
    """The ten numbers with half-widths of 95 % intervals."""
    ten = elements(estimate)
    texts = [(e.symbol + e.index, plain_number(e.value), plain_number(e.half_width), e.unit) for e in ten]
    width = max((len(value) for _, value, _, _ in texts), default=0)
    doubt = max((len(half) for _, _, half, _ in texts), default=0)
    lines = [title]
    for element, (name, value, half, unit) in zip(ten, texts, strict=True):
        known = f"{value:>{width}} ± {half:<{doubt}} {unit}"
        lines.append(f"  {name:<4}{known if element.observable else NOT_DETERMINED}")
    return "\n".join(lines)
