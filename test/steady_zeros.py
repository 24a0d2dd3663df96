"""Zeros that are the same in every recording, for tests that look at what else whitens a run."""

from __future__ import annotations

import sys

import pytest


@pytest.fixture(name="steady_zeros")
def steady_zeros_of_the_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """No device's zero wanders."""
    import rig_identification.estimate.wander

    monkeypatch.setattr(sys.modules[rig_identification.estimate.wander.__name__], "WANDER", 0.0)
