"""A channel that carries the sum of all cells in place of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

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
            yield _sum(name, names, _shares(evidence, name))


def _shares(evidence: Evidence, cell: str) -> dict[str, float]:
    """Shares of the sum that the cell itself should carry, by recording: a known mass shifts the load."""
    rest = evidence.without(evidence.cells).rest
    if rest is None:
        return {}
    place = [c.name for c in evidence.session.rig.cables].index(cell)
    part = rest.tension[:, place] / rest.tension.sum(axis=1)
    return {r.name: float(p) for r, p in zip(evidence.session.at_rest, part, strict=True)}


def _sum(cell: str, names: tuple[str, ...], shares: Mapping[str, float] | None) -> Hypothesis:
    """shares: of the sum that are the cell's own, where no other cell tells them."""

    def describe(rest: RestFit | None) -> SetupFault:
        return fault(
            "wiring",
            {"channel": cell, "kind": "sum"},
            {},
            f"The channel of {cell} carries the sum of all cells.",
            "Wire each cell to its own amplifier, not through the summing box."
            + ("" if shares is None else " Until then the channel is left out."),
            corrected=shares is None,
        )

    if shares is not None:
        even = 1.0 / len(names)
        alone = Change({cell: lambda values, recording: shares.get(recording, even) * values})
        out = Change(left_out=(cell,))
        return Hypothesis(alone, describe, frozenset(names), fitted=lambda rest: out)
    others = tuple(name for name in names if name != cell)
    return Hypothesis(Change(less={cell: others}), describe, frozenset(names), variants=len(names))
