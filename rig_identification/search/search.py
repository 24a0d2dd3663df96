"""The search: the likeliest model is expanded by one more effect, until whole runs are explained.

One queue holds all models that were fitted. The likeliest one that was not expanded yet is, each child at its
own level of the discrepancy; where a first effect only stood in for another one, the other one's turn comes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.identify import Ideal, only_watched
from rig_identification.estimate.solve import Problem
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import Promise, with_reference
from rig_identification.mismatch.whole_runs import Heard, unheard
from rig_identification.search.crossed import crossed, siblings
from rig_identification.search.expand import MEANT, Standing, children, described_closer
from rig_identification.search.ladder import REACHED, Rung, begun, climbed
from rig_identification.search.levels import ALONE
from rig_identification.search.stretch import over_all, stretch_of
from rig_identification.search.whole import MOST_EFFECTS, in_whole_runs

Notify = Callable[[str, float], None]

#: Effects in a row that leave the wrench as strong as it was: of two that are there the first one may, and
#: what two leave they do not explain.
IDLE = 2
#: Models that are expanded at most: those of three effects, and one more first effect's.
EXPANDED = 4
#: The level from which on whole runs are fitted without a discrepancy: a stronger one is no trace.
NEARLY_ALONE = ALONE - 2


@dataclass(frozen=True)
class Outcome:
    """What a search came to."""

    first: Standing  # without any effect
    whole: Rung  # ... over whole runs
    likeliest: Standing
    told: Explained | None  # what explains the session, but for a trace perhaps
    partly: Explained | None  # whole runs with the likeliest effects, where they explain a part

    @cached_property
    def rung(self) -> Rung:
        """The likeliest model with a wrench, over whole runs; without any effect where that needs none."""
        best = self.likeliest
        return self.whole if best.rung.alone else over_all(self.whole, best.found, best.rung)


def first_rung(ideal: Ideal) -> Rung | None:
    """The ideal model where its search begins; None where not even the strongest wrench follows.

    Far from the noise it is the model at its own level. Near the noise first order needs no wrench, and a
    weak one would take the place of nearly anything small. A body that is only watched tells none.
    """
    problem, fitted = problem_of(ideal), ideal.fitted
    if only_watched(fitted.problem) or misfit(fitted.evaluation) < NEAR_SQUARE:
        return Rung(problem, fitted.evaluation, ALONE)
    return begun(problem, fitted.guess or fitted.evaluation.point)


def problem_of(ideal: Ideal) -> Problem:
    """Whole runs of the ideal model, with its rest pose known."""
    return with_reference(ideal.fitted.problem, ideal.fitted.rest)


def search(
    ideal: Ideal,
    first: Rung,
    notify: Notify,
    budget: Budget,
    heard: Heard = unheard,
    promises: list[Promise] | None = None,
) -> Outcome:
    """What explains the session. first: the ideal model where the search begins.

    budget: how much it may compute. heard: is told what explains the session, as it is found. promises:
    about ``first``, where they are known.
    """
    problem = problem_of(ideal)
    candidates = catalogue(problem)
    start, whole = Standing(first if first.alone else stretch_of(first)), first
    looked_at = problem if start.rung is first else replace(problem, runs=start.rung.problem.runs)
    queue, idle = [start], {id(start): 0}
    likeliest, told, partly = start, None, None
    for turn in range(EXPANDED):
        if turn == 1 and start.rung.alone and not only_watched(problem) and not budget.spent():
            # What no number explains at first order may be a force that has no name
            start = Standing(whole := climbed(start.rung))
            queue += [] if start.rung.alone else [start]
            idle[id(start)] = 0
            likeliest = max(likeliest, start, key=lambda s: s.evidence)
        if not queue:
            break
        standing = max(queue, key=lambda s: s.evidence)
        if budget.spent():
            budget.leave(["one more effect" + (f" beside {standing.label}" if standing.found else "")])
            break
        queue.remove(standing)

        def say(label: str, turn: int = turn) -> None:
            notify(f"search: {label}", (turn + 0.5) / (EXPANDED + 1))

        nearer = described_closer(looked_at, standing, budget, say)
        every = nearer or children(looked_at, standing, candidates, budget, say, None if turn else promises)
        every = [child for child in every if child.evidence > standing.evidence + MEANT]
        if not every:
            continue
        if every[0].rung.level >= NEARLY_ALONE and not nearer:
            rivals = siblings(standing, queue)
            every += crossed(looked_at, standing, every[0], rivals, budget, say)
            every.sort(key=lambda child: -child.evidence)
        best = every[0]
        if best.evidence > likeliest.evidence:
            likeliest, partly = best, None
        if best.rung.level >= NEARLY_ALONE:
            found = in_whole_runs(ideal, problem, best, every[1:], candidates, budget, say, heard)
            if found is not None and found.wholly:
                return Outcome(start, whole, best, found, found)
            if found is not None and found.told:
                told = found
            if likeliest is best:
                partly = found
        for child in every:
            if child.evidence - standing.evidence < REACHED * (best.evidence - standing.evidence):
                # What stands in for two effects leads by less over either of them
                break
            stays = child.rung.level <= standing.rung.level and not child.rung.alone
            idle[id(child)] = idle[id(standing)] + 1 if stays else 0
            if len(child.found) < MOST_EFFECTS and idle[id(child)] < IDLE:
                queue.append(child)
    return Outcome(start, whole, likeliest, told, partly)
