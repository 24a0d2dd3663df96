"""The ground scale's mass: in pounds, or another body's."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.faults.unit import POUND
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.examination import SetupFault
from rig_identification.quantity import with_interval
from rig_identification.rig import Rig


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """The mass in pounds, and a mass that is not this body's."""
    rig = evidence.session.rig
    if rig.mass is not None:
        yield _pounds(rig.mass)
        yield _another(evidence, rig.mass)


def _pounds(mass: float) -> Hypothesis:
    def right(rig: Rig) -> Rig:
        return replace(
            rig, mass=POUND * mass, mass_std=None if rig.mass_std is None else POUND * rig.mass_std
        )

    def describe(rest: RestFit | None) -> SetupFault:
        return fault(
            "mass_error",
            {"channel": "description", "kind": "pounds"},
            {"factor": (POUND, 0.0, "kg per lb"), "mass": (POUND * mass, 0.0, "kg")},
            f"The mass of the rig description, {mass:g}, is in pounds, not in kg.",
            "Give the mass in kg.",
            f"mass: {POUND * mass:.6g}",
        )

    return Hypothesis(Change(rig=right), describe, frozenset(["rest"]), variants=2, fresh=True)


def _another(evidence: Evidence, mass: float) -> Hypothesis:
    """A body is weighed wrongly by a factor of two or three, not of hundreds: log-normal, a factor e."""
    loads = [
        abs(float(reading[0, 0]))
        for cable in evidence.session.rig.cables
        if (reading := evidence.session.at_rest[0].values.get(cable.name)) is not None
    ]
    carried = max(sum(loads) / evidence.session.rig.gravity, 1e-6)

    def describe(rest: RestFit | None) -> SetupFault:
        found, std = (mass, 0.0) if rest is None else (rest.mass, rest.mass * float(rest.value("mass")[1][0]))
        return fault(
            "mass_error",
            {"channel": "description", "kind": "another_mass"},
            {"mass": (found, std, "kg")},
            f"The load cells carry {with_interval(found, std, 'kg')}, the rig description says {mass:g} kg.",
            "Weigh body and frame together anew. Until then the mass is estimated from the load cells.",
        )

    return Hypothesis(
        Change(rig=lambda rig: replace(rig, mass=None, mass_std=None)), describe, frozenset(["rest"]),
        variants=2, free=1, fresh=True, penalty=0.5 * float(np.log(carried / mass) ** 2),
    )  # fmt: skip
