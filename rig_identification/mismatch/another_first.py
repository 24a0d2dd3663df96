"""A near twin of the first effect, beside the second one.

While the second is missing the first bends to it, and of two that are alike, a clock and a lag, the wrong one
may bend better. The second, once it is found, tells them apart; one fit of whole runs from where both were
fitted asks it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from rig_identification.estimate.identify import Ideal
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import compatible
from rig_identification.mismatch.screen import carried, extended
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import Trial, promised
from rig_identification.mismatch.whole_runs import fitted_whole


def another_first(
    ideal: Ideal, search: Search, alike: Sequence[Trial], notify: Callable[[str], None]
) -> tuple[Explained, Search] | None:
    """What explains whole runs with another first effect, and how it was found; None where nothing does.

    search: in which two were found, which leave something; alike: what hardly trailed the first alone.
    What changes the model is not put into it here: that is fitted slowly, and bends to anything.
    """
    second = search.found[-1].candidate
    for first in alike:
        plain = first.candidate.build is None and compatible([first.candidate], [second])
        if not plain or search.budget.spent():
            continue
        notify(f"whole runs with {first.candidate.label}, {second.label}")
        found, its = _instead(ideal, search, first)
        if found.wholly:
            return found, its
    return None


def _instead(ideal: Ideal, search: Search, first: Trial) -> tuple[Explained, Search]:
    """Whole runs with ``first`` in the place of what was found first."""
    its = search.forked()
    its.found, its.bodies = [first, *search.found[1:]], ()
    told = first.candidate.where, first.candidate.effect
    its.rivals = [r for r in its.rivals if (r["where"], r["effect"]) != told]
    runs = replace(search.problem, runs=search.here.runs)
    here = extended(runs, tuple(t.candidate for t in its.found))
    point = carried(here, search.here, search.evaluation.point)
    point = promised(here, point, first.candidate, first.values, search.evaluation)
    return fitted_whole(ideal, its, its.found, here, point), its
