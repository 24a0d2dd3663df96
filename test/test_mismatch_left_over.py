"""What is told where something is left: names beside which next to nothing is, and no effect too many."""

from __future__ import annotations

from dataclasses import replace

import pytest
from test_mismatch_whole_rivals import fit_of, ideal_of, search_in, whole_with
from test_simulate_identify import shaken

from rig_identification.estimate.identify import ORDINARY, Ideal, near_noise
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.left_over import _next_to_none, unexplained
from rig_identification.mismatch.look import Look
from rig_identification.mismatch.named import _adds_nothing
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.screen import Promise
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import Trial
from rig_identification.mismatch.whole_runs import whole_runs

#: N m s/rad in every hinge: so much that next to nothing is left of a swing after ten seconds.
DAMPING = 30.0


@pytest.fixture(scope="module")
def damped() -> tuple[Ideal, Search]:
    ideal = ideal_of(shaken(10, 10.0), {"hinge_damping": (DAMPING,)}, 5)
    return ideal, search_in(ideal)


@pytest.fixture(scope="module")
def aired(damped: tuple[Ideal, Search]) -> tuple[Trial, Explained]:
    """Air, which takes a part of it away, in whole runs."""
    ideal, search = damped
    trial = fit_of(search, "air_drag")
    return trial, whole_with(ideal, search, trial)


def _beside(search: Search, first: Trial, label: str) -> Trial:
    """One more hypothesis beside a first one."""
    own = replace(search, problem=first.problem, evaluation=first.evaluation)
    return fit_of(own, label)


def test_names_that_leave_next_to_nothing_are_told_from_those_that_stand_in(
    damped: tuple[Ideal, Search], aired: tuple[Trial, Explained]
) -> None:
    ideal, search = damped
    assert not near_noise(ideal.fitted)
    damping = fit_of(search, "hinge_damping")
    whole = whole_with(ideal, search, damping)
    assert _next_to_none(ideal, whole, [damping])
    assert not _next_to_none(ideal, aired[1], [aired[0]])
    # What has numbers enough bends to as much of what is none of it
    bends = replace(damping.candidate, parameters=damping.candidate.parameters * 6)
    assert not _next_to_none(ideal, whole, [damping, replace(damping, candidate=bends)])


def test_what_cannot_be_is_not_told_though_it_takes_nearly_all_away(damped: tuple[Ideal, Search]) -> None:
    ideal, search = damped
    damping = fit_of(search, "hinge_damping")
    found = search.forked()
    found.adopt(Trials([damping]), damping)
    found.share = 1.0
    best = whole_runs(ideal, found)
    assert best.possible
    told = unexplained(ideal, found, best, lambda label, fraction: None)
    assert told.mismatch.findings[0].effect == "hinge_damping"
    less = unexplained(ideal, found, replace(best, possible=False), lambda label, fraction: None)
    assert all(f.effect != "hinge_damping" for f in less.mismatch.findings)


def _look(search: Search) -> Look:
    """A look near the noise at which air promises a tenth of what shows, and heavy cables a hundredth."""
    candidates = catalogue(search.problem)
    promises = [
        Promise(next(c for c in candidates if c.effect == effect), gain, {}, share)
        for effect, gain, share in (("air_drag", 1e3, 0.1), ("cable_mass", 9e2, 0.01))
    ]
    return Look(
        search.problem,
        search.evaluation,
        search.problem,
        search.evaluation,
        candidates,
        promises,
        1e3,
        ORDINARY,
        False,
        lambda label: None,
        UNLIMITED,
        None,
    )


def test_near_the_noise_what_takes_a_hundredth_of_what_shows_is_not_fitted(
    damped: tuple[Ideal, Search],
) -> None:
    look = _look(damped[1])
    assert look._worthy(look.promises) == look.promises[:1]
    assert replace(look, far=True)._worthy(look.promises) == look.promises


def test_what_time_was_short_of_is_named_and_ties_with_nothing(damped: tuple[Ideal, Search]) -> None:
    ideal, search = damped
    look = _look(search)
    waiting = look.waiting
    assert [p.candidate.effect for p in waiting] == ["air_drag"]
    look.notify(waiting[0].candidate.label)
    assert not look.waiting
    over = replace(search.forked(), budget=Budget(0.0), waiting=waiting)
    told = unexplained(ideal, over, None, lambda stage, share: None)
    assert told.mismatch.verdict == "unexplained"
    assert "short of air_drag and others." in told.mismatch.explanation
    last = told.mismatch.alternatives[-1]
    assert (last["effect"], last["fitted"]) == ("air_drag", False)
    # First order says that nine tenths are left with it
    assert last["log_likelihood_gap"] == pytest.approx(9e3)
    in_time = unexplained(ideal, replace(over, budget=UNLIMITED), None, lambda stage, share: None)
    assert not in_time.mismatch.alternatives


@pytest.mark.parametrize(("label", "nothing"), [("exciter_gain exciter", True), ("hinge_damping", False)])
def test_one_more_that_leaves_most_of_what_was_left_is_not_kept(
    damped: tuple[Ideal, Search], aired: tuple[Trial, Explained], label: str, nothing: bool
) -> None:
    ideal, search = damped
    air, alone = aired
    assert alone.mismatch.verdict == "unexplained"
    begun = search.forked()
    begun.adopt(Trials([air]), air)
    before = begun.forked()
    other = _beside(search, air, label)
    begun.adopt(Trials([other]), other)
    both = whole_runs(ideal, begun)
    assert _adds_nothing(both, alone) is nothing
    begun.back_to(before)
    assert [t.candidate.label for t in begun.found] == ["air_drag"]
    assert begun.evaluation is before.evaluation
