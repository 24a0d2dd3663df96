"""The whole answer to a session: the ideal model, its verdict, and what it leaves out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import HOPELESS_SQUARE, misfit
from rig_identification.estimate.identify import (
    Assumed,
    Ideal,
    compose,
    fit_session,
    judged,
    only_watched,
    scores,
    with_pieces,
    without_unseen_force,
)
from rig_identification.estimate.observability import with_products
from rig_identification.estimate.origins import moved, near_origins, told
from rig_identification.estimate.solve import CannotBeFollowed
from rig_identification.estimate.tied_to_rig import tie_of
from rig_identification.estimate.unanswered import unanswered
from rig_identification.estimate.unseen_sway import one_turn
from rig_identification.estimate.vehicle import vehicle_quantities
from rig_identification.estimate.without_frame import vehicle_alone
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.gyroscope_heading import gyroscope_heading, heading_told, with_heading
from rig_identification.mismatch.interference import lines_at_rest, with_lines, without_lines
from rig_identification.mismatch.overrange import with_overranges
from rig_identification.mismatch.slack import spells_of
from rig_identification.mismatch.stretched_at_first import with_stretch_told
from rig_identification.mismatch.trial import may_be_none
from rig_identification.mismatch.watched import Watched, explain_watched
from rig_identification.mismatch.whole_runs import as_fitted
from rig_identification.model.work import WORK, counted
from rig_identification.recording import Session
from rig_identification.result import Identification, Interrupted
from rig_identification.search.explain import explain
from rig_identification.search.so_far import SoFar, accounted, both_accounted, interrupted, with_work_told

Progress = Callable[[str, float], None]
Watcher = Callable[[Identification], None]

#: Share of the progress bar that the ideal model's fit takes.
IDEAL_SHARE = 0.4


def identify(
    session: Session,
    progress: Progress | None = None,
    assumed: Assumed | None = None,
    work: float | None = None,
    watcher: Watcher | None = None,
) -> Identification:
    """Mass, centre of mass and inertia tensor, with whatever the ideal model leaves out found and modelled.

    assumed: what another ideal model than this project's assumes, the thesis' for one. work: units of work
    after which the search for what is left out begins nothing new; None: as many as budget.py has. watcher:
    is shown the ideal model's answer, then each better one, while the search runs; the answer stays the same.
    ``figures["ideal"]`` of the result holds the ideal model's own answer where effects were found.

    Raises
    ------
    InputError
        The session holds nothing to fit.
    Interrupted
        The user broke the search off; it holds the best answer until then. KeyboardInterrupt where there is
        none yet.
    """

    def notify(stage: str, fraction: float) -> None:
        if progress is not None:
            progress(stage, fraction)

    given, origins = session.rig, near_origins(session.rig)
    session = session if origins.given else moved(session, origins)
    lines = lines_at_rest(session)
    session = without_lines(session, lines)
    turned = gyroscope_heading(session)
    session = with_heading(session, turned)

    def ended(found: Identification) -> Identification:
        told_of = heading_told(with_overranges(found.mismatch, session), turned)
        found = replace(with_work_told(found), mismatch=with_lines(told_of, lines))
        found = found if origins.given else told(found, origins)
        return replace(found, vehicle=vehicle_quantities(found.without_frame or found.total, given))

    def seen(found: Identification) -> None:
        if watcher is not None:
            watcher(ended(found))

    shown = None if watcher is None else seen
    with counted():
        try:
            return ended(_driven(session, notify, assumed, WORK if work is None else work, shown))
        except CannotBeFollowed as why:
            return ended(unanswered(session, why))
        except Interrupted as stopped:
            raise Interrupted(ended(stopped.answer)) from stopped


def _driven(
    session: Session, notify: Progress, assumed: Assumed | None, work: float, watcher: Watcher | None
) -> Identification:
    """The answer to a session, without the runs that a force drives which was not recorded."""
    found, ideal = _identified(session, notify, assumed, work, watcher)
    if _nothing_follows(found, ideal):
        try:
            soft, its = _identified(session, notify, assumed, work, watcher, soft_asked=True)
        except KeyboardInterrupt as stopped:
            raise Interrupted(interrupted(found)) from stopped
        if its.stretch is not None and (soft.mismatch.findings or soft.mismatch.verdict == "none"):
            found, ideal = both_accounted(soft, found), its
    less = None
    if found.mismatch.verdict == "unexplained" and all(
        f.effect == "unknown" for f in found.mismatch.findings
    ):
        # An exciter whose topic is missing may have been off: only where nothing else is found was it not
        less = without_unseen_force(session, ideal, lambda run: True)
    if less is not None:
        try:
            rest, _ = _identified(less.session, notify, assumed, work, watcher)
        except KeyboardInterrupt as stopped:
            raise Interrupted(interrupted(found)) from stopped
        found = _without_unseen(found, rest, less.note)
    return with_stretch_told(found, ideal)


def _nothing_follows(found: Identification, ideal: Fitted) -> bool:
    """Whether no wrench follows what the sensors show, so that nothing could be searched.

    A body that hangs decimetres lower on soft ropes than on rigid ones is elsewhere all the time: no force on
    it brings rigid cables there, and rest is asked whether they stretch.
    """
    nothing = found.mismatch.verdict == "unexplained" and not found.mismatch.findings
    return nothing and ideal.stretch is None and not only_watched(ideal.problem)


def _without_unseen(found: Identification, rest: Identification, note: str) -> Identification:
    """The answer to what is left of a session, with the verdict on all of it."""
    first = found.mismatch
    mismatch = replace(first, explanation=f"{note} {first.explanation}")
    figures = {**rest.figures, "ideal": found.figures.get("ideal", found)}
    told = replace(rest, mismatch=mismatch, notes=(*rest.notes, note), figures=figures)
    return both_accounted(told, found)


def _watched(ideal: Ideal, notify: Progress, budget: Budget) -> Watched | None:
    """What damps a watched body; None where nothing does, or where no fit of it can be inverted."""
    try:
        return explain_watched(ideal, notify, budget)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None


def _answer_of(watched: Watched, session: Session, plain: Identification) -> Identification:
    """The answer to a body that is only watched to swing. plain: the ideal model's."""
    answer = compose(session, watched.fitted, scores(watched.fitted), watched.mismatch, watched.careful)
    lost = {*answer.total.unobservable, *watched.unobservable}
    total = replace(answer.total, unobservable=with_products(lost))
    alone = vehicle_alone(total, session.rig.frame)
    basis = watched.careful or (watched.fitted.problem, watched.fitted.evaluation)
    tie = tie_of(total, *basis, answer.textbook)
    notes = tuple(note for note in answer.notes if note != answer.tie)
    return replace(
        answer,
        total=total,
        without_frame=alone,
        figures={**answer.figures, "ideal": plain},
        tie=tie,
        notes=notes if tie is None else (*notes, tie),
    )


def _worth_a_search(watched: Watched) -> bool:
    """Whether what damps leaves so little, and yet something, that another hypothesis may explain it all."""
    return watched.mismatch.verdict == "unexplained" and misfit(watched.fitted.evaluation) < HOPELESS_SQUARE


def _one_turn(ideal: Ideal) -> bool:
    """Whether one turn is all that was measured.

    Nothing tells then a part that swings by itself from what the device errs by at the same frequency.
    """
    return all(one_turn(run) for run in ideal.fitted.problem.runs)


def _firm(found: Explained) -> bool:
    """Whether no effect of an explanation may as well be none.

    Without force a number that bends to what a tracker errs by gains as much as one that is there.
    """
    return not any(may_be_none(as_fitted(found.fitted, trial)) for trial in found.effects)


def _identified(
    session: Session,
    notify: Progress,
    assumed: Assumed | None,
    work: float,
    watcher: Watcher | None,
    *,
    soft_asked: bool = False,
) -> tuple[Identification, Fitted]:
    """The answer to a session, and the ideal model's fit. Raises Interrupted once there is an answer."""

    def fitting(stage: str, fraction: float) -> None:
        notify(stage, IDEAL_SHARE * fraction)

    budget = Budget(work)
    fitted = fit_session(session, fitting, assumed, soft_asked=soft_asked)
    so_far = SoFar(session, Ideal(fitted, *judged(fitted)), budget, watcher=watcher)
    try:
        so_far.show()
        return accounted(so_far.widened(_searched(so_far, notify)), budget), fitted
    except KeyboardInterrupt as stopped:
        raise Interrupted(so_far.interrupted()) from stopped


def _searched(so_far: SoFar, notify: Progress) -> Identification:
    """The answer to a session whose ideal model is fitted."""

    def searching(stage: str, fraction: float) -> None:
        notify(stage, IDEAL_SHARE + (1.0 - IDEAL_SHARE) * fraction)

    session, ideal, budget = so_far.session, so_far.ideal, so_far.budget
    plain, swinging = _plain(so_far), None
    if only_watched(ideal.fitted.problem) and ideal.mismatch.verdict != "none":
        if not _one_turn(ideal):
            ideal = so_far.ideal = with_pieces(ideal, searching)
        watched = _watched(ideal, searching, budget)
        if watched is not None:
            swinging = so_far.swinging = _answer_of(watched, session, plain)
            so_far.show()
            if not _worth_a_search(watched):
                return swinging
    found, note = None, None
    if ideal.fitted.problem.runs and not (ideal.mismatch.verdict != "none" and _one_turn(ideal)):
        try:
            found = explain(ideal, spells_of(ideal.fitted), searching, budget, so_far.hear, so_far.see)
        except (FloatingPointError, np.linalg.LinAlgError) as error:
            note = f"The search for left-out physics ended early ({error}); the ideal model's answer stands."
    if swinging is not None and not (
        found is not None and (found.mismatch.verdict == "none" or (found.wholly and _firm(found)))
    ):
        # What damps a swing is no trace: it gives way only to what leaves none, and is there
        return swinging
    if found is None:
        ideal = so_far.ideal = with_pieces(ideal, searching)
        plain = compose(session, ideal.fitted, ideal.scores, ideal.mismatch, ideal.careful)
        return plain if note is None else replace(plain, notes=(*plain.notes, note))
    if found.mismatch.verdict == "none" and found.effects:
        # What is ordinary, and in no ideal model
        return compose(session, found.fitted, scores(found.fitted), found.mismatch, None, rivals=found.bodies)
    if found.mismatch.verdict == "none":
        return compose(
            session, ideal.fitted, ideal.scores, found.mismatch, ideal.careful, rivals=found.bodies
        )
    return so_far.with_findings(found, plain)


def _plain(so_far: SoFar) -> Identification:
    """What the ideal model alone makes of the session."""
    ideal = so_far.ideal
    return compose(so_far.session, ideal.fitted, ideal.scores, ideal.mismatch, None)
