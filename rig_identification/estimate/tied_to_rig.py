"""The tolerance that the inertia about the vertical rests on, told where it is most of its doubt.

A body that is only watched tells of its inertia by a frequency. On alike threads w^2 = m g r R / (h J): the
swing tells J / (r R) and no more, and hinges that sit a centimetre elsewhere make another body of it.
"""

from __future__ import annotations

import numpy as np

from rig_identification.quantity import plain_figure
from rig_identification.result import ELEMENTS, InertialEstimate, UncertaintySource

#: Share of the variance from which one tolerance is told: more than all else together.
MOST = 0.5
#: What each tolerance is called, and what would tell it from the inertia.
WORDS = {
    "tolerance.hinge_position": (
        "where the hinges are",
        "Measure the distances between the hinges more closely",
    ),
    "tolerance.cable_length": (
        "how long the cables are",
        "Measure the cables between their hinges more closely",
    ),
    "tolerance.level": ("the level of the ceiling points", "Level the ceiling points"),
    "tolerance.gyroscope_scale": ("the gyroscope's scale", "Turn the gyroscope by a known angle"),
    "ground scale": ("the mass", "Weigh the body closer"),
}


def tied_note(estimate: InertialEstimate) -> str | None:
    """A sentence on the tolerance that Jzz rests on; None where none is most of its doubt.

    estimate: with the sources of its covariance.
    """
    zz = ELEMENTS.index("Jzz")
    whole = float(estimate.covariance[zz, zz])
    known = [source for source in estimate.sources if source.name in WORDS]
    if "Jzz" in estimate.unobservable or not known or not whole > 0.0:
        return None

    def variance(source: UncertaintySource) -> float:
        return float(source.covariance[zz, zz])

    most = max(known, key=variance)
    share = variance(most) / whole
    if share < MOST:
        return None
    what, advice = WORDS[most.name]
    of_value = np.sqrt(variance(most)) / abs(float(estimate.values[zz]))
    return (
        f"Jzz rests on {what}, as described: within the tolerance it may be "
        f"{plain_figure(196.0 * float(of_value), 2)} % larger or smaller with the same swing, which is "
        f"{plain_figure(100.0 * share, 2)} % of its variance. {advice}, or hang a body of known inertia on "
        "the same rig as well: the ratio of both needs no such number."
    )
