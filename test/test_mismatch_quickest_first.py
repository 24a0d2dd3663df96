"""Near the noise what has a few numbers is fitted before a hose, and may spare its fit."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from test_mismatch_along_measured import promise

from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.candidate import MANY
from rig_identification.mismatch.first_fits import BEATEN, _quickest_first, _Standing

SAMPLES = 100


@pytest.mark.parametrize(
    ("gains", "order"),
    [
        ((100.0, 60.0, 55.0), ["mass", "gain", "hose"]),  # more than half of the best, before it
        ((100.0, 60.0, 30.0), ["mass", "hose", "gain"]),  # what promises little is last
        ((100.0, 40.0, 35.0), ["hose", "mass", "gain"]),  # less than half
    ],
)
def test_few_numbers_come_before_many(gains: tuple[float, float, float], order: list[str]) -> None:
    hose, mass, gain = gains
    worthy = [promise("hose", hose, MANY), promise("mass", mass), promise("gain", gain)]
    assert [p.candidate.effect for p in _quickest_first(worthy)] == order


@dataclass(frozen=True)
class _Fitted:
    """The least of a fit that is heard: its cost (nats) and one run's residuals, of the noise's size."""

    cost: float

    @property
    def runs(self) -> tuple[SimpleNamespace, ...]:
        return (SimpleNamespace(residual=np.ones(SAMPLES), log_spread=0.0),)


@pytest.mark.parametrize(("took", "spared"), [(100.0 + 2.0 * BEATEN, True), (100.0, False)])
def test_what_takes_more_than_a_hose_promises_spares_its_fit(took: float, spared: bool) -> None:
    standing = _Standing(far=False, rings=False, budget=UNLIMITED)
    mass, hose, other = promise("mass", 90.0), promise("hose", 100.0, MANY), promise("other", 100.0)
    trial = SimpleNamespace(evaluation=_Fitted(-took), candidate=mass.candidate)
    standing.heard(mass, trial, _Fitted(0.0), True)  # type: ignore[arg-type]
    assert standing.passes_over(hose) is spared
    assert not standing.passes_over(other)


def test_a_hose_spares_no_other_ones_fit() -> None:
    standing = _Standing(far=False, rings=False, budget=UNLIMITED)
    general, along_y = promise("hose", 110.0, MANY), promise("hose y", 100.0, MANY)
    trial = SimpleNamespace(evaluation=_Fitted(-400.0), candidate=general.candidate)
    standing.heard(general, trial, _Fitted(0.0), True)  # type: ignore[arg-type]
    assert not standing.passes_over(along_y)
