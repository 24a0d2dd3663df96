"""Two small errors at once, which a hypothesis of many numbers bends to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import fit_session, near_noise
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.hypotheses import catalogue, count_of
from rig_identification.mismatch.pairs import first_of_two
from rig_identification.mismatch.screen import promises_of, screen, together, with_reference
from rig_identification.mismatch.trial import Trial, mass_of
from rig_identification.recording import Recording, Session
from rig_identification.simulate import simulate_session

#: Turn of the inclinometer about y, rad, and what the first cell reads too much, N: each some tolerances.
TURNED, TOO_MUCH = 0.004, 40.0


def wrong(recording: Recording, turned: float, too_much: float) -> Recording:
    """The recording as two devices that are a little wrong would have made it."""
    name, tension = next(iter(recording.tension.items()))
    inclination = recording.inclination
    assert inclination is not None
    tilted = replace(inclination, values=inclination.values + np.array([0.0, turned]))
    loud = {**recording.tension, name: replace(tension, values=tension.values + too_much)}
    return replace(recording, inclination=tilted, tension=loud)


def _session(turned: float, too_much: float) -> Session:
    spec = shaken(14, 12.0)
    made = simulate_session(spec, np.random.default_rng(5))[0]
    return replace(made, recordings=tuple(wrong(r, turned, too_much) for r in made.recordings))


def _first(session: Session) -> tuple[Fitted, Trial | None, list[str]]:
    fitted = fit_session(session, lambda stage, share: None, None)
    problem, evaluation = with_reference(fitted.problem, fitted.rest), fitted.evaluation
    candidates, mass = catalogue(problem), mass_of(problem, evaluation)
    promises, told = screen(problem, evaluation, candidates, mass), []
    led = first_of_two(problem, evaluation, promises, count_of(candidates), 3.0, 3.0, told.append, UNLIMITED)
    return fitted, led.first if led is not None and led.leads else None, told


@pytest.fixture(scope="module")
def both() -> tuple[Fitted, Trial | None, list[str]]:
    return _first(_session(TURNED, TOO_MUCH))


def test_two_small_errors_are_told_from_a_third_hypothesis(
    both: tuple[Fitted, Trial | None, list[str]],
) -> None:
    fitted, first, told = both
    assert near_noise(fitted)
    assert told, "no pair was worth more than every single hypothesis"
    assert first is not None
    assert first.candidate.effect in ("inclinometer_offset", "load_cell_offset")


def test_what_hardly_meets_promises_together_what_each_does(
    both: tuple[Fitted, Trial | None, list[str]],
) -> None:
    fitted = both[0]
    problem = with_reference(fitted.problem, fitted.rest)
    wanted = ("load_cell_offset cable_1", "inclinometer_offset inclinometer y")
    one, other = (next(c for c in catalogue(problem) if c.label == label) for label in wanted)
    (gain,) = together(problem, fitted.evaluation, [(one, other)])
    alone = promises_of(problem, fitted.evaluation, [one, other])
    assert gain == pytest.approx(sum(p.gain for p in alone), rel=0.1)


def test_one_error_is_no_pair() -> None:
    _, first, _ = _first(_session(0.0, 2.0 * TOO_MUCH))
    assert first is None
