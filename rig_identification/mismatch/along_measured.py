"""What acts on the body, told by the motion that was measured and not by the ideal model's.

Where the ideal model fails by far its motion is out of step with the real one, and what first order says
about it is hardly worth more than a guess: of twenty hypotheses each takes about half away. The motion that
was measured is another matter (measured.py). Along it the missing wrench is known, and of what it is made
up, dry hinges or a hose, is a regression. Where no wrench leaves only noise nothing acts on the body that
would do so, and this says nothing.
"""

from __future__ import annotations

from dataclasses import replace

from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.solve import shortened
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.measured import driven
from rig_identification.mismatch.screen import Promise, screen, with_reference
from rig_identification.mismatch.trial import mass_of

#: Seconds of each run that are looked at: along a known motion nothing adds up, and they have it all.
ENOUGH = 12.0


def along_measured(ideal: Ideal, candidates: list[Candidate]) -> list[Promise]:
    """Promises of forces about the measured motion, best first; none where no wrench explains that motion."""
    fitted = ideal.fitted
    problem = shortened(with_reference(fitted.problem, fitted.rest), ENOUGH)
    point = fitted.evaluation.point
    if ideal.pieces is not None and ideal.careful is not None:
        # Whole runs bend the body by far more than short pieces do, and the wrench has that to make up for
        there = ideal.careful[1].point
        begun = {run.begins: start for run, start in zip(ideal.pieces.runs, there.starts, strict=True)}
        if all(run.begins in begun for run in problem.runs):
            starts = tuple(begun[run.begins] for run in problem.runs)
            point = replace(point, theta=there.theta, starts=starts)
    mass = mass_of(problem, fitted.evaluation)
    seen = driven(problem, point, mass)
    # What the ideal model bent to swallow the force would promise much of being bent back
    return [] if seen is None else screen(*seen, [c for c in candidates if _acts(c)], mass)


def _acts(candidate: Candidate) -> bool:
    """Whether a hypothesis is a force, and no number of rig or devices that the lab doubts."""
    return not candidate.doubted and all(p.kind == "physics" for p in candidate.parameters)
