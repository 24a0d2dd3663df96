"""Dry friction at a point: a brake that saturates at once, found from one that saturates slowly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_simulate_identify import shaken

from rig_identification.estimate.estimates import estimates
from rig_identification.estimate.growing import settled_starts
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.solve import solve
from rig_identification.mismatch.opened import carried, extended, with_reference
from rig_identification.mismatch.place_scan import scales_of
from rig_identification.mismatch.point_laws import brake_law
from rig_identification.mismatch.trial import log_evidence, mass_of, promised
from rig_identification.simulate import simulate_session

FORCE, POINT, SLIDES = 30.0, (0.2, 0.4, -0.3), 1e6  # N, m, s^2/m^2


def test_a_brake_that_saturates_slowly_leads_to_dry_friction() -> None:
    effects = {
        "point_law.brake": (0.0, FORCE * SLIDES),
        "point_law.saturation": (SLIDES,),
        "point_law.upright": (0.0,),
        "point_law.position": POINT,
    }
    spec = replace(shaken(14, 10.0), effects=effects, doubts=False)
    fit = fit_session(simulate_session(spec, np.random.default_rng(4))[0])
    problem = with_reference(fit.problem, fit.rest)
    scales = scales_of(problem, fit.evaluation, mass_of(problem, fit.evaluation))
    early, law = 30.0, brake_law(problem.bench.rig, scales, 30.0)
    # As a scan of places leaves it: about there, and as strong
    start = {f"unknown.point.{a}": v for a, v in zip("xyz", POINT, strict=True)}
    start["unknown.quadratic_damping"] = FORCE * early / scales.speed**2
    wide = extended(problem, (law,))
    point = promised(wide, carried(wide, problem, fit.evaluation.point), law, start, fit.evaluation)
    point = replace(point, starts=settled_starts(wide, point))
    found, _ = solve(wide, point, iterations=15, tolerance=0.1)
    assert law.between is not None
    ((sharper, start),) = law.between(wide, found)
    wider = extended(problem, (sharper,))
    point = promised(wider, carried(wider, wide, found.point), sharper, start, found)
    evidence, (found, _) = log_evidence(found), solve(wider, point, iterations=15, tolerance=0.1)
    assert log_evidence(found) > evidence + 100.0
    told = estimates(wider, found)
    values = {name: told.of(name)[0] for name in ("unknown.quadratic_damping", "unknown.saturation")}
    assert 0.3 < values["unknown.saturation"] / SLIDES < 3.0
    pulls = values["unknown.quadratic_damping"] / values["unknown.saturation"]
    assert abs(pulls - FORCE) < 0.03 * FORCE
    place, std = told.of("unknown.point.x")
    assert abs(place - POINT[0]) < 4.0 * std
