"""From a session that the ideal model does not explain to the effects that do.

Screening (screen.py) ranks every hypothesis; the best few are fitted in full, in short
pieces first, where no model is far off; the most likely one stays (Laplace's approximation of the
marginal likelihood charges each free parameter for what it could have explained). Then the
whole runs are fitted with it, and if something is left the search goes on from there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, excess, still_promised
from rig_identification.mismatch.amounts import CHIEF, WORTH, far_promises, ringing_like, supports
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import compatible, count_of, slow, worth_a_fit
from rig_identification.mismatch.in_motion import unearned
from rig_identification.mismatch.late import told_apart
from rig_identification.mismatch.locate import find_liar
from rig_identification.mismatch.screen import Promise, screen
from rig_identification.mismatch.supports import gives_way
from rig_identification.mismatch.trial import (
    Trial,
    amount_seen,
    attempt,
    beyond_doubt,
    finished,
    log_evidence,
    mass_of,
)

Notify = Callable[[str], None]
#: The law that explains such pieces, of a body of so many kg; None where none does.
Law = Callable[[Problem, Evaluation, float, Budget], Trial | None]

#: Hypotheses that get to their end.
FINISHED = 3
#: Effects looked for at most.
MOST_EFFECTS = 2
#: Share of what is left that a promise has to take for its fit to come before any other doubt.
DIRECT = 0.8
#: Pieces that hypotheses are tried on; fewer above a mean square of the residuals.
TRIED, TRIED_FAR, VERY_FAR = 4, 2, 5.0
#: Log evidence that an effect has to gain.
MEANT = 3.0
#: Mean square of whitened residuals below which nothing much is left, and how many times as much as the best
#: a hypothesis may have left after its first steps to be its rival even so.
AT_NOISE = 1.05
RIVAL = 10.0
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


def worst_pieces(problem: Problem, evaluation: Evaluation) -> tuple[Problem, Evaluation]:
    """The problem on the pieces that fit worst: what tells hypotheses apart at a fraction of the cost."""
    tried = TRIED_FAR if misfit(evaluation) > VERY_FAR else TRIED
    if len(problem.runs) <= tried:
        return problem, evaluation
    misfits = [float(np.sum(run.residual**2) - run.residual.size) for run in evaluation.runs]
    chosen = sorted(np.argsort(misfits)[-tried:])
    part = replace(problem, runs=tuple(problem.runs[i] for i in chosen))
    point = replace(
        evaluation.point,
        starts=tuple(evaluation.point.starts[i] for i in chosen),
        latents=tuple(evaluation.point.latents[i] for i in chosen) if evaluation.point.latents else (),
    )
    again = evaluate(part, point)
    return (problem, evaluation) if again is None else (part, again)


def _at_noise(trial: Trial) -> bool:
    """Whether a hypothesis leaves residuals of the size of the noise."""
    return misfit(trial.evaluation) < AT_NOISE


def _without_support(tried: list[Trial], before: Evaluation) -> bool:
    """Whether near the noise there is no need to try what gives way.

    There is none where a hypothesis takes away the larger part of what is left; if it swings, which is
    alike, all of it. Where the residuals as a whole show nothing that is, there is only if something that
    swings is the best.
    """
    first = max(tried, key=lambda t: t.evidence, default=None)
    if not _shows(before):
        return first is None or first.candidate.build is None
    if first is None or (first.candidate.build is not None and not _at_noise(first)):
        return False
    return before.cost - first.evaluation.cost > CHIEF * excess(before)


def _almost(trial: Trial, before: Evaluation) -> bool:
    """Whether a hypothesis leaves next to nothing of what was left ``before``, and yet more than noise."""
    return not _at_noise(trial) and excess(trial.evaluation) < ALMOST * excess(before)


def _coarse(trial: Trial, before: Evaluation) -> bool:
    """Whether a hypothesis takes the larger part of what was left away, and has a closer description."""
    chief = excess(trial.evaluation) < (1.0 - CHIEF) * excess(before)
    return chief and trial.candidate.closer is not None and not _at_noise(trial)


@dataclass(frozen=True)
class Trials:
    """Hypotheses fitted in full, most likely first, and the device that contradicts all others."""

    done: list[Trial]
    liar: str | None = None
    beaten: tuple[Trial, ...] = ()  # settled, significant, and yet far less likely than the first


def trials(
    problem: Problem,
    evaluation: Evaluation,
    candidates: list[Candidate],
    limit: float,
    notify: Notify,
    screened: list[Promise] | None = None,
    budget: Budget | None = None,
    more: bool = False,
    law: Law | None = None,
) -> Trials:
    """Full fits of the most promising hypotheses to the pieces that fit worst, most likely first.

    All get a few steps; the best few go on to their end, and where one reaches the noise only those
    that had come as close. Where much is left and no hypothesis takes it away that promised to, first order
    is not to be trusted: witnesses are then heard one without the other, and what gives way is
    tried whatever screening says. screened: promises about this evaluation, where they are known. Where the
    budget is spent nothing more that changes the model is begun. more: another effect may be added after.
    law: what may explain all where nothing that first order tells of does.
    """
    budget = budget or Budget()
    mass = mass_of(problem, evaluation)
    far = misfit(evaluation) > NEAR_SQUARE
    if far:
        problem, evaluation = worst_pieces(problem, evaluation)
    count = count_of(candidates)
    promises = screened or screen(problem, evaluation, candidates, mass)
    here, seen = (problem, evaluation) if far else worst_pieces(problem, evaluation)
    device, needed = None, log_evidence(seen) + MEANT

    def instead() -> Trial | None:
        """The law, if it leaves nothing."""
        if law is None:
            return None
        notify("a force that follows one point's motion")
        lawful = law(here, seen, mass, budget)
        return lawful if lawful is not None and lawful.evidence > needed else None

    tried: list[Trial] = []
    if not far or (promises and promises[0].share > DIRECT):
        worthy = _worth_it(promises, count, seen, far)
        tried = begun(here, seen, worthy, far, notify, budget)
    if far and more and not any(_at_noise(t) for t in tried):
        lead = leading(tried, seen, candidates, mass, notify, budget)
        if lead is not None:
            return Trials([lead])
    if far and not any(_at_noise(t) for t in tried):
        liar = None
        if problem.bench.parameters.model.internal == 0:
            # With something that swings in the model such fits take minutes
            notify("without each device in turn")
            liar = find_liar(problem, evaluation)
        if liar is not None:
            # About the fit that does not hear it, what is wrong with it shows as it is
            device = liar.device
            about = evaluate(problem, liar.point) or seen
            worthy = worth_a_fit(screen(problem, about, candidates, mass), count, device)
            tried += begun(here, about, worthy, False, notify, budget)
        if not any(_at_noise(t) for t in tried):
            known = {t.candidate.label for t in tried}
            notify("what gives way")
            worthy = [p for p in far_promises(here, seen, promises, mass) if p.candidate.label not in known]
            known |= {p.candidate.label for p in worthy}
            worthy += [p for p in worth_a_fit(promises, count) if p.candidate.label not in known]
            further = begun(here, seen, sorted(worthy, key=lambda p: -p.gain), True, notify, budget, instead)
            if further and further[0].candidate.effect == "unknown":
                return Trials(further)
            tried += further
        if not any(_at_noise(t) for t in tried) and not gives_way(problem.bench.parameters.model):
            tried += begun(here, seen, ringing_like(here, tried, seen, mass), True, notify, budget)
    if not far and not _without_support(tried, seen):
        # Of what rings first order says nothing
        notify("what gives way")
        known = {t.candidate.label for t in tried}
        worthy = [p for p in supports(here, seen, mass) if p.candidate.label not in known]
        tried += begun(
            here, seen, worth_a_fit(sorted(worthy, key=lambda p: -p.gain), count), False, notify, budget
        )
    if not tried:
        return Trials([], device)
    ordinary = {p.name: p.prior_std for p in problem.bench.parameters.free if p.bounded}

    def fair(trial: Trial) -> Trial:
        """Near the noise: less what the trial only gains from the noise."""
        less = 0.0 if far else unearned(here, seen, trial.evaluation.runs)
        return replace(trial, evidence=log_evidence(trial.evaluation) - less)

    tried = sorted((fair(t) for t in tried), key=lambda t: -t.evidence)
    done: list[Trial] = []
    beaten: list[Trial] = []
    for trial in tried:
        last = any(_at_noise(t) for t in done) and _beaten(trial, done, tried[0], far)
        if len(done) == FINISHED or ((last or (done and budget.spent())) and not trial.settled):
            continue
        notify(trial.candidate.label)
        ended = finished(trial, budget)
        if ended is None or not beyond_doubt(ended, ordinary, limit):
            continue
        if not far and not amount_seen(ended):
            # It explains something, with an amount that may as well be none: it stands in for something else
            continue
        ended = fair(ended)
        if ended.evidence > needed:
            place = beaten if last else done
            # Two descriptions may have the same closer one
            same = next((t for t in place if t.candidate.label == ended.candidate.label), None)
            if same is None:
                place.append(ended)
            elif ended.evidence > same.evidence:
                place[place.index(same)] = ended
    return Trials(told_apart(done, MEANT), device, tuple(beaten))


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
            if second is None or not _at_noise(second):
                continue
            if best is None or second.evidence > best[0]:
                best = second.evidence, first
            break
    return None if best is None else best[1]


def _worth_it(promises: list[Promise], count: int, seen: Evaluation, far: bool) -> list[Promise]:
    """Promises worth a fit; where the residuals as a whole show something, only those that take of it away.

    A hose that explains twenty nats of four thousand is what it bends to, and its fit takes half a minute.
    """
    worthy = worth_a_fit(promises, count)
    return worthy if far or not _shows(seen) else [p for p in worthy if p.share > WORTH]


def _shows(evaluation: Evaluation) -> bool:
    """Whether the residuals as a whole show that something is left."""
    size = sum(run.residual.size for run in evaluation.runs)
    return bool(excess(evaluation) >= SEEN * np.sqrt(0.5 * size))


def _beaten(trial: Trial, done: list[Trial], first: Trial, far: bool) -> bool:
    """Whether a hypothesis is no rival of those that reached the noise, by its first steps."""
    if far:
        return excess(trial.evaluation) > RIVAL * excess(first.evaluation)
    # A curved valley takes more steps than the first ones
    ahead = 0.0 if trial.settled else still_promised(trial.problem, trial.evaluation)
    return trial.evidence + ahead < max(t.evidence for t in done) - BEATEN


def begun(
    problem: Problem,
    evaluation: Evaluation,
    worthy: list[Promise],
    far: bool,
    notify: Notify,
    budget: Budget,
    instead: Callable[[], Trial | None] | None = None,
) -> list[Trial]:
    """First, short fits of promises. far: much is left, and one that reaches the noise is no chance.

    instead: what is tried, and is the only one if it is found, where nothing that is fitted soon or promises
    the larger part leaves only noise, before what is fitted slowly and promises less.
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
        if instead is not None and not chief and not any(_at_noise(t) for t in out):
            found, instead = instead(), None
            if found is not None:
                return [found]
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
            if far and _at_noise(trial):
                reached = max(reached, promise.gain)
                # Where so much was left two that leave nothing at all are one too many to be looked for
                enough = promise is not worthy[0] or (very_far and not _shows(trial.evaluation))
    if instead is not None and not any(_at_noise(t) for t in out) and not budget.spent():
        found = instead()
        return out if found is None else [found]
    return out
