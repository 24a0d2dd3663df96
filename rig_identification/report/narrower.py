"""What would narrow the intervals, and by how much: from the sources that the covariance is made of.

The covariance is a sum over sources (estimate/sources.py), each times the gain with which the fit took it in.
With a source known exactly and the same gains its own term is gone; a fit to what is known then does no
worse. A run as long again halves what the noise of the channels adds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig_identification.quantity import Z_95, significant, unit_text
from rig_identification.report.findings import AlternativeView, alternative_views
from rig_identification.report.ten_numbers import UNITS
from rig_identification.report.words import words
from rig_identification.result import ELEMENTS, Identification, InertialEstimate, natural_size

#: Steps that are shown, and the least that one takes off the interval to be shown.
MOST, LEAST = 4, 0.03
#: Kinds of sources that another run averages down.
AVERAGED = ("noise", "rest")
FIRST_OF_INERTIA = 4


@dataclass(frozen=True)
class Narrower:
    """One thing to do, and what it does to the number that is known least."""

    what: str
    gain: str  # "Jzz ± 1.3 to ± 1.0 kg m²"
    share: float  # by which the interval gets narrower


def narrower(identification: Identification) -> list[Narrower]:
    """Steps that narrow the interval of the least known element of the inertia, largest gain first.

    None where the sources of the covariance are not told, or nothing is determined. Without any moment of
    inertia the least known of the other elements is asked.
    """
    total = identification.total
    element = _least_known(total)
    if element is None or not total.sources:
        return []
    variance = float(total.covariance[element, element])
    found = []
    for what, taken in _steps(identification, element):
        share = 1.0 - float(np.sqrt(max(1.0 - taken / variance, 0.0)))
        if share >= LEAST:
            found.append(Narrower(what, _told(element, variance, share), share))
    return sorted(found, key=lambda step: -step.share)[:MOST]


def _least_known(total: InertialEstimate) -> int | None:
    seen = [i for i, name in enumerate(ELEMENTS) if name not in total.unobservable]
    asked = [i for i in seen if i >= FIRST_OF_INERTIA] or seen
    variances = np.diag(total.covariance)
    if not asked or not np.all(np.isfinite(variances[asked])) or not np.all(variances[asked] > 0.0):
        return None
    relative = np.sqrt(variances[asked]) / np.abs(natural_size(total.values)[asked])
    return asked[int(np.argmax(relative))]


def _steps(identification: Identification, element: int) -> Iterator[tuple[str, float]]:
    """What to do, and the variance that it takes away."""
    noise = decide = 0.0
    for source in identification.total.sources:
        taken = float(source.covariance[element, element])
        if source.kind in AVERAGED:
            noise += taken
        elif source.kind == "model":
            decide += taken
        elif source.kind == "tolerance":
            yield f"Measure the {words(source.name.removeprefix('tolerance.'))} more closely.", taken
        elif source.kind == "scale":
            yield "Weigh the body more closely.", taken
    yield "Record as long again, with the runs that plan --after result.json chooses.", 0.5 * noise
    rivals = [view for view in alternative_views(identification.mismatch) if view.experiment]
    if rivals:
        names = ", ".join(dict.fromkeys(_called(view) for view in rivals))
        yield f"Decide on what these recordings leave open: {names}.", decide


def _called(view: AlternativeView) -> str:
    """An effect by name; what the contract has no word for, by its law."""
    return view.effect if view.effect != "unknown" else view.where or view.effect


def _told(element: int, variance: float, share: float) -> str:
    half = Z_95 * float(np.sqrt(variance))
    after = significant((1.0 - share) * half, 2)
    return f"{ELEMENTS[element]} ± {significant(half, 2)} to ± {after} {unit_text(UNITS[element])}"
