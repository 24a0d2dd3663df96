"""Runs that are noise each by itself, with other parameters, say together what was left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_mismatch_along_measured import quiet
from test_simulate_identify import shaken

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import Ideal, fit_session, judged
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.disagreeing import where_runs_disagree
from rig_identification.mismatch.first_fits import shows
from rig_identification.simulate import simulate_session
from rig_identification.simulate.exciter import UnbalancedMass
from rig_identification.simulate.start import Pulled

#: N/m along y that a hose adds to some 9 kN/m of swing.
STIFFNESS = 600.0


def _fitted(stiffness: float) -> Fitted:
    """Shaken at one frequency; held out, pulled aside and let go."""
    spec = shaken(10, 12.0)
    weight, at = float(spec.elements[0]) * spec.rig.gravity, spec.elements[1:4]
    shaking = replace(
        spec.runs[0], force=UnbalancedMass(0.03 * weight / (2.0 * np.pi * 1.1) ** 2, 1.1, ramp=2.0)
    )
    pull = Pulled(0.1 * weight * np.array([0.1, 1.0, 0.0]), at + np.array([0.6, 0.1, 0.0]))
    free = replace(spec.runs[0], name="run_2", holdout=True, start=pull, force=None)
    hose = {"tether": (0.0, stiffness, 0.0), "tether_point": (1.0, 2.0, -0.5)}
    spec = replace(spec, runs=(shaking, free), effects=hose if stiffness > 0.0 else {})
    return fit_session(simulate_session(spec, np.random.default_rng(2))[0], quiet)


@pytest.fixture(scope="module")
def hosed() -> Ideal:
    fitted = _fitted(STIFFNESS)
    assert not shows(fitted.evaluation)
    ideal = Ideal(fitted, *judged(fitted))
    assert ideal.mismatch.explanation.startswith("Run_2, held out, asks for other parameters")
    return ideal


def test_what_held_out_runs_ask_for_is_named_and_not_fitted_to_them(hosed: Ideal) -> None:
    found = where_runs_disagree(hosed, quiet, UNLIMITED)
    assert found is not None
    assert found.wholly
    hose = found.mismatch.findings[0]
    assert hose.effect == "tether"
    assert hose.where["axis"] == "y"
    stiffness = hose.parameters["stiffness"]
    assert abs(stiffness["value"] - STIFFNESS) < 3.0 * stiffness["std"]  # type: ignore[operator]
    assert "run_2 asked for other parameters" in found.mismatch.explanation
    # Its numbers, and the body's, are from the fitted run alone
    assert [run.recording.name for run in found.fitted.problem.runs] == ["run_1"]
    assert hosed.scores.holdout is not None
    after = hose.evidence["holdout_error_after"]
    assert after is not None
    assert after < hosed.scores.holdout


def test_where_no_time_is_left_or_runs_agree_nothing_is_asked(hosed: Ideal) -> None:
    assert where_runs_disagree(hosed, quiet, Budget(0.0)) is None
    fitted = _fitted(0.0)
    assert where_runs_disagree(Ideal(fitted, *judged(fitted)), quiet, UNLIMITED) is None
