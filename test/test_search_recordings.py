"""Large effects in recordings of another simulator, where this machine has them (pytest -m long)."""

from __future__ import annotations

import numpy as np
import pytest
from test_estimate_sessions import FOLDER, truth_of

from rig_identification.result import Finding, Identification
from rig_identification.search.identify import identify
from rig_identification.session import read_session


def _explained(name: str) -> tuple[Finding, Identification]:
    folder = FOLDER / name
    if not (folder / "truth.json").exists():
        pytest.skip(f"no {folder}: set RIG_IDENTIFICATION_RECORDINGS to a folder of sessions")
    found = identify(read_session(folder))
    assert found.mismatch.verdict == "explained"
    assert found.holdout_error is not None
    assert found.holdout_error <= 1.1
    deviation = (found.total.values - truth_of(name)) / np.sqrt(np.diag(found.total.covariance))
    assert np.max(np.abs(deviation)) < 3.0
    return found.mismatch.findings[0], found


def _holds(finding: Finding, name: str, value: float) -> None:
    told = finding.parameters[name]
    assert abs(told["value"] - value) < 3.0 * told["std"], name  # type: ignore[operator]


@pytest.mark.long
def test_a_hose_between_the_body_and_the_room() -> None:
    first, _ = _explained("session_e")
    assert first.effect == "tether"
    for name, value in {"stiffness": 150.0, "preload": 25.0, "damping": 2.0}.items():
        _holds(first, name, value)


@pytest.mark.long
def test_three_hundred_kilograms_on_springs_of_three_frequencies() -> None:
    first, _ = _explained("session_f")
    assert first.effect == "sprung_mass"
    for name, value in {"mass": 300.0, "frequency": 2.2, "frequency_x": 5.0, "frequency_y": 5.0}.items():
        _holds(first, name, value)
