"""A plan after an earlier session: what decides its ties, and what both sessions tell together."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_plan import BODY, RATES, linearised, release, rig, spec

from rig_identification.api.planning import earlier
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Problem, solve
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import carried, extended
from rig_identification.plan import Before, Known, Means, Plan, Stated, plan, planning
from rig_identification.plan.apart import DECIDED, SURE, Side, Tie, Told, deciding, needed, ties_of
from rig_identification.plan.information import Laboratory, laboratory
from rig_identification.plan.menu import bare
from rig_identification.plan_report import plan_document, render_plan
from rig_identification.rig import Rig
from rig_identification.simulate import SessionSpec

__all__ = ["rig", "spec"]  # fixtures

#: Hinges that damp and air that drags, each as strong that four seconds tell them apart by some nats.
DAMPING, DRAG = 0.03, 0.12
DAMPED = Stated("hinge_damping", "hinge_damping", {"hinge.damping": (DAMPING, 0.001)})
DRAGGED = Stated(
    "air_drag", "air_drag", {"air.drag_area": (DRAG, 0.01)}, gap=1.0, experiment="two amplitudes"
)


@pytest.fixture(scope="module")
def lab(spec: SessionSpec) -> Laboratory:
    return laboratory(spec, release())


def fitted_cost(problem: Problem, effect: str, start: dict[str, float], spec: SessionSpec) -> float:
    """Least cost of a fit with one effect, from its numbers."""
    candidate = next(c for c in catalogue(problem) if c.effect == effect)
    wide = extended(problem, (candidate,))
    _, there = linearised(spec, release())
    point = carried(wide, problem, there.point)
    theta = point.theta.copy()
    for i, p in enumerate(wide.bench.parameters.free, start=INERTIAL):
        if p.name in start:
            theta[i] = p.position(start[p.name])
    found, converged = solve(wide, replace(point, theta=theta))
    assert converged
    return found.cost


def test_expected_nats_are_what_a_fit_of_the_rival_loses(spec: SessionSpec, lab: Laboratory) -> None:
    """A session with damping, fitted with damping and with drag: the costs differ as foretold."""
    problem, _ = linearised(spec, release(), {"hinge_damping": (DAMPING,)})
    right = fitted_cost(problem, "hinge_damping", {"hinge.damping": DAMPING}, spec)
    wrong = fitted_cost(problem, "air_drag", {"air.drag_area": DRAG}, spec)
    items = [release(), bare(Means(rest=4.0))]
    (tie,) = ties_of(lab, items, Before((DAMPED,), (DRAGGED,)))
    assert len(tie.sides) == 2
    if_damped, _ = tie.sides
    total = if_damped.by_item["release"] + if_damped.by_item["static_bare"]
    assert wrong - right > 1.0
    assert total.nats(if_damped.prior) == pytest.approx(wrong - right, rel=0.1)
    assert tie.nats({"release": 1.0, "static_bare": 1.0}) <= total.nats(if_damped.prior)


def test_beside_nothing_the_amount_counts_that_is_likely(lab: Laboratory) -> None:
    """A rival that was found to be nothing, give or take: it is told apart by what it may be."""
    unsure = replace(DAMPED, numbers={"hinge.damping": (0.0, DAMPING)}, gap=0.5)
    sure = replace(DAMPED, numbers={"hinge.damping": (DAMPING, 0.0)}, gap=0.5)
    one, other = ties_of(lab, [release()], Before((), (unsure, sure)))
    assert one.told == ""
    assert one.nats({"release": 1.0}) == pytest.approx(other.nats({"release": 1.0}), rel=1e-6)
    assert one.nats({"release": 2.0}) > one.nats({"release": 1.0}) > 1.0
    assert one.nats({}) == 0.0


def test_what_cannot_be_built_is_left_to_its_experiment(lab: Laboratory) -> None:
    strange = Stated("liquid_slosh", "liquid_slosh", {}, gap=0.5, experiment="fill the tank")
    (tie,) = ties_of(lab, [release()], Before((), (strange,)))
    assert tie.sides == ()
    assert tie.chance(tie.nats({"release": 1.0})) == 0.0
    assert tie.experiment == "fill the tank"


def test_a_chance_grows_with_what_is_told() -> None:
    tie = Tie("", "b", 1.0, "", ())
    assert tie.chance(needed(tie)) == pytest.approx(SURE)
    assert tie.chance(DECIDED + 1.0) == pytest.approx(0.5)
    assert tie.chance(1.0) < 0.1


def test_time_goes_to_ties_that_can_be_decided() -> None:
    """One run tells of the first tie, another a little of the second: only the first is worth its time."""

    def told(square: float) -> Told:
        return Told(square, np.zeros(1), np.zeros((1, 1)))

    strong, weak = release(), replace(release(), name="other")
    sides = [
        (Side(np.eye(1), {"release": told(9.0), "other": told(0.0)}),),
        (Side(np.eye(1), {"release": told(0.0), "other": told(1.0)}),),
    ]
    ties = [Tie("a", "b", 0.0, "", side) for side in sides]
    chosen = deciding(ties, [strong, weak], seconds=20.0, most=100.0)
    assert chosen == {"release": 3}
    assert ties[0].nats(chosen) >= needed(ties[0])
    assert deciding(ties, [strong, weak], seconds=5.0, most=100.0) == {}


def known(std: float) -> Known:
    """An earlier session that knows each element of the body to a share of its size."""
    size = np.array([BODY[0], 1.0, 1.0, 1.0, *np.full(6, 15.0)])
    return Known((), np.diag((std * size) ** -2.0))


def test_what_is_known_counts_once_for_each_session(spec: SessionSpec, lab: Laboratory) -> None:
    again = laboratory(spec, release(), known(1e-3))
    alone = np.diag(lab.expected(lab.before).covariance)
    both = np.diag(again.expected(again.before).covariance)
    assert np.all(np.sqrt(both[1:]) <= 1.001e-3 * np.array([1.0, 1.0, 1.0, *np.full(6, 15.0)]))
    assert np.all(both < alone)


@pytest.fixture
def after(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> Plan:
    """A plan without what else it says."""
    monkeypatch.setattr(planning, "doubts", lambda *_: None)
    monkeypatch.setattr(planning, "others", lambda *_: ())
    damped = replace(DAMPED, numbers={"hinge.damping": (5.0 * DAMPING, 0.001)})
    dragged = replace(DRAGGED, numbers={"air.drag_area": (5.0 * DRAG, 0.01)})
    before = Before((damped,), (dragged,), known(0.01), 0.01 * np.ones(10))
    return plan(replace(rig, exciter=None), BODY, Means(minutes=0.7, rest=3.0, rates=RATES), before=before)


def test_a_plan_says_what_it_decides(after: Plan) -> None:
    (decision,) = after.decisions
    assert decision.nats is not None
    assert decision.nats > DECIDED + 1.0
    assert decision.decided
    assert decision.best in {p.item.name for p in after.recordings}
    document = json.loads(json.dumps(plan_document(after), allow_nan=False))
    assert document["ties"][0]["rival"] == "air_drag"
    assert document["ties"][0]["decided"] is True
    assert document["earlier_std"]["m"] == pytest.approx(0.01)
    page = render_plan(after)
    assert "hinge damping or air drag" in page
    assert "σ so far" in page


def test_an_earlier_result_is_read(tmp_path: Path) -> None:
    """Ties are alternatives that hardly trail; findings are told with their model's numbers."""
    entry = {"effect": "hinge_damping", "where": {}, "numbers": {"hinge.damping": [0.03, 0.001]}}
    rival = {"effect": "air_drag", "where": {"channel": None}, "numbers": {"air.drag_area": [0.1, 0.01]}}
    document = {
        "mass": {"value": 1.0},
        "center_of_mass": {"value": [0.0, 0.0, 0.0]},
        "inertia": {"value": np.eye(3).tolist()},
        "covariance": np.eye(10).tolist(),
        "unobservable": [],
        "mismatch": {
            "verdict": "explained",
            "findings": [entry],
            "alternatives": [
                {**rival, "log_likelihood_gap": 2.0, "experiment": "swing"},
                {**rival, "log_likelihood_gap": 20.0},
            ],
        },
    }
    (tmp_path / "result.json").write_text(json.dumps(document), encoding="utf-8")
    before = earlier(tmp_path / "result.json")
    assert [r.gap for r in before.rivals] == [2.0]
    assert before.rivals[0].experiment == "swing"
    assert before.findings[0].numbers == {"hinge.damping": (0.03, 0.001)}
    assert before.known is None
    assert before.std == pytest.approx(np.ones(10))
