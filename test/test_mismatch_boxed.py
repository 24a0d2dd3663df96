"""What freeing a number promises is what a fit with it free gains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken
from wrong_sessions import wrong

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import Promise, with_reference
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import Trial, fitted_to_its_end, mass_of
from rig_identification.recording import Session
from rig_identification.simulate import simulate_session

#: The cell that reads too much, and by how many of its tolerances: within what the ideal model may blame on
#: it, and beyond, where other numbers make up for the rest and lie at their bounds.
CELL = "load_cell_offset"
WITHIN, BEYOND = 4.0, 12.0


@pytest.fixture(scope="module")
def made() -> Session:
    return simulate_session(replace(shaken(14, 12.0), doubts=False), np.random.default_rng(5))[0]


def promised_and_kept(session: Session, tolerances: float) -> tuple[Fitted, Promise, Trial]:
    cable = next(iter(session.recordings[0].tension))
    doubts = fit_session(session, lambda stage, share: None, None).problem.bench.parameters.free
    tolerance = next(p.prior_std for p in doubts if p.name == f"{cable}.load_cell_zero")
    loud = replace(
        session, recordings=tuple(wrong(r, 0.0, tolerances * tolerance) for r in session.recordings)
    )
    fitted = fit_session(loud, lambda stage, share: None, None)
    problem = with_reference(fitted.problem, fitted.rest)
    zeros = [c for c in catalogue(problem) if c.effect == CELL and c.where["channel"] == cable]
    promises = screen(problem, fitted.evaluation, zeros, mass_of(problem, fitted.evaluation))
    (promise,) = (p for p in promises if p.candidate in zeros)
    trial = fitted_to_its_end(problem, fitted.evaluation, promise)
    assert trial is not None
    return fitted, promise, trial


def at_bounds(fitted: Fitted) -> int:
    bounded = [p.bounded for p in fitted.problem.bench.parameters.free]
    theta = np.abs(fitted.evaluation.point.theta[INERTIAL:])
    return int(np.sum(theta[bounded] > fitted.problem.bound - 1e-6))


@pytest.mark.parametrize(("tolerances", "pressed"), [(WITHIN, 0), (BEYOND, 1)])
def test_a_doubt_promises_what_its_fit_gains(made: Session, tolerances: float, pressed: int) -> None:
    """The prior that it had costs nothing any more, and what lies at a bound for it comes back from there."""
    fitted, promise, trial = promised_and_kept(made, tolerances)
    assert at_bounds(fitted) >= pressed
    gained = fitted.evaluation.cost - trial.evaluation.cost
    assert gained > 2.0
    assert promise.gain == pytest.approx(gained, rel=0.1)
    (value,) = promise.values.values()
    (name,) = promise.values
    assert value == pytest.approx(
        trial.problem.bench.parameters.named(trial.evaluation.point.theta)[name], rel=0.1
    )
