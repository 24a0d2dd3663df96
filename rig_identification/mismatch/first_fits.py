"""First, short fits of hypotheses: which of them come near the noise, and which one leads.

All get a few steps from what screening promised; what is fitted slowly only where what is fitted soon does
not take it all away.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.solve import Evaluation, Problem, excess
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import compatible, count_of, worth_a_fit
from rig_identification.mismatch.locate import EVENT_SHARE
from rig_identification.mismatch.screen import Promise, screen
from rig_identification.mismatch.supports import gives_way
from rig_identification.mismatch.trial import VERY_FAR, Trial, attempt, finished

Notify = Callable[[str], None]

#: Share of what is left that a promise has to take for its fit to come before any other doubt.
DIRECT = 0.8
#: Mean square of whitened residuals below which nothing much is left, and how many times as much as the best
#: a hypothesis may have left after its first steps to be its rival even so.
AT_NOISE = 1.05
RIVAL = 10.0
#: Share of what was left up to which a hypothesis, after its first steps, is fitted to its end at once.
ALMOST = 0.15
#: Share of what was left that no stand-in comes down to: one bends to most of what it stands in for, and
#: leaves a part in ten or in a hundred of it.
NO_STAND_IN = 1e-3
#: Hypotheses that are tried on top of another one, which leaves something.
FURTHER = 4
#: Pieces of which some may hold what the others do not.
FEWEST = 4
#: Standard deviations of a sum of squares beyond which something is left of the residuals as a whole.
SEEN = 4.0
#: Near the noise: log evidence by which a hypothesis is beaten for good, and the share of what another one
#: promised and kept that its promise must come to; and the nats by which what changes the model has to have
#: promised less than what took all away not to be tried beside it.
BEATEN = 30.0
CLOSE = 0.7
NO_TIE = 10.0


def at_noise(trial: Trial) -> bool:
    """Whether a hypothesis leaves residuals of the size of the noise."""
    return misfit(trial.evaluation) < AT_NOISE


def shows(evaluation: Evaluation) -> bool:
    """Whether the residuals as a whole show that something is left."""
    size = sum(run.residual.size for run in evaluation.runs)
    return bool(excess(evaluation) >= SEEN * np.sqrt(0.5 * size))


def almost(trial: Trial, before: Evaluation) -> bool:
    """Whether a hypothesis leaves next to nothing of what was left ``before``, and yet more than noise."""
    return not at_noise(trial) and excess(trial.evaluation) < ALMOST * excess(before)


def but_for_a_while(trial: Trial, before: Evaluation) -> bool:
    """Whether a hypothesis leaves next to nothing, and that in a few pieces: the others are noise.

    What acts in these alone, a push for one, is looked for with the hypothesis in the model.
    """
    squares = np.sort([float(np.mean(run.residual**2)) for run in trial.evaluation.runs])
    calm = squares[: squares.size - int(EVENT_SHARE * squares.size)]
    return squares.size >= FEWEST and almost(trial, before) and float(np.mean(calm)) < AT_NOISE


def _coarse(trial: Trial, before: Evaluation) -> bool:
    """Whether a hypothesis takes the larger part of what was left away, and has a closer description."""
    chief = excess(trial.evaluation) < (1.0 - CHIEF) * excess(before)
    return chief and trial.candidate.closer is not None and not at_noise(trial)


@dataclass
class _Standing:
    """What first fits have shown so far, and which promises are worth none any more."""

    far: bool  # much is left, and what reaches the noise is no chance
    rings: bool  # something rings or swings in the model already
    budget: Budget
    out: list[Trial] = field(default_factory=list)
    kept: float = 0.0  # most that was promised and kept, nats
    done: bool = False  # one took away all there was
    fallen: float = 0.0  # most that one of a few numbers took away, nats, promised or not
    reached: float = 0.0  # most that was promised by what leaves only noise
    nearly: float = 0.0  # ... by what leaves next to nothing
    enough: bool = False  # nothing that changes the model is looked for any more

    def passes_over(self, promise: Promise) -> bool:
        """Whether a promise is not worth a fit."""
        changes = promise.candidate.build is not None
        if self.rings and changes and promise.share < CHIEF:
            # On top of what rings or swings already a fit takes minutes: for the larger part of what is left
            return True
        if self.budget.spent() and (self.out or changes):
            return True
        return self._beaten_far(promise) if self.far else self._beaten_near(promise)

    def _beaten_near(self, promise: Promise) -> bool:
        """Whether one promised much more and kept it, or took more, or all and this changes the model."""
        if promise.gain < min(CLOSE * self.kept, self.kept - BEATEN):
            return True
        if promise.candidate.slow and promise.gain < self.fallen - BEATEN:
            return True
        return self.done and promise.candidate.build is not None and promise.gain < self.kept - NO_TIE

    def _beaten_far(self, promise: Promise) -> bool:
        """Whether another one left nothing, or next to nothing, and much more was expected of it."""
        if promise.candidate.build is not None and (self.enough or promise.gain < CLOSE * self.reached):
            return True
        return promise.gain < CLOSE * self.nearly and promise.candidate.slow

    def heard(self, promise: Promise, trial: Trial, before: Evaluation, first: bool) -> None:
        """Take a first fit into account. before: without it; first: of the likeliest promise."""
        self.out.append(trial)
        fallen = before.cost - trial.evaluation.cost
        self.kept = max(self.kept, min(promise.gain, fallen))
        if not promise.candidate.slow:
            # A hose of any direction bends to more than the one that is there
            self.fallen = max(self.fallen, fallen)
        self.done = self.done or excess(trial.evaluation) < BEATEN
        if self.far and at_noise(trial):
            self.reached = max(self.reached, promise.gain)
            # Where so much was left two that leave nothing at all are one too many to be looked for
            self.enough = not first or (misfit(before) > VERY_FAR and not shows(trial.evaluation))


def begun(
    problem: Problem,
    evaluation: Evaluation,
    worthy: list[Promise],
    far: bool,
    notify: Notify,
    budget: Budget,
    instead: Callable[[], bool] | None = None,
    known: Trial | None = None,
) -> list[Trial]:
    """First, short fits of promises. far: much is left, and one that reaches the noise is no chance.

    instead: whether something else explains it all, so that nothing more is begun; asked where nothing that
    is fitted soon or promises the larger part leaves only noise, before what is slow and promises less.
    known: what is fitted already.
    """
    standing = _Standing(far, gives_way(problem.bench.parameters.model), budget)
    if not far:
        worthy = _quickest_first(worthy)
    for promise in worthy:
        if standing.passes_over(promise):
            continue
        chief = promise.candidate.build is None or promise.share > CHIEF
        if instead is not None and not chief and not any(at_noise(t) for t in standing.out):
            explained, instead = instead(), None
            if explained:
                return standing.out
        notify(promise.candidate.label)
        fitted = known is not None and known.candidate.label == promise.candidate.label
        trial = known if fitted else _furthest(problem, evaluation, promise, far, budget)
        if trial is not None and far and (almost(trial, evaluation) or _coarse(trial, evaluation)):
            # Worth its last steps before any other is tried
            trial = finished(trial, budget) or trial
            standing.nearly = max(standing.nearly, promise.gain)
        if trial is not None:
            standing.heard(promise, trial, evaluation, promise is worthy[0])
    if instead is not None and not any(at_noise(t) for t in standing.out) and not budget.spent():
        instead()
    return standing.out


def _quickest_first(worthy: list[Promise]) -> list[Promise]:
    """Near the noise: promises in the order in which they are fitted.

    What has a few numbers is fitted in a tenth of the time of what changes the model or has many, and may
    leave nothing for it; what promises little has its turn after both.
    """
    most = max((p.gain for p in worthy), default=0.0)
    soon = max((p.gain for p in worthy if not p.candidate.slow), default=0.0)
    least = CLOSE * most if soon < CHIEF * most else CLOSE * soon
    return sorted(worthy, key=lambda p: (p.candidate.slow or p.gain < least, -p.gain))


def _furthest(
    problem: Problem, evaluation: Evaluation, promise: Promise, far: bool, budget: Budget
) -> Trial | None:
    """The first fit of a promise, or of the same elsewhere, that comes to least.

    far: much is left, and only what promises the larger part of it is worth a second start.
    """
    best = attempt(problem, evaluation, promise, budget)
    for other in promise.elsewhere if not far or promise.share > CHIEF else ():
        if budget.spent():
            break
        trial = attempt(problem, evaluation, other, budget)
        if best is None or (trial is not None and trial.evaluation.cost < best.evaluation.cost):
            best = trial
    return best


def leaving_nothing(first: Trial, promise: Promise, budget: Budget) -> Trial | None:
    """A second hypothesis beside a first one, from a promise; None where they leave more than noise."""
    second = _furthest(first.problem, first.evaluation, promise, True, budget)
    if second is not None and almost(second, first.evaluation):
        second = finished(second, budget)
    return second if second is not None and at_noise(second) else None


def leading(
    tried: list[Trial],
    left: float,
    candidates: list[Candidate],
    mass: float,
    notify: Notify,
    budget: Budget,
    finish: Callable[[Trial], Trial | None],
    settling: Callable[[Trial, list[Promise]], Iterable[Promise]],
    refused: int = 0,
    asked: Sequence[Promise] = (),
) -> tuple[Trial, Trial] | None:
    """The hypothesis with which, and with one more, nothing is left, and that one; None where there is none.

    left: without any of them, nats. finish: fits a trial to its end; None where its sign makes no sense.
    settling: of promises beside a trial those that explain rest with it. refused: so many of the first that
    were tried were asked before, and are not. asked: promises of what rest asks for most, which first order
    may say little of.

    Of two effects at once the one that takes most away alone may be neither: what bends to both does. What
    is left with either of the two shows the other one plainly.
    """
    best: tuple[Trial, Trial] | None = None
    least = min((excess(t.evaluation) for t in tried), default=0.0)
    ended: dict[str, float] = {}  # what is left of what was fitted to its end
    for trial in sorted(tried[refused:], key=lambda t: (t.candidate.build is not None, excess(t.evaluation))):
        if excess(trial.evaluation) > min(CHIEF * left, RIVAL * least):
            continue
        if best is not None and trial.candidate.build is not None:
            # What changes the model and is fitted slowly may bend to anything
            break
        if budget.spent():
            # What is fitted no further leaves something
            break
        if ended.get(trial.candidate.label, np.inf) <= excess(trial.evaluation):
            # From elsewhere the same one came to less: this is on its way there
            continue
        first = finish(trial)
        if first is None:
            continue
        ended[trial.candidate.label] = excess(first.evaluation)
        notify(f"{first.candidate.label}, and one more")
        others = compatible(candidates, [first.candidate])
        promises = screen(first.problem, first.evaluation, others, mass)
        chiefly = excess(first.evaluation) < ALMOST * left
        possible = {c.label for c in others}
        resting = (p for p in asked if p.candidate.label in possible)
        settled = settling(first, promises)
        for promise in chain(resting, settled, _further(promises, count_of(others), chiefly, budget)):
            second = leaving_nothing(first, promise, budget)
            if second is None:
                continue
            if best is None or second.evidence > best[1].evidence:
                best = first, second
            break
    return best


def _further(promises: list[Promise], count: int, chiefly: bool, budget: Budget) -> Iterator[Promise]:
    """Promises of what is tried on top of another hypothesis. chiefly: that leaves next to nothing."""
    for k, promise in enumerate(worth_a_fit(promises, count)[:FURTHER]):
        if promise.candidate.build is not None:
            # Fitted slowly, and promises less than it keeps: the best one, beside what is chief
            if k == 0 and chiefly and promise.share >= CHIEF and not budget.spent():
                yield promise
        elif promise.share >= DIRECT:
            yield promise
