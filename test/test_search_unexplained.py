"""What is told where something is left: names that leave next to nothing, and the wrench that is missing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.mismatch.unknown import missing_finding
from rig_identification.search import unexplained
from rig_identification.search.ladder import Rung, fitted_at
from rig_identification.search.levels import ALONE
from rig_identification.search.unexplained import WEAKER, WRONG, _partly, strongest_missing


def partly(
    monkeypatch: pytest.MonkeyPatch,
    *,
    possible: bool = True,
    left: float = 1.2,
    weaker: int = WEAKER,
    contradicted: bool = False,
) -> bool:
    """Whether names are told that leave so much, and make the wrench weaker by so many levels."""
    monkeypatch.setattr(unexplained, "misfit", lambda evaluation: left)
    monkeypatch.setattr(unexplained, "hear", lambda fitted: SimpleNamespace(contradicted=contradicted))
    found = SimpleNamespace(possible=possible, fitted=SimpleNamespace(evaluation=None))
    first, likeliest = (SimpleNamespace(rung=SimpleNamespace(level=level)) for level in (1, 1 + weaker))
    outcome = SimpleNamespace(partly=found, first=first, likeliest=likeliest)
    told = _partly(outcome)  # type: ignore[arg-type]
    assert told in (None, found)
    return told is found


def test_names_are_told_beside_which_next_to_nothing_is(monkeypatch: pytest.MonkeyPatch) -> None:
    assert partly(monkeypatch)
    assert not partly(monkeypatch, left=1.01 * WRONG)
    # They bend to what is none of them: the wrench stays
    assert not partly(monkeypatch, weaker=WEAKER - 1)
    assert not partly(monkeypatch, contradicted=True)
    # Less than nothing of an amount
    assert not partly(monkeypatch, possible=False)
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
