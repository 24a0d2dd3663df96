"""A strong brake at one point, of which no entry of the catalogue has the law, is told on the ladder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_simulate_identify import shaken

from rig_identification.estimate.identify import Ideal, fit_session, judged, near_noise
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.search.search import search
from rig_identification.simulate import simulate_session

#: N s/m, and where it acts, m.
BRAKE, POINT = 300.0, (0.2, 0.4, -0.3)


def test_a_strong_brake_is_told_as_a_law_of_one_point() -> None:
    spec = shaken(14, 10.0)
    (run,) = spec.runs
    effects = {"point_law.brake": (BRAKE, 0.0), "point_law.position": POINT}
    spec = replace(spec, effects=effects, runs=(run, replace(run, name="run_2", holdout=True)))
    session, _ = simulate_session(spec, np.random.default_rng(3))
    fitted = fit_session(session)
    assert not near_noise(fitted)
    found, _ = search(Ideal(fitted, *judged(fitted)), lambda label, fraction: None, UNLIMITED)
    assert found is not None
    assert found.told
    (finding,) = found.mismatch.findings
    assert finding.effect == "unknown"
    assert "in proportion to velocity" in finding.statement
    told = finding.parameters
    for name, value in {
        "damping": BRAKE,
        "point_x": POINT[0],
        "point_y": POINT[1],
        "point_z": POINT[2],
    }.items():
        entry = told[name]
        assert abs(entry["value"] - value) < 4.0 * entry["std"], name
