"""What is told of a look: the likeliest of what was tried, fitted to its end, with what is alike to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.solve import excess, solve, still_promised
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.first_fits import BEATEN, RIVAL, at_noise, shows
from rig_identification.mismatch.late import lag_like, told_apart
from rig_identification.mismatch.look import FINISHED, Look
from rig_identification.mismatch.outcome import MEANT, Trials
from rig_identification.mismatch.same_clock import contradicted
from rig_identification.mismatch.screen import carried
from rig_identification.mismatch.simpler import fitted_simpler
from rig_identification.mismatch.trial import (
    FIRST_STEPS,
    Trial,
    among_places,
    amount_seen,
    as_it_stands,
    beyond_doubt,
    earned_evidence,
    finished,
    fitted_to_its_end,
    log_evidence,
)


def told_of(look: Look, done: list[Trial]) -> list[Trial]:
    """Trials, likeliest first, with special cases of each, and the lag beside every late clock.

    A clock that leaves only noise keeps its lag from being tried, and with one more effect it may leave
    as little as the lag by itself. A clock that its stamps contradict is told only where nothing else
    is about as likely.
    """
    out = list(done)
    for clock in done:
        lag = lag_like(clock, look.candidates)
        if lag is None or any(t.candidate.label == lag.candidate.label for t in out):
            continue
        look.notify(lag.candidate.label)
        twin = fitted_to_its_end(look.here, look.seen, lag, look.budget)
        if twin is not None and twin.evidence > look.needed:
            out.append(twin)
    for trial in done:
        out += _simpler(look, trial, {t.candidate.label for t in out})
    heard = [(t, contradicted(t)) for t in out]
    likely = max((t.evidence for t, impossible in heard if not impossible), default=-np.inf)
    out = [t for t, impossible in heard if not impossible or t.evidence - likely > BEATEN]
    return told_apart(sorted(map(among_places, out), key=lambda t: -t.evidence), MEANT)


def _simpler(look: Look, trial: Trial, known: set[str]) -> list[Trial]:
    """Special cases of a trial that are worth telling beside it. known: labels of what is told.

    They begin where it ends, a few steps from their own end: a law is not told for want of these, where its
    own number is none and its device's zero is off.
    """
    if look.budget.late():
        return []
    judged = set() if look.far else {t.candidate.label for t in look.tried}
    unknown = [c for c in look.candidates if c.label not in known | judged]
    simpler = [_fair(look, t) for t in fitted_simpler(look.here, trial, unknown)]
    simpler = [t for t in simpler if t.evidence > look.needed]
    return [t for t in simpler if look.far or beyond_doubt(t, look.ordinary, look.limit)]


def leads(look: Look, done: list[Trial], *, asked: bool = False) -> Trials:
    """Trials of which the first leads to another one, with which nothing is left.

    asked: whether rivals of that other one were asked as well.
    """
    told = told_of(look, done)
    beside = look.beside.get(told[0].candidate.label, ())
    return Trials(told, led=True, beside=tuple(beside), asked=asked, left=look.left)


def ended(look: Look) -> Trials:
    """The likeliest of what was tried, fitted to its end."""
    if not look.tried:
        return Trials([], look.device, waiting=look.waiting)
    tried = sorted((_fair(look, t) for t in look.tried), key=lambda t: -t.evidence)
    done: list[Trial] = []
    beaten: list[Trial] = []
    unsure: list[Trial] = []
    for trial in tried:
        last = any(look.enough_with(t) for t in done) and _beaten(trial, done, tried[0], look.far)
        if len(done) == FINISHED or ((last or (done and look.budget.spent())) and not trial.settled):
            continue
        look.notify(trial.candidate.label)
        # Where nothing comes near it whole runs take it to its end
        lone = look.far and at_noise(trial) and trial.candidate.closer is None
        lone = lone and not any(_rivals(look, t, trial) for t in look.tried)
        # What is beaten is stated as it is: a closer description of it takes half a minute
        plain = replace(trial, candidate=replace(trial.candidate, closer=None)) if last else trial
        fitted = as_it_stands(plain) if lone else finished(plain, look.budget)
        if fitted is None or not beyond_doubt(fitted, look.ordinary, look.limit):
            continue
        # What explains something with an amount that may as well be none stands in for another
        doubtful = not look.far and not amount_seen(fitted) and not _missed(look, fitted)
        fitted = _fair(look, fitted)
        if fitted.evidence > look.needed:
            _place(fitted, unsure if doubtful else beaten if last else done)
    told = told_of(look, done)
    chief = bool(told) and excess(told[0].evaluation) < CHIEF * look.left
    return Trials(
        told,
        look.device,
        beaten=tuple(map(among_places, beaten)),
        unsure=tuple(map(among_places, unsure)),
        chief=chief,
        left=look.left,
        waiting=look.waiting,
    )


def _fair(look: Look, trial: Trial) -> Trial:
    """Near the noise: less what the trial only gains from the noise."""
    evidence = earned_evidence(look.here, look.seen, trial.evaluation, far=look.far)
    return replace(trial, evidence=evidence)


def _missed(look: Look, trial: Trial) -> bool:
    """Whether more is left without a trial, about where it ends.

    Far along a curved valley an amount's std says little of how clear of none it lies: of a part on springs
    little but its mass times its place shows. What changes the model bends to more than numbers do, and has
    to beat none of it for good. So has what has many numbers where no residual shows anything: a hose that
    may as well be none bends to cables that resist twist, and explains them within the noise.
    """
    if trial.candidate.build is not None or (trial.candidate.many and not shows(look.seen)):
        return trial.evidence > log_evidence(look.seen) + BEATEN
    point = carried(look.here, trial.problem, trial.evaluation.point)
    try:
        without, _ = solve(look.here, point, iterations=FIRST_STEPS, tolerance=0.5)
    except FloatingPointError:
        return False
    return trial.evidence > log_evidence(without) + MEANT


def _rivals(look: Look, trial: Trial, best: Trial) -> bool:
    """Whether a trial may yet come near the noise, as ``best`` does."""
    left = excess(trial.evaluation)
    return trial.candidate.label != best.candidate.label and left < CHIEF * excess(look.seen)


def _place(trial: Trial, among: list[Trial]) -> None:
    """Add a trial; of two descriptions that have the same closer one the likelier."""
    same = next((t for t in among if t.candidate.label == trial.candidate.label), None)
    if same is None:
        among.append(trial)
    elif trial.evidence > same.evidence:
        among[among.index(same)] = trial


def _beaten(trial: Trial, done: list[Trial], first: Trial, far: bool) -> bool:
    """Whether a hypothesis is no rival of those that reached the noise, by its first steps."""
    if far:
        return excess(trial.evaluation) > RIVAL * excess(first.evaluation)
    # A curved valley takes more steps than the first ones
    ahead = 0.0 if trial.settled else still_promised(trial.problem, trial.evaluation)
    return trial.evidence + ahead < max(t.evidence for t in done) - BEATEN
