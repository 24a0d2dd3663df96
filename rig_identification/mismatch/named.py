"""Effects of the catalogue, one after the other, until the whole runs are explained."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import ORDINARY, Ideal, near_noise
from rig_identification.estimate.solve import Evaluation, Problem, excess
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.first_fits import AT_NOISE, at_noise
from rig_identification.mismatch.hypotheses import catalogue, compatible, count_of, net_gain, worth_a_fit
from rig_identification.mismatch.lawful import lawful_instead
from rig_identification.mismatch.outcome import Law, Trials
from rig_identification.mismatch.push import Pushes, push_too
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.search import MOST_EFFECTS, trials
from rig_identification.mismatch.standing import EXPLAINED, WRONG, Search
from rig_identification.mismatch.trial import log_evidence, mass_of
from rig_identification.mismatch.undecided import undecided_beside
from rig_identification.mismatch.whole_rivals import likeliest_whole, outdone
from rig_identification.mismatch.whole_runs import pruned, whole_runs
from rig_identification.mismatch.without_first import without_first

Notify = Callable[[str, float], None]


def named(
    ideal: Ideal, search: Search, notify: Notify, pushes: Pushes | None = None, law: Law | None = None
) -> Explained | None:
    """Effects of the catalogue, one after the other, until the whole runs are explained.

    law: what may explain all runs where the catalogue's first promises do not; it stands alone or not at all.
    """
    candidates = catalogue(search.problem)
    best: Explained | None = None
    fallback: Explained | None = None
    uneven: tuple[Problem, Evaluation] | None = None  # pieces with an effect in that lack more
    led = False  # what is in the model waits for another one
    known: Trials | None = None  # ... which is fitted already, and whether its rivals were asked
    origin = search.forked()
    lawful: Callable[[], Explained | None] | None = None  # what tells whether a law explains it all instead
    for step in range(MOST_EFFECTS):
        if step and search.budget.spent() and known is None:
            break
        left = compatible(candidates, [t.candidate for t in search.found])
        at = (step + 0.5) / (MOST_EFFECTS + 1)
        tried = known if known is not None and (known.asked or search.budget.spent()) else None
        if tried is None:
            tried = trials(
                search.here,
                search.evaluation,
                left,
                ORDINARY,
                lambda label, at=at: notify(f"search: {label}", at),  # type: ignore[misc]
                search.screened,
                search.budget,
                more=step + 1 < MOST_EFFECTS,
                law=None if step else law,
                guess=None if step or ideal.fitted.guess is None else ideal.fitted.guess.theta,
            )
            if known is not None and not any(map(at_noise, tried.done)):
                # Time ran out before it was come to again
                tried = known
        known = Trials(list(tried.beside), asked=tried.asked) if tried.beside else None
        if tried.lawful is not None:
            return tried.lawful
        search.screened = None
        search.liar = search.liar or tried.liar
        if not tried.done:
            break
        if step:
            if search.whole:
                origin = replace(origin, here=search.problem, evaluation=ideal.fitted.evaluation)
            single = without_first(origin, search, tried, count_of(candidates))
            if single is not None:
                search, tried = replace(origin.forked(), liar=search.liar), single
        before = search.forked()
        first = tried.done[0]
        if not search.whole and not tried.chief:
            # What takes a smaller part away stands in for something: a fit to all pieces says no more of it
            search.rivals += [rival(t, first.evidence - t.evidence) for t in tried.done]
            break
        search.adopt(tried, first, in_passing=known is not None and known.asked)
        search.start = max(search.start, tried.left)
        search.share = 1.0 - excess(search.evaluation) / max(search.start, 1.0)
        more = known is not None or not search.budget.spent()
        led = tried.led and step + 1 < MOST_EFFECTS and more
        pushable = pushes is not None and not search.budget.spent()
        unfinished = led or misfit(search.evaluation) > EXPLAINED
        if unfinished and pushable and not search.whole:
            # A push among pieces that all lack something stands out with that in the model, and another
            # effect may bend to it
            pushed = push_too(ideal, before, tried, search, notify)
            if pushed is not None:
                return pushed
        if led:
            # With one more nothing is left: there is no use in whole runs without it
            continue
        if unfinished:
            if pushable and not search.whole:
                uneven = uneven or (search.here, search.evaluation)
            if search.share < CHIEF:
                # Two effects take nearly all away only where the first takes the larger part
                break
            # Something large is left: there is no use yet in whole runs
            continue
        notify("search: whole runs with " + ", ".join(t.candidate.label for t in search.found), at)
        latest = whole_runs(ideal, search)
        if best is not None and _adds_nothing(latest, best):
            search.back_to(before)
            break
        best = latest
        asked = law is not None and not step and not before.whole
        likelier = partial(lawful_instead, ideal, before, notify)
        if _wholly(best):
            best, search = likeliest_whole(
                ideal,
                before,
                tried,
                best,
                search,
                lambda label, at=at: notify(f"search: whole runs with {label}", at),  # type: ignore[misc]
            )
            if asked and search.found[-1].candidate.many:
                # A few kilograms that swing within the body, damped well, bend to many a law of one point
                ruled = _lawful(partial(likelier, search.found[-1], best), search, notify)
                if ruled is not None:
                    return ruled
            kept = pruned(best, search, len(candidates))
            # What the first may have stood in for is taken out before anything is looked for beside it
            alone = kept is best and step + 1 < MOST_EFFECTS and not search.budget.spent()
            return _one_more(ideal, search, kept, left, notify) if alone else kept
        if pushes is not None and not search.budget.spent():
            pushed = None if search.whole else push_too(ideal, before, tried, search, notify)
            if pushed is None and near_noise(best.fitted):
                pushed = pushes.in_whole_runs(best)
            if pushed is not None:
                return pushed
        if asked:
            lawful = partial(likelier, first)
            explained = best if best.mismatch.verdict == "explained" else None
            if explained is None or first.candidate.many:
                ruled = _lawful(partial(lawful, explained), search, notify)
                lawful = None
                if ruled is not None:
                    return ruled
        if best.mismatch.verdict == "explained":
            # All but a trace: a second effect may be that trace, or nothing better is found
            fallback = best
        if near_noise(best.fitted) and not search.budget.late():
            others = list(_second_choices(ideal, before, tried, notify))
            if others and _wholly(others[-1][0]):
                found, its = others[-1]
                traced = best.mismatch.verdict == "explained"
                if not traced or not outdone(ideal, first, best, its.found[-1], found):
                    return pruned(found, its, len(candidates))
                others = []
            standing = [(best, search), *others]
            for found, its in standing:
                its.here, its.evaluation = found.fitted.problem, found.fitted.evaluation
            if others and step + 1 < MOST_EFFECTS and not search.budget.spent():
                notify("search: which of them one more would explain", at)
                best, search = _most_promising(standing, candidates)
        elif misfit(best.fitted.evaluation) > WRONG and first.candidate.build is not None:
            # Short pieces bend to anything that swings; what whole runs refute is no base to go on from
            break
    if led:
        # The one that it waits for was not found again
        best = whole_runs(ideal, search)
    told = fallback or best
    if told is not None and told.mismatch.verdict == "explained":
        # What leaves a trace may stand in for a law, which is asked where no second effect is that trace
        return (_lawful(lawful, search, notify) if lawful is not None else None) or told
    if pushes is not None and uneven is not None and not search.budget.spent():
        # All is fitted anew outside of what stands out: only where one more effect does not explain it
        return pushes.in_pieces(*uneven) or told
    return told


def _lawful(asked: Callable[[], Explained | None], search: Search, notify: Notify) -> Explained | None:
    """The law that explains it all instead, if one does."""
    if search.budget.spent():
        return None
    notify("search: a force that follows one point's motion", 0.8)
    return asked()


def _one_more(
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
            if _wholly(both):
                return both
    return undecided_beside(best, promises, count_of(left), notify, search.budget)


def _adds_nothing(latest: Explained, before: Explained) -> bool:
    """Whether one more effect leaves far from the noise most of what was left ``before`` it."""
    if latest.mismatch.verdict == "explained" or near_noise(latest.fitted):
        return False
    return excess(latest.fitted.evaluation) > CHIEF * excess(before.fitted.evaluation)


def _wholly(found: Explained) -> bool:
    """Whether every residual is noise."""
    return found.mismatch.verdict == "explained" and not found.trace


def _second_choices(
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
        if _wholly(found):
            return


def _most_promising(
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
