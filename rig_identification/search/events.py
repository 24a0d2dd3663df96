"""What acts for seconds and is gone: found in the wrench's course, and left out of the fit.

What is wrong all the time is in the wrench all the time. What pushes for a second is in it for that second,
once or a few times. Near the noise no wrench is asked for, and the push that whole runs show most of
(mismatch/pulse.py) is told.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import Ideal, fitted_again, judged, near_noise
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.solve import Point, excess
from rig_identification.estimate.whole import fit_whole
from rig_identification.mismatch.explained import Explained, evidence_of, held_out_errors
from rig_identification.mismatch.latent import MissingWrench
from rig_identification.mismatch.pulse import Pulse, likeliest_pulse, pulse_finding
from rig_identification.mismatch.unknown import push_finding
from rig_identification.result import Finding, Mismatch
from rig_identification.search.ladder import Rung, fitted_at
from rig_identification.search.levels import ALONE
from rig_identification.search.unexplained import missing_wrenches

Array = NDArray[np.float64]
Notify = Callable[[str, float], None]
#: Explains what an event leaves of a session; None where the ideal model explains it.
Explain = Callable[[Ideal], Explained | None]

#: What is cut off on either side of an event, s.
MARGIN = 0.15
#: Share of what is wrong that may be left outside of an event for it to be the chief of it.
OUTSIDE = 0.5
#: Share of what a model leaves that a push beside it has to take away, to first order.
SEEN = 0.25
#: Seconds over which the wrench is averaged.
BIN = 0.25
#: Pushes stand out of the wrench at all other times by this factor (of its square), by it once more for each
#: further one, in so much of the time and so many stretches at most. What swings, rubs or lags comes to as
#: much again and again: a body on springs stood out of its own wrench three times.
STANDS_OUT, FOR, SEVERAL = 5.0, 0.2, 3
#: Bins on either side of what stands out in which it may begin and end.
ABOUT = 2


@dataclass(frozen=True)
class Event:
    """Seconds of one recording in which something acts that the rest of it does not show."""

    recording: str
    start: float  # s after the recording's start
    end: float  # s
    pulse: Pulse | None = None  # as whole runs near the noise show it
    missing: MissingWrench | None = None  # the wrench in which it was seen

    def inside(self, pulse: Pulse | None) -> Pulse | None:
        """The pulse if it acts at some time of the event."""
        return pulse if pulse is not None and pulse.within(self.recording, self.start, self.end) else None


def events_of(ideal: Ideal, first: Rung) -> tuple[Event, ...]:
    """The events that are chief of what the ideal model leaves; empty where there are none.

    first: that model at its own level.
    """
    fitted = ideal.fitted
    if near_noise(fitted):
        pulse = likeliest_pulse(fitted)
        chief = pulse is not None and pulse.net > (1.0 - OUTSIDE) * wrong(fitted)
        return _of_pulse(pulse) if pulse is not None and chief else ()
    return standing_out(first)


def events_beside(found: Explained) -> tuple[Event, ...]:
    """The event that a fit with something in its model shows in whole runs; empty where there is none."""
    if not near_noise(found.fitted):
        return ()
    pulse = likeliest_pulse(found.fitted)
    shows = pulse is not None and pulse.net > SEEN * wrong(found.fitted)
    return _of_pulse(pulse) if pulse is not None and shows else ()


def _of_pulse(pulse: Pulse) -> tuple[Event, ...]:
    return (Event(pulse.recording, pulse.start, pulse.end, pulse),)


def standing_out(rung: Rung) -> tuple[Event, ...]:
    """The stretches in which the wrench of a model stands out of its wrench at all other times."""
    if rung.alone or rung.problem.discrepancy is None:
        return ()
    size = np.sqrt(np.diag(rung.problem.discrepancy.covariance))
    every = missing_wrenches(rung)
    rows, place = [], []
    for missing in every:
        bins = max(1, int((missing.time[-1] - missing.time[0]) / BIN))
        parts = zip(np.array_split(missing.wrench, bins), np.array_split(missing.time, bins), strict=True)
        for wrench, time in parts:
            rows.append(np.mean(wrench, axis=0) / size)
            place.append((missing, float(time[0]), float(time[-1])))
    wrench = np.array(rows)
    out = []
    for begin, end in _stretches(np.sum((wrench - np.median(wrench, axis=0)) ** 2, axis=1)):
        first, last = begin - ABOUT, end + ABOUT
        if first < 0 or last > len(place) or place[first][0] is not place[last - 1][0]:
            # What begins or dies away stands out at a recording's end as well
            return ()
        missing = place[first][0]
        out.append(Event(missing.recording, place[first][1], place[last - 1][2], None, missing))
    return tuple(out)


def _stretches(squares: Array) -> list[tuple[int, int]]:
    """First bin, and the one after the last, of each stretch that stands out; empty where too much does."""
    high = np.flatnonzero(squares > np.max(squares) / STANDS_OUT)
    parts = np.split(high, np.flatnonzero(np.diff(high) > 2 * ABOUT) + 1)
    found = [(int(part[0]), int(part[-1]) + 1) for part in parts]
    lasting = sum(last - first for first, last in found)
    outside = np.ones(squares.size, dtype=bool)
    for first, last in found:
        outside[max(0, first - ABOUT) : last + ABOUT] = False
    alone = np.all(squares[outside] <= np.max(squares) / STANDS_OUT ** len(found))
    return found if alone and len(found) <= SEVERAL and lasting <= FOR * squares.size else []


def explained_outside(
    ideal: Ideal, events: tuple[Event, ...], explain: Explain, notify: Notify, *, chief: bool
) -> Explained | None:
    """What explains the session outside of some events, and these; None where something is left there.

    chief: the events have the larger part of what is wrong, and come first; otherwise they come last.
    """
    times = " and ".join(f"{e.start:.1f} s of {e.recording}" for e in events)
    notify(f"search: without a push at {times}", 0.1)
    fitted = ideal.fitted
    runs, held = fitted.problem.runs, fitted.holdout_runs
    for event in events:
        runs, held = all_without(runs, event), all_without(held, event)
    if not runs:
        return None
    again = fitted_again(ideal, runs, (*held, *fitted.lost), notify)
    if chief and wrong(again) > OUTSIDE * wrong(fitted):
        return None
    rest = Ideal(again, *judged(again))
    found = explain(rest) or Explained(rest.fitted, rest.mismatch, rest)
    if found.mismatch.verdict not in ("none", "explained") or found.trace:
        return None
    whole = _everything(found, ideal)
    if judged(whole)[1].verdict == "none":
        # A fit lost its way without what was found
        return replace(found, fitted=whole) if found.told else None
    after = judged(found.fitted)[0].holdout
    evidence = evidence_of(ideal, found.fitted, after)
    gain = float(wrong(ideal.fitted) - wrong(found.fitted))
    pulse = likeliest_pulse(whole) if near_noise(whole) else None
    seen = [event.inside(pulse) or event.pulse for event in events]
    # A pulse is right to first order, which is near the noise
    unseen = dict.fromkeys(e.recording for e, one in zip(events, seen, strict=True) if one is None)
    courses = {name: _course(found.fitted, whole, name) for name in unseen}
    pushes = tuple(
        replace(
            _told(event, one, courses, ideal),
            evidence=evidence | {"log_likelihood_gain": one.gain if one else gain},
        )
        for event, one in zip(events, seen, strict=True)
    )
    findings = (*pushes, *found.mismatch.findings) if chief else (*found.mismatch.findings, *pushes)
    outside = "the push" if len(events) == 1 else "the pushes"
    text = f"Outside {outside}: {found.mismatch.explanation} {held_out_errors(ideal.scores.holdout, after)}"
    alternatives = found.mismatch.alternatives if found.mismatch.findings else ()
    return replace(found, mismatch=Mismatch("explained", text, findings, alternatives), ideal=ideal)


def _told(
    event: Event, pulse: Pulse | None, courses: dict[str, MissingWrench | None], ideal: Ideal
) -> Finding:
    """The event as a finding without evidence: as a pulse, or else as the wrench over time."""
    if pulse is not None:
        return pulse_finding(pulse)
    missing = courses[event.recording] or event.missing
    if missing is None:
        raise AssertionError("an event was seen in a pulse or in a wrench")
    return push_finding(missing, ideal.fitted.problem.bench.rig, event.start, event.end)


def _everything(found: Explained, ideal: Ideal) -> Fitted:
    """All of every run with the model found outside of an event."""
    outside = found.fitted
    whole = replace(outside.problem, runs=ideal.fitted.problem.runs)
    return fit_whole(ideal.fitted, whole, outside.problem, outside.evaluation.point)


def _course(outside: Fitted, whole: Fitted, recording: str) -> MissingWrench | None:
    """What acts in a recording over time, with rig and body as the rest of the session has them.

    The wrench is as strong as its evidence asks for. None where no level can be followed.
    """
    run = next(r for r in (*whole.problem.runs, *whole.holdout_runs) if r.recording.name == recording)
    theta = outside.evaluation.point.theta
    problem = replace(outside.problem, runs=(run,), rests=())
    start = launch_state(problem.bench, run, theta, outside.rest)
    levels = (fitted_at(problem, Point(theta, (start,), ()), level, 0) for level in range(ALONE))
    best = max((r for r in levels if r is not None), key=lambda rung: rung.evidence, default=None)
    return None if best is None else missing_wrenches(best)[0]


def wrong(fitted: Fitted) -> float:
    """Excess (nats) of all runs, held-out ones included."""
    held = sum(0.5 * float(np.sum(run.residual**2) - run.residual.size) for run in fitted.holdouts)
    return max(1.0, excess(fitted.evaluation) + held)


def all_without(runs: tuple[Run, ...], event: Event) -> tuple[Run, ...]:
    """The stretches of all runs before and after an event."""
    return tuple(part for run in runs for part in _without(run, event))


def _without(run: Run, event: Event) -> list[Run]:
    """A run's stretches before and after an event, where they are long enough to say something."""
    if run.recording.name != event.recording:
        return [run]
    step = run.grid.step
    a = round((event.start - MARGIN - run.offset) / step)
    b = round((event.end + MARGIN - run.offset) / step)
    if b <= 0 or a >= run.grid.nodes - 1:
        # Another stretch of the recording, from before or after the event
        return [run]
    out = []
    if a * step > 1.0:
        out.append(run.between(0, a))
    if (run.grid.nodes - 1 - b) * step > 1.0:
        out.append(run.between(b, run.grid.nodes - 1))
    return out
