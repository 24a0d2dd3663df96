"""A channel that carries the sum of all cells in place of its own."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.examination import SetupFault


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Every channel; where it is the only one, it cannot be put right and is left out."""
    names = tuple(c.name for c in evidence.session.rig.cables)
    held = [n for n in names if any(n in r.values for r in evidence.session.recordings)]
    for name in names:
        if len(held) == len(names):
            yield _sum(name, names, None)
        elif held == [name]:
            yield _sum(name, names, _share(evidence, name))


def _share(evidence: Evidence, cell: str) -> float:
    """Share of the sum that the cell itself should carry at rest."""
    rest = evidence.without(frozenset(c.name for c in evidence.session.rig.cables)).rest
    if rest is None:
        return 1.0 / len(evidence.session.rig.cables)
    place = [c.name for c in evidence.session.rig.cables].index(cell)
    return float(rest.tension[0, place] / np.sum(rest.tension[0]))


def _sum(cell: str, names: tuple[str, ...], share: float | None) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        return fault(
            "wiring",
            {"channel": cell, "kind": "sum"},
            {},
            f"The channel of {cell} carries the sum of all cells.",
            "Wire each cell to its own amplifier, not through the summing box."
            + ("" if share is None else " Until then the channel is left out."),
            corrected=share is None,
        )

    if share is not None:
        alone = Change({cell: lambda values, _: share * values})
        out = Change(left_out=(cell,))
        return Hypothesis(alone, describe, frozenset(names), fitted=lambda rest: out)
    others = tuple(name for name in names if name != cell)
    return Hypothesis(Change(less={cell: others}), describe, frozenset(names), variants=len(names))
