"""Where no effect is found the body's interval holds what a wrench that follows the motion may hide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_simulate_identify import shaken

from rig_identification.estimate.identify import _begun, _silent, pose_problem
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.search.following import with_what_follows
from rig_identification.search.ladder import begun
from rig_identification.simulate import simulate_session

#: What is left out: a spring, a brake, a liquid.
LEFT_OUT = {
    "spring": {"tether": (3000.0, 500.0, 0.0), "tether_point": (0.2, 0.9, 0.0)},
    "brake": {"point_law.brake": (300.0, 0.0), "point_law.position": (0.2, 0.4, -0.3)},
    "hinges": {"hinge_damping": (20.0,)},
}


def test_nine_numbers_of_ten_lie_within_two_widened_std_and_not_within_two_of_the_fit_s_own() -> None:
    own_misses, misses = [], []
    for effects in LEFT_OUT.values():
        spec = replace(shaken(14, 8.0), effects=effects, doubts=False)
        session, _ = simulate_session(spec, np.random.default_rng(5))
        problem, theta, held = pose_problem(session)
        start = _begun(problem, theta, held, _silent)
        rung = begun(start.problem, start.point)
        assert rung is not None
        assert not rung.alone
        own = inertial_estimate(rung.problem, rung.evaluation)
        wide = with_what_follows(rung.problem, rung.evaluation)
        # Of a covariance that grows no direction becomes better known
        std = np.sqrt(np.diag(own.covariance))
        grown = (wide.covariance - own.covariance) / np.outer(std, std)
        assert np.min(np.linalg.eigvalsh(grown)) > -1e-6
        own_misses += list(np.abs(own.values - spec.elements) / std)
        misses += list(np.abs(wide.values - spec.elements) / np.sqrt(np.diag(wide.covariance)))
    assert np.mean(np.array(own_misses) < 2.0) < 0.7
    assert np.mean(np.array(misses) < 2.0) >= 0.9
