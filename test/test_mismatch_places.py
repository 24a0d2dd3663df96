"""Hoses and riders are screened at every place of the body, and riders finer in frequency than on a grid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.solve import Evaluation, Problem, evaluate
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import Promise, carried, extended
from rig_identification.mismatch.places import TERMS, best_place, crossed, design, monomials
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import Trial, in_reach, mass_of, possible


def told_by(
    effects: dict[str, tuple[float, ...]], *, noise: bool = True
) -> tuple[Problem, Evaluation, list[Promise]]:
    """What screening promises about the true body of a rig with ``effects``, its start states fitted."""
    spec = replace(shaken(14, 12.0), effects=effects, doubts=False, noise=noise)
    problem, found = seen_by_the_true_body(spec, 3)
    return problem, found, screen(problem, found, catalogue(problem), mass_of(problem, found))


def test_a_hose_at_a_corner_is_promised_at_that_corner() -> None:
    at = np.array([0.2, 0.4, -0.3])
    _, _, promises = told_by({"tether": (300.0, 0.0, 0.0), "tether_point": tuple(at)}, noise=False)
    first = promises[0]
    assert first.candidate.effect == "tether"
    # Where along its own line it is tied makes no difference
    along_x = next(p for p in promises if p.candidate.label == "tether x")
    assert along_x.gain > 0.9 * first.gain
    # Samples are read off the nearest node: columns are right to some percent, and it is where a fit starts
    assert along_x.values["tether.stiffness.x"] == pytest.approx(300.0, rel=0.6)
    found = np.array([along_x.values[f"tether.point.{a}"] for a in "yz"])
    middle = np.array([p.nominal for p in along_x.candidate.parameters if "point" in p.name])
    assert np.max(np.abs(found - at[1:])) < 0.3 < 0.4 * np.max(np.abs(middle - at))


def test_a_tank_far_from_the_middle_is_promised_there_at_its_own_frequency() -> None:
    at = np.array([0.9, 2.8, -0.8])
    _, _, promises = told_by(
        {
            "liquid_slosh.mass": (12.0,),
            "liquid_slosh.frequency": (0.93,),
            "liquid_slosh.damping_ratio": (0.007,),
            "liquid_slosh.position": tuple(at),
        }
    )
    first = promises[0]
    assert first.candidate.effect == "liquid_slosh"
    frequency = next(p.nominal for p in first.candidate.parameters if p.name.endswith("frequency"))
    assert frequency == pytest.approx(0.93, rel=0.02)
    assert first.values["liquid_slosh.mass"] == pytest.approx(12.0, rel=0.3)
    found = np.array([first.values[f"liquid_slosh.position.{a}"] for a in "xyz"])
    assert np.max(np.abs(found - at)) < 0.5


def test_a_steady_pull_promises_no_tether() -> None:
    """Cells that all read too much pull the body down, and say nothing of a spring."""
    matrix = np.zeros((2, TERMS, 2, TERMS))
    matrix[0, 0, 0, 0] = matrix[1, 0, 1, 0] = 100.0
    right = np.zeros((2, TERMS))
    right[1, 0] = 80.0
    assert best_place(matrix, right, np.ones(2), 1, 1.0, 0.6) is None
    right[0, 0] = 0.1
    pulled = best_place(matrix, right, np.ones(2), 1, 1.0, 0.6)
    assert pulled is not None
    assert pulled.gain > 30.0
    assert pulled.positive < 1e-3


def test_the_best_place_of_a_known_polynomial_is_found() -> None:
    rng = np.random.default_rng(7)
    columns = rng.normal(size=(400, TERMS))
    at, amount = np.array([0.31, -0.22, 0.4]), 3.0
    right = columns.T @ (columns @ (amount * monomials(at)))
    matrix = (columns.T @ columns).reshape(1, TERMS, 1, TERMS)
    best = best_place(matrix, right.reshape(1, TERMS), np.full(1, 1e-9), 1, 1e3, 0.6)
    assert best is not None
    assert np.max(np.abs(best.place - at)) < 0.02
    assert best.amounts[0] == pytest.approx(amount, rel=0.02)
    assert best.weights @ right == pytest.approx(2.0 * best.gain, rel=1e-3)


def test_monomials_follow_from_their_design_and_cross_products_are_polynomials() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 5, 3, 4))
    u = rng.normal(size=3)
    whole = np.cross(a @ np.array([1.0, *u]), b @ np.array([1.0, *u]))
    assert crossed(a, b) @ monomials(u) == pytest.approx(whole)
    assert np.linalg.matrix_rank(monomials(design())) == TERMS


def _with_number(label: str, name: str, value: float) -> Trial:
    """A hypothesis in the true body's model, one of its numbers at ``value`` (std of its prior), unfitted."""
    problem, found = seen_by_the_true_body(replace(shaken(14, 4.0), doubts=False), 3)
    candidate = next(c for c in catalogue(problem) if c.label == label)
    wide = extended(problem, (candidate,))
    point = carried(wide, problem, found.point)
    theta = point.theta.copy()
    theta[wide.bench.parameters.index_of(name)] = value
    there = evaluate(wide, replace(point, theta=theta))
    assert there is not None
    return Trial(candidate, wide, there, 0.0)


@pytest.mark.parametrize(("away", "there_can_be"), [(0.5, True), (3.9, True), (6.0, False)])
def test_a_hose_is_tied_to_what_a_body_in_this_rig_may_fill(away: float, there_can_be: bool) -> None:
    """away: of its point from the body's middle, in lengths of the rig; known to one of them, no better."""
    assert in_reach(_with_number("tether x", "tether.point.y", away)) is there_can_be


@pytest.mark.parametrize(("amount", "can_be"), [(1.0, True), (0.0, True), (-1.0, False)])
def test_hinges_that_push_a_swing_on_are_not_possible(amount: float, can_be: bool) -> None:
    assert possible(_with_number("hinge_damping", "hinge.damping", amount)) is can_be
