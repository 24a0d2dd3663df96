"""The known mass of a static recording: another recording's, in pounds, heavier or elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.faults.unit import POUND
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.rest_model import Loosened
from rig_identification.examination import SetupFault
from rig_identification.quantity import with_interval
from rig_identification.recording import Dummy


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Every exchange of two static recordings, pounds, another mass, another place, both."""
    rest = [r for r in evidence.session.recordings if r.kind == "static"]
    for one, other in combinations(rest, 2):
        if one.dummy is not None or other.dummy is not None:
            yield _exchanged(one.name, other.name, {one.name: other.dummy, other.name: one.dummy})
    loaded = {r.name: r.dummy for r in rest if r.dummy is not None}
    if loaded:
        pounds = {name: replace(dummy, mass=POUND * dummy.mass) for name, dummy in loaded.items()}
        yield _pounds(loaded, pounds)
        yield _wrong(evidence, loaded, Loosened(dummy_mass=True), "mass", 1)
        yield _wrong(evidence, loaded, Loosened(dummy_place=True), "place", 2)
        yield _wrong(evidence, loaded, Loosened(dummy_mass=True, dummy_place=True), "mass and place", 3)


def _exchanged(one: str, other: str, dummies: Mapping[str, Dummy | None]) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        return fault(
            "wiring",
            {"channel": "session", "kind": "recordings_swapped", "recordings": [one, other]},
            {},
            f"The recordings {one} and {other} are exchanged: the known mass hung in the other one.",
            "Exchange the two bags in session.yaml.",
            "\n".join(_entry(name, dummy) for name, dummy in dummies.items()),
        )

    return Hypothesis(Change(dummies=dict(dummies)), describe, frozenset(["rest"]), variants=2, fresh=True)


def _entry(name: str, dummy: Dummy | None) -> str:
    if dummy is None:
        return f"- {{bag: {name}, kind: static}}"
    place = ", ".join(f"{v:g}" for v in dummy.position)
    return f"- {{bag: {name}, kind: static, dummy: {{mass: {dummy.mass:.6g}, position: [{place}]}}}}"


def _pounds(loaded: Mapping[str, Dummy], pounds: Mapping[str, Dummy | None]) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        names = ", ".join(loaded)
        return fault(
            "dummy_error",
            {"channel": "session", "kind": "pounds", "recordings": list(loaded)},
            {"factor": (POUND, 0.0, "kg per lb")},
            f"The known mass of {names} is given in pounds, not in kg.",
            "Give the known mass in kg.",
            "\n".join(_entry(name, dummy) for name, dummy in pounds.items()),
        )

    return Hypothesis(Change(dummies=dict(pounds)), describe, frozenset(["rest"]), variants=2, fresh=True)


def _wrong(
    evidence: Evidence, loaded: Mapping[str, Dummy], loosened: Loosened, what: str, free: int
) -> Hypothesis:
    """The recording is left out: a mass known to a percent would turn the answer by as much."""
    order = [r.name for r in evidence.session.at_rest]

    def describe(rest: RestFit | None) -> SetupFault:
        parts, numbers = [], {}
        for name, dummy in loaded.items():
            if rest is None or name not in order:
                continue
            k = order.index(name)
            mass, mass_std = (float(v[k]) for v in rest.value("dummy_mass"))
            place, place_std = (v[3 * k : 3 * k + 3] for v in rest.value("dummy_place"))
            if loosened.dummy_mass:
                numbers["mass"] = (dummy.mass + mass, mass_std, "kg")
                hung = with_interval(dummy.mass + mass, mass_std, "kg")
                parts.append(f"{hung} hung in {name}, not {dummy.mass:g} kg")
            if loosened.dummy_place:
                numbers["distance"] = (float(np.linalg.norm(place)), float(np.linalg.norm(place_std)), "m")
                at = ", ".join(f"{v:.3f}" for v in dummy.position + place)
                parts.append(f"it hung at about [{at}] m in {name}")
        return fault(
            "dummy_error",
            {"channel": "session", "kind": what.replace(" ", "_"), "recordings": list(loaded)},
            numbers,
            f"The {what} of the known mass is not as written: {'; '.join(parts)}.",
            "Weigh the known mass and measure its place anew, and correct session.yaml. "
            "Until then the recording is left out.",
            corrected=False,
        )

    return Hypothesis(
        Change(), describe, frozenset(["rest"]), variants=2, loosened=loosened, free=free, fresh=True,
        fitted=lambda rest: Change(dropped=tuple(loaded)),
    )  # fmt: skip
