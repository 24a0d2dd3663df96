"""What the queue names is put right by whole runs, held-out ones among them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from wrong_sessions import ideal_of, made_twice

from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.verdict import held_out_densities
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.hypotheses import catalogue, count_of
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import Trial, fitted_to_its_end, mass_of
from rig_identification.mismatch.whole_runs import Named, pruned, whole_runs
from rig_identification.search.expand import Standing
from rig_identification.search.ladder import Rung
from rig_identification.search.levels import ALONE
from rig_identification.search.search import problem_of
from rig_identification.search.whole import Model, _beside_rivals, _likeliest

#: N m s/rad in every hinge; nats by which the wrong one is put ahead; error of the first cell's gain.
DAMPING, AHEAD, TOO_MUCH = 1.0, 2.0, 0.02
CELL, HINGES = "load_cell_gain cable_1", "hinge_damping"
GAIN = "cable_1.load_cell_gain"


@pytest.fixture(scope="module")
def ideal() -> Ideal:
    return ideal_of(made_twice(10, 10.0, 5, {"hinge_damping": (DAMPING,)}))


@pytest.fixture(scope="module")
def problem(ideal: Ideal) -> Problem:
    return problem_of(ideal)


def fit_of(problem: Problem, ideal: Ideal, label: str, beside: Trial | None = None) -> Trial:
    """A hypothesis, fitted to its end beside another one, if any."""
    here = problem if beside is None else beside.problem
    evaluation = ideal.fitted.evaluation if beside is None else beside.evaluation
    promises = screen(here, evaluation, catalogue(problem), mass_of(here, evaluation))
    ended = fitted_to_its_end(here, evaluation, next(p for p in promises if p.candidate.label == label))
    assert ended is not None
    return ended


def test_held_out_runs_put_damping_before_the_friction_that_chance_put_first(
    ideal: Ideal, problem: Problem
) -> None:
    damping, friction = (fit_of(problem, ideal, label) for label in (HINGES, "hinge_friction"))
    friction = replace(friction, evidence=damping.evidence + AHEAD)
    named = _beside_rivals(Named(problem, (friction,), UNLIMITED), [damping])
    assert named.rivals[0]["log_likelihood_gap"] == pytest.approx(AHEAD)
    wrong = whole_runs(ideal, named)
    assert [f.effect for f in wrong.mismatch.findings] == ["hinge_friction"]
    how, best = _likeliest(ideal, named, wrong, [Model((), friction), Model((), damping)], lambda label: None)
    assert [f.effect for f in best.mismatch.findings] == ["hinge_damping"]
    assert [t.candidate.effect for t in how.found] == ["hinge_damping"]
    after, before = held_out_densities(best.fitted), held_out_densities(wrong.fitted)
    gain = after["run_2", 0.0] - before["run_2", 0.0]
    assert gain > AHEAD
    (other,) = best.mismatch.alternatives
    assert other["effect"] == "hinge_friction"
    # What the fitted runs say is what they say at the end of fits to all of them
    assert float(str(other["log_likelihood_gap"])) == pytest.approx(gain - AHEAD, abs=0.1)
    assert len(best.bodies) == 1


def test_what_trails_by_far_is_not_asked_of_held_out_runs(ideal: Ideal, problem: Problem) -> None:
    damping, friction = (fit_of(problem, ideal, label) for label in (HINGES, "hinge_friction"))
    far = replace(friction, evidence=damping.evidence - 31.0)
    named = _beside_rivals(Named(problem, (damping,), UNLIMITED), [far])
    alone = whole_runs(ideal, named)
    said: list[str] = []
    how, best = _likeliest(ideal, named, alone, [Model((), damping), Model((), far)], said.append)
    assert best is alone
    assert how is named
    assert not said


def test_an_effect_is_as_likely_as_another_wherever_it_is(ideal: Ideal, problem: Problem) -> None:
    candidates = catalogue(problem)
    hinge = next(c for c in candidates if c.effect == "hinge_position")
    level = next(c for c in candidates if c.effect == "level_error")
    assert (hinge.places, level.places) == (sum(c.effect == "hinge_position" for c in candidates), 2)
    rung = Rung(problem, ideal.fitted.evaluation, ALONE)
    at_hinge, of_level = Standing(rung, (hinge,)), Standing(rung, (level,))
    assert of_level.evidence - at_hinge.evidence == pytest.approx(np.log(hinge.places / 2.0))
    assert Standing(rung).evidence - of_level.evidence == pytest.approx(np.log(2.0))
    # What it gains from noise alone is none
    assert Standing(rung, unearned=4.0).evidence == pytest.approx(rung.evidence - 4.0)


@pytest.mark.parametrize("there", [False, True])
def test_the_first_goes_where_the_second_needs_none(there: bool, ideal: Ideal, problem: Problem) -> None:
    """A cell's gain that only stood in for dry hinges, and one that is there beside them."""
    if there:
        ideal = ideal_of(made_twice(10, 10.0, 5, {"hinge_damping": (DAMPING,), GAIN: (TOO_MUCH,)}))
        problem = problem_of(ideal)
    first = fit_of(problem, ideal, CELL)
    second = fit_of(problem, ideal, HINGES, first)
    values = second.problem.bench.parameters.named(second.evaluation.point.theta)
    assert values[GAIN] == pytest.approx(TOO_MUCH if there else 0.0, abs=0.002)
    named = Named(problem, (first, second), UNLIMITED)
    both = whole_runs(ideal, named)
    assert both.told
    kept = pruned(both, named, count_of(catalogue(problem)))
    assert {f.effect for f in kept.mismatch.findings} == (
        {"load_cell_gain", "hinge_damping"} if there else {"hinge_damping"}
    )
