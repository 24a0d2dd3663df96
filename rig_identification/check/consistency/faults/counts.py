"""Cells that read in no unit of force: a converter's counts or millivolts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.faults.unit import scaled
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.rest_model import Loosened
from rig_identification.examination import SetupFault

#: A cell whose scale is off by more than this factor has no calibration at all.
FAR = 2.0
#: Scales and zeros of their own are told from calibrated ones where their mean square is beyond so many of
#: their variances.
CLEAR = 3.0


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """All cells, and each by itself: in proportion to the force, or with a scale and a zero of its own.

    The calibration that is missing would have taken the tare off. Such counts may chance to lie near newtons.
    """
    cells = evidence.cells
    rest = evidence.without(cells).rest
    if rest is None:
        return
    readings = {
        c.name: v
        for c in evidence.session.rig.cables
        if (v := evidence.session.at_rest[0].values.get(c.name)) is not None
    }
    wanted = {c: float(rest.expected[0][c][0]) for c in readings}
    for chosen in [tuple(readings), *((c,) for c in readings)]:
        have = sum(float(readings[c][0, 0]) for c in chosen)
        factor = sum(wanted[c] for c in chosen) / have if have else 0.0
        if factor > 0.0 and abs(np.log(factor)) > np.log(FAR):
            yield _counted(chosen, factor, cells)
        if factor > 0.0:
            yield _counted(chosen, factor, cells, Loosened(zeros=chosen, gains=chosen))


def _counted(
    chosen: tuple[str, ...], factor: float, about: frozenset[str], own: Loosened | None = None
) -> Hypothesis:
    """own: what each cell has for itself; None: one factor holds for all.

    Scales and zeros of their own take up whatever else is wrong at rest: cables that stretch let a body hang
    lower. Where they come out as a calibrated cell has them they are no counts.
    """
    uncalibrated = abs(np.log(factor)) > np.log(FAR)

    def confirmed(rest: RestFit) -> bool:
        if uncalibrated:
            return True
        off = np.concatenate([v / std for v, std in (rest.value("gain"), rest.value("zero"))])
        return bool(np.sum(off**2) > CLEAR * 2 * len(chosen))

    def describe(rest: RestFit | None) -> SetupFault:
        who = "The load cells read" if len(chosen) > 1 else f"The cell of {chosen[0]} reads"
        return fault(
            "unit",
            {
                "channel": list(chosen) if len(chosen) > 1 else chosen[0],
                "quantity": "tension",
                "unit": "counts",
            },
            {"factor": (factor, 0.01 * factor, "N per count")},
            f"{who} in no unit of force, perhaps raw counts: one of them is about {factor:.4g} N.",
            "Calibrate in the driver: publish N. Until then it is left out: nothing tells a cell's scale and "
            "zero well enough.",
            corrected=False,
        )

    change = Change({c: scaled(slice(None), factor) for c in chosen})
    out = Change(left_out=chosen)
    return Hypothesis(
        change, describe, about, variants=len(about) + 1, loosened=own or Loosened(),
        free=1 if own is None else 2 * len(chosen), fitted=lambda rest: out, confirmed=confirmed,
    )  # fmt: skip
