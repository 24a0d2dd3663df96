"""The first part of runs with a wrench: the motion goes on as it did, and whole runs follow from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.evidence import prepare
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import _begun, _silent, pose_problem
from rig_identification.estimate.prediction import drive
from rig_identification.estimate.solve import evaluate
from rig_identification.search.ladder import Rung, begun
from rig_identification.search.stretch import SECONDS, over_all, stretch_of
from rig_identification.simulate import simulate_session


@pytest.fixture(scope="module")
def whole() -> Rung:
    """A model that lacks a hose, over 30 s."""
    effects = {
        "tether": (2000.0, 0.0, 0.0),
        "tether_pull": (150.0, 0.0, 0.0),
        "tether_point": (0.2, 0.9, 0.0),
    }
    spec = replace(shaken(14, 30.0), effects=effects, doubts=False)
    problem, theta, held = pose_problem(simulate_session(spec, np.random.default_rng(5))[0])
    start = _begun(problem, theta, held, _silent)
    rung = begun(start.problem, start.point)
    assert rung is not None
    assert not rung.alone
    return rung


def test_the_first_part_of_a_run_moves_as_the_run_did(whole: Rung) -> None:
    part = stretch_of(whole)
    assert part.level == whole.level
    for short, long, run in zip(part.evaluation.runs, whole.evaluation.runs, part.problem.runs, strict=True):
        assert run.grid.duration == pytest.approx(SECONDS, rel=0.2)
        same = long.motion.states[: short.motion.states.shape[0], :3]
        assert np.max(np.abs(short.motion.states[:, :3] - same)) < 0.02 * np.ptp(same)
    assert 0.5 < misfit(part.evaluation) < 1.3


def test_a_run_that_is_short_stays_as_it_is(whole: Rung) -> None:
    part = stretch_of(whole)
    assert stretch_of(part) is part


def test_what_was_found_in_a_part_is_carried_over_to_whole_runs(whole: Rung) -> None:
    again = over_all(whole, (), stretch_of(whole))
    assert again.level == whole.level
    assert sum(r.residual.size for r in again.evaluation.runs) == sum(
        r.residual.size for r in whole.evaluation.runs
    )
    # The way down the ladder takes few steps a level: what a part was fitted to may be nearer to the end
    assert again.evidence > whole.evidence - 5.0


def test_wide_nodes_hold_the_same_motion_and_force() -> None:
    session, _ = simulate_session(shaken(3, 6.0), np.random.default_rng(3))
    problem, theta, held = pose_problem(session)
    start = _begun(problem, theta, held, _silent)
    fine = prepare(session.rig, start.problem.runs[0].recording, 0.005)
    wide = fine.with_wide_nodes()
    assert wide.grid.step == 0.01
    assert wide.grid.duration <= fine.grid.duration
    forces = [drive(run, start.problem.bench.parameters, start.point.theta).force for run in (fine, wide)]
    np.testing.assert_allclose(forces[1], forces[0][::2])
    at = [evaluate(replace(start.problem, runs=(run,)), start.point) for run in (fine, wide)]
    assert at[0] is not None
    assert at[1] is not None
    ends = [e.runs[0].motion.states[:, :3] for e in at]
    assert np.max(np.abs(ends[1] - ends[0][::2][: len(ends[1])])) < 1e-5
