"""Where a search stands: what is in the model so far, and what hypotheses are tried on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.mixture import Bodies
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import Evaluation, Problem, evaluate
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.screen import Promise, with_reference
from rig_identification.mismatch.trial import Trial, adopted

#: Mean square of whitened residuals up to which short pieces count as explained.
EXPLAINED = 1.3
#: Mean square of whole runs' residuals that refutes what short pieces agreed to.
WRONG = 3.0


#: Who is told what explains whole runs, as it is found.
Heard = Callable[[Explained], None]


def unheard(found: Explained) -> None:
    """Nobody waits for what is found on the way."""


@dataclass
class Search:
    """Where a search stands."""

    problem: Problem  # whole runs, ideal model
    here: Problem  # what hypotheses are tried on: short pieces where much is left, whole runs near the noise
    evaluation: Evaluation
    start: float  # excess of what it looks at before anything was found
    budget: Budget
    share: float = 0.0  # of that excess that the effects found take away
    found: list[Trial] = field(default_factory=list)
    rivals: list[dict[str, object]] = field(default_factory=list)
    bodies: Bodies = ()  # what rivals of the last one found make of the body, where whole runs say so
    waiting: tuple[Promise, ...] = ()  # what promised most of what was not fitted before the work was done
    liar: str | None = None
    screened: list[Promise] | None = None  # promises about ``evaluation``, where they are known
    heard: Heard = unheard  # is told what explains whole runs, as it is found

    @property
    def whole(self) -> bool:
        """Whether hypotheses are tried on whole runs."""
        return len(self.here.runs) == len(self.problem.runs)

    def forked(self) -> Search:
        """The same search, to go on with by itself."""
        return replace(self, found=list(self.found), rivals=list(self.rivals))

    def back_to(self, before: Search) -> None:
        """Go back to where it stood; what it has come to since stays said as a rival."""
        self.found, self.bodies = list(before.found), before.bodies
        self.here, self.evaluation, self.share = before.here, before.evaluation, before.share

    def adopt(self, tried: Trials, chosen: Trial, *, in_passing: bool = False) -> None:
        """Go on with ``chosen`` in the model; other likely ones not refuted before it are its rivals.

        in_passing: what it leads to is adopted next.
        """
        self.found.append(chosen)
        others = tried.rivals_of(chosen)
        self.rivals += [rival(t, gap) for gap, t in others]
        self.bodies = ()
        if self.whole:
            self.bodies = tuple((gap, inertial_estimate(t.problem, t.evaluation)) for gap, t in others)
        self.here, self.evaluation = adopted(
            self.here, self.evaluation, chosen, in_passing=in_passing, budget=self.budget
        )


def short_pieces(ideal: Ideal) -> tuple[Problem, Evaluation | None] | None:
    """The short pieces that the cautious fit was made to, and where it ended; None where there was none."""
    if ideal.pieces is None or ideal.careful is None:
        return None
    here = with_reference(ideal.pieces, ideal.fitted.rest)
    return here, evaluate(here, ideal.careful[1].point)
