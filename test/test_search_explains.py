"""What is large is found in one go: a fifth of a body on springs that move along three axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_simulate_identify import shaken

from rig_identification.estimate.identify import Ideal, fit_session, judged, near_noise
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.search.search import Outcome, first_rung, search
from rig_identification.simulate import SessionSpec, simulate_session


def searched(spec: SessionSpec, effects: dict[str, tuple[float, ...]], seed: int) -> Outcome:
    """What the search finds of a session with ``effects`` far beyond the noise, with a held-out run."""
    (run,) = spec.runs
    spec = replace(spec, effects=effects, runs=(run, replace(run, name="run_2", holdout=True)))
    session, _ = simulate_session(spec, np.random.default_rng(seed))
    fitted = fit_session(session)
    assert not near_noise(fitted)
    ideal = Ideal(fitted, *judged(fitted))
    first = first_rung(ideal)
    assert first is not None
    assert not first.alone
    return search(ideal, first, lambda label, fraction: None, UNLIMITED)


def test_a_fifth_of_the_body_on_springs_is_found_with_all_its_frequencies() -> None:
    spec = shaken(10, 10.0)
    mass = 0.2 * float(spec.elements[0])
    effects = {
        "sprung_mass.mass": (mass,),
        "sprung_mass.along": (3.6, 4.4, 2.2),
        "sprung_mass.damping_ratio": (0.08,),
        "sprung_mass.position": tuple(float(c) for c in spec.elements[1:4]),
    }
    outcome = searched(spec, effects, 11)
    assert outcome.likeliest.label == "sprung_mass"
    found = outcome.told
    assert found is not None
    assert found.told
    (finding,) = found.mismatch.findings
    assert finding.effect == "sprung_mass"
    told = finding.parameters
    for name, value in {"mass": mass, "frequency_x": 3.6, "frequency_y": 4.4, "frequency_z": 2.2}.items():
        entry = told[name]
        assert abs(entry["value"] - value) < 4.0 * entry["std"], name
        assert entry["std"] < 0.1 * value
