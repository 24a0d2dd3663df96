"""Effects of the catalogue, one after the other, until the whole runs are explained."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import ORDINARY, Ideal, near_noise
from rig_identification.estimate.solve import Evaluation, Problem, excess
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.search import (
    AT_NOISE,
    CHIEF,
    MOST_EFFECTS,
    Trials,
    catalogue,
    trials,
)
from rig_identification.mismatch.standing import EXPLAINED, WRONG, Search
from rig_identification.mismatch.whole_runs import pruned, whole_runs

Notify = Callable[[str, float], None]
#: What explains a session outside a push that shows in short pieces as they are fitted; None: no push does.
Beside = Callable[[Problem, Evaluation], Explained | None]


def named(ideal: Ideal, search: Search, notify: Notify, beside_push: Beside) -> Explained | None:
    """Effects of the catalogue, one after the other, until the whole runs are explained."""
    candidates = catalogue(search.problem)
    best: Explained | None = None
    fallback: Explained | None = None
    for step in range(MOST_EFFECTS):
        if step and search.budget.spent:
            break
        left = [c for c in candidates if c.label not in {t.candidate.label for t in search.found}]
        at = (step + 0.5) / (MOST_EFFECTS + 1)
        tried = trials(
            search.here,
            search.evaluation,
            left,
            ORDINARY,
            lambda label, at=at: notify(f"search: {label}", at),  # type: ignore[misc]
            search.screened,
            search.budget,
            more=step + 1 < MOST_EFFECTS,
        )
        search.screened = None
        search.liar = search.liar or tried.liar
        if not tried.done:
            break
        before = replace(search, found=list(search.found), rivals=list(search.rivals))
        first = tried.done[0]
        search.adopt(tried, first)
        if not search.whole:
            search.share = 1.0 - excess(search.evaluation) / max(search.start, 1.0)
        if misfit(search.evaluation) > EXPLAINED:
            # A push among pieces that all lack something stands out with that in the model
            beside = None if search.whole else beside_push(search.here, search.evaluation)
            if beside is not None:
                return beside
            if search.share < CHIEF:
                # Two effects take nearly all away only where the first takes the larger part
                break
            # Something large is left: there is no use yet in whole runs
            continue
        notify("search: whole runs with " + ", ".join(t.candidate.label for t in search.found), at)
        best = whole_runs(ideal, search)
        if best.mismatch.verdict == "explained" and not best.trace:
            return pruned(best, search, len(candidates))
        if best.mismatch.verdict == "explained":
            # All but a trace: a second effect may be that trace, or nothing better is found
            fallback = best
        if near_noise(best.fitted):
            again = _second_choice(ideal, before, tried, notify)
            if again is not None:
                return pruned(again[0], again[1], len(candidates))
        if near_noise(best.fitted):
            search.here, search.evaluation = best.fitted.problem, best.fitted.evaluation
        elif misfit(best.fitted.evaluation) > WRONG and first.candidate.build is not None:
            # Short pieces bend to anything that swings; what whole runs refute is no base to go on from
            break
    return fallback or best


def _second_choice(
    ideal: Ideal, before: Search, tried: Trials, notify: Notify
) -> tuple[Explained, Search] | None:
    """A less likely hypothesis that explains all runs where the likeliest does not, and how it was found.

    What has more numbers may bend further to the fitted runs. Held-out runs and the scale, which
    tell what is bent, are heard by the verdict alone.
    """
    for other in (*tried.done[1:], *tried.beaten):
        search = replace(before, found=list(before.found), rivals=list(before.rivals))
        search.adopt(tried, other)
        if misfit(search.evaluation) > AT_NOISE:
            continue
        notify("search: whole runs with " + ", ".join(t.candidate.label for t in search.found), 0.9)
        found = whole_runs(ideal, search)
        if found.mismatch.verdict == "explained" and not found.trace:
            return found, search
    return None
