"""The session with what was left out in the model: fitted, judged on the held-out run, and told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.growing import fit_start_growing, misfit
from rig_identification.estimate.identify import ORDINARY, Fitted, Ideal, parameter_estimates, scores
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Point, Problem, solve
from rig_identification.estimate.verdict import judge
from rig_identification.mismatch.screen import carried, extended, with_reference
from rig_identification.mismatch.search import MOST_EFFECTS, Trial, adopted, catalogue, trials
from rig_identification.model.equilibrium import find_rest
from rig_identification.result import Finding, Mismatch

Notify = Callable[[str, float], None]

#: Steps of the ideal model's fit to short pieces, about which hypotheses are screened.
PIECES_STEPS = 8
#: Mean square of whitened residuals up to which short pieces count as explained.
EXPLAINED = 1.3


@dataclass(frozen=True)
class Explained:
    """A fit with effects in it."""

    fitted: Fitted
    mismatch: Mismatch


def explain(found_ideal: Ideal, notify: Notify) -> Explained | None:
    """Search for what the ideal model leaves out; None where nothing is found.

    Where the ideal model fails the search looks at short pieces.
    """
    ideal = found_ideal.fitted
    problem = with_reference(ideal.problem, ideal.rest)
    candidates = catalogue(problem)
    here, evaluation = problem, ideal.evaluation
    if found_ideal.pieces is not None:
        here = with_reference(found_ideal.pieces[0], ideal.rest)
        evaluation, _ = solve(here, found_ideal.pieces[1], iterations=PIECES_STEPS, tolerance=0.5)
    found: list[Trial] = []
    rivals: list[dict[str, object]] = []
    best: Explained | None = None
    for step in range(MOST_EFFECTS):
        left = [c for c in candidates if c.label not in {t.candidate.label for t in found}]
        done = trials(
            here,
            evaluation,
            left,
            ORDINARY,
            lambda label, k=step: notify(f"search: {label}", (k + 0.5) / (MOST_EFFECTS + 1)),  # type: ignore[misc]
        )
        if not done:
            break
        found.append(done[0])
        rivals += [
            {
                "effect": t.candidate.effect,
                "where": dict(t.candidate.where),
                "log_likelihood_gap": float(done[0].evidence - t.evidence),
            }
            for t in done[1:]
        ]
        here, evaluation = adopted(here, evaluation, done[0])
        if misfit(evaluation) > EXPLAINED and step < MOST_EFFECTS - 1:
            # Something large is left: there is no use yet in whole runs
            continue
        notify(
            "search: whole runs with " + ", ".join(t.candidate.label for t in found),
            (step + 0.9) / (MOST_EFFECTS + 1),
        )
        best = _whole(ideal, problem, found, rivals)
        if best.mismatch.verdict == "explained":
            break
    if best is None and found:
        best = _whole(ideal, problem, found, rivals)
    return best


def _whole(ideal: Fitted, problem: Problem, found: list[Trial], rivals: list[dict[str, object]]) -> Explained:
    """Fit the whole runs with the effects found, and predict the held-out ones."""
    last = found[-1]
    whole = extended(problem, tuple(t.candidate for t in found))
    point = carried(whole, last.problem, last.evaluation.point)
    rest = find_rest(model_at(whole.bench.parameters, point.theta), (*point.rest_guesses, *point.starts)[0]).state
    begun = {
        (run.recording.name, run.offset): state
        for run, state in zip(last.problem.runs, point.starts, strict=True)
    }
    starts = tuple(
        begun.get((run.recording.name, run.offset)) or launch_state(whole.bench, run, point.theta, rest)
        for run in whole.runs
    )
    point = Point(point.theta, starts, point.rest_guesses)
    evaluation, converged = solve(whole, point, iterations=20)
    held_runs, held = [], []
    for run in ideal.holdout_runs:
        state = launch_state(whole.bench, run, evaluation.point.theta, rest)
        result = fit_start_growing(whole.bench, run, evaluation.point.theta, state)
        if result is not None:
            held_runs.append(run)
            held.append(result[0])
    fitted = replace(
        ideal,
        problem=whole,
        evaluation=evaluation,
        converged=converged,
        holdout_runs=tuple(held_runs),
        holdouts=tuple(held),
    )
    return Explained(fitted, _mismatch(ideal, fitted, found, rivals))


def _mismatch(ideal: Fitted, fitted: Fitted, found: list[Trial], rivals: list[dict[str, object]]) -> Mismatch:
    before, after = scores(ideal), scores(fitted)
    parameters = parameter_estimates(fitted.problem, fitted.evaluation)
    judged = judge(fitted, parameters, after.holdout, after.training, ORDINARY)
    gain = ideal.evaluation.cost - fitted.evaluation.cost
    values = {p.name: p.value for p in parameters}
    # An error beyond what is ordinary comes on top of an ordinary one, and only their sum is seen
    ordinary = {p.name: p.prior_std for p in ideal.problem.bench.parameters.free}
    stds = {p.name: float(np.hypot(p.std, ordinary.get(p.name, 0.0))) for p in parameters}
    findings = tuple(_finding(t, values, stds, gain, before.holdout, after.holdout) for t in found)
    named = ", ".join(f.effect for f in findings)
    if judged.verdict == "none":
        text = f"With {named} in the model every residual is noise. Held-out error "
        text += f"{_number(before.holdout)} before, {_number(after.holdout)} after (1 is a perfect model)."
        return Mismatch("explained", text, findings, tuple(rivals))
    text = f"{named} explains part of it; something is left. {judged.explanation}"
    return Mismatch("unexplained", text, findings, tuple(rivals))


def _number(value: float | None) -> str:
    return "not known" if value is None else f"{value:.3g}"


def _finding(
    trial: Trial,
    values: dict[str, float],
    stds: dict[str, float],
    gain: float,
    before: float | None,
    after: float | None,
) -> Finding:
    candidate = trial.candidate
    told = candidate.told(values, stds)
    first = next(iter(told.values()))
    shown = f"{first[0]:.4g} ± {first[1]:.2g}" + ("" if first[2] == "1" else f" {first[2]}")
    where = dict(candidate.where)
    if candidate.effect == "tether":
        where["position"] = [values[f"tether.point.{a}"] for a in "xyz"]
    if candidate.effect == "imu_misalignment":
        where["axis"] = max("xyz", key=lambda a: abs(told[f"angle_{a}"][0]))
    sentence = candidate.sentence.format(value=shown, channel=where.get("channel"))
    return Finding(
        candidate.effect,
        where,
        {name: {"value": float(v), "std": float(s), "unit": unit} for name, (v, s, unit) in told.items()},
        {
            "log_likelihood_gain": float(gain),
            "holdout_error_before": None if before is None else float(before),
            "holdout_error_after": None if after is None else float(after),
        },
        f"{sentence} {candidate.advice}",
    )
