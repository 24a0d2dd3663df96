"""Runs whose numbers contradict their dates: their bags may be exchanged in ``session.yaml``.

Two good runs under each other's names are two good runs, and some rigs number them in another order. So this
is a warning and no fault: nothing is corrected.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

from rig_identification.check.inventory import span_of
from rig_identification.raw import RawRecording, RawSession


def out_of_order(raw: RawSession) -> Iterator[str]:
    """One sentence for each pair of neighbours in number, as ``run_1`` and ``run_2``, in the wrong order."""
    series: dict[str, list[tuple[int, RawRecording]]] = {}
    for recording in raw.recordings:
        if numbered := re.fullmatch(r"(.*?)(\d+)", recording.name):
            series.setdefault(numbered[1], []).append((int(numbered[2]), recording))
    for named in series.values():
        ordered = [recording for _, recording in sorted(named, key=lambda pair: pair[0])]
        for first, second in pairwise(ordered):
            begun, ended = _span(first), _span(second)
            if begun is not None and ended is not None and begun[0] >= ended[1]:
                yield (
                    f"{first.name} was recorded after {second.name}, although its number is lower: the bags "
                    "may be exchanged. Compare session.yaml with the rig's log."
                )


def _span(recording: RawRecording) -> tuple[float, float] | None:
    """First and last stamp of a recording, ns; None where no stamp was set."""
    spans = [s for c in recording.channels if (s := span_of(c.stamp_ns)) is not None]
    return (min(s.first for s in spans), max(s.last for s in spans)) if spans else None
