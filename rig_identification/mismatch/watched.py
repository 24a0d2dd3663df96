"""What takes the energy out of a body that is only watched to swing.

Motion capture alone sees no force: of all that the ideal model may lack it tells apart what changes
how a swing dies away, and what turns the body back. The few effects that do are chosen on pieces of
several periods (swing_effects.py), and the whole runs are then fitted with them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.cautious import left_beyond_noise, once, reweighted, solve_cautiously
from rig_identification.estimate.estimates import estimates
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import settled_starts
from rig_identification.estimate.identify import Ideal, judged
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.observability import testimony
from rig_identification.estimate.segments import in_pieces
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, solve
from rig_identification.estimate.unseen_sway import one_turn
from rig_identification.estimate.whole import predicted
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import evidence_of
from rig_identification.mismatch.findings import effects_of, finding
from rig_identification.mismatch.hands import hand_finding, nobody_held
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.opened import with_reference
from rig_identification.mismatch.swing_effects import DAMPERS, STEPS, Choice, Notify, damped, exchanged
from rig_identification.mismatch.swing_near_noise import models_of_one_turn, near_noise_models
from rig_identification.mismatch.swing_whole import Predicted, Whole, likeliest
from rig_identification.mismatch.threads import physics_of_pendulums
from rig_identification.mismatch.tracker_error import tracker_findings
from rig_identification.mismatch.trial import Trial, in_stds, log_evidence, mass_of, may_be_none
from rig_identification.result import ELEMENTS, Mismatch

#: How many times as long pieces are: friction shows against the amplitude, which must change within one.
LONGER = 2.0
#: Steps of the fit of whole runs.
WHOLE_STEPS = 20


@dataclass(frozen=True)
class Watched:
    """The whole runs with what damps them, and the cautious fit of the body with that.

    No cautious fit where one turn is all that is measured and the whole runs leave noise alone.
    """

    fitted: Fitted
    mismatch: Mismatch
    careful: tuple[Problem, Evaluation] | None
    unobservable: tuple[str, ...]  # beyond what the information matrix alone names


def _tempered(problem: Problem, evaluation: Evaluation) -> tuple[Problem, Evaluation]:
    """The same with residuals that follow the motion counted as one error each, fitted again."""
    mild = once(problem, evaluation)
    return mild, solve(mild, evaluation.point, iterations=2 * STEPS, tolerance=0.1)[0]


def _begun_whole(ideal: Fitted, weights: Problem, evaluation: Evaluation) -> tuple[Problem, Point]:
    """Whole runs with the effects of ``weights``, weighed as there, and where their fit starts."""
    noise = {c.key: c.noise for run in weights.runs for c in run.channels}
    runs = tuple(
        replace(run, channels=tuple(replace(c, noise=noise.get(c.key, c.noise)) for c in run.channels))
        for run in ideal.problem.runs
    )
    heavy = replace(ideal.problem, runs=runs, bench=weights.bench, weak_center=weights.weak_center)
    theta = evaluation.point.theta
    starts = tuple(launch_state(heavy.bench, run, theta, ideal.rest) for run in runs)
    point = Point(theta, starts, evaluation.point.rest_guesses)
    return heavy, replace(point, starts=settled_starts(heavy, point))


def _scored(ideal: Fitted, heavy: Problem, evaluation: Evaluation, converged: bool) -> Fitted:
    """A fit to whole runs, scored with the sensors' noise, and what it predicts."""
    wide = replace(ideal.problem, bench=heavy.bench, weak_center=heavy.weak_center)
    scored = evaluate(wide, evaluation.point)
    if scored is None:
        raise FloatingPointError("the fitted motion cannot be followed")
    held_runs, held, lost = predicted(
        wide, (*ideal.holdout_runs, *ideal.lost), evaluation.point.theta, ideal.rest
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


def explain_watched(found_ideal: Ideal, notify: Notify, budget: Budget) -> Watched | None:
    """Find what damps a watched body; None where nothing does. budget: past which nothing new is begun."""
    ideal = found_ideal.fitted
    known = with_reference(ideal.problem, ideal.rest)
    if all(one_turn(run) for run in ideal.problem.runs):
        return _of_one_turn(found_ideal, known, notify, budget)
    if found_ideal.careful is None:
        return None
    notify("fitting in pieces", 0.05)
    start = found_ideal.careful[1].point.theta
    guesses = ideal.evaluation.point.rest_guesses
    parts, point = in_pieces(known, start, ideal.rest, guesses, LONGER)
    evaluation, _ = solve(parts, point, iterations=STEPS, tolerance=0.5)
    raw, parts = parts, reweighted(parts, evaluation)
    again = evaluate(parts, evaluation.point)
    evaluation = evaluation if again is None else again
    candidates = _candidates(ideal, mass_of(parts, evaluation))
    answer = damped(raw, parts, evaluation, candidates, notify, budget)
    if answer is None or not answer[0].effects:
        return None
    choice, problem, parted = answer
    notify("weighing each channel by its residual", 0.65)
    careful = _tempered(*solve_cautiously(replace(problem, runs=raw.runs), parted.point))
    if not _sure(choice.effects, careful):
        # Each may be none beside the others: the one that shows most has to be there by itself
        choice, careful = _one_alone(raw, parts, choice, careful)
        if not _sure(choice.effects, careful):
            return None
    notify("search: whole runs", 0.75)
    heavy, point = _begun_whole(ideal, *careful)
    whole, converged = solve(heavy, point, iterations=WHOLE_STEPS, tolerance=0.1)
    fitted = _scored(ideal, heavy, whole, converged)
    first = Whole(choice, fitted.problem, fitted.evaluation, converged)
    bare = replace(ideal.problem, bench=known.bench)
    models = near_noise_models(bare, first, ideal.rest, budget)
    best = likeliest(models, ideal, _predicting(ideal))
    if best is None:
        return None
    sure = _sure(choice.effects, careful)
    if best.choice.labels != choice.labels:
        changed, parted = exchanged(parts, *careful, choice, best.choice)
        careful = _tempered(*solve_cautiously(replace(changed, runs=raw.runs), parted.point))
        sure = best.choice.effects
    if best.evaluation is not fitted.evaluation:
        fitted, heavy, whole = _predicting(ideal)(best), best.problem, best.evaluation
    found = [Trial(c, heavy, whole, log_evidence(whole), True) for c in sure]
    left = left_beyond_noise(careful[0], raw.runs, careful[1])
    return _told(found_ideal, fitted, found, best.choice, careful, left)


def _candidates(ideal: Fitted, mass: float) -> list[Candidate]:
    """What may damp a watched body of a ``mass`` (kg), and what small bodies on threads show besides."""
    rig, parameters = ideal.problem.bench.rig, ideal.problem.bench.parameters
    damping = [c for c in left_out_physics(rig, parameters, mass) if c.effect in DAMPERS]
    return damping + physics_of_pendulums(rig, mass)


def _predicting(ideal: Fitted) -> Predicted:
    """What a model of whole runs makes of the held-out ones."""
    return lambda model: _scored(ideal, model.problem, model.evaluation, model.converged)


def _of_one_turn(found_ideal: Ideal, known: Problem, notify: Notify, budget: Budget) -> Watched | None:
    """What damps a body of which one turn is all that is measured; None where nothing does.

    known: the whole runs with the reference that effects need.
    """
    ideal = found_ideal.fitted
    bare = replace(ideal.problem, bench=known.bench)
    candidates = _candidates(ideal, mass_of(ideal.problem, ideal.evaluation))
    best = likeliest(models_of_one_turn(bare, ideal, candidates, notify, budget), ideal, _predicting(ideal))
    if best is None:
        return None
    fitted = _predicting(ideal)(best)
    found = [Trial(c, best.problem, best.evaluation, 0.0, True) for c in best.choice.effects]
    if judged(fitted)[1].verdict == "none":
        # Nothing is left that would bend the body: the whole runs tell of it
        return _told(found_ideal, fitted, found, best.choice, None, 0.0)
    notify("weighing each channel by its residual", 0.8)
    heavy = reweighted(best.problem, best.evaluation)
    careful = _tempered(heavy, solve(heavy, best.evaluation.point, iterations=STEPS, tolerance=0.1)[0])
    left = left_beyond_noise(careful[0], best.problem.runs, careful[1])
    return _told(found_ideal, fitted, found, best.choice, careful, left)


def _told(
    found_ideal: Ideal,
    fitted: Fitted,
    found: list[Trial],
    choice: Choice,
    careful: tuple[Problem, Evaluation] | None,
    left: float,
) -> Watched:
    """The answer with the effects of ``found`` in the whole runs ``fitted``.

    careful: the cautious fit; None where the whole runs tell of the body. left: what that leaves beyond noise
    (cautious.left_beyond_noise).
    """
    after, verdict = judged(fitted)
    basis = careful or (fitted.problem, fitted.evaluation)
    told = estimates(fitted.problem, fitted.evaluation, spread=basis[1])
    evidence = evidence_of(found_ideal, fitted, after.holdout)
    findings = [finding(t, told, evidence) for t in found]
    hand = hand_finding(found_ideal.fitted)
    if hand is not None and not (verdict.verdict == "none" and nobody_held(fitted)):
        findings.append(hand)
    findings += tracker_findings(fitted, evidence)
    named = effects_of(findings)
    if verdict.verdict == "none":
        mismatch = Mismatch(
            "explained", f"With {named} in the model every residual is noise.", tuple(findings), choice.rivals
        )
    else:
        text = f"{named} explains part of it; something is left. {verdict.explanation}"
        mismatch = Mismatch("unexplained", text, tuple(findings), choice.rivals)
    hidden = {name for t in found for name in t.candidate.hides}
    lost = hidden | set(testimony(*basis, _missed(fitted), left))
    return Watched(fitted, mismatch, careful, tuple(name for name in ELEMENTS if name in lost))


def _sure(effects: tuple[Candidate, ...], careful: tuple[Problem, Evaluation]) -> tuple[Candidate, ...]:
    """Effects in the model that may not as well be none. careful: the fit whose intervals are told."""
    trials = [Trial(c, *careful, log_evidence(careful[1]), True) for c in effects]
    return tuple(t.candidate for t in trials if not may_be_none(t))


def _one_alone(
    raw: Problem, base: Problem, choice: Choice, careful: tuple[Problem, Evaluation]
) -> tuple[Choice, tuple[Problem, Evaluation]]:
    """The cautious fit with the one effect in the model whose amount is the most std from none.

    raw: pieces with the sensors' own noise; base: without any effect.
    """
    seen = in_stds(Trial(choice.effects[0], *careful, 0.0))
    clearest = max(choice.effects, key=lambda c: max(abs(seen[p.name]) for p in c.parameters))
    chosen, holding = ((clearest,), ()) if clearest in choice.chosen else ((), (clearest,))
    alone = replace(choice, chosen=chosen, holding=holding)
    problem, evaluation = exchanged(base, *careful, choice, alone)
    return alone, _tempered(*solve_cautiously(replace(problem, runs=raw.runs), evaluation.point))


def _missed(fitted: Fitted) -> dict[tuple[str, str, int], float]:
    """(device, quantity, axis) -> residual as a share of the signal, held out where a run is.

    By the motion alone: what a tracker is off by as the body turns predicts nothing of the body.
    """
    held = tuple(zip(fitted.holdout_runs, fitted.holdouts, strict=True))
    out: dict[tuple[str, str, int], float] = {}
    for run, linearised in held or zip(fitted.problem.runs, fitted.evaluation.runs, strict=True):
        for index, c in enumerate(run.channels):
            for k, axis in enumerate(c.axes):
                left = linearised.plain[(linearised.channel == index) & (linearised.axis == axis)]
                share = float(np.std(left) / max(float(np.std(c.grouped[:, k])), 1e-12))
                key = (c.device, c.quantity, axis)
                out[key] = max(out.get(key, 0.0), share)
    return out
