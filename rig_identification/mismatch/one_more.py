"""What a hypothesis tells beside an explanation that leaves only noise, within that noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from rig_identification.estimate.identify import ORDINARY, Ideal
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import compatible, count_of, worth_a_fit
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.search import trials
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import mass_of
from rig_identification.mismatch.undecided import undecided_beside
from rig_identification.mismatch.whole_runs import whole_runs

Notify = Callable[[str, float], None]


def one_more(
    ideal: Ideal, search: Search, best: Explained, candidates: list[Candidate], notify: Notify
) -> Explained:
    """What a hypothesis tells beside an explanation that leaves only noise, and no residual; or ``best``.

    The same score test, and the same asking, as where the ideal model itself leaves only noise; and as there
    the body's interval has in it what may be there.
    """
    notify("search: anything more within the noise", 0.9)
    here, evaluation = best.fitted.problem, best.fitted.evaluation
    left = compatible(candidates, [t.candidate for t in search.found])
    promises = screen(here, evaluation, left, mass_of(here, evaluation))
    if worth_a_fit(promises, count_of(left)):
        beside = replace(search.forked(), here=here, evaluation=evaluation)
        tried = trials(
            here,
            evaluation,
            left,
            ORDINARY,
            lambda label: notify(f"search: {label}", 0.92),
            promises,
            search.budget,
        )
        if tried.done:
            beside.adopt(tried, tried.done[0])
            notify("search: whole runs with " + ", ".join(t.candidate.label for t in beside.found), 0.95)
            # What all residuals are noise with comes before what is found within that noise, and bends to it
            both = whole_runs(ideal, beside, as_found=True)
            if both.wholly:
                return both
    return undecided_beside(best, promises, count_of(left), notify, search.budget)
