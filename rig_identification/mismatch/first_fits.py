"""First, short fits of hypotheses: which of them come near the noise, and which one leads.

All get a few steps from what screening promised; what is fitted slowly only where what is fitted soon does
not take it all away.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.solve import Evaluation, Problem, excess
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import compatible, count_of, slow, worth_a_fit
from rig_identification.mismatch.screen import Promise, screen
from rig_identification.mismatch.supports import gives_way
from rig_identification.mismatch.trial import Trial, attempt, finished

Notify = Callable[[str], None]

#: Share of what is left that a promise has to take for its fit to come before any other doubt.
DIRECT = 0.8
#: Mean square of whitened residuals below which nothing much is left, and how many times as much as the best
#: a hypothesis may have left after its first steps to be its rival even so.
AT_NOISE = 1.05
RIVAL = 10.0
#: Mean square of the residuals above which so much is left that what leaves nothing of it is no chance.
VERY_FAR = 5.0
#: Share of what was left up to which a hypothesis, after its first steps, is fitted to its end at once.
ALMOST = 0.15
#: Hypotheses that are tried on top of another one, which leaves something.
FURTHER = 4
#: Standard deviations of a sum of squares beyond which something is left of the residuals as a whole.
SEEN = 4.0
#: Near the noise: log evidence by which a hypothesis is beaten for good, and the share of what another one
#: promised and kept that its promise must come to.
BEATEN = 30.0
CLOSE = 0.7


def at_noise(trial: Trial) -> bool:
    """Whether a hypothesis leaves residuals of the size of the noise."""
    return misfit(trial.evaluation) < AT_NOISE


def shows(evaluation: Evaluation) -> bool:
    """Whether the residuals as a whole show that something is left."""
    size = sum(run.residual.size for run in evaluation.runs)
    return bool(excess(evaluation) >= SEEN * np.sqrt(0.5 * size))


def _almost(trial: Trial, before: Evaluation) -> bool:
    """Whether a hypothesis leaves next to nothing of what was left ``before``, and yet more than noise."""
    return not at_noise(trial) and excess(trial.evaluation) < ALMOST * excess(before)


def _coarse(trial: Trial, before: Evaluation) -> bool:
    """Whether a hypothesis takes the larger part of what was left away, and has a closer description."""
    chief = excess(trial.evaluation) < (1.0 - CHIEF) * excess(before)
    return chief and trial.candidate.closer is not None and not at_noise(trial)


def begun(
    problem: Problem,
    evaluation: Evaluation,
    worthy: list[Promise],
    far: bool,
    notify: Notify,
    budget: Budget,
    instead: Callable[[], bool] | None = None,
) -> list[Trial]:
    """First, short fits of promises. far: much is left, and one that reaches the noise is no chance.

    instead: whether something else explains it all, so that nothing more is begun; asked where nothing that
    is fitted soon or promises the larger part leaves only noise, before what is slow and promises less.
    """
    out: list[Trial] = []
    reached, nearly, kept, done, enough = 0.0, 0.0, 0.0, False, False
    rings, very_far = gives_way(problem.bench.parameters.model), misfit(evaluation) > VERY_FAR
    if not far:
        # What changes no model is fitted in a tenth of the time, and may leave nothing for what does
        most = max((p.gain for p in worthy), default=0.0)
        worthy = sorted(
            worthy,
            key=lambda p: (p.candidate.build is not None or p.gain < CLOSE * most, -p.gain),
        )
    for promise in worthy:
        if promise.candidate.build is not None and promise.share < CHIEF and rings:
            # On top of what rings or swings already a fit takes minutes: for the larger part of what is left
            continue
        if budget.spent() and (out or promise.candidate.build is not None):
            continue
        if not far and promise.gain < min(CLOSE * kept, kept - BEATEN):
            # Another hypothesis promised much more, near the noise, and kept it
            continue
        if not far and done and promise.candidate.build is not None and promise.gain < kept:
            # Another one took away all there was: what changes the model, and promised less, is no likelier
            continue
        if far and promise.candidate.build is not None and (enough or promise.gain < CLOSE * reached):
            # Another one left nothing already, and much more was expected of it, or that is no chance
            continue
        if far and promise.gain < CLOSE * nearly and slow(promise.candidate):
            # Another one left next to nothing, and much more was expected of it
            continue
        chief = promise.candidate.build is None or promise.share > CHIEF
        if instead is not None and not chief and not any(at_noise(t) for t in out):
            explained, instead = instead(), None
            if explained:
                return out
        notify(promise.candidate.label)
        trial = attempt(problem, evaluation, promise, budget)
        if trial is not None and far and (_almost(trial, evaluation) or _coarse(trial, evaluation)):
            # Worth its last steps before any other is tried
            trial = finished(trial, budget) or trial
            nearly = max(nearly, promise.gain)
        if trial is not None:
            out.append(trial)
            kept = max(kept, min(promise.gain, evaluation.cost - trial.evaluation.cost))
            done = done or excess(trial.evaluation) < BEATEN
            if far and at_noise(trial):
                reached = max(reached, promise.gain)
                # Where so much was left two that leave nothing at all are one too many to be looked for
                enough = promise is not worthy[0] or (very_far and not shows(trial.evaluation))
    if instead is not None and not any(at_noise(t) for t in out) and not budget.spent():
        instead()
    return out


def leading(
    tried: list[Trial],
    before: Evaluation,
    candidates: list[Candidate],
    mass: float,
    notify: Notify,
    budget: Budget,
) -> Trial | None:
    """The hypothesis with which, and with one more, nothing is left; None where there is none.

    Of two effects at once the one that takes most away alone may be neither: what bends to both does. What
    is left with either of the two shows the other one plainly.
    """
    best: tuple[float, Trial] | None = None
    least = min((excess(t.evaluation) for t in tried), default=0.0)
    for trial in sorted(tried, key=lambda t: (t.candidate.build is not None, excess(t.evaluation))):
        if excess(trial.evaluation) > min(CHIEF * excess(before), RIVAL * least):
            continue
        if best is not None and trial.candidate.build is not None:
            # What changes the model and is fitted slowly may bend to anything
            break
        first = finished(trial, budget)
        if first is None:
            continue
        notify(f"{first.candidate.label}, and one more")
        others = compatible(candidates, [first.candidate])
        promises = screen(first.problem, first.evaluation, others, mass)
        for promise in worth_a_fit(promises, count_of(others))[:FURTHER]:
            if promise.share < DIRECT or promise.candidate.build is not None:
                continue
            second = attempt(first.problem, first.evaluation, promise, budget)
            if second is None or not at_noise(second):
                continue
            if best is None or second.evidence > best[0]:
                best = second.evidence, first
            break
    return None if best is None else best[1]
