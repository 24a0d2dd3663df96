"""The second of two effects, asked whether it explains as much by itself.

Of one large error the search may take first what bends to most of it, because with one more nothing is left:
a ceiling off level, and a hinge beside it, for one hinge. What is found beside an effect is so asked, from
where both were fitted, whether it needs that effect. One number fewer explains more (Laplace); and what was
found first has no say in it.
"""

from __future__ import annotations

from dataclasses import replace

from rig_identification.estimate.solve import POLISH, solve
from rig_identification.mismatch.first_fits import BEATEN, at_noise
from rig_identification.mismatch.outcome import MEANT, Trials
from rig_identification.mismatch.screen import carried, extended
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import (
    LAST_STEPS,
    Trial,
    among_places,
    log_evidence,
    ordinary_errors,
)
from rig_identification.mismatch.whole_runs import FIRM, firmness


def without_first(origin: Search, search: Search, tried: Trials, count: int) -> Trials | None:
    """Of what was ``tried`` beside ``search.found``, what explains as much without; None where nothing does.

    origin: the search on the same runs, with nothing found. count: of all hypotheses.
    """
    if any(t.candidate.build is not None for t in search.found):
        # What changes the model is not taken out of it again in a few steps
        return None
    first, ordinary = tried.done[0], ordinary_errors(origin.here)
    done = []
    for trial in tried.done:
        if first.evidence - trial.evidence > BEATEN or not at_noise(trial):
            continue
        beside = [replace(t, problem=trial.problem, evaluation=trial.evaluation) for t in search.found]
        if any(firmness(t, ordinary, count) > FIRM for t in beside):
            continue
        single = _by_itself(origin, trial)
        if single is not None and log_evidence(trial.evaluation) < single.evidence + MEANT:
            done.append(among_places(single))
    return Trials(sorted(done, key=lambda t: -t.evidence)) if done else None


def _by_itself(origin: Search, trial: Trial) -> Trial | None:
    """A trial without what was found before it, from where both were fitted; None where more is left."""
    pieces = replace(origin.here, runs=trial.problem.runs)
    problem = extended(pieces, (trial.candidate,))
    point = carried(problem, trial.problem, trial.evaluation.point)
    try:
        fitted, _ = solve(problem, point, iterations=LAST_STEPS, tolerance=0.05, polish=POLISH)
    except FloatingPointError:
        return None
    single = Trial(trial.candidate, problem, fitted, log_evidence(fitted), settled=True)
    return single if at_noise(single) else None
