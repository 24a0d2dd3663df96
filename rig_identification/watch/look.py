"""One look at a session while its last run is recorded: is the model's motion the body's, and if not, why?

The fit is the ideal model's. Where its residuals are more than noise, or a hypothesis promises more than
chance gives, the whole catalogue is screened to first order (mismatch/screen.py). The few that promise most
are fitted for some steps and compared by evidence, as the search begins. It ends there: a search takes
minutes, and comes when the recording is over.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.estimates import estimates
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.identify import Ideal, fit_session, judged, only_watched, pose_problem
from rig_identification.estimate.launch import launch_states
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import CannotBeFollowed, Point, Problem, solve
from rig_identification.mismatch.findings import finding
from rig_identification.mismatch.hypotheses import catalogue, count_of, net_gain
from rig_identification.mismatch.opened import Promise, with_reference
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import Trial, attempt, log_evidence, mass_of
from rig_identification.recording import Session
from rig_identification.result import Finding, InertialEstimate

#: Looks at one run: each may be the one that chance makes stand out, and pays for all of them.
LOOKS = 30
#: Hypotheses that are fitted, and the share of the best promise down to which.
FITTED, SHARE = 3, 0.7
#: Steps of a fit that goes on from the look before.
STEPS = 12


@dataclass(frozen=True)
class Look:
    """What the recordings say so far."""

    seconds: float  # of all runs that were fitted
    error: float  # root mean square of whitened residuals, in units of noise: 1 is perfect
    verdict: str  # "none", "explained": the finding leaves noise; "unexplained"
    finding: Finding | None  # what explains the motion best; None: nothing does, or nothing has to
    cause: str  # label of its hypothesis; "" without a finding
    estimate: InertialEstimate | None  # with the finding in the model; None where that does not explain it
    fitted: Fitted

    @property
    def text(self) -> str:
        """One sentence or two for a person."""
        if self.verdict == "none":
            return "All residuals are noise so far."
        if self.finding is None:
            return (
                f"The model does not explain the motion: residuals of {self.error:.2f} times their noise. "
                "No single known cause accounts for a part of them."
            )
        if self.verdict == "explained":
            return self.finding.statement
        return (
            f"The model does not explain the motion: residuals of {self.error:.2f} times their noise. "
            f"Nearest comes this, which leaves more than noise: {self.finding.statement}"
        )


def look(session: Session, before: Look | None = None) -> Look:
    """Fit what was recorded, and say what contradicts it.

    Parameters
    ----------
    session : Session
        Recordings at rest and in motion, the last one under way. Held-out runs are not looked at.
    before : Look, optional
        The last look at a shorter part of the same session; the fit goes on from there.

    Raises
    ------
    InputError
        Nothing is there to fit.
    CannotBeFollowed
        The model cannot even be evaluated.
    """
    fitted = _fitted(session, before)
    ideal = Ideal(fitted, *judged(fitted))
    evaluation = fitted.evaluation
    seconds = sum(run.grid.duration for run in fitted.problem.runs)
    sound = ideal.mismatch.verdict == "none"
    plain = Look(
        seconds, float(np.sqrt(misfit(evaluation))), ideal.mismatch.verdict, None, "",
        inertial_estimate(fitted.problem, evaluation) if sound else None, fitted,
    )  # fmt: skip
    if not fitted.problem.runs or only_watched(fitted.problem):
        # A body that is only watched to swing is damped by what no first order tells
        return plain
    problem = with_reference(fitted.problem, fitted.rest)
    best = _best(problem, ideal, "" if before is None else before.cause)
    if best is None:
        return plain
    told = finding(best, estimates(best.problem, best.evaluation), _evidence(ideal, best))
    plain = replace(plain, finding=told, cause=best.candidate.label)
    if misfit(best.evaluation) >= NEAR_SQUARE:
        return replace(plain, verdict="unexplained", estimate=None)
    return replace(plain, verdict="explained", estimate=inertial_estimate(best.problem, best.evaluation))


def _best(problem: Problem, ideal: Ideal, known: str) -> Trial | None:
    """The hypothesis with the most evidence among those that promise most; None where none is likelier.

    known: label of the one that explained the last look, which is among them.
    """
    evaluation = ideal.fitted.evaluation
    candidates = catalogue(problem)
    promises = screen(problem, evaluation, candidates, mass_of(problem, evaluation))
    trials = [attempt(problem, evaluation, p) for p in _worthy(promises, count_of(candidates) * LOOKS, known)]
    found = [t for t in trials if t is not None and t.evidence > log_evidence(evaluation)]
    return max(found, key=lambda trial: trial.evidence, default=None)


def _worthy(promises: list[Promise], count: int, known: str) -> list[Promise]:
    """The few that promise most beyond what chance gives one of ``count``, and what was ``known`` before."""
    ranked = sorted(promises, key=lambda p: -net_gain(p, count))
    out: list[Promise] = []
    for promise in ranked:
        if net_gain(promise, count) <= 0.0 or (out and promise.gain < SHARE * out[0].gain):
            break
        out.append(promise)
        if len(out) == FITTED:
            break
    told = {id(p) for p in out}
    same = [p for p in ranked if p.candidate.label == known and net_gain(p, count) > 0.0]
    return [*out, *(p for p in same[:1] if id(p) not in told)]


def _evidence(ideal: Ideal, trial: Trial) -> dict[str, float | None]:
    gain = ideal.fitted.evaluation.cost - trial.evaluation.cost
    return {"log_likelihood_gain": float(gain), "holdout_error_before": None, "holdout_error_after": None}


def _fitted(session: Session, before: Look | None) -> Fitted:
    """The ideal model's fit; from where the last one ended if that leads to a fit as good."""
    if before is not None:
        try:
            again = _going_on(session, before.fitted)
        except (CannotBeFollowed, FloatingPointError, np.linalg.LinAlgError):
            again = None
        if again is not None:
            return again
    return fit_session(session)


def _going_on(session: Session, before: Fitted) -> Fitted | None:
    """The fit from where the last one ended; None where that was no plain fit, or leads nowhere."""
    if before.stretch is not None or before.unfollowed or before.lost or before.held_parts:
        return None
    problem, theta, _ = pose_problem(session)
    if problem.bench.parameters.free != before.problem.bench.parameters.free or not problem.runs:
        return None
    theta = before.evaluation.point.theta
    problem = replace(problem, bench=replace(problem.bench, mocap=before.problem.bench.mocap))
    known = dict(zip((r.begins for r in before.problem.runs), before.evaluation.point.starts, strict=True))
    starts = [known.get(run.begins) for run in problem.runs]
    fresh = [run for run, start in zip(problem.runs, starts, strict=True) if start is None]
    launched = iter(launch_states(problem.bench, tuple(fresh), theta, before.rest))
    point = Point(
        theta,
        tuple(next(launched) if start is None else start for start in starts),
        (before.rest,) * len(problem.rests),
    )
    evaluation, converged = solve(problem, point, iterations=STEPS, tolerance=1e-2)
    if not converged or misfit(evaluation) > max(NEAR_SQUARE, 2.0 * misfit(before.evaluation)):
        return None
    return Fitted(problem, evaluation, converged, before.rest, (), (), before.notes, before.guess)
