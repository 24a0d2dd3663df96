"""Wires that stretch by hundredths of a millimetre: their stretch follows their tension, and is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_model_rigs import thesis_case_14
from test_simulate_identify import shaken

from rig_identification.estimate.identify import fit_session
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import with_reference
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.supports import TAUT, taut_cables
from rig_identification.mismatch.trial import attempt, mass_of
from rig_identification.model import layout
from rig_identification.model.equilibrium import find_rest
from rig_identification.model.motion import Input, simulate
from rig_identification.simulate import AtRest, simulate_session

#: EA, N, of wires on which a small car bounces at tens of hertz.
STIFFNESS = 4e7


def test_taut_cables_move_the_body_as_elastic_ones_do() -> None:
    """To a tenth of what the stretch does to the tensions, and hardly any at no compliance."""
    sample = thesis_case_14()
    rigid, elastic = sample.model(), sample.model(axial_stiffness=STIFFNESS)
    physics = elastic.physics.copy()
    for i in range(elastic.cables):
        physics[layout.cable_offset(i) + layout.AXIAL_DAMPING] = 1e-3
    elastic = elastic.with_physics(physics)
    (candidate,) = taut_cables(sample.rig, rigid, float(rigid.physics[layout.INERTIAL]))
    built, (own,) = candidate.built(rigid)
    assert built.internal == rigid.cables
    time = np.arange(0.0, 4.0, 0.01)
    force = 60.0 * (1.0 - np.exp(-time))[:, None] ** 2 * np.sin(2.0 * np.pi * 1.1 * time)[:, None]
    force = force * np.array([1.0, 0.5, 0.2])
    rate = np.gradient(force, 0.01, axis=0)
    drive = Input(0.01, force, rate, np.zeros((time.size, 6)))

    def tensions(compliance: float) -> np.ndarray:
        physics = built.physics.copy()
        for entry, length in own.shifts:
            physics[entry] += compliance * length
        model = built.with_physics(physics)
        return simulate(model, find_rest(model, sample.start).state, drive).outputs[:, layout.OUT_TENSION :]

    truth = simulate(elastic, find_rest(elastic, sample.start).state, drive, substeps=40)
    told = truth.outputs[:, layout.OUT_TENSION :]
    without, taut = tensions(0.0), tensions(1.0 / STIFFNESS)
    # It rings until its first second is over
    left, all_ = np.std((taut - told)[100:]), np.std((without - told)[100:])
    assert left < 0.15 * all_
    plain = simulate(rigid, find_rest(rigid, sample.start).state, drive).outputs[:, layout.OUT_TENSION :]
    assert np.max(np.abs(without - plain)) < 1e-6 * np.max(plain)


def test_first_order_promises_them_and_a_few_steps_find_their_stiffness() -> None:
    """Shaken from rest: a release would let the wires ring, which their stretch at once does not tell."""
    spec = shaken(12, 8.0)
    runs = tuple(replace(run, start=AtRest()) for run in spec.runs)
    spec = replace(spec, runs=runs, effects={"cable_elasticity": (STIFFNESS,)})
    fitted = fit_session(simulate_session(spec, np.random.default_rng(3))[0])
    problem, evaluation = with_reference(fitted.problem, fitted.rest), fitted.evaluation
    promises = screen(problem, evaluation, catalogue(problem), mass_of(problem, evaluation))
    promise = next(p for p in promises if TAUT in p.values)
    assert promise.gain > 20.0
    trial = attempt(problem, evaluation, promise)
    assert trial is not None
    gained = evaluation.cost - trial.evaluation.cost
    assert gained > 0.5 * promise.gain
    found = 1.0 / trial.problem.bench.parameters.named(trial.evaluation.point.theta)[TAUT]
    assert abs(found / STIFFNESS - 1.0) < 0.1
