"""Along the motion that was measured a force on the body is told at once, and that nothing acts on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_mismatch_push_beside import biased
from test_simulate_identify import shaken

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import Ideal, fit_session, judged, with_pieces
from rig_identification.mismatch.along_measured import along_measured
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.screen import with_reference
from rig_identification.mismatch.trial import VERY_FAR
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


def _promises(ideal: Ideal) -> list[tuple[str, float, dict[str, float]]]:
    problem = with_reference(ideal.fitted.problem, ideal.fitted.rest)
    return [(p.candidate.effect, p.gain, p.values) for p in along_measured(ideal, catalogue(problem))]


def test_dry_hinges_stand_out_of_all_that_brakes() -> None:
    spec = replace(shaken(10, 12.0), effects={"hinge_friction": (RUBBING,)})
    promises = _promises(_ideal(simulate_session(spec, np.random.default_rng(4))[0]))
    (first, gain, values), *others = promises
    assert first == "hinge_friction"
    assert gain > 1.2 * max(other for effect, other, _ in others)
    assert abs(values["hinge.friction"] - RUBBING) < 0.3 * RUBBING


def test_a_gyroscope_that_is_off_is_no_force() -> None:
    session, _ = simulate_session(shaken(10, 12.0), np.random.default_rng(4))
    off = replace(session, recordings=tuple(biased(r, 0.05) for r in session.recordings))
    assert _promises(_ideal(off)) == []
