"""Stamps that jitter to either side of the time of measurement, as a busy host's do."""

from __future__ import annotations

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.evenly import measured_evenly
from rig_identification.check.stamps.mended import Mended, names, undone
from rig_identification.check.stamps.regular import evenly_spaced, seconds
from rig_identification.check.stamps.streams import SECOND, Stream
from rig_identification.check.stamps.told import found, owner, quantity, recordings_text
from rig_identification.raw import RawSession

ORDER = 85


def find(session: RawSession) -> tuple[Found, ...]:
    """Streams whose values are those of even times and not of their stamps, put on even times."""
    return undone(session, _mend, _told)


def _mend(stream: Stream) -> Mended | None:
    # A message that overtook another one does not count
    order = np.argsort(stream.stamps, kind="stable")
    times = seconds(stream.stamps[order])
    grid = evenly_spaced(times)
    if grid is None or np.ptp(grid.late) == 0.0:
        return None
    gain = measured_evenly(stream.channel.values[order], grid.late, grid.interval, grid.index)
    stamps = stream.stamps.copy()
    stamps[order] = stream.stamps[order[0]] + np.round(grid.times * SECOND).astype(np.int64)
    facts = {
        "jitter": float(np.std(grid.late)), "most": float(np.max(np.abs(grid.late))),
        "interval": grid.interval, "lost": 1.0 - len(times) / (1.0 + float(grid.index[-1] - grid.index[0])),
    }  # fmt: skip
    return Mended(stream, stamps, gain, facts)


def _told(session: RawSession, devices: frozenset[str], some: list[Mended]) -> Found:
    where = names(some)
    facts = {name: float(np.median([one.facts[name] for one in some])) for name in some[0].facts}
    lost = f" {100.0 * facts['lost']:.2g} % of the samples are missing." if facts["lost"] > 0.0 else ""
    return found(
        session, session, devices, "jitter", where,
        parameters={
            "interval": quantity(facts["interval"], 0.0, "s"),
            "jitter": quantity(facts["jitter"], 0.0, "s"),
            "lost": quantity(facts["lost"], 0.0, "1"),
        },
        statement=f"{owner(session, devices)} stamps jitter by {1e3 * facts['jitter']:.2g} ms to either side"
        f"{recordings_text(session, where)}, up to {1e3 * facts['most']:.2g} ms: the values are those of "
        f"even times, {1e3 * facts['interval']:.4g} ms apart.{lost}",
        advice="Stamp each sample where it is measured, with the device's own clock or counter.",
        gain=sum(one.gain for one in some),
    )  # fmt: skip
