"""What short pieces or chance put first is put right by whole and held-out runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.identify import Ideal, fit_session, judged
from rig_identification.estimate.solve import excess
from rig_identification.estimate.verdict import held_out_densities
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import FITTED, catalogue, count_of, needed_gain, worth_a_fit
from rig_identification.mismatch.outcome import MEANT, Trials
from rig_identification.mismatch.screen import Promise, screen, with_reference
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import Trial, among_places, attempt, finished, mass_of
from rig_identification.mismatch.whole_rivals import likeliest_whole, outdone
from rig_identification.mismatch.whole_runs import whole_runs
from rig_identification.simulate import SessionSpec, simulate_session

#: N m s/rad in every hinge; nats by which the wrong one is put ahead.
DAMPING, AHEAD = 1.0, 2.0


def ideal_of(spec: SessionSpec, effects: dict[str, tuple[float, ...]], seed: int) -> Ideal:
    """The ideal model fitted to a session with effects and the same run once more, held out."""
    again = replace(spec.runs[0], name="run_2", holdout=True)
    spec = replace(spec, runs=(*spec.runs, again), effects=effects, doubts=False)
    fitted = fit_session(simulate_session(spec, np.random.default_rng(seed))[0])
    return Ideal(fitted, *judged(fitted))


def search_in(ideal: Ideal) -> Search:
    """A search in whole runs, with nothing found yet."""
    problem = with_reference(ideal.fitted.problem, ideal.fitted.rest)
    evaluation = ideal.fitted.evaluation
    return Search(problem, problem, evaluation, excess(evaluation), UNLIMITED)


def whole_with(ideal: Ideal, search: Search, trial: Trial) -> Explained:
    """Whole runs with a hypothesis."""
    own = replace(search, found=[], rivals=[])
    own.adopt(Trials([trial]), trial)
    return whole_runs(ideal, own)


@pytest.fixture(scope="module")
def ideal() -> Ideal:
    return ideal_of(shaken(10, 10.0), {"hinge_damping": (DAMPING,)}, 5)


@pytest.fixture(scope="module")
def search(ideal: Ideal) -> Search:
    return search_in(ideal)


def fit_of(search: Search, label: str) -> Trial:
    problem, evaluation = search.problem, search.evaluation
    promises = screen(problem, evaluation, catalogue(problem), mass_of(problem, evaluation))
    begun = attempt(problem, evaluation, next(p for p in promises if p.candidate.label == label))
    ended = None if begun is None else finished(begun)
    assert ended is not None
    return ended


def test_held_out_runs_put_damping_before_the_friction_that_chance_put_first(
    ideal: Ideal, search: Search
) -> None:
    damping, friction = fit_of(search, "hinge_damping"), fit_of(search, "hinge_friction")
    friction = replace(friction, evidence=damping.evidence + AHEAD)
    tried = Trials([friction, damping])
    first = replace(search, found=[], rivals=[])
    first.adopt(tried, friction)
    wrong = whole_runs(ideal, first)
    assert [f.effect for f in wrong.mismatch.findings] == ["hinge_friction"]
    best, how = likeliest_whole(ideal, search, tried, wrong, first, lambda label: None)
    assert [f.effect for f in best.mismatch.findings] == ["hinge_damping"]
    assert [t.candidate.effect for t in how.found] == ["hinge_damping"]
    after, before = held_out_densities(best.fitted), held_out_densities(wrong.fitted)
    gain = after["run_2", 0.0] - before["run_2", 0.0]
    assert gain > AHEAD
    (other,) = best.mismatch.alternatives
    assert other["effect"] == "hinge_friction"
    assert float(str(other["log_likelihood_gap"])) == pytest.approx(gain - AHEAD, rel=1e-6)
    assert len(best.bodies) == 1
    assert not search.found


def test_an_effect_is_as_likely_as_another_wherever_it_is(search: Search) -> None:
    candidates = catalogue(search.problem)
    hinge = next(c for c in candidates if c.effect == "hinge_position")
    level = next(c for c in candidates if c.effect == "level_error")
    assert (hinge.places, level.places) == (sum(c.effect == "hinge_position" for c in candidates), 2)
    at_hinge = among_places(Trial(hinge, search.problem, search.evaluation, 10.0))
    of_level = among_places(Trial(level, search.problem, search.evaluation, 10.0))
    assert of_level.evidence - at_hinge.evidence == pytest.approx(np.log(hinge.places / 2.0))


def test_what_leaves_a_trace_is_kept_where_what_leaves_none_is_far_less_likely(
    ideal: Ideal, search: Search
) -> None:
    """Air is no rival of damping, and damping is one of it."""
    found = []
    for label in ("hinge_damping", "air_drag"):
        trial = fit_of(search, label)
        found.append((trial, whole_with(ideal, search, trial)))
    (damping, with_damping), (drag, with_drag) = found
    assert outdone(ideal, damping, with_damping, drag, with_drag)
    assert not outdone(ideal, drag, with_drag, damping, with_damping)


def test_a_tie_is_stated_though_its_amount_may_as_well_be_none(search: Search) -> None:
    """A hose of 7 noises was told as entrained air, and nothing was said of the hose (session 14240)."""
    candidates = {c.label: c for c in catalogue(search.problem)}

    def fitted(label: str, evidence: float) -> Trial:
        return Trial(candidates[label], search.problem, search.evaluation, evidence, True)

    air, drag = fitted("air_added_mass", 10.0), fitted("air_drag", 2.0)
    hose, damping = fitted("tether x", 10.5), fitted("hinge_damping", 10.0 - MEANT)
    tried = Trials([air, drag], unsure=(hose, damping))
    assert tried.rivals_of(air) == [(8.0, drag), (0.0, hose)]
    # What is told is no rival of itself, wherever it acts, and what is likelier than it was refuted before
    along_y = fitted("tether y", 10.0)
    assert tried.rivals_of(along_y) == [(0.0, air), (8.0, drag)]
    assert tried.rivals_of(drag) == [(0.0, hose), (0.0, damping)]


def test_slow_hypotheses_take_no_place_from_quick_ones(search: Search) -> None:
    candidates = catalogue(search.problem)
    count = count_of(candidates)
    slow = [c for c in candidates if c.slow][: 2 * FITTED]
    quick = [c for c in candidates if not c.slow and c.doubted][:1]
    enough = max(needed_gain(c, count) for c in candidates)
    promises = [Promise(c, (3.0 - 0.01 * i) * enough, {}) for i, c in enumerate(slow)]
    promises += [Promise(c, 2.0 * enough, {}) for c in quick]
    chosen = [p.candidate.label for p in worth_a_fit(promises, count)]
    assert quick[0].label in chosen
    assert sum(label in chosen for label in (c.label for c in slow)) <= FITTED
