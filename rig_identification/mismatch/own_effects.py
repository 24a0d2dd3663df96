"""Hypotheses of the lab's own effects (:mod:`rig_identification.own`), one each."""

from __future__ import annotations

from rig_identification.estimate.estimates import Estimates
from rig_identification.mismatch.candidate import Candidate, Told, added
from rig_identification.model.effects.place import OWN_NUMBERS, own_block
from rig_identification.own import OwnEffect, own_effects
from rig_identification.rig import Rig


def own_hypotheses(rig: Rig, mass: float, block: int) -> list[Candidate]:
    """One for each effect. mass: kg, roughly. block: first entry of the effects' block in ``physics``."""
    return [
        _hypothesis(effect, rig, mass, own_block(block, k) + OWN_NUMBERS)
        for k, effect in enumerate(own_effects())
    ]


def _hypothesis(effect: OwnEffect, rig: Rig, mass: float, first: int) -> Candidate:
    parameters = tuple(
        added(f"{effect.name}.{n.name}", n.unit, n.believed(rig, mass), first + i, n.nominal)
        for i, n in enumerate(effect.numbers)
    )

    def told(found: Estimates) -> Told:
        return {n.name: (*found.of(q.name), n.unit) for n, q in zip(effect.numbers, parameters, strict=True)}

    where: dict[str, object] = {"channel": None, "axis": None}
    return Candidate(effect.name, parameters, effect.sentence, effect.advice, where, positive=1, tell=told)
