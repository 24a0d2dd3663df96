"""What stood first, asked again beside what came second.

A first effect is chosen while the second one is still missing, and bends to it: a device that follows slowly
trails a late clock as long as a rotor is not in the model. So its rivals get the second effect as well, at
the numbers that it has beside the first, before whole runs decide.
"""

from __future__ import annotations

from rig_identification.estimate.solve import Problem
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.hypotheses import compatible
from rig_identification.mismatch.opened import Promise
from rig_identification.search.expand import Say, Standing, begun_with, earned, makes_sense
from rig_identification.search.ladder import walked_down


def crossed(
    problem: Problem, standing: Standing, best: Standing, rivals: list[Standing], budget: Budget, say: Say
) -> list[Standing]:
    """The ``rivals`` of the last effect of ``standing`` with what ``best`` has beside it, each at its level.

    problem: without any effect. rivals: other models that differ from ``standing`` in its last effect.
    """
    added = best.found[-1]
    values = best.trial(added).values
    out = []
    for rival in rivals:
        if budget.spent():
            budget.leave([f"{rival.label}, {added.label}"])
            break
        if not compatible([added], list(rival.found)):
            continue
        begun = begun_with(rival, Promise(added, 0.0, values), budget, say)
        if begun is None:
            continue
        say(begun.label)
        rung = begun.rung
        down = walked_down(rung.model, rung.evaluation.point, rung.level)
        if down is None:
            continue
        both = earned(rival, Standing(down, begun.found))
        if makes_sense(both, problem):
            out.append(both)
    return out


def siblings(standing: Standing, queue: list[Standing]) -> list[Standing]:
    """Models that differ from ``standing`` in its last effect alone."""
    if not standing.found:
        return []
    return [
        other
        for other in queue
        if other is not standing and other.found and other.found[:-1] == standing.found[:-1]
    ]
