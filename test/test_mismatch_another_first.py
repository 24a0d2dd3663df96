"""A near twin of what was found first is asked beside what was found second."""

from __future__ import annotations

import pytest
from test_mismatch_whole_rivals import fit_of, ideal_of, search_in
from test_simulate_identify import shaken

from rig_identification.mismatch.another_first import another_first
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.screen import promises_of
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import attempt, finished
from rig_identification.mismatch.whole_runs import whole_runs

#: s by which the IMU's stamps are late, rad that an inclinometer reads too much.
LATE, ZERO = 0.05, 0.01
CLOCK, LAG, SECOND = "clock_offset imu", "sensor_lag imu", "inclinometer_offset inclinometer y"


def with_second(search: Search, label: str) -> Search:
    """The search with a hypothesis in its model beside what was found."""
    after = search.forked()
    candidate = next(c for c in catalogue(search.problem) if c.label == label)
    (promise,) = promises_of(after.here, after.evaluation, [candidate])
    begun = attempt(after.here, after.evaluation, promise)
    ended = None if begun is None else finished(begun)
    assert ended is not None
    after.adopt(Trials([ended]), ended)
    return after


def test_a_clock_takes_the_place_of_its_lag_once_the_inclinometers_zero_is_known() -> None:
    effects: dict[str, tuple[float, ...]] = {"imu.clock": (LATE,), "inclinometer.orientation.x": (ZERO,)}
    ideal = ideal_of(shaken(10, 10.0), effects, 5)
    origin = search_in(ideal)
    clock, lag = fit_of(origin, CLOCK), fit_of(origin, LAG)
    wrong = origin.forked()
    wrong.adopt(Trials([lag, clock]), lag)
    wrong = with_second(wrong, SECOND)
    assert not whole_runs(ideal, wrong).wholly
    said: list[str] = []
    found = another_first(ideal, wrong, [clock], said.append)
    assert found is not None
    assert said == [f"whole runs with {CLOCK}, {SECOND}"]
    best, how = found
    assert best.wholly
    values = {f.effect: next(iter(f.parameters.values()))["value"] for f in best.mismatch.findings}
    assert values["clock_offset"] == pytest.approx(LATE, abs=0.002)
    assert abs(values["inclinometer_offset"]) == pytest.approx(ZERO, abs=0.002)
    assert [t.candidate.label for t in how.found] == [CLOCK, SECOND]
    assert all(a["effect"] != "clock_offset" for a in best.mismatch.alternatives)
    # What does not explain them all either leaves it as it was
    assert another_first(ideal, wrong, [lag], said.append) is None
