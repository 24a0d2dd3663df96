"""Cells with the calibration of another cell: one gain far off, or two that stand for each other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.forces import LEAST
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, Reading, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.rest_model import Loosened
from rig_identification.examination import SetupFault
from rig_identification.quantity import with_interval


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Every cell, and every pair of cells. A negative gain is a wire's fault."""
    names = tuple(c.name for c in evidence.session.rig.cables)
    for name in names:
        yield _gains((name,), names)
    for pair in combinations(names, 2):
        yield _gains(pair, names)


def _gains(cells: tuple[str, ...], names: tuple[str, ...]) -> Hypothesis:
    def gains(rest: RestFit) -> dict[str, tuple[float, float]]:
        values, std = rest.value("gain")
        return {name: (float(values[k]), float(std[k])) for k, name in enumerate(names) if name in cells}

    def fitted(rest: RestFit) -> Change:
        readings: dict[str, Reading] = {name: _over(1.0 + gain) for name, (gain, _) in gains(rest).items()}
        return Change(readings)

    def describe(rest: RestFit | None) -> SetupFault:
        found = {} if rest is None else gains(rest)
        told = ", ".join(
            f"{name} {with_interval(100.0 * gain, 100.0 * std)} %" for name, (gain, std) in found.items()
        )
        gain, std = next(iter(found.values()), (0.0, 0.0))
        return fault(
            "load_cell_gain",
            {"channel": cells[0] if len(cells) == 1 else list(cells)},
            {"gain": (gain, std, "1")},
            f"The gain of {' and '.join(cells)} is far off, as with another cell's calibration: {told}.",
            "Compare the calibration numbers in the amplifier with each cell's certificate.",
        )

    def possible(rest: RestFit) -> bool:
        return all(gain > LEAST - 1.0 for gain, _ in gains(rest).values())

    return Hypothesis(
        Change(), describe, frozenset(names), variants=len(names) * (len(names) + 1) // 2,
        loosened=Loosened(gains=cells), fitted=fitted, possible=possible, free=len(cells),
    )  # fmt: skip


def _over(factor: float) -> Reading:
    return lambda values, _: values / factor
