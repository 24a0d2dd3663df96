"""A reading that follows a law of its own is told as that, not as the gains, zeros and lags it resembles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.recording import Recording
from rig_identification.result import Identification
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

#: Of the reading at 3000 N, about as much at twice that.
BENT = 2e-6
#: Of its neighbour's load, beyond what that is on the average, N.
LEAKS, EVEN = 0.02, 3000.0
#: rad/s per m/s^2: two degrees per second and g.
FELT = 3e-3
#: N on either branch, once the load has turned by twice the play, N.
BEHIND, PLAY = 5.0, 40.0
#: N/s at first, 1/s.
WARMS, SETTLES = 0.4, 0.2


def _bent(recording: Recording) -> Recording:
    cell = recording.tension["cable_2"]
    values = cell.values + BENT * cell.values**2
    return replace(recording, tension={**recording.tension, "cable_2": replace(cell, values=values)})


def _leaking(recording: Recording) -> Recording:
    cell, other = recording.tension["cable_2"], recording.tension["cable_3"]
    felt = np.interp(cell.time, other.time, other.values[:, 0])[:, None]
    values = cell.values + LEAKS * (felt - EVEN)
    return replace(recording, tension={**recording.tension, "cable_2": replace(cell, values=values)})


def _felt(recording: Recording) -> Recording:
    imu = recording.imu
    assert imu is not None
    values = imu.values.copy()
    values[:, 0] += FELT * imu.values[:, 4]
    return replace(recording, imu=replace(imu, values=values))


def _warming(recording: Recording) -> Recording:
    cell = recording.tension["cable_1"]
    moved = WARMS * (1.0 - np.exp(-SETTLES * cell.time)) / SETTLES
    values = cell.values + moved[:, None]
    return replace(recording, tension={**recording.tension, "cable_1": replace(cell, values=values)})


def _behind(recording: Recording) -> Recording:
    """Within its play a cell stays where it is; beyond it follows. At rest it is on neither branch."""
    if recording.exciter_force is None:
        return recording
    cell = recording.tension["cable_3"]
    values, held = cell.values.copy(), float(cell.values[0, 0])
    for k, load in enumerate(cell.values[:, 0]):
        held = min(max(held, load - PLAY), load + PLAY)
        values[k] += BEHIND / PLAY * (held - load)
    return replace(recording, tension={**recording.tension, "cable_3": replace(cell, values=values)})


class Law(NamedTuple):
    """What a device does, how it is told, and its amount."""

    corrupt: Callable[[Recording], Recording]
    channel: str
    quantity: str
    name: str
    amount: float
    unit: str


LAWS = {
    "bent": Law(_bent, "cable_2", "tension", "curvature", BENT, "1/N"),
    "leaking": Law(_leaking, "cable_2", "tension", "sensitivity", LEAKS, "1"),
    "behind": Law(_behind, "cable_3", "tension", "hysteresis", BEHIND, "N"),
    "felt": Law(_felt, "imu", "angular_rate", "sensitivity", FELT, "s/m"),
    "warming": Law(_warming, "cable_1", "tension", "settling_rate", SETTLES, "1/s"),
}

Answer = tuple[Law, Identification, np.ndarray]


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=pytest.mark.long if name == "behind" else ()) for name in LAWS],
)
def answer(request: pytest.FixtureRequest) -> Answer:
    law = LAWS[request.param]
    spec = replace(shaken(10, 10.0), doubts=False)
    made, truth = simulate_session(spec, np.random.default_rng(2))
    found = identify(replace(made, recordings=tuple(law.corrupt(r) for r in made.recordings)))
    return law, found, (found.total.values - truth.elements) / np.sqrt(np.diag(found.total.covariance))


def test_it_is_named_with_its_channel_and_amount(answer: Answer) -> None:
    law, found, _ = answer
    (finding,) = found.mismatch.findings
    assert (found.mismatch.verdict, finding.effect) == ("explained", "unknown")
    assert (finding.where["channel"], finding.where["quantity"]) == (law.channel, law.quantity)
    amount = finding.parameters[law.name]
    assert amount["unit"] == law.unit
    assert abs(amount["value"] - law.amount) < 3.0 * amount["std"]  # type: ignore[operator]


def test_the_body_is_as_it_is(answer: Answer) -> None:
    _, _, deviation = answer
    assert np.max(np.abs(deviation)) < 3.5
