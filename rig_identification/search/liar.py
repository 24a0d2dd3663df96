"""The device without which everything else agrees: where it is not heard no wrench is needed."""

from __future__ import annotations

from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.locate import devices_of, find_liar, silenced
from rig_identification.search.ladder import Rung, walked_down
from rig_identification.search.levels import ALONE

#: Devices of which one may contradict the others: of two either may.
FEWEST = 3


def liar_of(rung: Rung, budget: Budget) -> str | None:
    """The device that contradicts all others; None where none does. rung: a model at its own level.

    Physics that acts on the body leaves no device in peace. An error of one device is taken for a wrench only
    as long as that device is heard.
    """
    if rung.alone:
        liar = find_liar(rung.problem, rung.evaluation, budget)
        return None if liar is None else liar.device
    devices = devices_of(rung.problem)
    if len(devices) < FEWEST:
        return None
    peace: dict[str, Rung] = {}
    for device in devices:
        if budget.late():
            break
        quiet = walked_down(silenced(rung.model, device), rung.evaluation.point, rung.level)
        if quiet is not None and quiet.level >= ALONE - 1 > rung.level:
            peace[device] = quiet
    return max(peace, key=lambda device: peace[device].evidence, default=None)
