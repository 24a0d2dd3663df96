"""What stands in for physics that acts once, or that no entry of the catalogue explains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import AXES
from rig_identification.mismatch.findings import pushed, written
from rig_identification.mismatch.latent import MissingWrench, line_of_action, strongest_push
from rig_identification.mismatch.law import law_of
from rig_identification.mismatch.locate import DRIVE
from rig_identification.mismatch.riders import middle_of
from rig_identification.quantity import plain_figure
from rig_identification.result import Finding
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Relative uncertainty of a push's peak: it is an average over a tenth of a second.
SMEARED = 0.02
#: Share of the missing moment that a force at one point has to have for that point to be told.
ONE_FORCE = 0.95


def push_finding(missing: MissingWrench, rig: Rig, start: float, end: float) -> Finding:
    """The strongest course of a missing wrench from ``start`` to ``end`` (s) as a force, without evidence."""
    push = strongest_push(missing, middle_of(rig), start, end)
    stds = np.full(3, np.hypot(push.std, SMEARED * push.size))
    return pushed(missing.recording, push.start, push.end, push.peak, stds, push.point)


def missing_finding(missing: MissingWrench, rig: Rig, device: str | None) -> Finding:
    """Where, when and how strong whatever is left is, and the wrench over time that stands in its place.

    device: without which everything else agrees, if there is one.
    """
    middle = middle_of(rig)
    push = strongest_push(missing, middle)
    world = np.einsum("nij,nj->ni", missing.R_world_body, missing.wrench[:, :3])
    strength = np.sqrt(np.mean((world - np.mean(world, axis=0)) ** 2, axis=0))
    about = missing.wrench[:, 3:] - np.cross(middle, missing.wrench[:, :3])
    moment = np.sqrt(np.mean((about - np.mean(about, axis=0)) ** 2, axis=0))
    axis = AXES[int(np.argmax(strength))]
    law = law_of(missing)
    # A force at the exciter that nobody measured may be anything that acts on the body
    driven = device == DRIVE
    device = None if driven else device
    where: dict[str, object] = {"channel": device, "axis": axis}
    where["times"] = [
        {
            "recording": missing.recording,
            "start": round(float(missing.time[0]), 3),
            "end": round(float(missing.time[-1]), 3),
        }
    ]
    line = line_of_action(missing, middle)
    one = line.share > ONE_FORCE
    where["position"] = [float(v) for v in (line.point if one else push.point)]
    if device is not None:
        text = f"Everything but {device} agrees: it is wrong in a way that no entry of the catalogue has."
    else:
        force, turning_moment = (plain_figure(float(np.max(v))) for v in (strength, moment))
        text = (
            f"Something acts on the body that no entry of the catalogue has: about {force} N "
            f"(root mean square), mostly along {axis}, and {turning_moment} N m; strongest at "
            f"{0.5 * (push.start + push.end):.1f} s of {missing.recording}."
        )
        if one:
            place = ", ".join(f"{v:.3f}" for v in line.point)
            text += f" It acts as one force does at ({place}) m of the body."
        text += f" Over time {law.words}." if law is not None else " It follows no simple law of the motion."
        if driven:
            text += " A force at the exciter beyond the measured one would account for it as well."
    std = float(push.std) if np.isfinite(push.std) else float(np.max(strength))
    turning = float(np.std(about[:, int(np.argmax(moment))]) / np.sqrt(max(1, about.shape[0])))
    told = {
        "force": (float(np.max(strength)), std, "N"),
        "moment": (float(np.max(moment)), turning, "N*m"),
        "peak_force": (push.size, std, "N"),
    }
    return Finding("unknown", where, written(told), {}, text)
