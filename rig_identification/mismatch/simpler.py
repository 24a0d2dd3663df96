"""What a hypothesis has as a special case of itself: a bias beside a cross-sensitivity with its own bias.

The larger one promises at least as much as the smaller one, so it is fitted first, and once it leaves only
noise nothing else may be asked. Which of the two it is Laplace's evidence tells, if both are fitted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rig_identification.estimate.solve import Problem, solve
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.screen import carried, extended
from rig_identification.mismatch.trial import LAST_STEPS, Trial, log_evidence


def special_cases(candidate: Candidate, others: Sequence[Candidate]) -> list[Candidate]:
    """Those of ``others`` whose numbers are some, and not all, of a candidate's."""
    own = _names(candidate)
    return [c for c in others if c.build is None and _names(c) < own]


def fitted_simpler(problem: Problem, trial: Trial, others: Sequence[Candidate]) -> Iterator[Trial]:
    """Special cases of a trial's hypothesis among ``others``, fitted from where it ends.

    problem: without any of them.
    """
    for simple in special_cases(trial.candidate, others):
        wide = extended(problem, (simple,))
        point = carried(wide, trial.problem, trial.evaluation.point)
        try:
            fitted, _ = solve(wide, point, iterations=LAST_STEPS, tolerance=0.05)
        except FloatingPointError:
            continue
        yield Trial(simple, wide, fitted, log_evidence(fitted), settled=True)


def _names(candidate: Candidate) -> frozenset[str]:
    return frozenset(p.name for p in candidate.parameters)
