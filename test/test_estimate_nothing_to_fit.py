"""Sessions of which little or nothing can be fitted: refused in one line, or answered without a ``nan``."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.errors import InputError
from rig_identification.estimate.followable import followable
from rig_identification.estimate.identify import fit_session, judged, pose_problem
from rig_identification.estimate.launch import Launch
from rig_identification.estimate.solve import CannotBeFollowed, Point
from rig_identification.estimate.unanswered import unanswered
from rig_identification.model.motion import State
from rig_identification.recording import Session
from rig_identification.report.result_json import result_to_dict
from rig_identification.search.identify import identify
from rig_identification.simulate import SampleRates, simulate_session


@pytest.fixture(scope="module")
def session() -> Session:
    """Rest, and a run of 2 s."""
    return simulate_session(shaken(14, 2.0), np.random.default_rng(1))[0]


def held_out(session: Session) -> Session:
    recordings = tuple(replace(r, holdout=r.kind == "dynamic") for r in session.recordings)
    return replace(session, recordings=recordings)


def test_nothing_but_held_out_runs_is_refused_and_says_what_to_do(session: Session) -> None:
    session = held_out(session)
    session = replace(session, recordings=tuple(r for r in session.recordings if r.kind == "dynamic"))
    with pytest.raises(InputError, match=r"every run is held out \(run_1\).*take holdout: true"):
        identify(session)


@pytest.mark.parametrize("run", [True, False])
def test_rest_alone_is_fitted_and_no_text_says_nan(session: Session, run: bool) -> None:
    """With a held-out run beside it, and without any."""
    session = held_out(session)
    if not run:
        session = replace(session, recordings=session.statics)
    fitted = fit_session(session)
    scores, mismatch = judged(fitted)
    assert np.isfinite(scores.training)
    assert (scores.holdout is not None) == run
    assert "nan" not in mismatch.explanation


def test_motion_capture_of_held_out_runs_alone_is_left_aside() -> None:
    """How a tracker stands in the room is fitted: to no held-out run."""
    spec = replace(shaken(14, 2.0), rates=SampleRates(200.0, 500.0, 0.0, 100.0, 50.0, 60.0, 0.0))
    spec = replace(spec, runs=(*spec.runs, replace(spec.runs[0], name="run_2", holdout=True)))
    session, _ = simulate_session(spec, np.random.default_rng(2))
    recordings = tuple(replace(r, mocap=r.mocap if r.holdout else None) for r in session.recordings)
    problem, _, held = pose_problem(replace(session, recordings=recordings))
    assert not any(run.watched for run in (*problem.runs, *held))
    assert any(run.channels for run in held)
    assert not any(q.name.startswith("mocap.") for q in problem.bench.parameters.free)


def test_where_nothing_can_be_followed_all_but_the_weighed_mass_is_null(session: Session) -> None:
    problem, theta, _ = pose_problem(session)
    nowhere = State(np.full(3, np.nan), np.eye(3), np.zeros(3), np.zeros(3))
    point = Point(theta, (nowhere,) * len(problem.runs), (nowhere,) * len(problem.rests))
    with pytest.raises(CannotBeFollowed) as caught:
        followable(problem, point, nowhere)
    answer = result_to_dict(unanswered(session, caught.value))
    text = json.dumps(answer, allow_nan=False)
    assert "nan" not in text
    assert answer["mass"] == {"value": session.rig.mass, "std": session.rig.mass_std}
    assert answer["inertia"]["value"] == [[None] * 3] * 3  # type: ignore[index]
    assert answer["mismatch"]["verdict"] == "unexplained"  # type: ignore[index]
    assert all(r.name in unanswered(session, caught.value).mismatch.explanation for r in session.recordings)


def test_what_can_be_followed_stays_and_the_rest_is_named(session: Session) -> None:
    problem, theta, _ = pose_problem(session)
    launch = Launch(problem, theta).from_rest()
    assert launch.rest is not None
    nowhere = State(np.full(3, np.nan), np.eye(3), np.zeros(3), np.zeros(3))
    guesses = (nowhere, *((launch.rest,) * (len(problem.rests) - 1)))
    found = followable(problem, Point(launch.theta, launch.starts, guesses), launch.rest)
    assert found.names == (problem.rests[0].recording.name,)
    assert found.problem.runs == problem.runs
    assert found.problem.rests == problem.rests[1:]
