"""Along the motion that was measured a force on the body is told at once, and a device that is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from test_mismatch_push_beside import biased
from test_simulate_identify import shaken

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import Ideal, fit_session, judged, with_pieces
from rig_identification.mismatch.along_measured import Along, acts, along_measured
from rig_identification.mismatch.candidate import MANY, Candidate, added
from rig_identification.mismatch.first_fits import at_noise
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.screen import Promise, with_reference
from rig_identification.mismatch.search import worst_pieces
from rig_identification.mismatch.standing import short_pieces
from rig_identification.mismatch.trial import VERY_FAR, attempt
from rig_identification.mismatch.unbent import at_first
from rig_identification.recording import Recording, Session
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

#: N m of each hinge.
RUBBING = 20.0


def promise(name: str, gain: float, numbers: int = 1) -> Promise:
    """A promise of a hypothesis of so many numbers, nats."""
    parameters = tuple(added(f"{name}.{k}", "1", 1.0, k) for k in range(numbers))
    return Promise(Candidate(name, parameters, "", ""), gain, {})


@pytest.mark.parametrize(
    ("lag", "gain", "hose", "worthy"),
    [
        (60.0, 55.0, 100.0, ["lag", "gain", "hose"]),
        (60.0, 30.0, 100.0, ["lag", "hose"]),  # half of the lag's is little
        (40.0, 39.0, 100.0, ["hose"]),  # less than half of the best
        (100.0, 20.0, 60.0, ["lag"]),
        (25.0, 20.0, 29.0, []),  # a few nats of so much
    ],
)
def test_few_numbers_are_tried_before_a_hose(lag: float, gain: float, hose: float, worthy: list[str]) -> None:
    along = Along([promise("lag", lag), promise("gain", gain), promise("hose", hose, MANY)])
    assert [p.candidate.effect for p in along.worthy] == worthy


def nested(share: float, curve: float) -> Along:
    """A cell's zero, and its curve, which has the zero's number too: their shares of what is left."""
    zero, bend = added("zero", "N", 1.0, 0), added("curve", "1/N", 1.0, 0)
    return Along(
        [
            Promise(Candidate("curve", (zero, bend), "", ""), 1000.0 * curve, {}, curve),
            Promise(Candidate("zero", (zero,), "", ""), 1000.0 * share, {}, share),
        ]
    )


@pytest.mark.parametrize(
    ("share", "curve", "worthy", "sure"),
    [
        (0.73, 0.75, ["zero"], ["zero"]),  # what else there is bends the curve a little
        (0.73, 0.95, ["curve", "zero"], ["curve"]),  # most of what the zero leaves
        (3.4781, 3.4783, ["zero"], ["zero"]),  # more than there is, to first order
        (0.45, 0.5, ["zero"], []),  # no more than half
    ],
)
def test_a_number_that_takes_little_more_is_not_needed(
    share: float, curve: float, worthy: list[str], sure: list[str]
) -> None:
    along = nested(share, curve)
    assert [p.candidate.effect for p in along.worthy] == worthy
    assert [p.candidate.effect for p in along.sure] == sure


def test_cables_that_stretch_have_shown_what_a_device_promises() -> None:
    soft = Candidate("soft", (added("soft", "N", 1.0, 0),), "", "", build=lambda model: (model, ()))
    promises = [promise("gain", 3000.0), Promise(soft, 970.0, {}, 0.97)]
    assert [p.candidate.effect for p in Along(promises, beyond=True).worthy] == ["soft"]
    assert [p.candidate.effect for p in Along(promises).worthy] == ["gain"]


def quiet(stage: str, fraction: float) -> None:
    """No progress."""


def _ideal(session: Session) -> Ideal:
    fitted = fit_session(session, quiet)
    assert misfit(fitted.evaluation) > VERY_FAR
    return with_pieces(Ideal(fitted, *judged(fitted)), quiet)


def _along(ideal: Ideal) -> Along:
    return along_measured(ideal, catalogue(with_reference(ideal.fitted.problem, ideal.fitted.rest)))


@pytest.fixture(scope="module")
def rubbing() -> Ideal:
    spec = replace(shaken(10, 12.0), effects={"hinge_friction": (RUBBING,)})
    return _ideal(simulate_session(spec, np.random.default_rng(4))[0])


def test_dry_hinges_stand_out_of_all_that_brakes(rubbing: Ideal) -> None:
    along = _along(rubbing)
    assert not along.beyond
    first, *others = along.promises
    assert first.candidate.effect == "hinge_friction"
    assert first.gain > 1.2 * max(other.gain for other in others)
    assert abs(first.values["hinge.friction"] - RUBBING) < 0.3 * RUBBING


def test_what_it_tells_comes_to_the_noise_from_a_body_that_is_far_off(rubbing: Ideal) -> None:
    pieces = short_pieces(rubbing)
    assert pieces is not None
    here, evaluation = pieces
    assert evaluation is not None
    assert rubbing.fitted.guess is not None
    here, seen = worst_pieces(here, evaluation)
    start = at_first(here, seen, rubbing.fitted.guess.theta)
    assert start is not None
    grown = attempt(here, start, _along(rubbing).promises[0], growing=True)
    assert grown is not None
    assert at_noise(grown)
    told = grown.problem.bench.parameters.named(grown.evaluation.point.theta)
    assert abs(told["hinge.friction"] - RUBBING) < 0.02 * RUBBING


def _off(bias: float, effects: dict[str, tuple[float, ...]]) -> Session:
    """A session whose gyroscope is off by ``bias`` (rad/s) about x."""
    made, _ = simulate_session(replace(shaken(10, 12.0), effects=effects), np.random.default_rng(4))
    return replace(made, recordings=tuple(biased(r, bias) for r in made.recordings))


def test_a_gyroscope_that_is_off_is_no_force() -> None:
    along = _along(_ideal(_off(0.05, {})))
    assert along.beyond
    assert not any(acts(p.candidate) or p.candidate.build is not None for p in along.promises)
    most = along.promises[0].gain
    (bias,) = (p for p in along.promises if set(p.values) == {"imu.gyroscope_bias.x"})
    # A sensitivity to gravity, with the bias free beside it, says the same in more numbers
    assert bias.gain > 0.9 * most
    assert bias.values["imu.gyroscope_bias.x"] == pytest.approx(0.05, rel=0.2)


def _lagging(recording: Recording, lag: float) -> Recording:
    """The recording with its first cell behind a low-pass of time constant ``lag`` (s)."""
    name, tension = next(iter(recording.tension.items()))
    step = float(np.median(np.diff(tension.time)))
    decay = np.exp(-step / lag)
    values = tension.values.astype(float)
    start = [decay * values[0]]
    late = lfilter([1.0 - decay], [1.0, -decay], values, axis=0, zi=start)[0]
    return replace(recording, tension={**recording.tension, name: replace(tension, values=late)})


@pytest.mark.long
def test_a_cell_that_lags_is_told_from_forces() -> None:
    made, _ = simulate_session(shaken(10, 12.0), np.random.default_rng(4))
    session = replace(made, recordings=tuple(_lagging(r, 0.05) for r in made.recordings))
    cell = next(iter(made.recordings[0].tension))
    first = _along(_ideal(session)).promises[0]
    assert first.candidate.label in (f"sensor_lag {cell}", f"clock_offset {cell}")


@pytest.mark.long
def test_what_devices_contradict_leads_to_what_acts_on_the_body() -> None:
    said: list[str] = []
    found = identify(_off(0.012, {"hinge_friction": (4.0,)}), lambda stage, share: said.append(stage))
    assert found.mismatch.verdict == "explained"
    assert {f.effect for f in found.mismatch.findings} == {"imu_bias", "hinge_friction"}
    assert any("imu_bias imu x, and hinge_friction" in stage for stage in said)
