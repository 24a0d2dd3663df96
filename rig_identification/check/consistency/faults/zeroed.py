"""Cells that were zeroed while the body hung on them: at rest they read about nothing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, Reading, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.rest_model import DOUBT, Loosened
from rig_identification.examination import SetupFault

#: A cell that reads less than this share of its even load reads about nothing.
NOTHING = 0.1


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """All cells that read about nothing in one recording at rest: each cable that holds a body pulls."""
    rig, rest = evidence.session.rig, evidence.without(evidence.cells).rest
    if rest is None:
        return
    even = rest.mass * rig.gravity / len(rig.cables)
    for recording in evidence.session.at_rest:
        loads = {
            c.name: abs(float(recording.values[c.name][0, 0]))
            for c in rig.cables
            if c.name in recording.values
        }
        empty = tuple(name for name, load in loads.items() if load < NOTHING * even)
        if empty:
            least = rig.tolerance["load_cell_zero"] / DOUBT
            near = [NOTHING * even / max(loads[name], least, 1e-9) for name in empty]
            yield _zeroed(empty, evidence.cells, float(np.sum(np.log(np.maximum(near, 1.0)))))


def _zeroed(cells: tuple[str, ...], about: frozenset[str], exactly: float) -> Hypothesis:
    """exactly: nats by which readings so near to zero speak against loads that happen to be small."""

    def zeros(rest: RestFit) -> dict[str, float]:
        values = rest.value("zero")[0]
        return {name: float(values[k]) for k, name in enumerate(rest.expected[0]) if name in cells}

    def fitted(rest: RestFit) -> Change:
        readings: dict[str, Reading] = {name: _less(zero) for name, zero in zeros(rest).items()}
        return Change(readings)

    def describe(rest: RestFit | None) -> SetupFault:
        found = {} if rest is None else zeros(rest)
        mean = float(np.mean(list(found.values()))) if found else 0.0
        spread = rest.value("zero")[1] if rest is not None else np.zeros(1)
        who = "All load cells were" if len(cells) > 1 else f"The cell of {cells[0]} was"
        told = ", ".join(f"{name} {zero:.0f} N" for name, zero in found.items())
        channel: object = list(cells) if len(cells) > 1 else cells[0]
        return fault(
            "zeroed_cell",
            {"channel": channel},
            {"offset": (mean, float(np.mean(spread)), "N")},
            f"{who} zeroed under load: their zeros are {told}.",
            "Zero the cells with nothing hanging on them, and record again. Until then the zeros are "
            "estimated.",
        )

    return Hypothesis(
        Change(),
        describe,
        about,
        variants=4,
        loosened=Loosened(zeros=cells),
        fitted=fitted,
        free=len(cells),
        penalty=-exactly,
    )


def _less(zero: float) -> Reading:
    return lambda values, _: values - zero
