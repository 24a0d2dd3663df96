"""A second effect that no residual shows beside the first is asked for all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.recording import Recording
from rig_identification.result import Identification
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

#: Turn of the inclinometer about y, rad, which all contradicts; kg of entrained air, which nothing does.
TURNED, AIR = 0.02, 40.0


def _turned(recording: Recording) -> Recording:
    inclination = recording.inclination
    assert inclination is not None
    return replace(
        recording,
        inclination=replace(inclination, values=inclination.values + np.array([0.0, TURNED])),
    )


def _answer(air: float) -> tuple[Identification, np.ndarray]:
    spec = replace(shaken(10, 10.0), effects={"air_added_mass": (air,)}, doubts=False)
    made, truth = simulate_session(spec, np.random.default_rng(2))
    found = identify(replace(made, recordings=tuple(_turned(r) for r in made.recordings)))
    return found, (found.total.values - truth.elements) / np.sqrt(np.diag(found.total.covariance))


@pytest.fixture(scope="module")
def both() -> tuple[Identification, np.ndarray]:
    return _answer(AIR)


@pytest.mark.long
def test_air_beside_a_turned_inclinometer_is_told(both: tuple[Identification, np.ndarray]) -> None:
    found, deviation = both
    assert [f.effect for f in found.mismatch.findings] == ["inclinometer_offset", "air_added_mass"]
    air = next(f for f in found.mismatch.findings if f.effect == "air_added_mass").parameters["added_mass"]
    assert abs(air["value"] - AIR) < 3.0 * air["std"]  # type: ignore[operator]
    assert np.max(np.abs(deviation)) < 3.5


@pytest.mark.long
def test_each_of_them_bears_its_own_evidence(both: tuple[Identification, np.ndarray]) -> None:
    """Without the turn all is contradicted; without the air no residual shows it, and less is lost."""
    turn, air = (f.evidence["log_likelihood_gain"] for f in both[0].mismatch.findings)
    assert turn is not None
    assert air is not None
    assert turn > 2.0 * air
    assert air > 5.0


@pytest.mark.long
def test_where_there_is_no_air_none_is_told_and_the_interval_has_cables_in_it() -> None:
    found, deviation = _answer(0.0)
    assert {f.effect for f in found.mismatch.findings} == {"inclinometer_offset"}
    assert "cable_mass" in found.mismatch.explanation
    assert np.max(np.abs(deviation)) < 3.5
