"""Along the motion that was measured a force on the body is told at once, and that nothing acts on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_mismatch_push_beside import biased
from test_simulate_identify import shaken

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import Ideal, fit_session, judged, with_pieces
from rig_identification.mismatch.along_measured import along_measured
from rig_identification.mismatch.first_fits import at_noise
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.screen import Promise, with_reference
from rig_identification.mismatch.search import worst_pieces
from rig_identification.mismatch.standing import short_pieces
from rig_identification.mismatch.trial import VERY_FAR, attempt
from rig_identification.mismatch.unbent import at_first
from rig_identification.recording import Session
from rig_identification.simulate import simulate_session

#: N m of each hinge.
RUBBING = 20.0


def quiet(stage: str, fraction: float) -> None:
    """No progress."""


def _ideal(session: Session) -> Ideal:
    fitted = fit_session(session, quiet)
    assert misfit(fitted.evaluation) > VERY_FAR
    return with_pieces(Ideal(fitted, *judged(fitted)), quiet)


def _promises(ideal: Ideal) -> list[Promise]:
    return along_measured(ideal, catalogue(with_reference(ideal.fitted.problem, ideal.fitted.rest)))


@pytest.fixture(scope="module")
def rubbing() -> Ideal:
    spec = replace(shaken(10, 12.0), effects={"hinge_friction": (RUBBING,)})
    return _ideal(simulate_session(spec, np.random.default_rng(4))[0])


def test_dry_hinges_stand_out_of_all_that_brakes(rubbing: Ideal) -> None:
    first, *others = _promises(rubbing)
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
    grown = attempt(here, start, _promises(rubbing)[0], growing=True)
    assert grown is not None
    assert at_noise(grown)
    told = grown.problem.bench.parameters.named(grown.evaluation.point.theta)
    assert abs(told["hinge.friction"] - RUBBING) < 0.02 * RUBBING


def test_a_gyroscope_that_is_off_is_no_force() -> None:
    session, _ = simulate_session(shaken(10, 12.0), np.random.default_rng(4))
    off = replace(session, recordings=tuple(biased(r, 0.05) for r in session.recordings))
    assert _promises(_ideal(off)) == []
