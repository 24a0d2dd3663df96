"""A load cell that is no straight line is told as that, not as the gain and zero it resembles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.mismatch.identify import identify
from rig_identification.recording import Recording
from rig_identification.result import Identification
from rig_identification.simulate import simulate_session

#: Of the reading at 3000 N, about as much at twice that.
BENT = 2e-6


def _bent(recording: Recording, curve: float) -> Recording:
    cell = recording.tension["cable_2"]
    values = cell.values + curve * cell.values**2
    return replace(recording, tension={**recording.tension, "cable_2": replace(cell, values=values)})


@pytest.fixture(scope="module")
def answer() -> tuple[Identification, np.ndarray]:
    spec = replace(shaken(10, 10.0), doubts=False)
    made, truth = simulate_session(spec, np.random.default_rng(2))
    found = identify(replace(made, recordings=tuple(_bent(r, BENT) for r in made.recordings)))
    return found, (found.total.values - truth.elements) / np.sqrt(np.diag(found.total.covariance))


def test_it_is_named_with_its_channel_and_curvature(answer: tuple[Identification, np.ndarray]) -> None:
    found, _ = answer
    (finding,) = found.mismatch.findings
    assert (found.mismatch.verdict, finding.effect) == ("explained", "unknown")
    assert (finding.where["channel"], finding.where["quantity"]) == ("cable_2", "tension")
    curvature = finding.parameters["curvature"]
    assert curvature["unit"] == "1/N"
    assert abs(curvature["value"] - BENT) < 3.0 * curvature["std"]  # type: ignore[operator]


def test_the_body_is_as_it_is(answer: tuple[Identification, np.ndarray]) -> None:
    _, deviation = answer
    assert np.max(np.abs(deviation)) < 3.5
