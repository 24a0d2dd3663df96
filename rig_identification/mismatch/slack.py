"""Cables that go slack: seen in their own tension, and left out of what a taut rig can explain.

A slack cable pulls nothing, which its load cell says by itself. While it hangs loose the body has one
freedom more, and when it comes taut again a shock that depends on more than the rig. The stretches
between are motion of the taut rig, each with a start of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run, heard_apart
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import Ideal, fit_again, judged, near_noise
from rig_identification.estimate.rest_evidence import RestEvidence
from rig_identification.estimate.rods import FEW, pushes, reads_nothing
from rig_identification.estimate.solve import excess
from rig_identification.estimate.verdict import hear
from rig_identification.mismatch.explained import Explained, evidence_of, held_out_errors, only_a_trace
from rig_identification.result import Finding, Mismatch

Notify = Callable[[str, float], None]

#: Share of a cable's usual tension below which such a reading means something.
USUAL = 0.1
#: Spells (s) closer to each other than this are one.
JOINED = 0.2
#: Share of the slackest cable's time below which another one rings rather than hangs loose.
RINGING = 0.2
#: Second differences of a tension beyond so many of their std are a shock: a cable that came taut again
#: between two samples shows in no other way, and no motion of the body on its cables is as sudden.
SHOCK = 8.0
#: Mean square of whitened residuals between the spells up to which what is left there is a trace.
SETTLED = 1.3
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
    """Spells in which a cable of ``run`` carries nothing. zero: tolerance of a cell's zero, N.

    What pushes is a rod, and never slack.
    """
    out: list[Spell] = []
    for c in run.channels:
        if c.quantity != "tension":
            continue
        tension = c.values[:, 0]
        limit = reads_nothing(c, zero)
        # The mean carries the weight however long the cable hangs loose; the median does not
        if limit > USUAL * float(np.mean(tension)) or pushes(c, zero):
            continue
        loose = np.flatnonzero(tension < limit)
        if loose.size < FEW:
            continue
        out += _spells_at(run, c.device, c.time[loose])
    return out


def _spells_at(run: Run, cable: str, time: NDArray[np.float64]) -> list[Spell]:
    """Spells that hold the instants ``time`` (k,) of a run, s; none where there are no instants."""
    parts = np.split(time, np.flatnonzero(np.diff(time) > JOINED) + 1)
    return [
        Spell(cable, run.recording.name, run.offset + float(part[0]), run.offset + float(part[-1]))
        for part in parts
        if part.size
    ]


def shocks(run: Run) -> list[Spell]:
    """Moments in which a tension of ``run`` jumps or rings as no swinging body makes it."""
    out: list[Spell] = []
    for c in run.channels:
        if c.quantity != "tension" or c.time.size < FEW:
            continue
        bend = np.diff(c.values[:, 0], 2)
        usual = max(np.sqrt(6.0) * float(c.noise[0]), 1.4826 * float(np.median(np.abs(bend))))
        out += _spells_at(run, c.device, c.time[1:-1][np.abs(bend) > SHOCK * usual])
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


def _merged(spells: list[Spell]) -> list[tuple[str, float, float]]:
    """(recording, start, end) in which any cable carries nothing, in order."""
    out: list[tuple[str, float, float]] = []
    for s in sorted(spells, key=lambda s: (s.recording, s.start)):
        if out and out[-1][0] == s.recording and s.start <= out[-1][2] + JOINED:
            out[-1] = (s.recording, out[-1][1], max(out[-1][2], s.end))
        else:
            out.append((s.recording, s.start, s.end))
    return out


def slack_finding(spells: list[Spell]) -> Finding:
    """The spells as one finding of the recording contract, without evidence."""
    cables = {s.cable: sum(t.end - t.start for t in spells if t.cable == s.cable) for s in spells}
    worst = max(cables, key=lambda name: cables[name])
    # A snap makes the other cables ring through nothing for a moment: that is no slack of their own
    own = [s for s in spells if cables[s.cable] >= RINGING * cables[worst] and s.end > s.start] or spells
    times = [
        {"recording": recording, "start": round(start, 3), "end": round(end, 3)}
        for recording, start, end in _merged(own)
    ]
    names = " and ".join(sorted({s.cable for s in own}))
    text = (
        f"{names} went slack {len(times)} times; these moments are left out "
        "of the fit. Shake more gently or hang the rig so that every cable carries more."
    )
    return Finding("cable_slack", {"channel": worst, "axis": None, "times": times}, {}, {}, text)


def spells_of(fitted: Fitted) -> list[Spell]:
    """Slack spells of all runs of a session."""
    zeros = [p.prior_std for p in fitted.problem.bench.parameters.free if p.name.endswith("load_cell_zero")]
    runs = quietened((*fitted.problem.runs, *fitted.holdout_runs, *fitted.lost), fitted.problem.rests)
    return [s for run in runs for s in slack_spells(run, max(zeros, default=0.0))]


def quietened(runs: tuple[Run, ...], rests: tuple[RestEvidence, ...]) -> list[Run]:
    """The runs, each load cell as noisy as where it is quietest, be that at rest.

    A cable that hangs loose half the time and snaps makes its own cell look so noisy that nothing is left
    which that cell would read as nothing.
    """
    quietest: dict[str, float] = {}
    moving = [(c.device, c.quantity, c.noise) for run in runs for c in run.channels]
    at_rest = [(c.device, c.quantity, c.noise) for rest in rests for c in rest.channels]
    for device, quantity, noise in (*moving, *at_rest):
        if quantity == "tension":
            quietest[device] = min(float(noise[0]), quietest.get(device, np.inf))
    return [
        replace(
            run,
            channels=tuple(
                replace(c, noise=np.array([quietest[c.device]])) if c.quantity == "tension" else c
                for c in run.channels
            ),
        )
        for run in runs
    ]


def blows(runs: tuple[Run, ...], spells: list[Spell]) -> list[Spell]:
    """Shocks by which cables come taut again: there is none before the first that went slack."""
    first = {
        name: min(s.start for s in spells if s.recording == name) for name in {s.recording for s in spells}
    }
    return [
        shock
        for run in runs
        for shock in (shocks(run) if run.recording.name in first else [])
        if shock.end >= first[shock.recording]
    ]


def slack_alone(ideal: Ideal, spells: list[Spell]) -> Explained:
    """The spells, and that they leave nothing to fit."""
    slack = replace(slack_finding(spells), evidence=evidence_of(ideal, ideal.fitted, ideal.scores.holdout))
    text = f"Cables go slack so often that no stretch in which all of them pull lasts {SHORTEST:g} s. "
    mismatch = Mismatch("unexplained", text + ideal.mismatch.explanation, (slack,), ())
    return Explained(ideal.fitted, mismatch, ideal, hear(ideal.fitted).looseness)


def taut_ideal(ideal: Ideal, spells: list[Spell], notify: Notify) -> Ideal | None:
    """The ideal model fitted between the spells, from where nothing is bent; None where nothing is left."""
    fitted = ideal.fitted
    every = (*fitted.problem.runs, *fitted.holdout_runs, *fitted.lost)
    loose = [*spells, *blows(every, spells)]

    def taut(cut: tuple[Run, ...]) -> tuple[Run, ...]:
        rig = fitted.problem.bench.rig
        return tuple(heard_apart(rig, part) for run in cut for part in taut_stretches(run, loose))

    runs, held = taut(fitted.problem.runs), taut((*fitted.holdout_runs, *fitted.lost))
    if not runs:
        return None
    return fit_again(ideal, runs, held, notify)


def comes_after(mismatch: Mismatch, *, taken: float, left_out: float, fails: bool) -> bool:
    """Whether slack is told after what was found between the spells.

    taken: nats that what was found takes away. left_out: nats that the spells had. fails: whether the ideal
    model fails by far where every cable pulls, too. What does that is no slack, and may be what makes it: a
    body that bounces on cables that stretch lets go of them.
    """
    named = bool(mismatch.findings) and mismatch.findings[0].effect != "unknown"
    return (named and fails) or (mismatch.verdict == "explained" and taken > left_out)


def with_slack(found: Explained, ideal: Ideal, spells: list[Spell]) -> Explained:
    """What was found between the spells, and the spells."""
    before, after = ideal.scores.holdout, judged(found.fitted)[0].holdout
    loose, taut, modelled = (excess(f.evaluation) for f in (ideal.fitted, found.ideal.fitted, found.fitted))
    # What is left out of the fit is compared by what it left: of other samples there is no likelihood
    evidence = {**evidence_of(ideal, found.fitted, after), "log_likelihood_gain": loose - taut}
    slack = replace(slack_finding(spells), evidence=evidence)
    mismatch = found.mismatch
    if mismatch.verdict == "none":
        text = f"Where every cable pulls every residual is noise. {held_out_errors(before, after)}"
        mismatch = Mismatch("explained", text, (), ())
    elif mismatch.verdict == "unexplained" and only_a_trace(ideal.fitted, found.ideal.fitted, SETTLED):
        # Blows that hard leave their trace in any rig: the intervals are widened by it
        errors = held_out_errors(before, after)
        text = f"Where every cable pulls a trace is left. {errors} {mismatch.explanation}"
        fitted = found.ideal.fitted
        mismatch = Mismatch("explained", text, (), mismatch.alternatives)
        found = replace(found, fitted=fitted, loose=max(found.loose, hear(fitted).looseness))
    fails = not near_noise(found.ideal.fitted)
    last = comes_after(mismatch, taken=taut - modelled, left_out=loose - taut, fails=fails)
    findings = (*mismatch.findings, slack) if last else (slack, *mismatch.findings)
    return replace(found, mismatch=replace(mismatch, findings=findings))
