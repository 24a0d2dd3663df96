"""The session with what was left out in the model: located, named, fitted, judged on held-out runs, told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import ORDINARY, Ideal, parameter_estimates, scores
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, excess
from rig_identification.estimate.verdict import judge
from rig_identification.estimate.whole import fit_whole
from rig_identification.mismatch.findings import finding
from rig_identification.mismatch.locate import Event, find_event
from rig_identification.mismatch.screen import carried, extended, with_reference
from rig_identification.mismatch.search import MOST_EFFECTS, Trial, adopted, catalogue, mass_of, trials
from rig_identification.mismatch.unknown import push_finding, unknown_finding
from rig_identification.result import Finding, Mismatch

Notify = Callable[[str, float], None]

#: Mean square of whitened residuals up to which short pieces count as explained.
EXPLAINED = 1.3
#: Share of the excess that named effects must take away to be told where something is left.
CONVINCING = 0.95
#: How uneven pieces must be (worst over median mean square) for an event to be looked for.
UNEVEN = 4.0
#: What is cut off on either side of a push, s.
MARGIN = 0.15


@dataclass(frozen=True)
class Explained:
    """A fit with effects in it."""

    fitted: Fitted
    mismatch: Mismatch


@dataclass
class _Search:
    """Where a search stands."""

    problem: Problem  # whole runs, ideal model
    here: Problem  # what hypotheses are tried on
    evaluation: Evaluation
    found: list[Trial] = field(default_factory=list)
    rivals: list[dict[str, object]] = field(default_factory=list)
    liar: str | None = None


def explain(found_ideal: Ideal, notify: Notify) -> Explained | None:
    """Search for what the ideal model leaves out; None where nothing is found.

    Where the ideal model fails the search looks at short pieces.
    """
    if found_ideal.pieces is None or found_ideal.careful is None:
        # Every residual is noise: what hides within it is no finding
        return None
    ideal = found_ideal.fitted
    problem = with_reference(ideal.problem, ideal.rest)
    here = with_reference(found_ideal.pieces, ideal.rest)
    evaluation = evaluate(here, found_ideal.careful[1].point)
    if evaluation is None:
        return None
    search = _Search(problem, here, evaluation)
    pushed = _pushed(ideal, search, notify)
    if pushed is not None:
        return pushed
    start = excess(search.evaluation)
    best = _named(ideal, search, notify)
    if best is not None and best.mismatch.verdict == "explained":
        return best
    return _unexplained(ideal, search, best, start, notify)


def _named(ideal: Fitted, search: _Search, notify: Notify) -> Explained | None:
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
        search.rivals += [
            {
                "effect": t.candidate.effect,
                "where": dict(t.candidate.where),
                "log_likelihood_gap": float(first.evidence - t.evidence),
                "experiment": t.candidate.experiment or first.candidate.experiment,
            }
            for t in tried.done[1:]
        ]
        search.here, search.evaluation = adopted(search.here, search.evaluation, first)
        if misfit(search.evaluation) > EXPLAINED:
            # Something large is left: there is no use yet in whole runs
            continue
        notify("search: whole runs with " + ", ".join(t.candidate.label for t in search.found), at)
        best = _whole(ideal, search)
        if best.mismatch.verdict == "explained":
            break
    return best


def _whole(ideal: Fitted, search: _Search) -> Explained:
    whole = extended(search.problem, tuple(t.candidate for t in search.found))
    known = search.evaluation.point
    point = replace(known, theta=carried(whole, search.here, known).theta)
    fitted = fit_whole(ideal, whole, search.here, point)
    return Explained(fitted, _mismatch(ideal, fitted, search))


def _mismatch(ideal: Fitted, fitted: Fitted, search: _Search) -> Mismatch:
    before, after = scores(ideal), scores(fitted)
    parameters = parameter_estimates(fitted.problem, fitted.evaluation)
    judged = judge(fitted, parameters, after.holdout, after.training, ORDINARY)
    gain = ideal.evaluation.cost - fitted.evaluation.cost
    values = {p.name: p.value for p in parameters}
    # An error beyond what is ordinary comes on top of an ordinary one, and only their sum is seen
    ordinary = {p.name: p.prior_std for p in ideal.problem.bench.parameters.free}
    stds = {p.name: float(np.hypot(p.std, ordinary.get(p.name, 0.0))) for p in parameters}
    findings = tuple(finding(t, values, stds, gain, before.holdout, after.holdout) for t in search.found)
    named = ", ".join(f.effect for f in findings)
    if judged.verdict == "none":
        text = f"With {named} in the model every residual is noise. {_errors(before.holdout, after.holdout)}"
        return Mismatch("explained", text, findings, tuple(search.rivals))
    text = f"{named} explains part of it; something is left. {judged.explanation}"
    return Mismatch("unexplained", text, findings, tuple(search.rivals))


def _errors(before: float | None, after: float | None) -> str:
    def number(value: float | None) -> str:
        return "not known" if value is None else f"{value:.3g}"

    return f"Held-out error {number(before)} before, {number(after)} after (1 is a perfect model)."


def _pushed(ideal: Fitted, search: _Search, notify: Notify) -> Explained | None:
    """The session without the seconds in which something pushed; None where nothing did, or more is wrong."""
    squares = [float(np.mean(run.residual**2)) for run in search.evaluation.runs]
    if max(squares) < UNEVEN * float(np.median(squares)):
        return None
    notify("search: a push", 0.05)
    event = find_event(search.here, search.evaluation)
    if event is None:
        return None
    mass = mass_of(search.here, search.evaluation)
    at = replace(search.evaluation, point=event.point)
    told = push_finding(search.here, at, ideal.rest, mass, event)
    if told is None:
        return None
    push, start, end = told
    parts = tuple(part for run in search.problem.runs for part in _without(run, event, start, end))
    whole = replace(search.problem, runs=parts)
    fitted = fit_whole(ideal, whole, search.here, event.point)
    before, after = scores(ideal), scores(fitted)
    parameters = parameter_estimates(fitted.problem, fitted.evaluation)
    judged = judge(fitted, parameters, after.holdout, after.training, ORDINARY)
    if judged.verdict != "none":
        return None
    evidence = {
        "log_likelihood_gain": float(ideal.evaluation.cost - fitted.evaluation.cost),
        "holdout_error_before": before.holdout,
        "holdout_error_after": after.holdout,
    }
    text = f"Outside the push every residual is noise. {_errors(before.holdout, after.holdout)}"
    return Explained(fitted, Mismatch("explained", text, (replace(push, evidence=evidence),), ()))


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


def _unexplained(
    ideal: Fitted, search: _Search, best: Explained | None, start: float, notify: Notify
) -> Explained | None:
    """What is told where something is left: named effects only where they take nearly all of it away."""
    share = 1.0 - excess(search.evaluation) / max(start, 1.0)
    convincing = bool(search.found) and share > CONVINCING and misfit(search.evaluation) < EXPLAINED**2
    notify("search: the missing wrench", 0.95)
    mass = mass_of(search.here, search.evaluation)
    unknown = unknown_finding(search.here, search.evaluation, ideal.rest, mass, search.liar)
    if convincing and best is None:
        best = _whole(ideal, search)
    if convincing and best is not None:
        kept: tuple[Finding, ...] = best.mismatch.findings
        fitted, explanation, rivals = best.fitted, best.mismatch.explanation, best.mismatch.alternatives
    else:
        kept, fitted = (), ideal
        partly: list[dict[str, object]] = [
            {"effect": t.candidate.effect, "where": dict(t.candidate.where), "log_likelihood_gap": 0.0}
            for t in search.found
        ]
        rivals = (*partly, *search.rivals)
        found = scores(ideal)
        explanation = judge(
            ideal,
            parameter_estimates(ideal.problem, ideal.evaluation),
            found.holdout,
            found.training,
            ORDINARY,
        ).explanation
        if partly:
            named = ", ".join(str(p["effect"]) for p in partly)
            explanation += (
                f" {named} would take away {100 * max(share, 0.0):.0f} % of it, which does not convince."
            )
    if unknown is None and not kept:
        return None
    before = scores(ideal).holdout
    evidence = {"log_likelihood_gain": 0.0, "holdout_error_before": before, "holdout_error_after": before}
    findings = kept if unknown is None else (*kept, replace(unknown, evidence=evidence))
    return Explained(fitted, Mismatch("unexplained", explanation, findings, tuple(rivals)))
