"""Stamps of arrival at the host in place of measurement: late by a latency that varies, never early."""

from __future__ import annotations

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.lateness import late
from rig_identification.check.stamps.mended import Mended, names, undone
from rig_identification.check.stamps.streams import Stream
from rig_identification.check.stamps.told import found, owner, quantity, recordings_text
from rig_identification.raw import RawSession

ORDER = 80


def find(session: RawSession) -> tuple[Found, ...]:
    """Streams stamped on arrival, put on the regular grid of the measurements that arrived soonest."""
    tolerance = session.rig.tolerance["clock"]

    def mend(stream: Stream) -> Mended | None:
        seen = late(stream, tolerance)
        if seen is None:
            return None
        spread = float(np.std(seen.grid.late))
        if spread < tolerance:
            return None
        facts = {
            "spread": spread, "mean": float(np.mean(seen.grid.late)), "interval": seen.grid.interval,
            "late": float(np.quantile(seen.grid.late, 0.99)), "std": seen.std,
        }  # fmt: skip
        return Mended(stream, seen.stamps, seen.gain, facts)

    return undone(session, mend, _told)


def _told(session: RawSession, devices: frozenset[str], some: list[Mended]) -> Found:
    where = names(some)
    facts = {name: float(np.median([one.facts[name] for one in some])) for name in some[0].facts}
    return found(
        session, session, devices, "arrival_time", where,
        parameters={
            "interval": quantity(facts["interval"], 0.0, "s"),
            "latency": quantity(facts["mean"], facts["std"], "s"),
            "jitter": quantity(facts["spread"], 0.0, "s"),
            "delay": quantity(0.0, facts["std"], "s"),
        },
        statement=f"{owner(session, devices)} stamps are times of arrival, not of measurement"
        f"{recordings_text(session, where)}: they are late by {1e3 * facts['mean']:.2g} ms in the mean and "
        f"by {1e3 * facts['late']:.2g} ms once in a hundred samples, and never early.",
        advice="Stamp each sample where it is measured, with the device's own clock or counter.",
        gain=sum(one.gain for one in some),
    )  # fmt: skip
