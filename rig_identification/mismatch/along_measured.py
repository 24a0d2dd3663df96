"""What acts on the body, told by the motion that was measured and not by the ideal model's.

Where the ideal model fails by far its motion is out of step with the real one, and what first order says
about it is hardly worth more than a guess: of twenty hypotheses each takes about half away. The motion that
was measured is another matter (measured.py). Along it the missing wrench is known, and of what it is made
up, dry hinges or a hose, is a regression. Where no wrench leaves only noise nothing acts on the body that
would do so, and this says nothing.
"""

from __future__ import annotations

from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.solve import shortened
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.measured import driven
from rig_identification.mismatch.screen import Promise, screen, with_reference
from rig_identification.mismatch.trial import mass_of

#: Seconds of each run that are looked at: along a known motion nothing adds up, and they have it all.
ENOUGH = 12.0


def along_measured(ideal: Ideal, candidates: list[Candidate]) -> list[Promise]:
    """Promises about the measured motion, best first; none where no wrench explains what was measured."""
    fitted = ideal.fitted
    problem = shortened(with_reference(fitted.problem, fitted.rest), ENOUGH)
    mass = mass_of(problem, fitted.evaluation)
    seen = driven(problem, fitted.evaluation.point, mass)
    return [] if seen is None else screen(*seen, candidates, mass)
