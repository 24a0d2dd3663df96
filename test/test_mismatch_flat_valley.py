"""A fit along a flat valley, from where it stands and from a promise far along it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.solve import Evaluation, Problem, still_promised
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import Promise, with_reference
from rig_identification.mismatch.trial import attempt
from rig_identification.simulate import simulate_session

#: m: a ceiling hinge higher than described, many tolerances, which its three neighbours share among them.
RAISED = 0.007


@pytest.fixture(scope="module")
def shared_out() -> tuple[Problem, Evaluation]:
    """The ideal model's fit to a rig of which one upper hinge is off: four of them are bent instead."""
    points = np.zeros((4, 3))
    points[0, 2] = RAISED
    effects = {"hinge_position.ceiling": tuple(points.ravel())}
    spec = replace(shaken(10, 10.0), effects=effects, doubts=False)
    fitted = fit_session(simulate_session(spec, np.random.default_rng(2))[0])
    return with_reference(fitted.problem, fitted.rest), fitted.evaluation


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_hinge_is_found_along_a_flat_valley(shared_out: tuple[Problem, Evaluation], share: float) -> None:
    """From where the fit stands, and from a promise that by itself throws everything out."""
    problem, evaluation = shared_out
    assert misfit(evaluation) < 1.1
    hinge = next(c for c in catalogue(problem) if c.label == "hinge_position cable_1 ceiling z")
    name = hinge.parameters[0].name
    bent = dict(
        zip(
            (p.name for p in problem.bench.parameters.free),
            problem.bench.parameters.values(evaluation.point.theta),
            strict=True,
        )
    )[name]
    value = bent + share * (hinge.parameters[0].nominal + RAISED - bent)
    trial = attempt(problem, evaluation, Promise(hinge, 10.0, {name: float(value)}))
    assert trial is not None
    assert trial.evaluation.cost < evaluation.cost - 5.0
    assert not trial.settled or still_promised(trial.problem, trial.evaluation) < 0.5
