"""A rig of alike threads about one vertical line, as people hang a body to time its turning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig_identification.rig import Rig

#: Share of a thread's length by which all may differ, and hinges lie beside, and still be threads alike.
ALIKE = 0.02
#: Share of a thread's length by which it may lean.
LEAN = 0.5


@dataclass(frozen=True)
class AlikeThreads:
    """What the turning of such a rig depends on."""

    count: int
    product: float  # m2, mean of R_i r_i: distances of the ceiling's and the body's hinges from their middles
    height: float  # m, between the hinges at rest
    product_share: float  # std of the product, relative
    height_share: float  # std of the height, relative
    hinge: float  # m, std of where each hinge is, that product_share comes from


def alike_threads(rig: Rig) -> AlikeThreads | None:
    """The rig as alike threads about a vertical line; None where it is something else."""
    ceiling = np.array([c.ceiling_point for c in rig.cables])
    body = np.array([c.body_point for c in rig.cables])
    length = np.array([c.length for c in rig.cables])
    above, below = ceiling - np.mean(ceiling, axis=0), body - np.mean(body, axis=0)
    mean = float(np.mean(length))
    level = max(float(np.ptp(ceiling[:, 2])), float(np.ptp(body[:, 2])), float(np.ptp(length)))
    R, r = np.hypot(*above[:, :2].T), np.hypot(*below[:, :2].T)
    if level > ALIKE * mean or min(float(np.min(R)), float(np.min(r))) < ALIKE * mean:
        return None
    twisted = np.abs(above[:, 0] * below[:, 1] - above[:, 1] * below[:, 0])
    opposed = np.sum(above[:, :2] * below[:, :2], axis=1) <= 0.0
    lean = float(np.mean(np.abs(R - r)))
    uneven = np.ptp(R * r) > ALIKE * np.max(R * r) or np.max(twisted) > ALIKE * np.min(R * r)
    if uneven or np.any(opposed) or lean > LEAN * mean:
        return None
    n, product, height = len(rig.cables), float(np.mean(R * r)), float(np.sqrt(mean**2 - lean**2))
    hinge, long = rig.tolerance["hinge_position"], rig.tolerance["cable_length"]
    ends = hinge * np.sqrt(1.0 / np.mean(R) ** 2 + 1.0 / np.mean(r) ** 2)
    return AlikeThreads(
        n, product, height, float(ends / np.sqrt(n)), float(long / np.sqrt(n) / height), hinge
    )
