"""What was found first gives way to its twin, once what was found second is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_estimate_launch import tilted_trifilar
from test_mismatch_whole_rivals import fit_of, ideal_of, search_in
from test_mismatch_without_first import fit_beside
from test_simulate_identify import shaken

from rig_identification.estimate.identify import Ideal, fit_session, judged
from rig_identification.mismatch.another_first import another_first
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.named import _Naming
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.whole_runs import whole_runs

#: s by which the IMU's stamps are late, rad that an inclinometer reads too much.
LATE, ZERO = 0.05, 0.01
CLOCK, LAG, SECOND = "clock_offset imu", "sensor_lag imu", "inclinometer_offset inclinometer y"


def with_second(search: Search, label: str) -> Search:
    """The search with a hypothesis in its model beside what was found."""
    after, ended = search.forked(), fit_beside(search, label)
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


#: Of three parallel cables the one whose upper hinge is described 5 mm too high, and so much more (m), and
#: another one.
HIGHER = 0.015
TWIN = "hinge_position cable_1 ceiling z"
ASIDE = "inclinometer_offset inclinometer x"


def _naming(ideal: Ideal, search: Search) -> _Naming:
    return _Naming(
        ideal, search, lambda label, fraction: None, None, None, catalogue(search.problem), search_in(ideal)
    )


def test_one_more_effect_makes_a_twin_needless() -> None:
    session = tilted_trifilar()
    assert session.rig.inclinometer is not None
    turned = replace(session.rig.inclinometer, orientation=Rotation.from_rotvec([0.0, -ZERO, 0.0]).as_quat())
    *others, last = session.rig.cables
    last = replace(last, ceiling_point=last.ceiling_point + np.array([0.0, 0.0, HIGHER]))
    rig = replace(session.rig, inclinometer=turned, cables=(*others, last))
    fitted = fit_session(replace(session, rig=rig))
    ideal = Ideal(fitted, *judged(fitted))
    origin = search_in(ideal)
    twin = fit_of(origin, TWIN)
    wrong = origin.forked()
    wrong.adopt(Trials([twin]), twin)
    wrong = with_second(wrong, ASIDE)
    assert not whole_runs(ideal, wrong).wholly
    found = _naming(ideal, wrong)._exchanged()
    assert found is not None
    assert found.wholly
    told = {f.effect: f for f in found.mismatch.findings}
    assert len(told) == 2
    # Three hinges at the ceiling, one of them off, are a level that is off as well
    assert all(f.where["channel"] != "cable_1" for f in told.values())
    assert abs(told["inclinometer_offset"].parameters["offset"]["value"]) == pytest.approx(ZERO, abs=1e-3)
    # Where nothing else is in the model there is nothing to exchange
    alone = origin.forked()
    alone.adopt(Trials([twin]), twin)
    assert _naming(ideal, alone)._exchanged() is None
