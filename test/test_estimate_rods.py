"""Whether a rig hangs on ropes or on rods is read off its load cells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.evidence import Run, prepare
from rig_identification.estimate.identify import fit_session, pose_problem
from rig_identification.estimate.rods import note_of, rods_of
from rig_identification.mismatch.supports import cable_elasticity
from rig_identification.model import layout
from rig_identification.recording import Session
from rig_identification.simulate import simulate_session


@pytest.fixture(scope="module")
def session() -> Session:
    return simulate_session(shaken(14, 4.0), np.random.default_rng(3))[0]


def pulling(session: Session, force: np.ndarray) -> tuple[Run, ...]:
    """The runs with ``force`` (n,) N in the first cable."""
    runs = []
    for recording in session.training:
        run = prepare(session.rig, recording)
        channels = list(run.channels)
        at = next(i for i, c in enumerate(channels) if c.quantity == "tension")
        c = channels[at]
        channels[at] = replace(c, values=np.interp(c.time, np.linspace(0.0, 4.0, force.size), force)[:, None])
        runs.append(replace(run, channels=tuple(channels)))
    return tuple(runs)


SWING = 300.0 + 500.0 * np.sin(np.linspace(0.0, 20.0, 400))


@pytest.mark.parametrize(
    ("force", "found"),
    [(SWING, True), (np.maximum(SWING, 0.0), False), (SWING + 400.0, False)],
    ids=["rod", "rope that goes slack", "rope"],
)
def test_what_pushes_is_a_rod(session: Session, force: np.ndarray, found: bool) -> None:
    rods = rods_of(session.rig, pulling(session, force))
    assert rods == ((session.rig.cables[0].name,) if found else ())


def test_rods_do_not_let_go_in_the_model_and_stretch_both_ways(session: Session) -> None:
    recording = session.training[0]
    name = session.rig.cables[0].name
    cell = recording.tension[name]
    pushed = replace(cell, values=cell.values - 2.0 * np.median(cell.values))
    changed = replace(recording, tension={**recording.tension, name: pushed})
    others = tuple(changed if r is recording else r for r in session.recordings)
    problem, _, _ = pose_problem(replace(session, recordings=others))
    model = problem.bench.parameters.model
    assert list(model.can_slacken) == [c.name != name for c in session.rig.cables]
    stretched, _ = cable_elasticity(session.rig, model, 1000.0).built(model)
    expected = [layout.ELASTIC_ROD if c.name == name else layout.ELASTIC for c in session.rig.cables]
    assert list(stretched.modes) == expected
    assert name in note_of((name,))


def test_ropes_stay_ropes(session: Session) -> None:
    fitted = fit_session(session)
    assert np.all(fitted.problem.bench.parameters.model.can_slacken)
    assert not any("rods" in note for note in fitted.notes)
