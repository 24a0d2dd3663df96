"""The session with what was left out in the model: located, named, fitted, judged on held-out runs, told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from rig_identification.estimate.cautious import solve_cautiously
from rig_identification.estimate.evidence import Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit, settled_starts
from rig_identification.estimate.identify import (
    ORDINARY,
    Ideal,
    judged,
    near_noise,
    parameter_estimates,
    with_pieces,
)
from rig_identification.estimate.segments import in_pieces
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, excess
from rig_identification.estimate.verdict import loudest
from rig_identification.estimate.whole import fit_whole
from rig_identification.mismatch.findings import finding
from rig_identification.mismatch.locate import Event, find_event
from rig_identification.mismatch.screen import carried, extended, with_reference
from rig_identification.mismatch.search import (
    MOST_EFFECTS,
    Trial,
    adopted,
    beyond_doubt,
    catalogue,
    mass_of,
    needed_gain,
    strength,
    trials,
)
from rig_identification.mismatch.slack import Spell, slack_finding, slack_spells, taut_stretches
from rig_identification.mismatch.unknown import push_finding, unknown_finding
from rig_identification.result import Finding, Mismatch

Notify = Callable[[str, float], None]

#: Mean square of whitened residuals up to which short pieces count as explained.
EXPLAINED = 1.3
#: Share of the excess that named effects must take away to be told where something is left.
CONVINCING = 0.95
#: Share of the ideal model's excess, and mean square beyond noise, up to which what is left is a trace: no
#: model of a swinging liquid or a dry hinge is perfect.
TRACE, TRACE_SQUARE = 0.01, 1.03
#: Gain, in parts of what chance gives, above which it is not tried whether the rest does without an effect.
FIRM = 10.0
#: How uneven pieces must be (worst over median mean square) for an event to be looked for.
UNEVEN = 4.0
#: What is cut off on either side of a push, s.
MARGIN = 0.15


@dataclass(frozen=True)
class Explained:
    """A fit with effects in it; beside it the cautious fit of the ideal model where that was needed."""

    fitted: Fitted
    mismatch: Mismatch
    ideal: Ideal
    loose: float = 1.0  # factor on every variance where a trace is left


@dataclass
class _Search:
    """Where a search stands."""

    problem: Problem  # whole runs, ideal model
    here: Problem  # what hypotheses are tried on: short pieces where much is left, whole runs near the noise
    evaluation: Evaluation
    start: float  # excess in short pieces before anything was found
    share: float = 0.0  # of that excess that the effects found take away
    found: list[Trial] = field(default_factory=list)
    rivals: list[dict[str, object]] = field(default_factory=list)
    liar: str | None = None

    @property
    def whole(self) -> bool:
        """Whether hypotheses are tried on whole runs."""
        return len(self.here.runs) == len(self.problem.runs)


def explain(ideal: Ideal, notify: Notify) -> Explained | None:
    """Search for what the ideal model leaves out; None where every residual is noise.

    Near the noise the search looks at whole runs, which say most; where the ideal model fails by
    far, at short pieces, in which no model is far off.
    """
    if ideal.mismatch.verdict == "none":
        # What hides within noise is no finding
        return None
    spells = _spells(ideal.fitted)
    if not spells:
        return _explain(ideal, notify)
    notify("search: stretches in which every cable pulls", 0.02)
    taut = _taut(ideal, spells)
    if taut is None:
        return _explain(ideal, notify)
    found = None
    if near_noise(taut.fitted):
        found = _explain(taut, notify)
    return _with_slack(found or Explained(taut.fitted, taut.mismatch, taut), ideal, spells)


def _explain(ideal: Ideal, notify: Notify) -> Explained | None:
    """The search, on runs in which every cable pulls."""
    if ideal.mismatch.verdict == "none":
        return None
    fitted = ideal.fitted
    problem = with_reference(fitted.problem, fitted.rest)
    if ideal.pieces is None or ideal.careful is None:
        here, point = problem, fitted.evaluation.point
    else:
        here, point = with_reference(ideal.pieces, fitted.rest), ideal.careful[1].point
    evaluation = evaluate(here, point)
    if evaluation is None:
        return None
    search = _Search(problem, here, evaluation, excess(evaluation))
    pushed = _pushed(ideal, search, notify)
    if pushed is not None:
        return pushed
    best = _named(ideal, search, notify)
    if best is not None and best.mismatch.verdict == "explained":
        return best
    return _unexplained(ideal, search, best, notify)


def _spells(fitted: Fitted) -> list[Spell]:
    zeros = [p.prior_std for p in fitted.problem.bench.parameters.free if p.name.endswith("load_cell_zero")]
    runs = (*fitted.problem.runs, *fitted.holdout_runs)
    return [s for run in runs for s in slack_spells(run, max(zeros, default=0.0))]


def _taut(ideal: Ideal, spells: list[Spell]) -> Ideal | None:
    """The ideal model fitted between the spells, from where nothing is bent; None where nothing is left."""
    fitted = ideal.fitted
    runs = tuple(part for run in fitted.problem.runs for part in taut_stretches(run, spells))
    held = tuple(part for run in fitted.holdout_runs for part in taut_stretches(run, spells))
    if not runs:
        return None
    problem = replace(fitted.problem, runs=runs)
    point = fitted.guess or fitted.evaluation.point
    pieces, start = in_pieces(problem, point.theta, fitted.rest, point.rest_guesses)
    careful = solve_cautiously(pieces, start)
    again = fit_whole(replace(fitted, holdout_runs=held), problem, pieces, careful[1].point)
    found = Ideal(again, *judged(again))
    return found if near_noise(again) else replace(found, pieces=pieces, careful=careful)


def _with_slack(found: Explained, ideal: Ideal, spells: list[Spell]) -> Explained:
    """What was found between the spells, and the spells."""
    before, after = ideal.scores.holdout, judged(found.fitted)[0].holdout
    evidence = {
        "log_likelihood_gain": float(ideal.fitted.evaluation.cost - found.fitted.evaluation.cost),
        "holdout_error_before": before,
        "holdout_error_after": after,
    }
    slack = replace(slack_finding(spells), evidence=evidence)
    mismatch = found.mismatch
    if mismatch.verdict == "none":
        text = f"Where every cable pulls every residual is noise. {_errors(before, after)}"
        mismatch = Mismatch("explained", text, (), ())
    return replace(found, mismatch=replace(mismatch, findings=(slack, *mismatch.findings)))


def _named(ideal: Ideal, search: _Search, notify: Notify) -> Explained | None:
    """Effects of the catalogue, one after the other, until the whole runs are explained."""
    candidates = catalogue(search.problem)
    best: Explained | None = None
    for step in range(MOST_EFFECTS):
        left = [c for c in candidates if c.label not in {t.candidate.label for t in search.found}]
        at = (step + 0.5) / (MOST_EFFECTS + 1)
        tried = trials(
            search.here,
            search.evaluation,
            left,
            ORDINARY,
            lambda label, at=at: notify(f"search: {label}", at),  # type: ignore[misc]
        )
        search.liar = search.liar or tried.liar
        if not tried.done:
            break
        first = tried.done[0]
        search.found.append(first)
        search.rivals += [_rival(t, first) for t in tried.done[1:]]
        search.here, search.evaluation = adopted(search.here, search.evaluation, first)
        if not search.whole:
            search.share = 1.0 - excess(search.evaluation) / max(search.start, 1.0)
        if misfit(search.evaluation) > EXPLAINED:
            # Something large is left: there is no use yet in whole runs
            continue
        notify("search: whole runs with " + ", ".join(t.candidate.label for t in search.found), at)
        best = _whole(ideal, search)
        if best.mismatch.verdict == "explained":
            return _pruned(best, search, len(candidates))
        if near_noise(best.fitted):
            search.here, search.evaluation = best.fitted.problem, best.fitted.evaluation
    return best


def _rival(trial: Trial, first: Trial) -> dict[str, object]:
    return {
        "effect": trial.candidate.effect,
        "where": dict(trial.candidate.where),
        "log_likelihood_gap": float(first.evidence - trial.evidence),
        "experiment": trial.candidate.experiment or first.candidate.experiment,
    }


def _whole(ideal: Ideal, search: _Search) -> Explained:
    return _fitted_whole(ideal, search, search.found, search.here, search.evaluation.point)


def _fitted_whole(
    ideal: Ideal, search: _Search, found: list[Trial], here: Problem, known: Point
) -> Explained:
    """Whole runs with the effects ``found``, from a ``known`` point of the problem ``here``."""
    whole = extended(search.problem, tuple(t.candidate for t in found))
    point = replace(known, theta=carried(whole, here, known).theta)
    fitted = fit_whole(ideal.fitted, whole, here, point)
    after, verdict = judged(fitted)
    share = excess(fitted.evaluation) / max(excess(ideal.fitted.evaluation), 1.0)
    trace = fitted.converged and share < TRACE and misfit(fitted.evaluation) < TRACE_SQUARE
    loose = loudest(fitted) if trace and verdict.verdict != "none" else 1.0
    findings = _findings(ideal, fitted, found, after.holdout, loose)
    named = ", ".join(f.effect for f in findings)
    errors = _errors(ideal.scores.holdout, after.holdout)
    if verdict.verdict == "none":
        told, text = "explained", f"With {named} in the model every residual is noise. {errors}"
    elif trace:
        told, text = "explained", f"{named} explains all but a trace. {errors} {verdict.explanation}"
    else:
        told = "unexplained"
        text = f"{named} explains part of it; something is left. {verdict.explanation}"
    return Explained(fitted, Mismatch(told, text, findings, tuple(search.rivals)), ideal, loose)


def _pruned(best: Explained, search: _Search, count: int) -> Explained:
    """The explanation less what it can do without: an early effect may only have stood in for a later one."""
    kept = list(search.found)
    ordinary = {p.name: p.prior_std for p in search.problem.bench.parameters.free if p.bounded}
    while len(kept) > 1:
        fitted = best.fitted
        here = [replace(t, problem=fitted.problem, evaluation=fitted.evaluation) for t in kept]
        strengths = [
            # What swings or gives way has states of its own: no small thing to take back
            np.inf
            if t.candidate.build is not None
            else strength(t) / needed_gain(t.candidate, count)
            if beyond_doubt(t, ordinary, ORDINARY)
            else 0.0
            for t in here
        ]
        for i in np.argsort(strengths):
            if strengths[i] > FIRM:
                return best
            less = [t for k, t in enumerate(kept) if k != i]
            again = _fitted_whole(best.ideal, search, less, fitted.problem, fitted.evaluation.point)
            if again.mismatch.verdict == "explained":
                best, kept = again, less
                break
        else:
            return best
    return best


def _findings(
    ideal: Ideal, fitted: Fitted, found: list[Trial], after: float | None, loose: float
) -> tuple[Finding, ...]:
    """The effects in the recording contract's words. loose: factor on their variances."""
    parameters = parameter_estimates(fitted.problem, fitted.evaluation)
    gain = ideal.fitted.evaluation.cost - fitted.evaluation.cost
    values = {p.name: p.value for p in parameters}
    # An error beyond what is ordinary comes on top of an ordinary one, and only their sum is seen
    ordinary = {p.name: p.prior_std for p in ideal.fitted.problem.bench.parameters.free}
    stds = {p.name: float(np.sqrt(loose * p.std**2 + ordinary.get(p.name, 0.0) ** 2)) for p in parameters}
    return tuple(finding(t, values, stds, gain, ideal.scores.holdout, after) for t in found)


def _errors(before: float | None, after: float | None) -> str:
    def number(value: float | None) -> str:
        return "not known" if value is None else f"{value:.3g}"

    return f"Held-out error {number(before)} before, {number(after)} after (1 is a perfect model)."


def _pushed(ideal: Ideal, search: _Search, notify: Notify) -> Explained | None:
    """The session without the seconds in which something pushed; None where nothing did, or more is wrong."""
    squares = [float(np.mean(run.residual**2)) for run in search.evaluation.runs]
    if search.whole or max(squares) < UNEVEN * float(np.median(squares)):
        return None
    notify("search: a push", 0.05)
    event = find_event(search.here, search.evaluation)
    if event is None:
        return None
    mass = mass_of(search.here, search.evaluation)
    at = replace(search.evaluation, point=event.point)
    told = push_finding(search.here, at, ideal.fitted.rest, mass, event)
    if told is None:
        return None
    push, start, end = told
    parts = tuple(part for run in search.problem.runs for part in _without(run, event, start, end))
    whole = replace(search.problem, runs=parts)
    fitted = fit_whole(ideal.fitted, whole, search.here, event.point)
    after, verdict = judged(fitted)
    if verdict.verdict != "none":
        return None
    evidence = {
        "log_likelihood_gain": float(ideal.fitted.evaluation.cost - fitted.evaluation.cost),
        "holdout_error_before": ideal.scores.holdout,
        "holdout_error_after": after.holdout,
    }
    text = f"Outside the push every residual is noise. {_errors(ideal.scores.holdout, after.holdout)}"
    return Explained(fitted, Mismatch("explained", text, (replace(push, evidence=evidence),), ()), ideal)


def _without(run: Run, event: Event, start: float, end: float) -> list[Run]:
    """A run's stretches before and after a push, where they are long enough to say something."""
    if run.recording.name != event.recording:
        return [run]
    step = run.grid.step
    a = round((start - MARGIN - run.offset) / step)
    b = round((end + MARGIN - run.offset) / step)
    out = []
    if a * step > 1.0:
        out.append(run.between(0, a))
    if (run.grid.nodes - 1 - b) * step > 1.0:
        out.append(run.between(b, run.grid.nodes - 1))
    return out


def _unexplained(ideal: Ideal, search: _Search, best: Explained | None, notify: Notify) -> Explained:
    """What is told where something is left: named effects only where they take nearly all of it away."""
    convincing = bool(search.found) and search.share > CONVINCING and misfit(search.evaluation) < EXPLAINED**2
    ideal = with_pieces(ideal, notify)
    notify("search: the missing wrench", 0.95)
    unknown = _unknown(ideal, search)
    if convincing and best is None:
        best = _whole(ideal, search)
    if convincing and best is not None:
        kept: tuple[Finding, ...] = best.mismatch.findings
        fitted, explanation, rivals = best.fitted, best.mismatch.explanation, best.mismatch.alternatives
    else:
        kept, fitted, explanation = (), ideal.fitted, ideal.mismatch.explanation
        partly: list[dict[str, object]] = [
            {"effect": t.candidate.effect, "where": dict(t.candidate.where), "log_likelihood_gap": 0.0}
            for t in search.found
        ]
        rivals = (*partly, *search.rivals)
        if partly:
            named = ", ".join(str(p["effect"]) for p in partly)
            explanation += f" {named} would take away a part of it, which does not convince."
    before = ideal.scores.holdout
    evidence = {"log_likelihood_gain": 0.0, "holdout_error_before": before, "holdout_error_after": before}
    findings = kept if unknown is None else (*kept, replace(unknown, evidence=evidence))
    return Explained(fitted, Mismatch("unexplained", explanation, findings, tuple(rivals)), ideal)


def _unknown(ideal: Ideal, search: _Search) -> Finding | None:
    """A stand-in for what is left, seen in short pieces."""
    here, evaluation = search.here, search.evaluation
    if search.whole:
        point = evaluation.point
        here, start = in_pieces(here, point.theta, ideal.fitted.rest, point.rest_guesses)
        again = evaluate(here, replace(start, starts=settled_starts(here, start)))
        if again is None:
            return None
        evaluation = again
    return unknown_finding(here, evaluation, ideal.fitted.rest, mass_of(here, evaluation), search.liar)
