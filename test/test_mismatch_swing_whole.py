"""Of models of whole runs the one is taken for which fitted and held-out runs together say most."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import pytest

from rig_identification.estimate.fitted import Fitted
from rig_identification.mismatch import swing_whole
from rig_identification.mismatch.swing_whole import Whole, likeliest

RUN, OTHER = ("run_2", 0.0), ("run_3", 0.0)


@dataclass(frozen=True)
class Said:
    """A model by what its runs say of it: nats of the fitted ones, and of each held-out one it follows."""

    score: float
    held: dict[tuple[str, float], float]

    @property
    def evaluation(self) -> float:
        return self.score


def taken(monkeypatch: pytest.MonkeyPatch, ideal: Said, *models: Said) -> Said | None:
    monkeypatch.setattr(swing_whole, "held_out_densities", lambda fitted: fitted.held)
    monkeypatch.setattr(swing_whole, "log_evidence", lambda evaluation: evaluation)
    found = likeliest(cast(list[Whole], list(models)), cast(Fitted, ideal), lambda m: cast(Fitted, m))
    return cast(Said | None, found)


def test_all_runs_together_decide(monkeypatch: pytest.MonkeyPatch) -> None:
    ideal = Said(1000.0, {RUN: 900.0})
    bent, sound = Said(1400.0, {RUN: 910.0}), Said(1390.0, {RUN: 930.0})
    assert taken(monkeypatch, ideal, bent, sound) is sound
    assert taken(monkeypatch, ideal, sound, bent) is sound


def test_what_predicts_worse_than_the_ideal_model_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever it makes of the fitted runs."""
    ideal, bent = Said(1000.0, {RUN: 900.0}), Said(5000.0, {RUN: 899.0})
    assert taken(monkeypatch, ideal, bent) is None
    weak = Said(1001.0, {RUN: 901.0})
    assert taken(monkeypatch, ideal, bent, weak) is weak


def test_what_the_runs_do_not_ask_for_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    assert taken(monkeypatch, Said(1000.0, {RUN: 900.0}), Said(990.0, {RUN: 905.0})) is None


def test_a_model_that_loses_a_run_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    ideal = Said(1000.0, {RUN: 900.0, OTHER: 10.0})
    assert taken(monkeypatch, ideal, Said(2000.0, {RUN: 950.0})) is None


def test_a_run_that_only_some_follow_says_nothing_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    ideal = Said(1000.0, {RUN: 900.0})
    more, fewer = Said(1100.0, {RUN: 910.0, OTHER: -500.0}), Said(1050.0, {RUN: 910.0})
    assert taken(monkeypatch, ideal, more, fewer) is more
    # Without a held-out run the fitted ones decide
    assert taken(monkeypatch, Said(1000.0, {}), Said(1001.0, {})) == Said(1001.0, {})
