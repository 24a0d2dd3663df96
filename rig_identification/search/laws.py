"""Laws without a name on the ladder: screened beside every named effect, made sparse, told in words.

A law (mismatch/point_laws.py) is a force at one point of the body by powers of that point's travel or
velocity. Its columns are those of any other wrench along the motion, so it is a hypothesis as any other.
"""

from __future__ import annotations

from dataclasses import replace

from rig_identification.estimate.solve import POLISH, Problem, solve
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.carried_air import CARRIED_NAME, CarriedAir
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import effects_of
from rig_identification.mismatch.opened import Promise, carried, extended
from rig_identification.mismatch.place_scan import Shape, best_places
from rig_identification.mismatch.plates import AREA_NAME, PLATES
from rig_identification.mismatch.point_laws import LAWS, law_finding, parts_of, sparser
from rig_identification.mismatch.trial import LAST_STEPS, Trial, in_stds, log_evidence, mass_of
from rig_identification.search.ladder import Rung


def promised_laws(rung: Rung, found: tuple[Candidate, ...]) -> list[Promise]:
    """What laws, and named effects at a place, promise about the motion of a model, best first.

    None of what it has already.
    """
    laws = () if any(parts_of(c) for c in found) else LAWS
    taken = {q.name for q in rung.problem.bench.parameters.free}
    plates = () if AREA_NAME in taken else PLATES
    carried = () if f"{CARRIED_NAME}.x" in taken else (CarriedAir(),)
    shapes: tuple[Shape, ...] = (*laws, *plates, *carried)
    mass = mass_of(rung.problem, rung.evaluation)
    return best_places(rung.problem, rung.evaluation, mass, shapes) if shapes else []


def sparse(problem: Problem, found: list[Trial], budget: Budget) -> list[Trial]:
    """The effects ``found`` with no part in a law that is not seen. problem: without any effect."""
    law = _law_of(found)
    if law is None:
        return found
    others = tuple(t.candidate for t in found if t is not law)
    less = _made_sparse(extended(problem, others), law, budget)
    if less is law:
        return found
    return [replace(less if t is law else t, problem=less.problem, evaluation=less.evaluation) for t in found]


def in_words(best: Explained, found: list[Trial]) -> Explained:
    """What was found with each law told in words: where it acts, how strong, and what it follows."""
    trial = _law_of(found)
    if trial is None:
        return best
    law = trial.candidate
    amount = parts_of(law)[0].name.removeprefix("unknown.")
    findings = tuple(
        law_finding(best.fitted, law, f) if f.effect == law.effect and amount in f.parameters else f
        for f in best.mismatch.findings
    )
    told = replace(best.mismatch, findings=findings)
    before, named = effects_of(best.mismatch.findings), effects_of(findings)
    if named != before:
        # The law has a name of the catalogue: other descriptions of that are no rivals
        text = told.explanation.replace(before, named, 1)
        others = tuple(a for a in told.alternatives if a["effect"] not in named.split(", "))
        told = replace(told, explanation=text, alternatives=others)
    return replace(best, mismatch=told)


def _law_of(found: list[Trial]) -> Trial | None:
    """The one that is a law; None where none is."""
    return next((t for t in found if parts_of(t.candidate)), None)


def _made_sparse(problem: Problem, trial: Trial, budget: Budget) -> Trial:
    """The trial less the parts of its law that are not seen, one after the other."""
    while True:
        less: Candidate | None = sparser(trial.candidate, in_stds(trial))
        if less is None:
            return trial
        wide = extended(problem, (less,))
        try:
            start = carried(wide, trial.problem, trial.evaluation.point)
            fitted, settled = solve(
                wide, start, iterations=LAST_STEPS, tolerance=0.1, polish=POLISH, stop=budget.spent
            )
        except FloatingPointError:
            return trial
        trial = Trial(less, wide, fitted, log_evidence(fitted), settled)
