"""What takes the energy out of a body that is only watched to swing.

Motion capture alone sees no force: of all that the ideal model may lack it tells apart what changes
how a swing dies away. The few effects that do are fitted to pieces of several periods, with every
channel weighed by what its residual really has, the likeliest are added one by one, and the whole
runs are then fitted with them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.cautious import coherence, reweighted, solve_cautiously
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import settled_starts
from rig_identification.estimate.identify import Ideal, Scores, judged, parameter_estimates
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.observability import testimony
from rig_identification.estimate.segments import PIECE, in_pieces
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, solve
from rig_identification.estimate.whole import predicted
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import evidence_of
from rig_identification.mismatch.findings import finding, rival
from rig_identification.mismatch.hands import hand_finding
from rig_identification.mismatch.hypotheses import needed_gain
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.screen import carried, extended, with_reference
from rig_identification.mismatch.threads import physics_of_pendulums
from rig_identification.mismatch.trial import Trial, finished, log_evidence, mass_of, signs
from rig_identification.result import ELEMENTS, Mismatch

Notify = Callable[[str, float], None]

#: Effects that change how a swing dies away.
DAMPERS = ("hinge_damping", "hinge_friction", "air_drag")
#: Length of the pieces, s: friction shows against the amplitude, which must change within one.
LONG_PIECE = 2.0 * PIECE
#: Steps of the fit of one hypothesis, and of the whole runs.
STEPS = 8
WHOLE_STEPS = 20
#: Where a hypothesis starts, in units of its prior's std.
FIRST_VALUE = 0.02
#: Std by which an effect must differ from nothing beside all others.
SHOWS = 2.0


@dataclass(frozen=True)
class Watched:
    """The whole runs with what damps them, and the cautious fit of the body with that."""

    fitted: Fitted
    mismatch: Mismatch
    careful: tuple[Problem, Evaluation]
    unobservable: tuple[str, ...]  # beyond what the information matrix alone names


def _trial(problem: Problem, evaluation: Evaluation, candidate: Candidate) -> Trial | None:
    wide = extended(problem, (candidate,))
    point = carried(wide, problem, evaluation.point)
    theta = point.theta.copy()
    theta[wide.bench.parameters.index_of(candidate.parameters[0].name)] = FIRST_VALUE
    point, steps = replace(point, theta=theta), STEPS
    if candidate.settle is not None:
        # From another body: the way to its best is longer
        point, steps = candidate.settle(wide, point, evaluation), 3 * STEPS
    try:
        fitted, _ = solve(wide, point, iterations=steps, tolerance=0.5)
    except FloatingPointError:
        return None
    return finished(Trial(candidate, wide, fitted, log_evidence(fitted), True))


def _weighed(raw: Problem, problem: Problem, evaluation: Evaluation) -> tuple[Problem, Evaluation]:
    """The model of ``problem`` on the pieces of ``raw``, each channel weighed by what it leaves now, fitted.

    raw: pieces with the sensors' own noise. Weights that an earlier, poorer model set would hide from a
    better one what it still leaves.
    """
    bare = replace(problem, runs=raw.runs)
    now = evaluate(bare, evaluation.point)
    if now is None:
        return problem, evaluation
    heavy = reweighted(bare, now)
    return heavy, solve(heavy, evaluation.point, iterations=STEPS, tolerance=0.5)[0]


def _tempered(problem: Problem, evaluation: Evaluation) -> tuple[Problem, Evaluation]:
    """The same with residuals that follow the motion counted as one error each, fitted again.

    Taken as many independent ones they would outweigh what a tape measure says of the rig, and bend it.
    """
    factor = np.sqrt(coherence(problem, evaluation))
    runs = tuple(
        replace(run, channels=tuple(replace(c, noise=factor * c.noise) for c in run.channels))
        for run in problem.runs
    )
    mild = replace(problem, runs=runs)
    return mild, solve(mild, evaluation.point, iterations=2 * STEPS, tolerance=0.1)[0]


def _better(
    problem: Problem, evaluation: Evaluation, left: list[Candidate], count: int, notify: Callable[[str], None]
) -> list[Trial]:
    """Trials that gain more than chance over ``count`` does, likeliest first."""
    base, tried = log_evidence(evaluation), []
    for candidate in left:
        notify(f"search: {candidate.label}")
        trial = _trial(problem, evaluation, candidate)
        if trial is not None and trial.evidence - base > needed_gain(candidate, count):
            tried.append(trial)
    return sorted(tried, key=lambda t: -t.evidence)


def _damped(
    raw: Problem, problem: Problem, evaluation: Evaluation, candidates: list[Candidate], notify: Notify
) -> tuple[list[Trial], Evaluation, list[dict[str, object]]]:
    """Effects added one by one while each gains more than chance, the fit, and rivals of the first.

    What damps comes first, for no swing is followed without it; then what changes the body's freedom, which
    is no matter of degree; then what damps besides.
    """
    found: list[Trial] = []
    rivals: list[dict[str, object]] = []
    dampers = [c for c in candidates if c.effect in DAMPERS]
    holds = [c for c in candidates if c.effect not in DAMPERS]
    base_problem, count, left = problem, len(candidates), dampers
    while left or holds:

        def told(stage: str) -> None:
            notify(stage, 0.2 + 0.1 * len(found))

        tried = _better(problem, evaluation, left, count, told)
        if tried:
            if not found:
                rivals = [rival(t, tried[0]) for t in tried[1:]]
            found.append(tried[0])
            problem, evaluation = tried[0].problem, tried[0].evaluation
        if holds:
            held = _better(problem, evaluation, holds, count, told)
            holds = []
            if held:
                problem, evaluation = _weighed(raw, held[0].problem, held[0].evaluation)
                found.append(replace(held[0], problem=problem, evaluation=evaluation))
        elif not tried:
            break
        names = {t.candidate.parameters[0].name for t in found}
        left = [c for c in dampers if c.parameters[0].name not in names] if found else []
    return (*_needed(base_problem, found, evaluation), rivals)


def _needed(problem: Problem, found: list[Trial], evaluation: Evaluation) -> tuple[list[Trial], Evaluation]:
    """The effects less those that a later one left with nothing, fitted again without them."""
    kept = [t for t in found if signs(replace(found[-1], candidate=t.candidate))[0] > SHOWS]
    if not found or not kept or len(kept) == len(found):
        return found, evaluation
    wide = extended(problem, tuple(t.candidate for t in kept))
    point = carried(wide, found[-1].problem, evaluation.point)
    fitted, _ = solve(wide, point, iterations=STEPS, tolerance=0.5)
    return [replace(t, problem=wide, evaluation=fitted) for t in kept], fitted


def _whole(ideal: Fitted, found: list[Trial], weights: Problem, evaluation: Evaluation) -> Fitted:
    """Whole runs fitted with the effects, weighed as in ``weights``, then scored with the sensors' noise."""
    last = found[-1]
    wide = replace(ideal.problem, bench=last.problem.bench, weak_center=last.problem.weak_center)
    noise = {(c.device, c.quantity): c.noise for run in weights.runs for c in run.channels}
    runs = tuple(
        replace(run, channels=tuple(replace(c, noise=noise[c.device, c.quantity]) for c in run.channels))
        for run in wide.runs
    )
    heavy = replace(wide, runs=runs)
    theta = evaluation.point.theta
    starts = tuple(launch_state(wide.bench, run, theta, ideal.rest) for run in runs)
    point = Point(theta, starts, evaluation.point.rest_guesses)
    point = replace(point, starts=settled_starts(heavy, point))
    fitted, converged = solve(heavy, point, iterations=WHOLE_STEPS, tolerance=0.1)
    scored = evaluate(wide, fitted.point)
    if scored is None:
        raise FloatingPointError("the fitted motion cannot be followed")
    held_runs, held, lost = predicted(
        wide, (*ideal.holdout_runs, *ideal.lost), fitted.point.theta, ideal.rest
    )
    return replace(
        ideal,
        problem=wide,
        evaluation=scored,
        converged=converged,
        holdout_runs=held_runs,
        lost=lost,
        holdouts=held,
    )


def explain_watched(found_ideal: Ideal, notify: Notify) -> Watched | None:
    """Find what damps a watched body; None where nothing does."""
    ideal = found_ideal.fitted
    if found_ideal.careful is None:
        return None
    notify("fitting in pieces", 0.05)
    start = found_ideal.careful[1].point.theta
    guesses = ideal.evaluation.point.rest_guesses
    known = with_reference(ideal.problem, ideal.rest)
    parts, point = in_pieces(known, start, ideal.rest, guesses, LONG_PIECE)
    evaluation, _ = solve(parts, point, iterations=STEPS, tolerance=0.5)
    raw, parts = parts, reweighted(parts, evaluation)
    again = evaluate(parts, evaluation.point)
    evaluation = evaluation if again is None else again
    rig, parameters = ideal.problem.bench.rig, ideal.problem.bench.parameters
    mass = mass_of(parts, evaluation)
    candidates = [c for c in left_out_physics(rig, parameters, mass) if c.effect in DAMPERS]
    candidates += physics_of_pendulums(rig, mass)
    found, damped, rivals = _damped(raw, parts, evaluation, candidates, notify)
    if not found:
        return None
    notify("weighing each channel by its residual", 0.75)
    careful = _tempered(*solve_cautiously(replace(found[-1].problem, runs=raw.runs), damped.point))
    notify("search: whole runs", 0.85)
    fitted = _whole(ideal, found, careful[0], careful[1])
    after, verdict = judged(fitted)
    values = {p.name: p.value for p in parameter_estimates(fitted.problem, fitted.evaluation)}
    stds = {p.name: p.std for p in parameter_estimates(fitted.problem, careful[1])}
    evidence = evidence_of(found_ideal, fitted, after.holdout)
    findings = [finding(t, values, stds, evidence) for t in found]
    hand = hand_finding(ideal)
    if hand is not None:
        findings.append(hand)
    named = ", ".join(f.effect for f in findings)
    if verdict.verdict == "none":
        mismatch = Mismatch(
            "explained", f"With {named} in the model every residual is noise.", tuple(findings), tuple(rivals)
        )
    else:
        text = f"{named} explains part of it; something is left. {verdict.explanation}"
        mismatch = Mismatch("unexplained", text, tuple(findings), tuple(rivals))
    hidden = {name for t in found for name in t.candidate.hides}
    lost = hidden | set(testimony(*careful, _missed(fitted, after)))
    return Watched(fitted, mismatch, careful, tuple(name for name in ELEMENTS if name in lost))


def _missed(fitted: Fitted, found: Scores) -> dict[tuple[str, str, int], float]:
    """(device, quantity, axis) -> residual as a share of the signal, held out where a run is."""
    held = {run.recording.name for run in (*fitted.holdout_runs, *fitted.lost)}
    out: dict[tuple[str, str, int], float] = {}
    for c in found.channels:
        if c.recording in held or not held:
            share = float(np.std(c.measured - c.predicted) / max(float(np.std(c.measured)), 1e-12))
            key = (c.channel, c.quantity, 0 if c.axis is None else "xyz".index(c.axis))
            out[key] = max(out.get(key, 0.0), share)
    return out
