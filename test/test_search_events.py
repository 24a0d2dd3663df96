"""What acts for seconds and is gone: found where it stands out, and cut out of the runs."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from wrong_sessions import made

from rig_identification.estimate.identify import fit_session
from rig_identification.mismatch.latent import MissingWrench
from rig_identification.mismatch.pulse import Pulse
from rig_identification.search import events
from rig_identification.search.events import BIN, MARGIN, Event, _stretches, all_without, standing_out


def test_what_stands_out_for_a_while() -> None:
    rng = np.random.default_rng(2)
    squares = rng.chisquare(6, size=100) / 6.0
    assert _stretches(squares) == []
    squares[40:44] = [30.0, 90.0, 100.0, 25.0]
    assert _stretches(squares) == [(40, 44)]
    # It comes again
    squares[70] = 60.0
    assert _stretches(squares) == [(40, 44), (70, 71)]
    # ... beside something that is there all the time
    assert _stretches(squares + 15.0) == []
    # ... and again
    squares[[10, 20, 30, 55, 85]] = 60.0
    assert _stretches(squares) == []
    # It dies away slowly
    assert _stretches(np.exp(-np.arange(100) / 20.0)) == []
    # A constant beside it, in one piece alone, is less
    squares = np.where(np.arange(100) < 16, 4.0, 0.1)
    squares[50:53] = 100.0
    assert _stretches(squares) == [(50, 53)]


def test_a_push_leaves_other_stretches_of_its_recording_alone() -> None:
    whole = fit_session(made(14, 12.0, 3)).problem.runs[0]
    middle, last = whole.grid.nodes // 2, whole.grid.nodes - 1
    early, late = whole.between(0, middle), whole.between(middle, last)
    event = Event(whole.recording.name, early.offset + 2.0, early.offset + 3.0)
    before, after, untouched = all_without((early, late), event)
    assert untouched is late
    assert before.offset == early.offset
    assert before.grid.duration < 2.0 - MARGIN + whole.grid.step
    assert after.offset > event.end
    assert [r.offset for r in all_without((late,), Event("another", 2.0, 3.0))] == [late.offset]
    # What is left is too short to say anything
    (rest,) = all_without((early,), Event(whole.recording.name, early.offset + 1.0, early.offset + 3.0))
    assert rest.offset > early.offset + 3.0


def test_a_pulse_is_of_an_event_that_it_overlaps() -> None:
    here = Pulse("run_1", 4.0, 5.0, np.ones(3), np.ones(3), 20.0, 5.0, np.zeros(3))
    assert Event("run_1", 4.5, 9.0).inside(here) is here
    assert Event("run_1", 5.5, 9.0).inside(here) is None
    assert Event("run_2", 4.5, 9.0).inside(here) is None
    assert Event("run_1", 4.5, 9.0).inside(None) is None


def _wrench(name: str, start: float, lasts: float, swing: float = 0.0) -> MissingWrench:
    """A run of 20 s in which the model lacks 100 N for a while, and a force that swings."""
    time = 0.01 * np.arange(2001)
    rng = np.random.default_rng(7)
    wrench = rng.normal(size=(time.size, 6)) + swing * np.sin(3.0 * time)[:, None]
    wrench[:, 1] += np.where((time > start) & (time < start + lasts), 100.0, 0.0)
    return MissingWrench(name, time, wrench, np.tile(np.eye(3), (time.size, 1, 1)), np.zeros((time.size, 12)))


@pytest.mark.parametrize(
    ("start", "lasts", "swing", "there"),
    [
        (9.0, 1.0, 0.0, True),
        (9.0, 1.0, 20.0, True),  # beside something that is there all the time
        (9.0, 1.0, 80.0, False),  # which comes to as much again and again
        (0.0, 0.0, 0.0, False),
        (18.9, 1.0, 0.0, False),  # what begins or dies away stands out at a recording's end as well
        (2.0, 16.0, 0.0, False),  # for as good as ever
    ],
)
def test_a_push_stands_out_of_the_wrench(
    monkeypatch: pytest.MonkeyPatch, start: float, lasts: float, swing: float, there: bool
) -> None:
    every = [_wrench("run_1", 0.0, 0.0, swing), _wrench("run_2", start, lasts, swing)]
    monkeypatch.setattr(events, "missing_wrenches", lambda rung: every)
    problem = SimpleNamespace(discrepancy=SimpleNamespace(covariance=np.diag([10.0] * 3 + [10.0] * 3)))
    found = standing_out(SimpleNamespace(alone=False, problem=problem))  # type: ignore[arg-type]
    assert len(found) == there
    for event in found:
        assert event.recording == "run_2"
        assert start - 3.0 * BIN < event.start < start
        assert start + lasts < event.end < start + lasts + 3.0 * BIN + 0.01
        assert event.missing is every[1]
    # Where no wrench is asked for there is nothing to see
    assert standing_out(SimpleNamespace(alone=True, problem=problem)) == ()  # type: ignore[arg-type]
