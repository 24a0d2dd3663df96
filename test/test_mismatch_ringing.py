"""Samples that ring after a blow: which are left out, and of which channels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.evidence import Run, prepare
from rig_identification.mismatch.ringing import without_ringing
from rig_identification.simulate import simulate_session

BLOW = 4.0  # s


@pytest.fixture(scope="module")
def calm() -> Run:
    spec = replace(shaken(14, 10.0), doubts=False)
    session = simulate_session(spec, np.random.default_rng(2))[0]
    return prepare(session.rig, session.training[0])


def struck(run: Run, cable: str, *, offset: float = 0.0) -> Run:
    """The run with a load cell that rings at 60 Hz after a blow, and node 0 ``offset`` s after its start."""
    channels = []
    for c in run.channels:
        values = c.values
        if c.device == cable:
            after = np.maximum(c.time - BLOW, 0.0)
            ring = 500.0 * np.sin(2.0 * np.pi * 60.0 * after) * np.exp(-after / 0.02)
            values = values + ring[:, None]
        channels.append(replace(c, values=values))
    return replace(run, channels=tuple(channels), offset=offset)


@pytest.mark.parametrize("offset", [0.0, 2.5])
def test_what_rings_is_left_out_of_cells_and_accelerometers_alone(calm: Run, offset: float) -> None:
    run = struck(calm, calm.channels[0].device, offset=offset)
    kept = without_ringing(run)
    for before, after in zip(run.channels, kept.channels, strict=True):
        lost = np.setdiff1d(before.time, after.time)
        if before.quantity in ("tension", "specific_force"):
            assert 0 < lost.size < 0.1 * before.time.size
            assert np.all(np.abs(lost - BLOW) < 0.3)
            assert after.group.size == after.time.size == after.values.shape[0]
            assert after.node.size == after.group[-1] + 1
        else:
            assert lost.size == 0


def test_a_run_without_blows_is_as_it_was(calm: Run) -> None:
    assert all(a is b for a, b in zip(calm.channels, without_ringing(calm).channels, strict=True))
