"""Stamps taken when a driver hands over several samples at once, with the samples measured evenly before."""

from __future__ import annotations

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.lateness import late
from rig_identification.check.stamps.mended import Mended, names, undone
from rig_identification.check.stamps.streams import Stream
from rig_identification.check.stamps.told import found, owner, quantity, recordings_text
from rig_identification.raw import RawSession

ORDER = 70


def find(session: RawSession) -> tuple[Found, ...]:
    """Streams stamped at hand-overs, in bursts or by a quick poll, put on the regular grid under them."""
    tolerance = session.rig.tolerance["clock"]

    def mend(stream: Stream) -> Mended | None:
        seen = late(stream, tolerance)
        if seen is None or not seen.polled:
            return None
        facts = {
            "together": seen.together, "steps": len(seen.stamps) - 1, "handover": seen.handover,
            "interval": seen.grid.interval, "stall": float(np.max(seen.grid.late)), "std": seen.std,
        }  # fmt: skip
        return Mended(stream, seen.stamps, seen.gain, facts)

    return undone(session, mend, _told)


def _told(session: RawSession, devices: frozenset[str], some: list[Mended]) -> Found:
    where = names(some)
    facts = {name: [one.facts[name] for one in some] for name in some[0].facts}
    together, steps = int(sum(facts["together"])), int(sum(facts["steps"]))
    handover = float(np.median(facts["handover"]))
    close = f"{together:,} of {steps:,} intervals are shorter than a tenth of the sampling interval, and "
    return found(
        session, session, devices, "usb_bursts", where,
        parameters={
            "interval": quantity(float(np.median(facts["interval"])), 0.0, "s"),
            "handover": quantity(handover, 0.0, "s"),
            "longest": quantity(max(facts["stall"]), 0.0, "s"),
            "delay": quantity(0.0, max(facts["std"]), "s"),
        },
        statement=f"{owner(session, devices)} stamps are taken when a driver hands samples over, every "
        f"{1e3 * handover:.3g} ms{recordings_text(session, where)}: {close if together else ''}"
        f"samples wait for up to {1e3 * max(facts['stall']):.3g} ms.",
        advice="Stamp each sample in the driver when the device measures it, or let the device's own counter "
        "stamp it; on a serial adapter set the latency timer to 1 ms.",
        gain=sum(one.gain for one in some),
    )  # fmt: skip
