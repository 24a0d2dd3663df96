"""A channel that carries the sum of all cells in place of its own."""

from __future__ import annotations

from collections.abc import Iterator

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.examination import SetupFault


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Every channel."""
    names = tuple(c.name for c in evidence.session.rig.cables)
    for name in names:
        yield _sum(name, names)


def _sum(cell: str, names: tuple[str, ...]) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        return fault(
            "wiring",
            {"channel": cell, "kind": "sum"},
            {},
            f"The channel of {cell} carries the sum of all cells.",
            "Wire the cell to its own amplifier, not through the summing box.",
        )

    others = tuple(name for name in names if name != cell)
    return Hypothesis(Change(less={cell: others}), describe, frozenset(names), variants=len(names))
