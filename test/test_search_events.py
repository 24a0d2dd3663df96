"""What acts for seconds and is gone: found where it stands out, and cut out of the runs."""

from __future__ import annotations

import numpy as np
from wrong_sessions import made

from rig_identification.estimate.identify import fit_session
from rig_identification.mismatch.pulse import Pulse
from rig_identification.search.events import MARGIN, Event, _stretch, all_without


def test_what_stands_out_for_a_while() -> None:
    rng = np.random.default_rng(2)
    squares = rng.chisquare(6, size=100) / 6.0
    assert _stretch(squares) is None
    squares[40:44] = [30.0, 90.0, 100.0, 25.0]
    assert _stretch(squares) == (40, 44)
    # It comes again
    squares[70] = 60.0
    assert _stretch(squares) is None
    # It dies away slowly
    assert _stretch(np.exp(-np.arange(100) / 20.0)) is None
    # A constant beside it, in one piece alone, is less
    squares = np.where(np.arange(100) < 16, 4.0, 0.1)
    squares[50:53] = 100.0
    assert _stretch(squares) == (50, 53)


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
