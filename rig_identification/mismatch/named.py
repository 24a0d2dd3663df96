"""Effects of the catalogue, one after the other, until the whole runs are explained."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import ORDINARY, Ideal, near_noise
from rig_identification.estimate.solve import Evaluation, Problem, excess
from rig_identification.mismatch.along_measured import along_measured
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.another_first import another_first
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.first_fits import BEATEN, at_noise
from rig_identification.mismatch.hypotheses import catalogue, compatible, count_of
from rig_identification.mismatch.lawful import lawful_instead
from rig_identification.mismatch.one_more import one_more
from rig_identification.mismatch.outcome import NOTHING, Alone, Law, Trials
from rig_identification.mismatch.push import Pushes, push_too
from rig_identification.mismatch.search import MOST_EFFECTS, trials
from rig_identification.mismatch.second_choices import most_promising, second_choices
from rig_identification.mismatch.standing import EXPLAINED, WRONG, Search
from rig_identification.mismatch.trial import Trial
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
    return _Naming(ideal, search, notify, pushes, law, catalogue(search.problem), search.forked()).named()


@dataclass
class _Naming:
    """Effects found one after the other, and what came of each in whole runs."""

    ideal: Ideal
    search: Search
    notify: Notify
    pushes: Pushes | None
    law: Law | None
    candidates: list[Candidate]
    origin: Search  # where the search stood with nothing found
    step: int = 0
    left: list[Candidate] = field(default_factory=list)  # that can stand beside what was found
    best: Explained | None = None  # whole runs with what was found
    fallback: Explained | None = None  # ... of which they explain all but a trace
    uneven: tuple[Problem, Evaluation] | None = None  # pieces with an effect in that lack more
    led: bool = False  # what is in the model waits for another one
    known: Trials | None = None  # ... which is fitted already, and whether its rivals were asked
    lawful: Callable[[], Explained | None] | None = None  # what tells whether a law explains it all instead
    over: bool = False  # nothing more is looked for
    alike: list[Trial] = field(default_factory=list)  # what hardly trailed the first effect that was found

    @property
    def last(self) -> bool:
        """Whether no further effect is looked for after this one."""
        return self.step + 1 >= MOST_EFFECTS

    def named(self) -> Explained | None:
        """What explains the session, or the most that names do."""
        for self.step in range(MOST_EFFECTS):
            if self.step and self.search.budget.spent() and self.known is None:
                break
            tried = self._tried()
            if tried.lawful is not None:
                return tried.lawful
            found = self._adopted(tried) if tried.done else None
            if found is not None:
                return found
            if self.over or not tried.done:
                break
        return self._exchanged() or self._in_the_end()

    def _exchanged(self) -> Explained | None:
        """What explains the session with one more effect, and without one of those before it.

        Of two large errors the one found first may be another's twin, which takes nearly all away, and no
        second one the rest: one of three parallel cables for the next. With the right one beside it nothing
        of the twin is left. Three that are all needed are one more than is told.
        """
        search = self.search
        at_the_end = len(search.found) == MOST_EFFECTS and not (self.over or self.led)
        if not at_the_end or search.budget.spent() or (self.best is not None and self.best.told):
            return None
        self.step = MOST_EFFECTS
        before, tried = search.forked(), self._tried()
        self.search = search.forked()
        if tried.done:
            self.search.adopt(tried, tried.done[0])
            if misfit(self.search.evaluation) <= EXPLAINED:
                self._say("whole runs with " + ", ".join(t.candidate.label for t in self.search.found))
                best = whole_runs(self.ideal, self.search)
                kept = self._wholly(before, tried, best, asked=False) if best.wholly else best
                if kept.wholly and len(kept.mismatch.findings) <= MOST_EFFECTS:
                    return kept
        self.search = before
        return None

    def _say(self, label: str) -> None:
        self.notify(f"search: {label}", (self.step + 0.5) / (MOST_EFFECTS + 2))

    def _tried(self) -> Trials:
        """Hypotheses fitted to what is left, or what is known of them."""
        search, known = self.search, self.known
        self.left = compatible(self.candidates, [t.candidate for t in search.found])
        tried = known if known is not None and (known.asked or search.budget.spent()) else None
        if tried is None:
            tried = trials(
                search.here,
                search.evaluation,
                self.left,
                ORDINARY,
                self._say,
                search.screened,
                search.budget,
                more=not self.last,
                alone=NOTHING if self.step else self._alone(),
                led=None if known is None else known.done[0],
            )
            if known is not None and not any(map(at_noise, tried.done)):
                # The work was done before it was come to again
                tried = known
        self.known = Trials(list(tried.beside), asked=tried.asked) if tried.beside else None
        search.screened = None
        search.liar = search.liar or tried.liar
        search.waiting = tried.waiting if search.budget.spent() else ()
        search.budget.leave(p.candidate.label for p in search.waiting)
        return tried

    def _alone(self) -> Alone:
        """What is asked as long as nothing is found."""
        guess = self.ideal.fitted.guess
        return Alone(self.law, None if guess is None else guess.theta, partial(along_measured, self.ideal))

    def _adopted(self, tried: Trials) -> Explained | None:
        """What explains the session with the first of what was tried; None: it goes on, or is over."""
        if self.step:
            tried = self._without_first(tried)
        search = self.search
        before, first = search.forked(), tried.done[0]
        if not search.whole and not tried.chief:
            # What takes a smaller part away stands in for something: a fit to all pieces says no more of it
            search.rivals += [rival(t, first.evidence - t.evidence) for t in tried.done]
            self.over = True
            return None
        if not self.step:
            self.alike = [t for t in tried.done[1:] if first.evidence - t.evidence < BEATEN]
        search.adopt(tried, first, in_passing=self.known is not None and self.known.asked)
        search.start = max(search.start, tried.left)
        search.share = 1.0 - excess(search.evaluation) / max(search.start, 1.0)
        more = self.known is not None or not search.budget.spent()
        self.led = tried.led and not self.last and more
        if not self.led and misfit(search.evaluation) <= EXPLAINED:
            return self._in_whole_runs(before, tried)
        # A push among pieces that all lack something stands out with that in the model, and another effect
        # may bend to it
        pushed = self._pushed_in_pieces(before, tried)
        if pushed is not None or self.led:
            # With one more nothing is left: there is no use in whole runs without it
            return pushed
        if self._asks_for_pushes and not search.whole:
            self.uneven = self.uneven or (search.here, search.evaluation)
        # Something large is left: there is no use yet in whole runs. Two effects take nearly all away only
        # where the first takes the larger part
        self.over = search.share < CHIEF
        return None

    def _without_first(self, tried: Trials) -> Trials:
        """What was tried; where it explains as much without what was found before, that alone."""
        search = self.search
        if search.whole:
            self.origin = replace(self.origin, here=search.problem, evaluation=self.ideal.fitted.evaluation)
        single = without_first(self.origin, search, tried, count_of(self.candidates))
        if single is None:
            return tried
        self.search = replace(self.origin.forked(), liar=search.liar)
        return single

    @property
    def _asks_for_pushes(self) -> bool:
        return self.pushes is not None and not self.search.budget.spent()

    def _pushed_in_pieces(self, before: Search, tried: Trials) -> Explained | None:
        if self.search.whole or not self._asks_for_pushes:
            return None
        return push_too(self.ideal, before, tried, self.search, self.notify)

    def _pushed(self, before: Search, tried: Trials, best: Explained) -> Explained | None:
        """What was found, and a push beside it, in short pieces or near the noise in whole runs."""
        pushed = self._pushed_in_pieces(before, tried)
        if pushed is not None or self.pushes is None or not self._asks_for_pushes:
            return pushed
        return self.pushes.in_whole_runs(best) if near_noise(best.fitted) else None

    def _in_whole_runs(self, before: Search, tried: Trials) -> Explained | None:
        """What explains whole runs, now that short ones are explained; None: it goes on, or is over."""
        search, first = self.search, tried.done[0]
        self._say("whole runs with " + ", ".join(t.candidate.label for t in search.found))
        best = whole_runs(self.ideal, search)
        if self.best is not None and _adds_nothing(best, self.best):
            search.back_to(before)
            self.over = True
            return None
        self.best = best
        asked = self.law is not None and not self.step and not before.whole
        if best.wholly:
            return self._wholly(before, tried, best, asked=asked)
        again = self._with_another_first(best)
        if again is not None:
            return again
        pushed = self._pushed(before, tried, best)
        if pushed is not None:
            return pushed
        if asked:
            self.lawful = partial(lawful_instead, self.ideal, before, self.notify, first)
            explained = best if best.told else None
            # What leaves a trace of a few numbers beside something else is asked for that first
            if first.candidate.many or not (best.told or near_noise(best.fitted)):
                ruled = self._ruled(partial(self.lawful, explained))
                self.lawful = None
                if ruled is not None:
                    return ruled
        if best.told:
            # All but a trace: a second effect may be that trace, or nothing better is found
            self.fallback = best
        if near_noise(best.fitted) and not search.budget.late():
            return self._second_choice(before, tried, best)
        # Short pieces bend to anything that swings; what whole runs refute is no base to go on from
        self.over = misfit(best.fitted.evaluation) > WRONG and first.candidate.build is not None
        return None

    def _wholly(self, before: Search, tried: Trials, best: Explained, *, asked: bool) -> Explained:
        """What explains whole runs best, of what does. asked: whether a law may be what does."""
        best, self.search = likeliest_whole(
            self.ideal,
            before,
            tried,
            best,
            self.search,
            lambda label: self._say(f"whole runs with {label}"),
        )
        chosen = self.search.found[-1]
        if asked and chosen.candidate.many:
            # A few kilograms that swing within the body, damped well, bend to many a law of one point
            ruled = self._ruled(partial(lawful_instead, self.ideal, before, self.notify, chosen, best))
            if ruled is not None:
                return ruled
        kept = pruned(best, self.search, len(self.candidates))
        # What the first may have stood in for is taken out before anything is looked for beside it
        if kept is best and not self.last and not self.search.budget.spent():
            return one_more(self.ideal, self.search, kept, self.left, self.notify)
        return kept

    def _with_another_first(self, best: Explained) -> Explained | None:
        """What explains whole runs with another first effect that hardly trailed it; None: nothing does."""
        if len(self.search.found) < MOST_EFFECTS or best.told or not near_noise(best.fitted):
            return None
        found = another_first(self.ideal, self.search, self.alike, self._say)
        if found is None:
            return None
        best, self.search = found
        return pruned(best, self.search, len(self.candidates))

    def _second_choice(self, before: Search, tried: Trials, best: Explained) -> Explained | None:
        """What explains whole runs of less likely hypotheses; None: it goes on, from the likeliest one."""
        others = list(second_choices(self.ideal, before, tried, self.notify))
        if others and others[-1][0].wholly:
            found, its = others[-1]
            if not best.told or not outdone(self.ideal, tried.done[0], best, its.found[-1], found):
                return pruned(found, its, len(self.candidates))
            others = []
        standing = [(best, self.search), *others]
        for found, its in standing:
            its.here, its.evaluation = found.fitted.problem, found.fitted.evaluation
        if others and not self.last and not self.search.budget.spent():
            self._say("which of them one more would explain")
            self.best, self.search = most_promising(standing, self.candidates)
        return None

    def _in_the_end(self) -> Explained | None:
        """What is told where no number of effects leaves only noise."""
        if self.led:
            # The one that it waits for was not found again
            self.best = whole_runs(self.ideal, self.search)
        told = self.fallback or self.best
        if told is not None and told.told:
            # What leaves a trace may stand in for a law, which is asked where no second effect is that trace
            return self._ruled_instead() or told
        ruled = self._ruled_instead()
        if ruled is not None:
            return ruled
        if self.pushes is not None and self.uneven is not None and not self.search.budget.spent():
            # All is fitted anew outside of what stands out: only where one more effect does not explain it
            return self.pushes.in_pieces(*self.uneven) or told
        return told

    def _ruled_instead(self) -> Explained | None:
        """The law that explains it all instead, where it was not asked yet."""
        return None if self.lawful is None else self._ruled(self.lawful)

    def _ruled(self, asked: Callable[[], Explained | None]) -> Explained | None:
        """The law that explains it all instead, if one does."""
        if self.search.budget.spent():
            return None
        self.notify("search: a force that follows one point's motion", 0.8)
        return asked()


def _adds_nothing(latest: Explained, before: Explained) -> bool:
    """Whether one more effect leaves far from the noise most of what was left ``before`` it."""
    if latest.told or near_noise(latest.fitted):
        return False
    return excess(latest.fitted.evaluation) > CHIEF * excess(before.fitted.evaluation)
