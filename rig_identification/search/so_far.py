"""What an answer has come to so far: the best model of the session until now, and the work that it took."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.identify import CAUTION, TIED, Ideal, compose, scores
from rig_identification.estimate.verdict import hear
from rig_identification.estimate.without_frame import vehicle_alone
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.by_itself import each_by_itself, not_weighed
from rig_identification.mismatch.explained import Explained
from rig_identification.model.work import counted
from rig_identification.recording import Session
from rig_identification.result import Identification, Work
from rig_identification.search.following import with_what_follows
from rig_identification.search.ladder import Rung

#: What is told of an answer that did not come to its end.
INTERRUPTED = (
    "Interrupted before the search for what the ideal model leaves out had ended: this is the best answer "
    "until then. What was not tried yet may explain the recordings better."
)
#: What is told of a body whose interval holds what a missing wrench may hide.
FOLLOWS = (
    "The model does not explain these recordings. The ten numbers come from a fit with a random wrench "
    "beside it. Their intervals hold what a missing wrench that follows the motion may hide in the body."
)


@dataclass
class SoFar:
    """The best answer to a session until now."""

    session: Session
    ideal: Ideal
    budget: Budget
    found: Explained | None = None  # what explains the session
    swinging: Identification | None = None  # the answer to a body that is only watched
    rung: Rung | None = None  # the last model with a discrepancy
    watcher: Callable[[Identification], None] | None = (
        None  # is shown each better answer while the search runs
    )

    def hear(self, found: Explained) -> None:
        """Keep what explains the session; what leaves only noise is not given up for what leaves a trace."""
        if found.wholly or self.found is None or not self.found.wholly:
            self.found = found
            self.show()

    def see(self, rung: Rung) -> None:
        """Keep the last model with a discrepancy."""
        self.rung = rung

    def with_findings(self, found: Explained, plain: Identification) -> Identification:
        """The answer with what was found in the model, each finding weighed. plain: the ideal model's."""
        return self._composed(each_by_itself(found, self.budget.late), plain)

    def interrupted(self) -> Identification:
        """The answer where the search is broken off here, marked so."""
        return interrupted(accounted(self._until_now(), self.budget))

    def show(self) -> None:
        """Show the answer until now to whoever watches. What this computes is no work of the answer's."""
        if self.watcher is None:
            return
        with counted():
            try:
                answer = self._until_now()
            except (FloatingPointError, np.linalg.LinAlgError):
                return  # no numbers yet, as where a search ends early; the next answer is shown
        self.watcher(answer)

    def _until_now(self) -> Identification:
        answer = self.swinging or self._plain()
        if self.found is not None:
            answer = self._composed(not_weighed(self.found), self._plain())
        return self.widened(answer)

    def widened(self, answer: Identification) -> Identification:
        """The answer; where nothing explains the session, with the body that a missing wrench leaves open."""
        rung, frame = self.rung, self.session.rig.frame
        if answer.mismatch.verdict != "unexplained" or rung is None or rung.alone:
            return answer
        try:
            total = with_what_follows(rung.problem, rung.evaluation)
        except np.linalg.LinAlgError:
            # Recordings that tell next to nothing: the cautious fit's numbers stand
            return answer
        return replace(
            answer,
            total=total,
            without_frame=vehicle_alone(total, frame),
            notes=(*(n for n in answer.notes if n not in (CAUTION, TIED)), FOLLOWS),
        )

    def _composed(self, found: Explained, plain: Identification) -> Identification:
        careful = None if found.told else found.ideal.careful
        fitted = found.fitted
        answer = compose(
            self.session, fitted, scores(fitted), found.mismatch, careful, found.loose, found.bodies
        )
        return replace(answer, figures={**answer.figures, "ideal": plain})

    def _plain(self) -> Identification:
        """The ideal model's answer; where it leaves something, as loosely as its residuals ask for."""
        ideal, loose = self.ideal, 1.0
        if ideal.mismatch.verdict != "none" and ideal.careful is None:
            loose = hear(ideal.fitted).looseness
        return compose(self.session, ideal.fitted, ideal.scores, ideal.mismatch, ideal.careful, loose)


def interrupted(answer: Identification) -> Identification:
    """The answer, marked as the best one before the user broke the search off."""
    return replace(answer, notes=(INTERRUPTED, *answer.notes), interrupted=True)


def accounted(answer: Identification, budget: Budget) -> Identification:
    """The answer with the work that it took, and what was left untried."""
    return replace(answer, work=Work(budget.used, budget.limit, tuple(budget.untried)))


def both_accounted(answer: Identification, before: Identification) -> Identification:
    """The second answer to a session, with the work of the one ``before`` it as well."""
    if answer.work is None or before.work is None:
        return answer
    one, two = before.work, answer.work
    return replace(answer, work=Work(one.used + two.used, one.limit + two.limit, two.untried))


def with_work_told(answer: Identification) -> Identification:
    """The answer with its work as a sentence among its notes."""
    work = answer.work
    if work is None:
        return answer
    bound = f"begins nothing new after {work.limit:g}" if math.isfinite(work.limit) else "has no limit"
    text = f"{work.used:.3g} units of work were computed; the search {bound}."
    if work.used >= work.limit or work.untried:
        left = ", ".join(work.untried) or "nothing by name, but not every rival was followed to its end"
        text += f" It ended there. Left untried: {left}. The option --work gives it more."
    return replace(answer, notes=(*answer.notes, text))
