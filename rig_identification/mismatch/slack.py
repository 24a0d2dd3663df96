"""Cables that go slack: seen in their own tension, and left out of what a taut rig can explain.

A slack cable pulls nothing, which its load cell says by itself. While it hangs loose the body has one
freedom more, and when it comes taut again a shock that depends on more than the rig. The stretches
between are motion of the taut rig, each with a start of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig_identification.estimate.evidence import Run
from rig_identification.result import Finding

#: A cell reads nothing where it reads less than so many std of its noise and tolerance of its zero.
NOTHING = 4.0
#: Share of a cable's usual tension below which such a reading means something.
USUAL = 0.1
#: So many samples of a run must read nothing: one or two are glitches. A cable that snaps rings, and may be
#: loose for no more than a sample at a time.
FEW = 5
#: Spells (s) closer to each other than this are one.
JOINED = 0.2
#: What is cut off on either side of a spell, and the shortest stretch worth keeping, s.
MARGIN = 0.25
SHORTEST = 1.0


@dataclass(frozen=True)
class Spell:
    """One cable without tension."""

    cable: str
    recording: str
    start: float  # s after the recording's start
    end: float  # s


def slack_spells(run: Run, zero: float) -> list[Spell]:
    """Spells in which a cable of ``run`` carries nothing. zero: tolerance of a cell's zero, N."""
    out: list[Spell] = []
    for c in run.channels:
        if c.quantity != "tension":
            continue
        tension = c.values[:, 0]
        limit = NOTHING * float(np.hypot(c.noise[0], zero))
        if limit > USUAL * float(np.median(tension)):
            continue
        loose = np.flatnonzero(tension < limit)
        if loose.size < FEW:
            continue
        time = c.time[loose]
        for part in np.split(time, np.flatnonzero(np.diff(time) > JOINED) + 1):
            start, end = run.offset + float(part[0]), run.offset + float(part[-1])
            out.append(Spell(c.device, run.recording.name, start, end))
    return out


def taut_stretches(run: Run, spells: list[Spell]) -> list[Run]:
    """A run's stretches in which every cable pulls."""
    step, last = run.grid.step, run.grid.nodes - 1
    taut = np.ones(run.grid.nodes, dtype=bool)
    for s in spells:
        if s.recording == run.recording.name:
            a = int((s.start - MARGIN - run.offset) / step)
            b = int(np.ceil((s.end + MARGIN - run.offset) / step))
            taut[max(a, 0) : min(b, last) + 1] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[False], taut, [False]]).astype(int)))
    return [
        run.between(int(a), int(b) - 1)
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        if (b - 1 - a) * step > SHORTEST
    ]


def slack_finding(spells: list[Spell]) -> Finding:
    """The spells as one finding of the recording contract, without evidence."""
    cables = {s.cable: sum(t.end - t.start for t in spells if t.cable == s.cable) for s in spells}
    worst = max(cables, key=lambda name: cables[name])
    times = [{"recording": s.recording, "start": round(s.start, 3), "end": round(s.end, 3)} for s in spells]
    text = (
        f"{' and '.join(sorted(cables))} went slack {len(spells)} times; these moments are left out of the "
        "fit. Shake more gently or hang the rig so that every cable carries more."
    )
    return Finding("cable_slack", {"channel": worst, "axis": None, "times": times}, {}, {}, text)
