"""What is told where something is left: names that leave next to nothing, and the wrench that is missing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.identify import Ideal, fit_session, judged
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.mismatch.unknown import missing_finding
from rig_identification.result import ELEMENTS
from rig_identification.search import unexplained
from rig_identification.search.ladder import Rung, fitted_at
from rig_identification.search.levels import ALONE
from rig_identification.search.unexplained import WEAKER, WRONG, _partly, strongest_missing, without_device
from rig_identification.simulate import simulate_session


def partly(
    monkeypatch: pytest.MonkeyPatch,
    *,
    possible: bool = True,
    left: float = 1.2,
    weaker: int = WEAKER,
    contradicted: bool = False,
    held_out: float | None = 1.4,
    named: bool = True,
) -> bool:
    """Whether names are told that leave so much, and make the wrench weaker by so many levels."""
    monkeypatch.setattr(unexplained, "misfit", lambda evaluation: left)
    monkeypatch.setattr(unexplained, "hear", lambda fitted: SimpleNamespace(contradicted=contradicted))
    monkeypatch.setattr(unexplained, "scores", lambda fitted: SimpleNamespace(holdout=held_out))
    told = SimpleNamespace(findings=("named",) if named else ())
    found = SimpleNamespace(possible=possible, fitted=SimpleNamespace(evaluation=None), mismatch=told)
    first, likeliest = (SimpleNamespace(rung=SimpleNamespace(level=level)) for level in (1, 1 + weaker))
    outcome = SimpleNamespace(partly=found, first=first, likeliest=likeliest)
    partial = _partly(outcome)  # type: ignore[arg-type]
    assert partial in (None, found)
    return partial is found


def test_names_are_told_beside_which_next_to_nothing_is(monkeypatch: pytest.MonkeyPatch) -> None:
    assert partly(monkeypatch)
    assert not partly(monkeypatch, left=1.01 * WRONG)
    # They bend to what is none of them: the wrench stays
    assert not partly(monkeypatch, weaker=WEAKER - 1)
    assert not partly(monkeypatch, contradicted=True)
    assert not partly(monkeypatch, contradicted=True, held_out=None)
    # A run moves sharp numbers by some std, and is predicted all the same
    assert partly(monkeypatch, contradicted=True, held_out=1.01)
    # Less than nothing of an amount, or none
    assert not partly(monkeypatch, possible=False)
    assert not partly(monkeypatch, named=False)
    nothing = SimpleNamespace(partly=None, first=SimpleNamespace(rung=None))
    assert _partly(nothing) is None  # type: ignore[arg-type]


#: N/m and N of a hose along x.
STIFFNESS, PULL = 2000.0, 150.0


def test_the_missing_wrench_is_as_strong_as_what_is_left_out_and_acts_where_it_does() -> None:
    effects = {
        "tether": (STIFFNESS, 0.0, 0.0),
        "tether_pull": (PULL, 0.0, 0.0),
        "tether_point": (0.2, 0.9, 0.0),
    }
    problem, found = seen_by_the_true_body(replace(shaken(14, 8.0), effects=effects, doubts=False), 5)
    rung = fitted_at(problem, replace(found.point, latents=()), 2, 0)
    assert rung is not None
    missing = strongest_missing(rung)
    assert missing is not None
    assert missing.recording == "run_1"
    assert missing.wrench.shape == (missing.time.size, 6)
    told = missing_finding(missing, problem.bench.rig, None)
    assert told.where["axis"] == "x"
    # A spring follows how far its point has moved: the middle of the smoothed motion is what it was held at
    moved = STIFFNESS * float(np.std(missing.states[:, 0]))
    assert told.parameters["force"]["value"] == pytest.approx(moved, rel=0.5)
    # Where the evidence asks for no wrench it is looked for at a weak one
    alone = strongest_missing(Rung(problem, rung.evaluation, ALONE))
    assert alone is not None
    assert alone.recording == "run_1"


def test_where_everything_but_one_device_agrees_the_others_tell_the_body() -> None:
    """A motor that hums into a cell: with it heard the body is bent to the hum."""
    made, truth = simulate_session(shaken(12, 10.0), np.random.default_rng(6))
    runs = []
    for run in made.recordings:
        tension = dict(run.tension)
        cell = tension["cable_2"]
        if run.kind == "dynamic":
            hum = 30.0 * np.sin(2.0 * np.pi * 1.4 * cell.time + np.cos(3.0 * cell.time))[:, None]
            tension["cable_2"] = replace(cell, values=cell.values + hum)
        runs.append(replace(run, tension=tension))
    fitted = fit_session(replace(made, recordings=tuple(runs)))
    ideal = Ideal(fitted, *judged(fitted))
    assert ideal.mismatch.verdict == "unexplained"
    others = without_device(ideal, "cable_2", lambda stage, done: None)
    assert others is not None
    told = inertial_estimate(others.fitted.problem, others.fitted.evaluation)
    off = np.abs(told.values - truth.elements) / np.sqrt(np.diag(told.covariance))
    known = np.array([name not in told.unobservable for name in ELEMENTS])
    assert known.sum() >= 7
    assert np.max(off[known]) < 3.5
    bent = inertial_estimate(fitted.problem, fitted.evaluation)
    assert np.max(np.abs(bent.values - truth.elements) / np.sqrt(np.diag(bent.covariance))) > 5.0
