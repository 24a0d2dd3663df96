"""Sensors at the end of their range: what they read there is left out, and said.

No physics of the rig explains such samples and none has to: they are the sensor's limit, exactly, many times
in a row (cleaning/clipping.py). The contract's table has no word for that, so the finding is ``unknown``
with its device, quantity, axis, times and limit.
"""

from __future__ import annotations

from rig_identification.mismatch.findings import NO_EVIDENCE, with_mended, written
from rig_identification.recording import Overrange, Recording, Session
from rig_identification.result import Finding, Mismatch


def overrange_findings(session: Session) -> tuple[Finding, ...]:
    """One finding for every component of a device's readings that is clipped in any recording."""
    seen: dict[tuple[str, str, str | None], list[tuple[Recording, Overrange]]] = {}
    for recording in session.recordings:
        for quality in recording.quality:
            for end in quality.overranges:
                seen.setdefault((end.device, end.quantity, end.axis), []).append((recording, end))
    return tuple(_finding(ends) for ends in seen.values())


def _finding(ends: list[tuple[Recording, Overrange]]) -> Finding:
    first = ends[0][1]
    limits = sorted({end.limit for _, end in ends})
    both = limits[0] < 0.0 < limits[-1]
    limit = min(limits, key=abs)
    spans: dict[str, tuple[float, float]] = {}
    for recording, end in ends:
        begun, over = spans.get(recording.name, (end.start, end.end))
        spans[recording.name] = (min(begun, end.start), max(over, end.end))
    times = [
        {"recording": name, "start": round(begun, 3), "end": round(over, 3)}
        for name, (begun, over) in spans.items()
    ]
    where: dict[str, object] = {
        "channel": first.device,
        "axis": first.axis,
        "quantity": first.quantity,
        "times": times,
    }
    what = first.quantity.replace("_", " ") + (f" along {first.axis}" if first.axis else "")
    stops = " and ".join(f"{value:.6g}" for value in limits)
    count = sum(end.samples for _, end in ends)
    text = (
        f"{first.device} stops at the end of its range: {count} samples of {what} lie exactly at {stops} "
        f"{first.unit}. All that noise may have brought there is left out of the fit. Set a larger range or "
        "shake more gently."
    )
    told = {"limit": (abs(limit) if both else limit, 0.0, first.unit)}
    return Finding("unknown", where, written(told), NO_EVIDENCE, text)


def with_overranges(mismatch: Mismatch, session: Session) -> Mismatch:
    """The mismatch with what is to be said of sensors at the end of their range."""
    so = "what sensors read at the end of their range left out"
    return with_mended(mismatch, overrange_findings(session), so)
