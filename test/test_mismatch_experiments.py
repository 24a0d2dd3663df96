"""Alternatives say how much of them there would be, and which experiment would tell."""

from __future__ import annotations

import pytest

from bench.concealed.wording import PARAMETERS
from rig_identification.mismatch.experiments import experiment_for
from rig_identification.report.findings import alternative_views
from rig_identification.result import Mismatch


@pytest.mark.parametrize("effect", sorted(set(PARAMETERS) - {"cable_slack"}))
def test_every_effect_of_the_contract_has_an_experiment(effect: str) -> None:
    """But for slack, which is seen and has no rival."""
    assert len(experiment_for(effect).split()) > 3


@pytest.mark.parametrize("law", ["curvature", "cross-sensitivity", "drift"])
def test_every_law_of_a_reading_has_one_of_its_own(law: str) -> None:
    assert len(experiment_for(f"unknown {law}").split()) > 3


def test_an_alternative_is_written_out() -> None:
    entry: dict[str, object] = {
        "effect": "air_added_mass",
        "where": {"channel": "body", "axis": None},
        "parameters": {"added_mass": {"value": 9.0503, "std": 2.41, "unit": "kg"}},
        "log_likelihood_gap": 0.61,
        "experiment": experiment_for("air_added_mass"),
    }
    (view,) = alternative_views(Mismatch("none", "Every residual is noise.", (), (entry,)))
    assert (view.effect, view.where, view.gap) == ("air added mass", "body", "0.610")
    assert view.amount.startswith("added mass 9")
    assert "±" in view.amount
    assert view.amount.endswith("kg")
    assert view.experiment == experiment_for("air_added_mass")


def test_an_alternative_with_nothing_but_a_name_is_written_out_too() -> None:
    (view,) = alternative_views(Mismatch("unexplained", "", (), ({"effect": "tether"},)))
    assert (view.effect, view.where, view.amount, view.gap, view.experiment) == ("tether", "", "", "–", "")
