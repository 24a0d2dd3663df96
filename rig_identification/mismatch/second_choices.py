"""Less likely hypotheses in whole runs, where the likeliest one does not explain all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import Ideal, near_noise
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.first_fits import AT_NOISE
from rig_identification.mismatch.hypotheses import compatible, count_of, net_gain
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import log_evidence, mass_of
from rig_identification.mismatch.whole_runs import whole_runs

Notify = Callable[[str, float], None]


def second_choices(
    ideal: Ideal, before: Search, tried: Trials, notify: Notify
) -> Iterator[tuple[Explained, Search]]:
    """Less likely hypotheses near the noise in all runs, and how they were found.

    What has more numbers may bend further to the fitted runs. Held-out runs and the scale, which
    tell what is bent, are heard by the verdict alone. One that explains all is the last.
    """
    for other in (*tried.done[1:], *tried.beaten):
        if misfit(other.evaluation) > AT_NOISE:
            continue
        search = before.forked()
        search.adopt(tried, other)
        if misfit(search.evaluation) > AT_NOISE:
            continue
        notify("search: whole runs with " + ", ".join(t.candidate.label for t in search.found), 0.9)
        found = whole_runs(ideal, search)
        if near_noise(found.fitted):
            yield found, search
        if found.wholly:
            return


def most_promising(
    standing: list[tuple[Explained, Search]], candidates: list[Candidate]
) -> tuple[Explained, Search]:
    """Of hypotheses of which none explains all, the likeliest with one more, to first order.

    Short pieces hardly tell a cable's length from its hinge; with what else is wrong in the model
    whole runs do.
    """
    count = count_of(candidates)
    best: tuple[float, Explained, Search] | None = None
    for found, search in standing:
        others = compatible(candidates, [t.candidate for t in search.found])
        mass = mass_of(search.here, search.evaluation)
        search.screened = screen(search.here, search.evaluation, others, mass)
        gains = [net_gain(p, count) for p in search.screened]
        likely = log_evidence(search.evaluation) + max(0.0, *gains)
        if best is None or likely > best[0]:
            best = likely, found, search
    if best is None:
        raise ValueError("nothing to choose from")
    return best[1:]
