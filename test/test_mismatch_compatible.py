"""What is asked beside an effect leaves that effect's numbers as they were found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.solve import Problem
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import catalogue, compatible
from rig_identification.mismatch.opened import extended
from rig_identification.simulate import simulate_session


@pytest.fixture(scope="module")
def problem() -> Problem:
    spec = replace(shaken(10, 6.0), doubts=False)
    return fit_session(simulate_session(spec, np.random.default_rng(2))[0]).problem


def _labels(candidates: list[Candidate]) -> set[str]:
    return {c.label for c in candidates}


def test_no_number_of_what_was_found_is_written_over(problem: Problem) -> None:
    """Each effect with its numbers off zero, and all that may stand beside it at zero."""
    numbers = [c for c in catalogue(problem) if c.build is None]
    assert len(numbers) > 50
    for found in numbers:
        alone = extended(problem, (found,)).bench.parameters
        theta = alone.start(alone.elements(np.zeros(alone.size)))
        for p in found.parameters:
            theta[alone.index_of(p.name)] = 1.0
        beside = [c for c in compatible(numbers, [found]) if not c.doubted]
        wide = extended(extended(problem, (found,)), tuple(beside)).bench.parameters
        there = wide.converted(theta, alone)
        for p in found.parameters:
            entries = [*p.written, *(entry for entry, _ in p.shifts)]
            after, before = (getattr(s, p.kind)(t) for s, t in ((wide, there), (alone, theta)))
            assert np.array_equal(after[entries], before[entries]), (found.label, p.name)


def test_the_lag_of_all_cells_is_not_asked_beside_one_cells(problem: Problem) -> None:
    candidates = catalogue(problem)
    every, one = (
        next(c for c in candidates if c.label == label) for label in ("sensor_lag", "sensor_lag cable_4")
    )
    assert every.label not in _labels(compatible(candidates, [one]))
    assert _labels(compatible(candidates, [every])).isdisjoint(f"sensor_lag cable_{i}" for i in (1, 2, 3, 4))
    assert {"sensor_lag imu", "sensor_lag cable_1", "air_drag"} <= _labels(compatible(candidates, [one]))
