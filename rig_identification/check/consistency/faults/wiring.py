"""Cells under the wrong cable, wrong signs, and the sum of all cells on one channel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, Reading, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.examination import SetupFault

Array = NDArray[np.float64]

#: Cables up to which every permutation is tried; beyond, pairs and rotations of the whole order.
ALL_ORDERS = 4


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Every order of the cells, every sign."""
    names = [c.name for c in evidence.session.rig.cables]
    orders = list(_orders(names))
    for order in orders:
        yield _ordered(names, order, len(orders))
    yield _negative(tuple(names), names)
    for name in names:
        yield _negative((name,), names)


def _orders(names: list[str]) -> Iterator[tuple[str, ...]]:
    if len(names) <= ALL_ORDERS:
        yield from (order for order in permutations(names) if list(order) != names)
        return
    for one, other in combinations(range(len(names)), 2):
        order = list(names)
        order[one], order[other] = names[other], names[one]
        yield tuple(order)
    for shift in range(1, len(names)):
        yield tuple(names[shift:] + names[:shift])
    yield tuple(reversed(names))


def _ordered(names: list[str], order: tuple[str, ...], count: int) -> Hypothesis:
    wires = {name: source for name, source in zip(names, order, strict=True) if name != source}

    def describe(rest: RestFit | None) -> SetupFault:
        told = "; ".join(f"the cell of {cable} is recorded as {source}" for cable, source in wires.items())
        lines = "\n".join(f"--topic {cable}/wrench=<topic of {source}>" for cable, source in wires.items())
        return fault(
            "wiring",
            {"channel": list(wires), "kind": "cells_swapped", "sources": wires},
            {},
            f"Cells are swapped between cables: {told}.",
            "Exchange the plugs, or the names of the topics.",
            lines,
        )

    return Hypothesis(Change(wires=wires), describe, frozenset(names), variants=count)


def _negative(cells: tuple[str, ...], names: list[str]) -> Hypothesis:
    readings: Mapping[str, Reading] = {name: lambda values, _: -values for name in cells}

    def describe(rest: RestFit | None) -> SetupFault:
        who = "All load cells read" if len(cells) > 1 else f"The cell of {cells[0]} reads"
        channel: object = list(cells) if len(cells) > 1 else cells[0]
        return fault(
            "wiring",
            {"channel": channel, "kind": "negative"},
            {},
            f"{who} negative where the cable pulls.",
            "Exchange the signal wires of the cell's bridge, or change the sign in the driver.",
        )

    return Hypothesis(Change(readings), describe, frozenset(names), variants=len(names) + 1)
