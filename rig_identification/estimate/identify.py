"""The main job: from a session to mass, centre of mass and inertia with their intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.estimate import noise_at_rest
from rig_identification.estimate.cautious import coherence, solve_cautiously
from rig_identification.estimate.channel_fits import rest_fits, run_fits, run_motion
from rig_identification.estimate.enough import enough, loss_told, told
from rig_identification.estimate.estimates import parameter_estimates
from rig_identification.estimate.evidence import Run, away_from_jumps, prepare
from rig_identification.estimate.first_guess import (
    elements_that_hang,
    mocap_mount,
    rest_of,
    seen_whole,
    weak_prior,
)
from rig_identification.estimate.fitted import Fitted, HeldPart, sure_of
from rig_identification.estimate.followable import followable, hanging
from rig_identification.estimate.growing import (
    HOPELESS_SQUARE,
    NEAR_SQUARE,
    OutOfReach,
    misfit,
    solve_growing,
)
from rig_identification.estimate.hung_by_eye import hung_by_eye
from rig_identification.estimate.hung_by_eye import note_of as note_of_center
from rig_identification.estimate.joint_information import joint_information
from rig_identification.estimate.launch import REGRESSED, Launch, launch_states, tracked
from rig_identification.estimate.mixture import Bodies, mixture
from rig_identification.estimate.mount_by_lengths import mount_by_lengths
from rig_identification.estimate.noise_at_rest import slow_noise, with_slow_noise
from rig_identification.estimate.observability import inertial_estimate, unsettled
from rig_identification.estimate.parameters import INERTIAL, parameter_set
from rig_identification.estimate.pose_error_told import LAW, pose_error_text, pose_errors
from rig_identification.estimate.prediction import Bench, model_at
from rig_identification.estimate.rest_evidence import prepare_rest
from rig_identification.estimate.rods import note_of, rods_of, with_rods
from rig_identification.estimate.rolling import ways_of_rolling
from rig_identification.estimate.scan import Scanned, scan
from rig_identification.estimate.segments import (
    FreePart,
    free_part,
    in_pieces,
    solve_in_pieces,
    with_noise_of_swing,
)
from rig_identification.estimate.solve import (
    CannotBeFollowed,
    Evaluation,
    Point,
    Problem,
    as_good_as_settled,
    evaluate,
    shortened,
    solve,
)
from rig_identification.estimate.sources import with_sources
from rig_identification.estimate.stretching import Stretched, where_they_stretch, with_stretch
from rig_identification.estimate.swing_period import FORCES
from rig_identification.estimate.textbook import textbook_answers, turning_inertia
from rig_identification.estimate.tied_to_rig import tie_of
from rig_identification.estimate.unseen_sway import one_turn
from rig_identification.estimate.valley import Valley, valley_of
from rig_identification.estimate.verdict import judge
from rig_identification.estimate.watched_mount import mount_from_track, without_mocap
from rig_identification.estimate.whichever_way import whichever_way
from rig_identification.estimate.whole import fit_whole, predicted
from rig_identification.estimate.without_frame import vehicle_alone
from rig_identification.joint import JointInformation
from rig_identification.model.motion import RigModel, State, rig_model
from rig_identification.model.sensors import MocapMount
from rig_identification.recording import Recording, Session
from rig_identification.result import (
    BodyMotion,
    ChannelFit,
    Identification,
    Mismatch,
)
from rig_identification.rig import Rig

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

#: What an ideal model assumes, put into a rig's model.
Assumed = Callable[[RigModel], RigModel]

#: The ideal model may differ from its description by so many tolerances (recording contract).
ORDINARY = 3.0


def _silent(stage: str, fraction: float) -> None:
    _ = stage, fraction


def pose_problem(session: Session, assumed: Assumed | None = None) -> tuple[Problem, Array, tuple[Run, ...]]:
    """What is to be fitted, the vector of a first guess from geometry alone, and the held-out runs.

    assumed: what another ideal model than this project's assumes.
    Raises InputError where no recording holds a device that the description mounts.
    """
    rig = session.rig
    elements = elements_that_hang(session)
    model = rig_model(rig, elements)
    model = model if assumed is None else assumed(model)
    runs, held = runs_of(rig, session.training), runs_of(rig, session.holdouts)
    rests = tuple(r for r in (prepare_rest(rig, recording) for recording in session.statics) if r.channels)
    if not (runs or rests):
        _refuse(session, held)
    slow = slow_noise(rests, max((run.exciter_noise for run in runs), default=0.0))
    runs, held = with_slow_noise(runs, slow), with_slow_noise(held, slow)
    model = with_rods(model, rig, rods_of(rig, (*runs, *held)))
    if not any(run.watched for run in runs):
        # How the tracker stands in the room is fitted, and to no held-out run
        held = tuple(run for run in map(without_mocap, held) if run.channels)
    channels = {c.device for run in (*runs, *held) for c in run.channels}
    channels |= {c.device for evidence in rests for c in evidence.channels}
    parameters = parameter_set(rig, model, channels)
    theta = parameters.start(elements)
    mass = (
        None
        if rig.mass is None
        else (rig.mass, rig.mass_std if rig.mass_std is not None else 1e-3 * rig.mass)
    )
    problem = Problem(
        Bench(rig, parameters), runs, rests, mass, weak_prior(rig), theta[:INERTIAL].copy(), bound=ORDINARY
    )
    return hung_by_eye(problem), theta, held


def runs_of(rig: Rig, recordings: tuple[Recording, ...]) -> tuple[Run, ...]:
    """Runs in which a device that the description mounts was heard, in parts where a force is not known."""
    parts = (away_from_jumps(part) for r in recordings for part in prepare(rig, r).where_driven())
    return enough(tuple(part for part in parts if part.channels))


def _refuse(session: Session, held: tuple[Run, ...]) -> None:
    """Say why a session holds nothing that a fit may use."""
    if held:
        names = ", ".join(dict.fromkeys(run.recording.name for run in held))
        raise InputError(
            f"{session.name}: every run is held out ({names}) and no static recording holds a device that "
            "the rig description mounts: nothing is left to fit to; take holdout: true from a run in "
            "session.yaml"
        )
    raise InputError(
        f"{session.name}: no recording holds a cable's tension, an IMU, an inclinometer or motion "
        "capture that the rig description mounts; record or describe at least one of them"
    )


@dataclass(frozen=True)
class Start:
    """Where the fit of a session starts, and the free parts of its runs."""

    problem: Problem
    point: Point
    rest: State
    held: tuple[Run, ...]
    notes: tuple[str, ...] = ()
    held_parts: tuple[HeldPart, ...] = ()
    unfollowed: tuple[str, ...] = ()  # recordings that the model cannot follow from there
    stretch: Stretched | None = None  # where its cables stretch from the first guess on


def _measured_start(problem: Problem, theta: Array, held: tuple[Run, ...], progress: Progress) -> Start:
    """From rest, then from momentum: sessions whose tensions or IMU are recorded."""
    blind = replace(problem, runs=tuple(without_mocap(run) for run in problem.runs))
    launch = Launch(blind, theta).from_rest()
    if launch.rest is None:
        raise AssertionError("from_rest finds a pose")
    progress("first guess from momentum", 0.05)
    watched = next((run for run in problem.runs if run.watched), None)
    if watched is None:
        return Start(problem, launch.from_momentum().point(), launch.rest, held)
    mount, theta = _mounted(problem, launch, launch.rest, watched)
    launch = replace(launch, theta=theta)
    problem = replace(problem, bench=replace(problem.bench, mocap=mount))
    launch = replace(launch, problem=problem).from_momentum()
    return Start(problem, launch.point(), launch.rest or launch.starts[0], held)


def _mounted(problem: Problem, launch: Launch, rest: State, watched: Run) -> tuple[MocapMount, Array]:
    """The tracker's mount as the description, the IMU, the cables or a scan tell it, and the body then."""
    rig, mount, theta = problem.bench.rig, None, launch.theta
    if rig.mocap is not None:
        return mocap_mount(rig, watched, rest, 0.0), theta
    if any(c.device == "imu" for c in watched.channels) and seen_whole(watched):
        track = tracked(launch.problem.bench, without_mocap(watched).until(REGRESSED), theta, rest)
        mount = None if track is None else mount_from_track(watched, track)
    else:
        found = mount_by_lengths(problem.bench, watched.until(REGRESSED), rest, theta, problem.weak)
        if found is not None:
            return found.mount, found.theta
        scanned = scan(problem, watched)
        mount = None if scanned is None else scanned.problem.bench.mocap
    return mount or mocap_mount(rig, watched, rest, 0.0), theta


def _watched_start(problem: Problem, held: tuple[Run, ...], progress: Progress) -> Start | None:
    """From a scan, then from the free parts of the runs: sessions that only watch a body swing."""
    progress("scanning inertia and depth", 0.05)
    found = scan(problem, next((run for run in problem.runs if run.watched), problem.runs[0]))
    if found is None:
        return None
    believed = _as_believed(problem, found)
    found = found if believed is None else believed
    problem = replace(found.problem, runs=problem.runs)
    progress("looking for the free part of each run", 0.2)
    half = replace(problem, runs=tuple(r.between(r.grid.nodes // 2, r.grid.nodes - 1) for r in problem.runs))
    theta = _rolling(half, found) if believed is None else found.theta
    parts = [(r.recording.name, free_part(problem, r, theta, found.rest)) for r in (*problem.runs, *held)]
    free = tuple(with_noise_of_swing(problem.bench.rig, part.run) for _, part in parts)
    by_hand = tuple(stretch for name, part in parts for stretch in _stretches(name, part))
    notes = tuple(_note(name, part) for name, part in parts if part.held)
    runs, held = free[: len(problem.runs)], free[len(problem.runs) :]
    problem = replace(problem, runs=runs)
    starts = launch_states(problem.bench, runs, theta, found.rest)
    point = Point(theta, starts, (found.rest,) * len(problem.rests))
    return Start(problem, point, found.rest, held, notes, by_hand)


def _as_believed(problem: Problem, found: Scanned) -> Scanned | None:
    """The body as believed, as large as the textbooks' formula makes it, where one turn is all there is.

    None elsewhere, or on a rig without such a formula. The turn alone says no more of a body than that, and a
    scan of one piece bends its shape, and a swing that nothing sees, to what damps the turn.
    """
    if not all(one_turn(run) for run in problem.runs):
        return None
    parameters = problem.bench.parameters
    shape = parameters.elements(np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)]))
    inertia = turning_inertia(replace(found.problem, runs=problem.runs), float(shape[0]))
    if inertia is None:
        return None
    shape[4:] *= inertia / shape[9]
    theta = parameters.start(shape)
    center = replace(found.problem, weak_center=theta[:INERTIAL].copy())
    return Scanned(center, theta, rest_of(model_at(parameters, theta)))


def _rolling(half: Problem, found: Scanned) -> Array:
    """The scan's vector fitted to short pieces, with the body rolling as it fits them best (rolling.py)."""
    guesses = (found.rest,) * len(half.rests)
    try:
        parts, best = solve_in_pieces(half, found.theta, found.rest, guesses)
    except CannotBeFollowed:
        return found.theta
    for theta in ways_of_rolling(parts, parts.runs, best.point.theta, found.rest):
        try:
            _, other = solve_in_pieces(half, theta, found.rest, guesses)
        except CannotBeFollowed:
            continue
        if len(other.runs) == len(best.runs) and other.cost < best.cost:
            best = other
    return best.point.theta


def _stretches(name: str, part: FreePart) -> list[HeldPart]:
    """Driven pieces that touch, joined."""
    out: list[HeldPart] = []
    for start, end in part.held:
        if out and start - out[-1].end < 1e-6 + 0.5 * (end - start):
            out[-1] = replace(out[-1], end=end)
        else:
            out.append(HeldPart(name, start, end))
    return out


def _note(name: str, part: FreePart) -> str:
    where = ", ".join(f"{s.start:.1f} to {s.end:.1f} s" for s in _stretches(name, part))
    return (
        f"{name}: used from {part.start:.1f} to {part.end:.1f} s; outside of that something beside the rig "
        f"moves the body ({where}), a person's hand for one"
    )


def only_watched(problem: Problem) -> bool:
    """Whether no device measures force or acceleration: the body is only seen to move."""
    measured = {c.quantity for run in problem.runs for c in run.channels}
    return bool(problem.runs) and not measured & FORCES


def weighed(problem: Problem) -> bool:
    """Whether a force is measured that momentum can be balanced with."""
    measured = {c.quantity for run in problem.runs for c in run.channels}
    return not problem.runs or bool(measured & {"tension", "exciter_force"})


def start_of(problem: Problem, theta: Array, held: tuple[Run, ...], progress: Progress) -> Start:
    """The way to a first guess that the session's sensors allow.

    Without a force an accelerometer says no more of inertia than a tracker does, and how the body hangs says
    next to nothing of its centre of mass where cables are nearly parallel.
    """
    if not weighed(problem):
        watched = _watched_start(problem, held, progress)
        if watched is not None:
            return watched
    return _measured_start(problem, theta, held, progress)


def _begun(
    problem: Problem, theta: Array, held: tuple[Run, ...], progress: Progress, *, soft_asked: bool = False
) -> Start:
    """Where the fit of a session starts, with what its model can follow from there.

    soft_asked: rest is asked whether the cables stretch, whatever the rig.
    Raises CannotBeFollowed where that is nothing.
    """
    soft = where_they_stretch(problem, theta, asked=soft_asked)
    if soft is None:
        try:
            return _followed(problem, theta, held, progress)
        except CannotBeFollowed:
            # No pose keeps the length of every cable: those that stretch always hang somewhere
            soft = with_stretch(problem, theta)
            if soft is None:
                raise
    start = _followed(soft.problem, soft.theta, held, progress)
    return replace(start, stretch=soft)


def _followed(problem: Problem, theta: Array, held: tuple[Run, ...], progress: Progress) -> Start:
    """Where the fit starts, with what its model can follow. Raises CannotBeFollowed where that is nothing."""
    rest = rest_of(model_at(problem.bench.parameters, theta))
    still, lost = hanging(problem, theta, rest)
    start = start_of(still, theta, held, progress)
    moving = followable(start.problem, start.point, start.rest)
    names = tuple(dict.fromkeys((*lost, *moving.names)))
    return replace(start, problem=moving.problem, point=moving.point, unfollowed=names)


def fit_session(
    session: Session,
    progress: Progress = _silent,
    assumed: Assumed | None = None,
    *,
    soft_asked: bool = False,
) -> Fitted:
    """Fit the ideal model to a session and predict its held-out runs.

    soft_asked: rest is asked whether the cables stretch, whatever the rig (estimate/stretching.py).
    """
    progress("first guess from rest and geometry", 0.0)
    problem, theta, held = pose_problem(session, assumed)
    fitted = fit_from(_begun(problem, theta, held, progress, soft_asked=soft_asked), progress)
    noisy = noise_at_rest.told((*problem.runs, *held))
    notes = (*told((*problem.runs, *held)), *note_of_center(problem), *noisy)
    fitted = replace(fitted, notes=(*notes, *fitted.notes))
    rods = rods_of(session.rig, (*problem.runs, *held))
    fitted = replace(fitted, notes=(*fitted.notes, note_of(rods))) if rods else fitted
    less = without_unseen_force(session, fitted, _surely_driven)
    if less is None:
        return fitted
    progress("without the runs whose force was not measured", 0.6)
    problem, theta, held = pose_problem(less.session, assumed)
    again = fit_from(_begun(problem, theta, held, progress), progress)
    return replace(again, notes=(*again.notes, less.note))


#: rad/s, of an exciter's shaft that turns.
TURNS = 0.5


def _surely_driven(run: Run) -> bool:
    """Whether an exciter ran whose force was not measured: its topic holds no number, or its shaft turns.

    A topic that is missing altogether may mean that there was nothing to measure.
    """
    shaft = run.recording.exciter_shaft
    turning = shaft is not None and float(np.median(np.abs(shaft.values[:, 1]))) > TURNS
    return run.recording.exciter_unmeasured or turning


@dataclass(frozen=True)
class Less:
    """A session without some of its runs, and what is told of them."""

    session: Session
    note: str


def without_unseen_force(session: Session, fitted: Fitted, chosen: Callable[[Run], bool]) -> Less | None:
    """The session less its ``chosen`` runs without the force of a described exciter, where it moves them.

    None where there are none, where a free swing explains them, or where nothing would be left.
    """
    if session.rig.exciter is None:
        return None
    fits = zip(fitted.problem.runs, fitted.evaluation.runs, strict=True)
    held = zip(fitted.holdout_runs, fitted.holdouts, strict=True)
    followed = [(run, float(np.mean(lin.residual**2))) for run, lin in (*fits, *held)]
    unseen = [
        (run, square)
        for run, square in (*followed, *((run, np.inf) for run in fitted.lost))
        if run.force is None and chosen(run)
    ]
    if not any(square > HOPELESS_SQUARE for _, square in unseen):
        return None
    # One that is driven bends the fit of all: no other without its force is to be trusted either
    names = [
        r.name for r in (*session.training, *session.holdouts) if any(run.recording is r for run, _ in unseen)
    ]
    kept = tuple(r for r in session.recordings if r.name not in names)
    if all(r.kind == "dynamic" and r.holdout for r in kept):
        return None
    return Less(replace(session, recordings=kept), UNSEEN_FORCE.format(runs=" and ".join(names)))


#: What is told of runs without the force that drives them.
UNSEEN_FORCE = (
    "{runs}: left aside. The exciter's force was not recorded, and without it the model does not move as the "
    "body did: something drives it, and what an unknown force does tells nothing of the inertia. Record the "
    "exciter's force, or let the body swing with the exciter off."
)


#: Steps in which the fit of a body that is only watched is followed to its end, near the noise.
FOLLOWED = 80
#: Nats that a full step may promise where such a fit ends: of no weight to whether the model explains the
#: recordings, and the step goes into the body's interval.
LEFT = 2.0


#: What is told where a motion cannot be followed to its end.
CUT_SHORT = (
    "Of each run the first {end:g} s are used: beyond, the motion of the model as fitted has no bound."
)


def _grown(start: Start, progress: Progress) -> tuple[Start, Evaluation, bool]:
    """The fit over growing horizons, as far as its runs can be followed: what was fitted, it, converged."""

    def notify(fraction: float, text: str) -> None:
        progress(f"fit: {text}", 0.15 + 0.45 * fraction)

    try:
        return (start, *solve_growing(start.problem, start.point, notify))
    except OutOfReach as reached:
        short = shortened(start.problem, reached.end)
        names = tuple(dict.fromkeys((*start.unfollowed, *(run.recording.name for run in short.runs))))
        notes = (*start.notes, CUT_SHORT.format(end=reached.end))
        start = replace(start, problem=short, notes=notes, unfollowed=names)
        return (start, *solve(short, reached.point))


def fit_from(start: Start, progress: Progress = _silent) -> Fitted:
    """Fit the ideal model from where a session's fit starts, and predict the held-out runs."""
    start, evaluation, converged = _grown(start, progress)
    if only_watched(start.problem) and misfit(evaluation) < NEAR_SQUARE:
        # The valleys of a body that is only watched are curved: what a step wins says little of what is left
        evaluation, converged = solve(start.problem, evaluation.point, iterations=FOLLOWED, tolerance=1e-3)
        converged = converged or as_good_as_settled(start.problem, evaluation, LEFT)
    evaluation, converged, valley = _lowest(start.problem, evaluation, converged)
    progress("predicting held-out runs", 0.6)
    held_runs, held_out, lost = predicted(start.problem, start.held, evaluation.point.theta, start.rest)
    return Fitted(
        start.problem,
        evaluation,
        converged,
        start.rest,
        held_runs,
        held_out,
        start.notes,
        start.point,
        start.held_parts,
        lost,
        start.unfollowed,
        start.stretch,
        valley,
    )


def _lowest(
    problem: Problem, evaluation: Evaluation, converged: bool
) -> tuple[Evaluation, bool, Valley | None]:
    """Where a fit ends once its valleys are asked, whether it settled there, and what they allow."""
    valley = valley_of(problem, evaluation)
    if valley is None:
        return evaluation, converged, None
    return valley.evaluation, converged if valley.converged is None else valley.converged, valley


@dataclass(frozen=True)
class Scores:
    """Every sample beside its prediction, and the two errors that a person asks for first."""

    channels: tuple[ChannelFit, ...]
    training: float
    holdout: float | None
    motions: tuple[BodyMotion, ...] = ()


def scores(fitted: Fitted) -> Scores:
    """Predictions and errors of a fit."""
    problem, evaluation = fitted.problem, fitted.evaluation
    fits = []
    for run, linearised in zip(problem.runs, evaluation.runs, strict=True):
        fits += run_fits(problem, run, linearised, evaluation.point.theta)
    still = []
    for evidence, rest in zip(problem.rests, evaluation.rests, strict=True):
        still += rest_fits(evidence, rest)
    training = error_in_sigma(fits or still)
    held = []
    for run, linearised in zip(fitted.holdout_runs, fitted.holdouts, strict=True):
        held += run_fits(problem, run, linearised, evaluation.point.theta)
    pairs = ((problem.runs, evaluation.runs), (fitted.holdout_runs, fitted.holdouts))
    motions = [run_motion(*one) for runs, found in pairs for one in zip(runs, found, strict=True)]
    holdout = error_in_sigma(held) if held else None
    return Scores((*fits, *still, *held), training, holdout, tuple(motions))


@dataclass(frozen=True)
class Ideal:
    """The ideal model's fit, its verdict, and a cautious fit to short pieces where there is one."""

    fitted: Fitted
    scores: Scores
    mismatch: Mismatch
    pieces: Problem | None = None  # the runs in short pieces
    careful: tuple[Problem, Evaluation] | None = None  # their cautious fit (cautious.py)


#: What the report says of numbers that come from the cautious fit.
CAUTION = (
    "The model does not explain these recordings. The ten numbers come from a fit in short pieces that "
    "weighs each channel by its own residual; their intervals hold what the model lacks only as far as "
    "the residuals show it."
)
#: Factor on a std from which it is said that rivals make it wider.
WIDER = 1.5
TIED = (
    "Other explanations that these recordings hardly tell apart make another body of them. The ten numbers "
    "and their intervals cover all of those explanations, each weighed by how likely it is."
)


def fit_ideal(session: Session, notify: Progress, assumed: Assumed | None = None) -> Ideal:
    """Fit the ideal model and judge it; fit short pieces cautiously where it fails by far."""
    fitted = fit_session(session, notify, assumed)
    ideal = Ideal(fitted, *judged(fitted))
    return ideal if near_noise(fitted) else with_pieces(ideal, notify)


def near_noise(fitted: Fitted) -> bool:
    """Whether a fit came so near the noise that what it lacks is a small, linear thing."""
    return misfit(fitted.evaluation) < NEAR_SQUARE


def with_pieces(ideal: Ideal, notify: Progress) -> Ideal:
    """The same with a cautious fit of short pieces, where the ideal model does not explain the session."""
    if ideal.mismatch.verdict == "none" or not ideal.fitted.problem.runs or ideal.careful is not None:
        return ideal
    notify("fitting short pieces, each channel weighed by its residual", 0.7)
    try:
        return _with_pieces(ideal, notify)
    except CannotBeFollowed:
        # Not even a piece: the fit stands as it is
        return ideal


def _with_pieces(ideal: Ideal, notify: Progress) -> Ideal:
    fitted, found, mismatch = ideal.fitted, ideal.scores, ideal.mismatch
    points = [fitted.evaluation.point]
    if fitted.guess is not None and misfit(fitted.evaluation) > HOPELESS_SQUARE:
        # A model that lacks much bends everything to swallow it: start again from where nothing is bent
        points.insert(0, fitted.guess)
    for point in points:
        pieces, start = in_pieces(fitted.problem, point.theta, fitted.rest, point.rest_guesses)
        # What is only watched has no search that goes on from here: these weights are what it is told with
        careful = solve_cautiously(pieces, start, hasty=not only_watched(fitted.problem))
        again = evaluate(pieces, careful[1].point)
        if again is not None and misfit(again) <= misfit(fitted.evaluation):
            # Pieces fit no worse than the whole: the way from there did not get lost
            break
    if again is not None and misfit(again) < HOPELESS_SQUARE < misfit(fitted.evaluation):
        # Short pieces fit: it was the way to the whole run's fit that failed, not the model
        notify("fitting whole runs again", 0.9)
        fitted = fit_whole(fitted, fitted.problem, pieces, careful[1].point)
        found, mismatch = judged(fitted)
        if mismatch.verdict == "none":
            return Ideal(fitted, found, mismatch)
    return Ideal(fitted, found, mismatch, pieces, careful)


def fit_again(ideal: Ideal, runs: tuple[Run, ...], held: tuple[Run, ...], notify: Progress) -> Ideal:
    """The ideal model fitted to other stretches of its session's runs, to short pieces too where it fails."""
    return in_pieces_if_far(fitted_again(ideal, runs, held, notify), notify)


def in_pieces_if_far(again: Fitted, notify: Progress) -> Ideal:
    """A fit of the ideal model, judged; fitted to short pieces as well where it fails by far."""
    found = Ideal(again, *judged(again))
    return found if near_noise(again) else with_pieces(found, notify)


def fitted_again(ideal: Ideal, runs: tuple[Run, ...], held: tuple[Run, ...], notify: Progress) -> Fitted:
    """The ideal model fitted to other stretches of its session's runs, from where nothing is bent."""
    fitted = ideal.fitted
    point = fitted.guess or fitted.evaluation.point
    return fitted_anew(fitted, replace(fitted.problem, runs=runs), point, held, notify)


def fitted_anew(
    fitted: Fitted, problem: Problem, point: Point, held: tuple[Run, ...], notify: Progress
) -> Fitted:
    """Another ``problem`` of a session than it was ``fitted`` to, from a ``point`` with starts of its own."""
    starts = launch_states(problem.bench, problem.runs, point.theta, fitted.rest)
    start = Start(
        problem,
        replace(point, starts=starts),
        fitted.rest,
        held,
        fitted.notes,
        fitted.held_parts,
        fitted.unfollowed,
        fitted.stretch,
    )
    return fit_from(start, notify)


def judged(fitted: Fitted) -> tuple[Scores, Mismatch]:
    """Errors of a fit, and whether the model in it explains the session."""
    found = scores(fitted)
    parameters = parameter_estimates(fitted.problem, fitted.evaluation)
    return found, judge(fitted, parameters, found.holdout, found.training, ORDINARY)


def compose(
    session: Session,
    fitted: Fitted,
    found: Scores,
    mismatch: Mismatch,
    careful: tuple[Problem, Evaluation] | None,
    loose: float = 1.0,
    rivals: Bodies = (),
) -> Identification:
    """Everything that a fit says of a session; the body from the cautious fit where there is one.

    loose: factor on the body's covariance, for a trace that the model leaves. rivals: what models that
    these recordings hardly tell apart make of the body.
    """
    if careful is not None:
        loose *= coherence(*careful)
    basis = careful or (fitted.problem, fitted.evaluation)
    valley = None if careful is not None else sure_of(fitted)
    total = inertial_estimate(*basis) if valley is None else valley.estimate
    covariance = loose * total.covariance
    if careful is None and fitted.converged:
        covariance = covariance + unsettled(*basis)
    alone = replace(total, covariance=covariance)
    total = mixture(alone, rivals)
    wider = np.sqrt(np.diag(total.covariance) / np.diag(alone.covariance))
    notes = fitted.notes + ((CAUTION,) if careful else ())
    if valley is not None and valley.note is not None:
        notes += (valley.note,)
    errors = pose_errors(fitted)
    if errors and not any(finding.where.get("law") == LAW for finding in mismatch.findings):
        notes += (pose_error_text(errors),)
    if float(np.max(wider)) > WIDER:
        notes += (TIED,)
    total, headings = whichever_way(*basis, total)
    notes += (headings,) if headings else ()
    notes += loss_told(*basis, total)
    total = with_sources(total, *basis, loose)
    textbook = textbook_answers(fitted.problem, alone)
    tied = tie_of(total, *basis, textbook) if only_watched(fitted.problem) else None
    notes += () if tied is None else (tied,)
    frame = session.rig.frame
    return Identification(
        total=total,
        without_frame=vehicle_alone(total, frame),
        mismatch=mismatch,
        parameters=parameter_estimates(fitted.problem, fitted.evaluation),
        channels=found.channels,
        holdout_error=found.holdout,
        training_error=found.training,
        converged=fitted.converged,
        notes=notes,
        joint=_joint(session, fitted, valley)
        if careful is None and mismatch.verdict != "unexplained"
        else None,
        textbook=textbook,
        tie=tied,
        motions=found.motions,
    )


def _joint(session: Session, fitted: Fitted, valley: Valley | None) -> JointInformation | None:
    """Body and rig together; None where the fit did not converge, or its body is too thin to be inverted.

    Nor is there one of a model that leaves something: nobody knows which errors another session shares. Nor
    along a valley that bends: information at one place holds the body tighter than the recordings do.
    """
    if not fitted.converged or (valley is not None and valley.followed):
        return None
    try:
        return joint_information(session, fitted.problem, fitted.evaluation)
    except np.linalg.LinAlgError:
        return None


def identify(session: Session, progress: Progress | None = None) -> Identification:
    """Mass, centre of mass, inertia tensor and whether the ideal model explains the session.

    Raises InputError where the session holds nothing to fit.
    """
    notify = progress or _silent
    ideal = with_pieces(fit_ideal(session, notify), notify)
    notify("done", 1.0)
    return compose(session, ideal.fitted, ideal.scores, ideal.mismatch, ideal.careful)


def error_in_sigma(fits) -> float:  # type: ignore[no-untyped-def]
    """Root mean square of all residuals, each in units of its sensor's noise. fits: at least one."""
    total = sum(float(np.sum(fit.residual_in_sigma**2)) for fit in fits)
    return float(np.sqrt(total / sum(fit.time.size for fit in fits)))
