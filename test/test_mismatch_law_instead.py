"""A law of one point's motion where an entry of the catalogue bends to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_mismatch_whole_rivals import fit_of, ideal_of, search_in, whole_with
from test_simulate_identify import shaken

from rig_identification.estimate.identify import Ideal
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.lawful import lawful_instead
from rig_identification.mismatch.outcome import MEANT
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import Trial

#: N s/m of a brake at one point.
BRAKE = 60.0


def searched(effects: dict[str, tuple[float, ...]]) -> tuple[Ideal, Search]:
    ideal = ideal_of(shaken(14, 12.0), effects, 3)
    return ideal, search_in(ideal)


def told(ideal: Ideal, search: Search, label: str) -> tuple[Trial, Explained]:
    """A hypothesis, and whole runs with it as if they were explained but for a trace."""
    trial = fit_of(search, label)
    found = whole_with(ideal, search, trial)
    mismatch = replace(found.mismatch, verdict="explained")
    return trial, replace(found, mismatch=mismatch, trace=True)


@pytest.fixture(scope="module")
def braked() -> tuple[Ideal, Search]:
    return searched({"point_law.brake": (BRAKE, 0.0), "point_law.position": (0.2, 0.4, -0.3)})


def test_a_brake_is_no_liquid_that_bends_to_it(braked: tuple[Ideal, Search]) -> None:
    ideal, search = braked
    trial, liquid = told(ideal, search, "liquid_slosh")
    # Short pieces bend more than whole runs: what they say of the liquid is not what decides
    found = lawful_instead(ideal, search, lambda stage, share: None, replace(trial, evidence=-np.inf), liquid)
    assert found is not None
    (finding,) = found.mismatch.findings
    assert finding.effect == "unknown"
    damping = finding.parameters["damping"]
    assert isinstance(damping, dict)
    assert abs(damping["value"] - BRAKE) < 4.0 * damping["std"]
    first = found.mismatch.alternatives[0]
    assert first["effect"] == "liquid_slosh"
    assert float(str(first["log_likelihood_gap"])) > MEANT
    assert len(found.bodies) == 1


@pytest.mark.long
def test_no_law_goes_before_what_is_there() -> None:
    ideal, search = searched({"hinge_damping": (3.0,)})
    trial, damping = told(ideal, search, "hinge_damping")
    beaten = replace(trial, evidence=-np.inf)
    assert lawful_instead(ideal, search, lambda stage, share: None, beaten, damping) is None
