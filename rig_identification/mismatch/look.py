"""One look for what explains most of what is left: the witnesses that are asked, and what came of it.

Which is asked after which search.py says, and what is told of it telling.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.solve import (
    Evaluation,
    Problem,
    evaluate,
    excess,
)
from rig_identification.mismatch.along_measured import acts, along_beside
from rig_identification.mismatch.amounts import CHIEF, WORTH, far_promises, ringing_like, stretching, supports
from rig_identification.mismatch.at_rest import AtRest, at_rest, both_at_rest, from_rest
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.first_fits import (
    BEATEN,
    CLOSE,
    DIRECT,
    NO_STAND_IN,
    Notify,
    almost,
    at_noise,
    begun,
    but_for_a_while,
    leading,
    leaving_nothing,
    shows,
)
from rig_identification.mismatch.hypotheses import as_likely, compatible, count_of, worth_a_fit
from rig_identification.mismatch.locate import find_liar
from rig_identification.mismatch.outcome import MEANT, NOTHING, Alone
from rig_identification.mismatch.screen import Promise, carried, extended, screen
from rig_identification.mismatch.simpler import fitted_simpler
from rig_identification.mismatch.supports import gives_way
from rig_identification.mismatch.trial import (
    VERY_FAR,
    Trial,
    at_minimum,
    attempt,
    finished,
    fitted_from,
    log_evidence,
    ordinary_errors,
)
from rig_identification.mismatch.unbent import MOST, at_first, best_of, likely, unbent

#: Hypotheses that get to their end.
FINISHED = 3
#: What gives way or swings that is tried before changes of numbers which promise less.
AT_ONCE = 3
#: Hypotheses that are named where the work was done before they could be fitted.
WAITING = 3
#: Promises as good as the best that are fitted beside what is certain.
ALIKE = 2


@dataclass
class Look:
    """One look for what explains most of what is left: what has been tried so far, and on what."""

    problem: Problem  # in which devices are heard one without the other, and where it stands
    evaluation: Evaluation
    here: Problem  # what hypotheses are fitted to, and what they are to explain
    seen: Evaluation
    candidates: list[Candidate]
    promises: list[Promise]
    mass: float  # kg, of the body
    limit: float  # of ordinary errors, in tolerances
    far: bool  # whether much is left
    tell: Notify
    budget: Budget
    alone: Alone = NOTHING
    led: Trial | None = None  # what led here: with it nothing was left of what the first effect was fitted to
    fitted: Trial | None = None  # before, to ``here`` about ``seen``
    tried: list[Trial] = field(default_factory=list)
    device: str | None = None  # that contradicts all others
    lawful: Explained | None = None
    certain: list[Trial] = field(default_factory=list)  # what rest asks for, beside something that moves
    beside: dict[str, list[Trial]] = field(default_factory=dict)  # that something else, by label
    hopeless: set[str] = field(default_factory=set)  # labels of what was begun and led nowhere
    asked: list[Promise] = field(default_factory=list)  # by rest, most of all
    moving: bool = False  # whether rest asks for next to nothing, and no change of numbers promises much
    weighed: set[str] = field(default_factory=set)  # labels of what the scale leaves no other choice than
    rung: set[str] = field(default_factory=set)  # labels of ceilings that were tried like a part on springs
    refused: int = 0  # of what was tried, that were asked whether with one more they leave nothing
    slowly: list[Promise] = field(default_factory=list)  # along the measured motion, what is fitted slowly
    said: set[str] = field(default_factory=set)  # what it is at and has been at: labels of all that was begun

    def notify(self, label: str) -> None:
        """Say what it is at."""
        self.said.add(label)
        self.tell(label)

    @property
    def count(self) -> int:
        """Number of hypotheses."""
        return count_of(self.candidates)

    @cached_property
    def ordinary(self) -> dict[str, float]:
        """Errors that the lab doubts itself, by name."""
        return ordinary_errors(self.problem)

    @property
    def needed(self) -> float:
        """Log evidence that is worth telling."""
        return log_evidence(self.seen) + MEANT

    @property
    def soon(self) -> float:
        """Most (nats) that anything promises whose fit takes a second or two."""
        return max((p.gain for p in self.promises if not p.candidate.slow), default=0.0)

    @property
    def at_noise(self) -> bool:
        """Whether anything that was tried leaves only noise."""
        return any(at_noise(t) for t in self.tried)

    @property
    def enough(self) -> bool:
        """Whether anything that was tried leaves only noise, or next to nothing of what was left."""
        return any(self.enough_with(t) for t in self.tried)

    @property
    def almost(self) -> bool:
        """Whether anything that was tried leaves little of what was left, and yet more than noise."""
        return any(almost(t, self.seen) for t in self.tried)

    @property
    def leads_on(self) -> bool:
        """Whether what was tried may leave nothing with one more, before what is fitted slowly is."""
        if self.almost:
            return True
        return bool(self.slowly) and any(excess(t.evaluation) < CHIEF * self.left for t in self.tried)

    @cached_property
    def left(self) -> float:
        """What is left without any of them (nats), with the recordings weighed as they are here.

        Where the search begins channels were weighed by their residuals (cautious.py): rest may be far off
        there, and the runs less than any fit that heeds rest leaves of them.
        """
        there = excess(self.seen)
        if not self.far:
            return there
        return max(there, excess(at_minimum(self.here, self.seen)))

    def enough_with(self, trial: Trial) -> bool:
        """Whether a trial leaves only noise, but for a while maybe, or next to nothing of what was left."""
        nothing = at_noise(trial) or excess(trial.evaluation) < NO_STAND_IN * excess(self.seen)
        return nothing or but_for_a_while(trial, self.seen)

    def begin(self, worthy: list[Promise], about: Evaluation | None = None) -> None:
        """First fits of promises about an evaluation; about another one's than ``seen`` all have a chance."""
        far = self.far and about is None
        self.tried += begun(
            self.here, about or self.seen, worthy, far, self.notify, self.budget, known=self.fitted
        )

    def untried(self, promises: list[Promise]) -> list[Promise]:
        """Promises of what has not been tried."""
        known = {t.candidate.label for t in self.tried} | self.hopeless
        return [p for p in promises if p.candidate.label not in known]

    @property
    def waiting(self) -> tuple[Promise, ...]:
        """What promises most of what was never fitted, one of a kind."""
        known = {p.candidate.kind for p in self.promises if p.candidate.label in self.said}
        best: dict[str, Promise] = {}
        for promise in self._worthy(self.promises):
            if promise.candidate.kind not in known:
                best.setdefault(promise.candidate.kind, promise)
        return tuple(best.values())[:WAITING]

    def _worthy(self, promises: list[Promise]) -> list[Promise]:
        """The promises worth a fit here.

        Where near the noise the residuals as a whole show something, only what takes of it away: a hose that
        explains twenty nats of four thousand is what it bends to, and its fit takes half a minute.
        """
        worthy = worth_a_fit(promises, self.count)
        return worthy if self.far or not shows(self.seen) else [p for p in worthy if p.share > WORTH]

    def directly(self) -> None:
        """What screening promises."""
        worthy = self._worthy(self.promises)
        if self.fitted is not None and all(p.candidate.label != self.fitted.candidate.label for p in worthy):
            # More than first order promised may have come of it
            worthy += [p for p in self.promises if p.candidate.label == self.fitted.candidate.label]
        if not self.far and worthy:
            worthy += as_likely(self.promises, worthy, MEANT)
        if self.led is not None:
            worthy = [self._promised_by(self.led), *worthy]
        self.begin(worthy)

    def _promised_by(self, led: Trial) -> Promise:
        """What led here is as good as kept: first order may say little of it, as it did before."""
        most = max((p.gain for p in self.promises), default=0.0)
        return Promise(led.candidate, most, led.values, share=1.0)

    def as_measured(self) -> None:
        """What the motion that was measured promises most of, in a rig as it is described.

        First what is fitted soon, a number of a device or the rig; with it and one more all may be explained.
        """
        if self.alone.measured is None:
            return
        self.notify("along the motion that was measured")
        along = self.alone.measured(self.candidates)
        worthy = along.worthy
        self.slowly = [] if along.beyond else [p for p in worthy if p.candidate.slow]
        self._fit_as_described([p for p in worthy if along.beyond or not p.candidate.slow])
        if along.beyond and not self.enough and not self.almost:
            sure = {p.candidate.label for p in along.sure}
            self.certain = self._contradicting([t for t in self.tried if t.candidate.label in sure])

    def slowly_as_measured(self) -> None:
        """What the motion that was measured promises most of, and is fitted in ten times the time."""
        promises, self.slowly = self.slowly, []
        if not self.enough:
            self._fit_as_described(promises)

    def _fit_as_described(self, promises: list[Promise]) -> None:
        for promise in promises:
            if self.budget.spent() or (promise.candidate.slow and self.enough):
                continue
            self.notify(promise.candidate.label)
            for start in self._as_described():
                trial = attempt(self.here, start, promise, self.budget, growing=acts(promise.candidate))
                if trial is not None:
                    self.tried.append(trial)
                    if at_noise(trial) or almost(trial, self.seen):
                        break

    def _contradicting(self, told: list[Trial]) -> list[Trial]:
        """What other devices contradict whatever acts on the body, beside another effect of the motion.

        Not all of its share of what is left: what else there is has that. Of several the one with the fewest
        numbers says what the others do.
        """
        best: dict[str, Trial] = {}
        for trial in sorted(told, key=lambda t: -t.evidence):
            best.setdefault(trial.candidate.label, trial)
        names = [{p.name for p in t.candidate.parameters} for t in best.values()]
        fewest = [t for t, own in zip(best.values(), names, strict=True) if not any(n < own for n in names)]
        return self._beside_each([t for t in map(self.finished, fewest) if t is not None])

    def outright(self) -> None:
        """What swings and promises most, a hose that promises nearly all, and cables that stretch.

        A hose bends to an error of one length or hinge, which promises as much with one number of its own.
        What swings near the exciter's frequencies promises a tenth to first order and leaves nothing once it
        is fitted, in seconds; one that did not is tried again from where nothing is bent. Cables that
        stretch are tried where a stiffness takes nearly all away.
        """
        ahead = [p for p in self.promises[:1] if p.candidate.slow and self.soon < CLOSE * p.gain]
        promised = [p for p in ahead if p.share > DIRECT]
        swings = [p for p in ahead if p.share <= DIRECT and p.candidate.build is not None]
        self.notify("cables that stretch")
        stretched = stretching(self.here, self.seen, self.mass)
        promised += [] if stretched is None or stretched.share < DIRECT else [stretched]
        self.begin(promised + swings)
        self.ringing()
        self.hopeless = {p.candidate.label for p in self.untried(promised)} if not self.at_noise else set()

    def ringing(self) -> None:
        """Ceilings that ring as a part on springs does that was fitted: a ceiling rings with the body."""
        like = ringing_like(self.here, self.tried, self.seen, self.mass)
        new = [p for p in like if p.candidate.label not in self.rung]
        self.rung |= {p.candidate.label for p in new}
        self.begin(new)

    def as_weighed(self) -> None:
        """What acts on the body and alone explains it at rest, where the scale was wrong, beside one more.

        The scale weighed no cables and no exciter's rotor. Equilibrium holds no valleys of a motion out of
        step, and no wrench along the measured motion accounts for what the scale did not weigh: with that in
        the model first, the motion tells what it has besides.
        """
        if self.alone.measured is None:
            return
        heavy = [c for c in self.candidates if acts(c)]
        if not any(a.settles for a in at_rest(self.here, self.seen, heavy, self.budget)):
            return
        self.notify("what rest asks for")
        settled = self._settling()
        if not settled or not all(acts(a.promise.candidate) for a in settled):
            return
        for found in settled:
            self._fit_as_it_hangs(found)
        self.weighed = {a.promise.candidate.label for a in settled}
        if not self.enough:
            ended = [self.finished(t) for t in list(self.tried) if t.candidate.label in self.weighed]
            self.certain = self._beside_each([t for t in ended if t is not None])

    def as_it_hangs(self) -> None:
        """What alone explains rest, where what promises most is fitted slowly.

        A hose's stiffnesses bend to a hinge that is off, and their fit takes a minute; equilibrium tells in
        seconds.
        """
        if self.alone.measured is None or not self.promises or not self.promises[0].candidate.slow:
            return
        self.notify("what rest asks for")
        for found in self._settling():
            if self.budget.spent():
                break
            self._fit_as_it_hangs(found)

    def _settling(self) -> list[AtRest]:
        """Of what rest asks for beyond doubt what explains it alone, about as well as any."""
        most = max((a.promise.gain for a in self._hanging), default=0.0)
        if most < BEATEN:
            return []
        return [a for a in self._hanging if a.settles and a.promise.gain > most - BEATEN]

    @cached_property
    def _hanging(self) -> list[AtRest]:
        """What the static recordings ask for, likeliest first."""
        return at_rest(self.here, self.seen, self.candidates, self.budget, self.promises)[:MOST]

    def _fit_as_it_hangs(self, found: AtRest) -> None:
        """A fit to the motion of what rest asks for, from the rig as it hangs with it."""
        start = from_rest(self.here, self.seen, found)
        starts = [self.seen] if start is None else [start, self.seen]
        if gives_way(self.here.bench.parameters.model):
            # With something that swings or rings in the model a fit takes many seconds
            starts = [min(starts, key=lambda s: s.cost)]
        self.notify(found.promise.candidate.label)
        trial, _ = best_of(self.here, starts, found.promise, self.budget)
        if trial is not None:
            self.tried.append(trial)

    def at_rest(self) -> None:
        """What the static recordings ask for by themselves, started where they have it.

        What explains them about as well as one that leaves only noise gets its turn beside it: an upper hinge
        that is off is alike to a ceiling off level.
        """
        self.notify("what rest asks for")
        asked = self._hanging
        most = max((a.promise.gain for a in asked), default=0.0)
        # A few nats that rest asks for are no reason for so much motion
        asked = asked if most > BEATEN else []
        self.asked = [a.promise for a in asked if most - a.promise.gain < BEATEN]
        for found in asked:
            behind = most - found.promise.gain
            if self.budget.spent() or (self.at_noise and behind > BEATEN):
                break
            if found.promise.candidate.label not in self.weighed:
                self._fit_as_it_hangs(found)
        if not self.enough:
            self.certain = self._certain(asked) or self._two_at_rest(asked)
        soon = max((p.share for p in self.promises if not p.candidate.slow), default=0.0)
        self.moving = most < BEATEN and soon < CHIEF

    def _certain(self, asked: list[AtRest]) -> list[Trial]:
        """What rest asks for beyond doubt beside another effect of the motion, likeliest first.

        One that takes nearly all of the motion's residual away, and leaves too much for noise, is certain by
        itself. Of those with which all is quiet at rest one is right. The motion tells which, once what it
        has besides is in the model: where one more effect leaves only noise they are as likely as with it.
        """
        least = max(BEATEN, max((a.promise.gain for a in asked), default=0.0) - BEATEN)
        sure = {id(a.promise.candidate): a for a in asked if a.promise.gain > least}
        alike = sorted((t for t in self.tried if id(t.candidate) in sure), key=lambda t: -t.evidence)
        if not alike:
            return []
        if excess(alike[0].evaluation) <= (1.0 - DIRECT) * excess(self.seen):
            first = self.finished(alike[0])
            return [] if first is None else [first]
        alike = [t for t in alike if t.candidate.label not in self.weighed]
        settled = [t for t in alike if sure[id(t.candidate)].settles]
        ended = [t for t in map(self.finished, settled) if t is not None]
        return self._beside_each(ended)

    def _beside_each(self, ended: list[Trial]) -> list[Trial]:
        """Of trials of which one is right, those that leave nothing with one more, likeliest first."""
        if not ended:
            return []
        ended.sort(key=lambda t: -t.evidence)
        self.notify(f"{ended[0].candidate.label}, and one more")
        others = compatible(self.candidates, [ended[0].candidate])
        promises = screen(ended[0].problem, ended[0].evaluation, others, self.mass)
        if not promises or promises[0].candidate.slow or promises[0].share < DIRECT:
            stretched = stretching(ended[0].problem, ended[0].evaluation, self.mass)
            promises += [] if stretched is None else [stretched]
            promises.sort(key=lambda p: -p.gain)
        sure = [p for p in promises if p.share >= DIRECT and p.gain > promises[0].gain - BEATEN]
        for promised in sure[:ALIKE]:
            # A clock and a lag promise the same, and one of them leaves nothing
            found = self._leaving_nothing(ended, promised)
            if found:
                return found
        if sure:
            return []
        if misfit(ended[0].evaluation) > VERY_FAR and not self.budget.spent():
            for promise in along_beside(ended[0], others, self.mass).worthy:
                found = self._leaving_nothing(ended, promise)
                if found or self.budget.spent():
                    return found
        return []

    def _leaving_nothing(self, ended: list[Trial], promised: Promise) -> list[Trial]:
        """Of trials of which one is right, those that leave nothing with what was promised beside one."""
        sought = promised.candidate
        out = []
        for trial in ended:
            if self.budget.spent() or not compatible([sought], [trial.candidate]):
                continue
            self.notify(f"{trial.candidate.label}, and {sought.label}")
            second = leaving_nothing(trial, promised, self.budget)
            if second is not None:
                out.append(replace(trial, evidence=second.evidence))
                self.beside[trial.candidate.label] = [second]
        return out

    def _two_at_rest(self, asked: list[AtRest]) -> list[Trial]:
        """Of two errors that both show at rest: the one that rest asks more of; the motion decides.

        Equilibrium with both is explained where with either it is not, and a fit to it takes a few hundredths
        of a second. Where the motion leaves only noise with both, the other one is known as well.
        """
        if not asked:
            return []
        self.notify("what rest asks for, two at once")
        out: dict[str, Trial] = {}
        for pair in both_at_rest(self.here, self.seen, asked, self.candidates, self.budget):
            self.notify(f"{pair.first.label}, and {pair.second.label}")
            second = fitted_from(pair.second, pair.problem, pair.starts, self.budget)
            if second is None or not at_noise(second):
                continue
            problem = extended(self.here, (pair.first,))
            alone = evaluate(problem, carried(problem, pair.problem, second.evaluation.point))
            if alone is None:
                continue
            label = pair.first.label
            if label not in out or second.evidence > out[label].evidence:
                out[label] = Trial(pair.first, problem, alone, second.evidence)
            self.beside.setdefault(label, []).append(second)
            self.beside[label].sort(key=lambda t: -t.evidence)
        return sorted(out.values(), key=lambda t: -t.evidence)

    def from_nothing_bent(self) -> None:
        """What first order promises, and fits come to, in a rig as it is described (unbent.py)."""
        self.notify("from where nothing is bent")
        starts = [e for e in (self._about, self._first) if e is not None]
        again = [] if self._about is None else screen(self.here, self._about, self.candidates, self.mass)
        known: set[str] = set()
        for promise in likely(self.promises, again):
            label = promise.candidate.label
            if self.budget.spent() or self.enough:
                break
            if label in known or any(t.candidate.label == label and self._decided(t) for t in self.tried):
                continue
            self.notify(label)
            trial, alike = best_of(self.here, starts, promise, self.budget)
            if trial is not None:
                self.tried.append(trial)
            if alike:
                known.add(label)

    @cached_property
    def _about(self) -> Evaluation | None:
        """About the same body in a rig as it is described."""
        return unbent(self.here, self.seen)

    @cached_property
    def _first(self) -> Evaluation | None:
        """Where the ideal model's fit began, which is known as long as nothing else is in the model."""
        guess = self.alone.guess
        return None if guess is None else at_first(self.here, self.seen, guess)

    def _as_described(self) -> Iterator[Evaluation]:
        """Starts at which nothing is bent: first the one whose body is no worse than a guess."""
        if self._first is not None:
            yield self._first
        if self._about is not None:
            yield self._about

    def _decided(self, trial: Trial) -> bool:
        """Whether starting a hypothesis from what the other screening promised of it is of no use."""
        return trial.settled or excess(trial.evaluation) > CHIEF * excess(self.seen)

    def leading(self) -> Trial | None:
        """Far from the noise: what leaves nothing together with one more; see :func:`first_fits.leading`."""
        if not self.far or self.at_noise or not self.tried:
            return None
        found = leading(
            list(self.tried),
            self.left,
            self.candidates,
            self.mass,
            self.notify,
            self.budget,
            self.finished,
            self._settling_beside,
            self.refused,
            self.asked,
        )
        self.refused = len(self.tried)
        if found is None:
            return None
        first, second = found
        others = compatible(self.candidates, [first.candidate])
        seconds = [
            second,
            *fitted_simpler(first.problem, second, others),
            *self._ringing_beside(first, second),
        ]
        self.beside[first.candidate.label] = sorted(seconds, key=lambda t: -t.evidence)
        return first

    def _settling_beside(self, first: Trial, promises: list[Promise]) -> Iterator[Promise]:
        """What explains rest with a first effect in the model, of what is fitted soon and promises as much.

        A model bent to a second error promises all that is left to twenty hypotheses, to a hose of nine
        numbers first. Rest tells two that both show there from all others; it takes some seconds, and is
        asked once nothing before it leaves nothing.
        """
        soon = [p for p in promises if not p.candidate.slow]
        close = [p.candidate for p in soon if p.gain > CLOSE * soon[0].gain]
        asked = at_rest(first.problem, first.evaluation, close, self.budget, soon)
        yield from [a.promise for a in asked if a.settles][:ALIKE]

    def _ringing_beside(self, first: Trial, second: Trial) -> list[Trial]:
        """Ceilings that ring beside a first hypothesis as a part on springs does, and leave nothing."""
        if gives_way(first.problem.bench.parameters.model):
            return []
        like = ringing_like(first.problem, [second], first.evaluation, self.mass)
        ceilings = (leaving_nothing(first, promise, self.budget) for promise in like)
        return [t for t in ceilings if t is not None]

    def finished(self, trial: Trial) -> Trial | None:
        """A trial fitted to its end, which takes its place among what was tried."""
        ended = finished(trial, self.budget)
        if ended is not None:
            self.tried = [ended if t is trial else t for t in self.tried]
        return ended

    def without_devices(self) -> None:
        """What is wrong with the device that contradicts all others, if one does."""
        if self.problem.bench.parameters.model.internal > 0:
            # With something that swings in the model such fits take minutes
            return
        self.notify("without each device in turn")
        liar = find_liar(self.problem, self.evaluation, self.budget)
        if liar is None:
            return
        # About the fit that does not hear it, what is wrong with it shows as it is
        self.device = liar.device
        about = evaluate(self.problem, liar.point) or self.seen
        promises = screen(self.problem, about, self.candidates, self.mass)
        self.begin(worth_a_fit(promises, self.count, self.device), about)

    @cached_property
    def scanned(self) -> list[Promise]:
        """What gives way and what swings, by its best amount."""
        self.notify("what gives way")
        return far_promises(self.here, self.seen, self.promises, self.mass, self.budget)

    def giving_way_at_once(self) -> None:
        """What gives way or swings and promises more than any change of numbers, before these.

        Rest that is quiet has no error of geometry, cells or level in it that would explain so much motion.
        """
        worthy = sorted((p for p in self.scanned if p.gain > self.soon), key=lambda p: -p.gain)[:AT_ONCE]
        worthy = self.untried(worthy)
        self.begin(worthy)
        if not self.at_noise:
            self.hopeless |= {p.candidate.label for p in self.untried(worthy)}

    def giving_way(self) -> None:
        """What gives way, whatever screening says of it, and all else; the law where that explains it."""
        worthy = self.untried(self.scanned)
        known = {p.candidate.label for p in worthy}
        others = self.untried(worth_a_fit(self.promises, self.count))
        worthy += [p for p in others if p.candidate.label not in known]
        worthy.sort(key=lambda p: -p.gain)
        self.tried += begun(self.here, self.seen, worthy, True, self.notify, self.budget, self._lawfully)

    def yielding_a_little(self) -> None:
        """Near the noise: what gives way, of which first order says nothing where it rings."""
        self.notify("what gives way")
        worthy = self.untried(supports(self.here, self.seen, self.mass, self.budget))
        self.begin(self._worthy(sorted(worthy, key=lambda p: -p.gain)))

    def passed_over(self) -> bool:
        """Whether there is a number of the rig left to try, where nothing that was tried makes sense.

        Of two effects at once a third one of many numbers may promise more than either, keep it, and have an
        amount that may as well be none.
        """
        rest = [p for p in self.untried(self.promises) if not p.candidate.slow]
        self.tried = []
        self.begin(self._worthy(rest))
        return bool(self.tried)

    def giving_way_beside(self) -> list[Trial]:
        """What takes the larger part away and leaves nothing beside what gives way, likeliest first.

        A clock that is off and a ceiling that yields: without the clock nothing that the ceiling promises
        is to be seen. What is alike to the clock, a lag, is asked beside the same ceiling.
        """
        chief = CHIEF * self.left
        plain = [t for t in self.tried if t.candidate.build is None and excess(t.evaluation) < chief]
        plain.sort(key=lambda t: excess(t.evaluation))
        if not plain or gives_way(plain[0].problem.bench.parameters.model):
            return []
        self.notify(f"{plain[0].candidate.label}, and what gives way")
        promises = supports(plain[0].problem, plain[0].evaluation, self.mass, self.budget)
        best = max(promises, key=lambda p: p.gain, default=None)
        if best is None or best.share < CHIEF:
            return []
        out: dict[str, Trial] = {}
        for first in plain[:FINISHED]:
            label = first.candidate.label
            alike = excess(first.evaluation) < 2.0 * excess(plain[0].evaluation)
            if self.budget.spent() or label in out or not alike:
                continue
            self.notify(f"{label}, and {best.candidate.label}")
            second = leaving_nothing(first, best, self.budget)
            if second is not None:
                out[label] = replace(first, evidence=second.evidence)
                self.beside[label] = [second]
        return sorted(out.values(), key=lambda t: -t.evidence)

    def _lawfully(self) -> bool:
        """Whether a law explains it all."""
        if self.alone.law is not None:
            self.notify("a force that follows one point's motion")
            self.lawful = self.alone.law(self.here, self.seen, self.needed)
        return self.lawful is not None
