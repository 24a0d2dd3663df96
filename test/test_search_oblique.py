"""A part on springs along a line between axes of the body, or along two axes as a liquid swings."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_model_derivatives import drive_of
from test_model_internal import rider, with_rest
from test_model_rigs import thesis_case_14
from test_simulate_identify import shaken

from rig_identification.estimate.estimates import Estimates, estimates
from rig_identification.estimate.growing import settled_starts
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, solve
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.opened import carried, extended, opened_with, with_reference
from rig_identification.mismatch.rider_places import along_a_line, finer
from rig_identification.mismatch.rider_promises import further_ways, springs_instead
from rig_identification.mismatch.riders import Swing, lean, rider_candidate
from rig_identification.mismatch.trial import promised
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.equilibrium import settle
from rig_identification.model.motion import simulate
from rig_identification.simulate import simulate_session

NAMES = ("direction_x", "direction_y", "direction_z")
AT = np.array([0.4, 0.9, -0.7])


def tilted(axis: str) -> tuple[Any, Any]:
    """The hypothesis of a part along a line near ``axis``, and a model with it."""
    sample = thesis_case_14()
    model = with_rest(sample.model())
    bench = SimpleNamespace(rig=sample.rig, parameters=SimpleNamespace(model=model))
    problem: Any = SimpleNamespace(bench=bench)
    candidate, _ = rider_candidate(problem, Swing(axis, 4.0, tilted=True), 1200.0, 30.0, AT)
    return candidate, candidate.built(model)[0]


def test_a_line_that_leans_is_written_beside_its_axis() -> None:
    candidate, model = tilted("y")
    first = place.internal_block(4, 0)
    entries = {p.name: p.index - first for p in candidate.parameters}
    assert entries["sprung_mass.direction.x"] == layout.AXIS
    assert entries["sprung_mass.direction.z"] == layout.AXIS + 2
    assert "sprung_mass.direction.y" not in entries
    assert model.physics[first + layout.AXIS + 1] == 1.0
    assert candidate.where["axis"] is None


def test_a_direction_of_any_length_is_the_same_part_at_another_frequency() -> None:
    """What the numbers of a line that leans stand for is what the model makes of them."""
    sample = thesis_case_14()
    plain = sample.model(rods=True)
    plain = plain.referred(settle(plain, sample.start))
    u, v, frequency, damping = 0.8, -0.4, 5.0, 0.06
    length = lean(u, v)
    line = np.array([u, 1.0, v])
    as_written = rider(40.0, AT, line[None], frequency, damping)
    as_told = rider(40.0, AT, line[None] / length, frequency / length, damping * length)
    drive = drive_of(400, 0.005, 4)
    outputs = []
    for block in (as_written, as_told):
        model = plain.with_internal(block)
        outputs.append(
            simulate(model, replace(settle(plain, sample.start), internal=np.zeros(2)), drive).outputs
        )
    np.testing.assert_allclose(outputs[0], outputs[1], rtol=1e-6, atol=1e-9)


def test_a_line_that_leans_is_told_by_its_unit_vector_and_own_frequency() -> None:
    candidate, _ = tilted("y")
    values = {p.name: 0.1 for p in candidate.parameters}
    values |= {"sprung_mass.direction.x": 3.0, "sprung_mass.direction.z": -1.0}
    values |= {"sprung_mass.frequency": 6.0, "sprung_mass.damping_ratio": 0.02}
    told = candidate.tell(Estimates(values, 1e-6 * np.eye(len(values))))
    length = 11.0**0.5
    assert told["frequency"][0] == pytest.approx(6.0 / length)
    assert told["damping_ratio"][0] == pytest.approx(0.02 * length)
    direction = [told[f"direction_{a}"][0] for a in "xyz"]
    np.testing.assert_allclose(direction, np.array([3.0, 1.0, -1.0]) / length)


def test_a_part_fitted_along_an_axis_is_found_along_its_line() -> None:
    """From the axis that its line is nearest to, where the fit along that axis says how it leans."""
    spec = shaken(10, 10.0)
    mass, line = 0.2 * float(spec.elements[0]), np.array([0.4, 0.9, 0.1])
    line /= np.linalg.norm(line)
    effects = {
        "sprung_mass.mass": (mass,),
        "sprung_mass.frequency": (4.3,),
        "sprung_mass.damping_ratio": (0.06,),
        "sprung_mass.direction": tuple(float(c) for c in line),
        "sprung_mass.position": tuple(float(c) for c in spec.elements[1:4]),
    }
    spec = replace(spec, effects=effects, doubts=False)
    fit = fit_session(simulate_session(spec, np.random.default_rng(4))[0])
    problem = with_reference(fit.problem, fit.rest)
    swing, body = Swing("y", 4.3), float(spec.elements[0])
    along_axis, start = rider_candidate(problem, swing, body, 0.5 * mass, np.array(spec.elements[1:4]))
    wide = extended(problem, (along_axis,))
    point = promised(wide, carried(wide, problem, fit.evaluation.point), along_axis, start, fit.evaluation)
    point = replace(point, starts=settled_starts(wide, point))
    there, _ = solve(wide, point, iterations=15, tolerance=0.5)
    leaning = [(c, v) for c, v in further_ways(swing, body, wide, there) if "sprung_mass.direction.x" in v]
    ((candidate, start),) = leaning
    assert start["sprung_mass.direction.x"] > 0.0
    wider = extended(problem, (candidate,))
    point = promised(wider, carried(wider, wide, there.point), candidate, start, there)
    found, _ = solve(wider, point, iterations=25, tolerance=0.1)
    told = candidate.told(estimates(wider, found))
    for name, value in {"mass": mass, "frequency": 4.3, **dict(zip(NAMES, line, strict=True))}.items():
        entry = told[name]
        assert abs(entry[0] - value) < 4.0 * entry[1], name


def fitted_with(candidate: Candidate, problem: Problem, evaluation: Evaluation, mass: float) -> Any:
    """A problem with one more effect at its described numbers and a mass, and its evaluation."""
    wide = extended(problem, (candidate,))
    point = carried(wide, problem, evaluation.point)
    theta = point.theta.copy()
    own = next(q for q in candidate.parameters if q.name.endswith(".mass"))
    theta[wide.bench.parameters.index_of(own.name)] = mass / own.prior_std
    found = evaluate(wide, replace(point, theta=theta))
    assert found is not None
    return wide, found


def test_a_liquid_is_asked_as_a_part_on_springs_along_its_axes() -> None:
    """With its mass, place, frequency and damping; along the vertical too where that explains some."""
    fit = fit_session(simulate_session(replace(shaken(14, 8.0), doubts=False), np.random.default_rng(3))[0])
    problem = with_reference(fit.problem, fit.rest)
    liquid = Swing("xy", 0.9)
    candidate, _ = rider_candidate(problem, liquid, 800.0, 30.0, AT)
    wide, there = fitted_with(candidate, problem, fit.evaluation, 30.0)
    ((asked, start),) = springs_instead(liquid, 800.0, wide, there)
    assert asked.effect == "sprung_mass"
    assert start["sprung_mass.mass"] == pytest.approx(30.0)
    frequencies = {q.name: q.nominal for q in asked.parameters if ".frequency." in q.name}
    assert frequencies["sprung_mass.frequency.x"] == pytest.approx(0.9)
    assert frequencies["sprung_mass.frequency.y"] == pytest.approx(0.9)
    # Next to another such part its numbers would be written over that one's
    part, _ = rider_candidate(problem, Swing("z", 3.0), 800.0, 10.0, AT)
    both, there = fitted_with(part, wide, there, 10.0)
    assert springs_instead(liquid, 800.0, both, there) == []


def test_a_line_between_all_axes_is_told_to_first_order() -> None:
    """It promises more along its line than along any axis, and that line is near the true one."""
    spec = shaken(10, 10.0)
    body, line = float(spec.elements[0]), np.array([0.6, -0.7, 0.4]) / np.sqrt(1.01)
    effects = {
        "sprung_mass.mass": (0.03 * body,),
        "sprung_mass.frequency": (5.0,),
        "sprung_mass.damping_ratio": (0.03,),
        "sprung_mass.direction": tuple(float(c) for c in line),
        "sprung_mass.position": tuple(float(c) for c in spec.elements[1:4]),
    }
    fit = fit_session(
        simulate_session(replace(spec, effects=effects, doubts=False), np.random.default_rng(6))[0]
    )
    problem = with_reference(fit.problem, fit.rest)
    there = evaluate(problem, fit.evaluation.point)
    assert there is not None
    _, beyond, _ = opened_with(problem, there, [])
    found = along_a_line(problem, beyond, 5.0, 0.03, body)
    assert found is not None
    ridden, direction = found
    assert abs(float(direction @ line)) > np.cos(np.radians(30.0))
    assert ridden.swing.tilted
    along = [finer(problem, beyond, Swing(axis, 5.0), body) for axis in "xyz"]
    assert ridden.best.gain > 1.2 * max(a.best.gain for a in along if a is not None)
