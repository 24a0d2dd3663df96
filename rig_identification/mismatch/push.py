"""A push: something outside acts for seconds and is gone. The rest of the session is fitted without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import Ideal, fitted_again, in_pieces_if_far, judged
from rig_identification.estimate.solve import Evaluation, Problem, excess
from rig_identification.estimate.whole import fit_whole
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.explained import Explained, evidence_of, held_out_errors
from rig_identification.mismatch.locate import CALM, Calm, Event, at_an_end, find_event
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.pulse import Pulse, likeliest_pulse, pulse_finding
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import mass_of
from rig_identification.mismatch.unknown import push_finding
from rig_identification.mismatch.whole_rivals import likeliest_whole
from rig_identification.mismatch.whole_runs import whole_runs
from rig_identification.result import Finding, Mismatch

Array = NDArray[np.float64]
Notify = Callable[[str, float], None]
#: The pieces that an event leaves in peace, fitted when they are first asked for.
Calmed = Callable[[], Calm | None]
#: The likeliest push of whole runs, looked for when it is first asked for.
Likeliest = Callable[[], Pulse | None]

#: How uneven pieces must be (worst over median mean square) for an event to be looked for.
UNEVEN = 4.0
#: What is cut off on either side of a push, s.
MARGIN = 0.15
#: Share of what is wrong in all runs that may be left outside a push for it to be the chief of it.
OUTSIDE = 0.5
#: Share of what is wrong with something in the model that a push has to take away, to first order, for the
#: rest to be looked at without it.
SEEN = 0.25


def nothing_known() -> None:
    """No piece is known to be calm."""


@dataclass(frozen=True)
class Pushes:
    """How a session is explained outside a push that shows beside something else; None: it is not."""

    in_pieces: Callable[[Problem, Evaluation], Explained | None]  # short pieces as they are fitted
    in_whole_runs: Callable[[Explained], Explained | None]  # near the noise, with something in the model


def without_push(
    ideal: Ideal,
    problem: Problem,
    here: Problem,
    evaluation: Evaluation,
    likeliest: Likeliest,
    notify: Notify,
    calm: Calmed = nothing_known,
) -> Explained | None:
    """The session without the seconds in which something pushed; None where nothing did, or more is wrong.

    problem: whole runs. here, evaluation: their short pieces, fitted. likeliest: the push of all runs.
    calm: what is known of the pieces that a push leaves in peace.
    """
    if not _may_hold_an_event(evaluation):
        return None
    notify("search: a push", 0.05)
    event = find_event(here, evaluation, calm=calm())
    if event is None:
        return None
    pulse = likeliest()
    seen = pulse is not None and pulse.within(event.recording, event.start, event.end)
    if at_an_end(event, here) and not seen:
        # What begins or dies away shows there as well
        return None
    mass = mass_of(here, evaluation)
    at = replace(evaluation, point=event.point)
    told = push_finding(here, at, ideal.fitted.rest, mass, event)
    if told is None:
        return None
    push, start, end = told
    for first, last in ((start, end), (event.start, event.end)):
        whole = replace(problem, runs=all_without(problem.runs, event.recording, first, last))
        fitted = fit_whole(ideal.fitted, whole, here, event.point)
        after, verdict = judged(fitted)
        if verdict.verdict == "none":
            break
    else:
        return None
    if pulse is not None and seen:
        push = pulse_finding(pulse)
    elif (first, last) != (start, end):
        push = _gentle(push, event)
    evidence = evidence_of(ideal, fitted, after.holdout)
    text = f"Outside the push every residual is noise. {held_out_errors(ideal.scores.holdout, after.holdout)}"
    return Explained(fitted, Mismatch("explained", text, (replace(push, evidence=evidence),), ()), ideal)


def _squares(evaluation: Evaluation) -> Array:
    """Mean square of what is left in each piece."""
    return np.array([float(np.mean(run.residual**2)) for run in evaluation.runs])


def _uneven(squares: Array) -> bool:
    return bool(np.max(squares) >= UNEVEN * np.median(squares))


def _may_hold_an_event(evaluation: Evaluation) -> bool:
    """Whether one piece stands out, or the most are noise, so that a faint one may."""
    squares = _squares(evaluation)
    return _uneven(squares) or bool(np.median(squares) <= CALM)


def _gentle(push: Finding, event: Event) -> Finding:
    """A push too gentle for its moment and direction to be told: the pieces that it disturbs are left out."""
    times = [{"recording": event.recording, "start": round(event.start, 3), "end": round(event.end, 3)}]
    where: dict[str, object] = {"channel": None, "axis": None, "times": times}
    text = (
        f"Something pushes the body gently at some time from {event.start:.1f} to {event.end:.1f} s of "
        f"{event.recording}; where and along what is not to be told. These seconds are left out of the fit. "
        "Keep people and draughts away from the rig, or cut the recording there."
    )
    return replace(push, where=where, statement=text)


def push_beside(
    here: Problem, evaluation: Evaluation, notify: Notify, calm: Calmed = nothing_known
) -> Event | None:
    """A push beside something else that is wrong all the time. calm: as :func:`without_push` has it."""
    if not _uneven(_squares(evaluation)):
        return None
    notify("search: a push beside something else", 0.06)
    return find_event(here, evaluation, alone=False, calm=calm())


def push_too(ideal: Ideal, before: Search, tried: Trials, search: Search, notify: Notify) -> Explained | None:
    """What was found, and a push that it leaves in short pieces; None where it leaves more, or no push.

    With the effects in the model all other pieces are noise, and so is all of every run outside the push.
    before: where the search stood before the last of them; tried: what that was chosen from.
    """
    if not _may_hold_an_event(search.evaluation):
        return None
    notify("search: a push beside " + ", ".join(t.candidate.label for t in search.found), 0.6)
    event = find_event(search.here, search.evaluation)
    if event is None or at_an_end(event, search.here):
        return None
    outside_of_it = replace(
        search.problem, runs=all_without(search.problem.runs, event.recording, event.start, event.end)
    )
    its = replace(search, problem=outside_of_it)
    found = whole_runs(ideal, its)
    if not found.wholly:
        return None
    # What it was chosen from was heard with the push among the residuals
    found, _ = likeliest_whole(
        ideal,
        replace(before, problem=outside_of_it),
        tried,
        found,
        its,
        lambda label: notify(f"search: whole runs with {label}", 0.6),
    )
    return with_push(found, ideal, search.here, event)


def outside(ideal: Ideal, recording: str, start: float, end: float, notify: Notify) -> Ideal:
    """The ideal model fitted to all but the seconds of a recording in which something pushes."""
    return in_pieces_if_far(_fitted_outside(ideal, recording, start, end, notify), notify)


def outside_of_event(ideal: Ideal, event: Event, notify: Notify, *, chief: bool) -> Ideal | None:
    """The ideal model outside of an event.

    chief: None where most of what is wrong is wrong there as well. What rings has its strongest second,
    too, and a search of the rest takes all the time there is.
    """
    fitted = _fitted_outside(ideal, event.recording, event.start, event.end, notify)
    if chief and excess(fitted.evaluation) > CHIEF * excess(ideal.fitted.evaluation):
        return None
    return in_pieces_if_far(fitted, notify)


def _fitted_outside(ideal: Ideal, recording: str, start: float, end: float, notify: Notify) -> Fitted:
    fitted = ideal.fitted
    runs = all_without(fitted.problem.runs, recording, start, end)
    held = all_without(fitted.holdout_runs, recording, start, end)
    return fitted_again(ideal, runs, (*held, *fitted.lost), notify)


def with_push(found: Explained, ideal: Ideal, here: Problem, event: Event) -> Explained | None:
    """What was found outside a push, and the push as the model found there sees it; None where it is none.

    Where every residual is noise in the push's seconds as well there is none, and what was found stands
    alone: a short piece lost its way without it.
    """
    whole, undisturbed = _everything(found, ideal)
    if undisturbed:
        return replace(found, fitted=whole)
    fitted = found.fitted
    evaluation = fitted.evaluation
    pieces = replace(here, bench=fitted.problem.bench)
    told = push_finding(pieces, evaluation, fitted.rest, mass_of(pieces, evaluation), event)
    if told is None:
        return None
    after = judged(fitted)[0].holdout
    pulse = _pulse_within(whole, event.recording, event.start, event.end)
    push = told[0] if pulse is None else pulse_finding(pulse)
    push = replace(push, evidence=evidence_of(ideal, fitted, after))
    mismatch = replace(
        found.mismatch,
        explanation=f"Outside the push: {found.mismatch.explanation}",
        findings=(*found.mismatch.findings, push),
    )
    return replace(found, mismatch=mismatch, ideal=ideal)


def _everything(found: Explained, ideal: Ideal) -> tuple[Fitted, bool]:
    """All of every run with the model found outside a push, and whether that leaves nothing."""
    outside_of_it = found.fitted
    whole = replace(outside_of_it.problem, runs=ideal.fitted.problem.runs)
    fitted = fit_whole(ideal.fitted, whole, outside_of_it.problem, outside_of_it.evaluation.point)
    return fitted, judged(fitted)[1].verdict == "none"


def _pulse_within(whole: Fitted, recording: str, start: float, end: float) -> Pulse | None:
    """The push that whole runs show with what was found in the model, if it is the one looked for."""
    pulse = likeliest_pulse(whole)
    return pulse if pulse is not None and pulse.within(recording, start, end) else None


def chiefly(pulse: Pulse, fitted: Fitted) -> bool:
    """Whether a push may take most of what is wrong in all runs away."""
    return pulse.net > (1.0 - OUTSIDE) * _wrong(fitted)


def shows_beside(pulse: Pulse, fitted: Fitted) -> bool:
    """Whether a push may be what a fit with something in its model leaves."""
    return pulse.net > SEEN * _wrong(fitted)


def outside_of_pulse(ideal: Ideal, pulse: Pulse, notify: Notify) -> Ideal | None:
    """The ideal model outside of a push; None where as much is wrong there as well."""
    rest = outside(ideal, pulse.recording, pulse.start, pulse.end, notify)
    return None if _wrong(rest.fitted) > OUTSIDE * _wrong(ideal.fitted) else rest


def _wrong(fitted: Fitted) -> float:
    """Excess (nats) of all runs, held-out ones included."""
    held = sum(0.5 * float(np.sum(run.residual**2) - run.residual.size) for run in fitted.holdouts)
    return max(1.0, excess(fitted.evaluation) + held)


def with_pulse(
    found: Explained | None, rest: Ideal, ideal: Ideal, pulse: Pulse, *, last: bool = False
) -> Explained | None:
    """What explains the session outside a push, and the push; None where something is left there.

    found: what is told of the rest; None where the ideal model explains it. rest: that model's fit outside.
    last: the push takes less away than what is told of the rest.
    """
    found = found or Explained(rest.fitted, rest.mismatch, rest)
    if found.mismatch.verdict not in ("none", "explained") or found.trace:
        return None
    whole, undisturbed = _everything(found, ideal)
    if undisturbed:
        return replace(found, fitted=whole) if found.told else None
    pulse = _pulse_within(whole, pulse.recording, pulse.start, pulse.end) or pulse
    after = judged(found.fitted)[0].holdout
    evidence = evidence_of(ideal, found.fitted, after) | {"log_likelihood_gain": pulse.gain}
    push = replace(pulse_finding(pulse), evidence=evidence)
    mismatch = Mismatch(
        "explained",
        f"Outside the push: {found.mismatch.explanation} {held_out_errors(ideal.scores.holdout, after)}",
        (*found.mismatch.findings, push) if last else (push, *found.mismatch.findings),
        found.mismatch.alternatives if found.mismatch.findings else (),
    )
    return replace(found, mismatch=mismatch, ideal=ideal)


def all_without(runs: tuple[Run, ...], recording: str, start: float, end: float) -> tuple[Run, ...]:
    """The stretches of all runs before and after a push."""
    return tuple(part for run in runs for part in _without(run, recording, start, end))


def _without(run: Run, recording: str, start: float, end: float) -> list[Run]:
    """A run's stretches before and after a push, where they are long enough to say something."""
    if run.recording.name != recording:
        return [run]
    step = run.grid.step
    a = round((start - MARGIN - run.offset) / step)
    b = round((end + MARGIN - run.offset) / step)
    if b <= 0 or a >= run.grid.nodes - 1:
        # Another stretch of the recording, from before or after the push
        return [run]
    out = []
    if a * step > 1.0:
        out.append(run.between(0, a))
    if (run.grid.nodes - 1 - b) * step > 1.0:
        out.append(run.between(b, run.grid.nodes - 1))
    return out
