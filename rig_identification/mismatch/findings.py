"""A fitted hypothesis in the words of the recording contract."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import Estimates, estimates
from rig_identification.estimate.parameters import AXES
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.mismatch.experiments import experiment_for
from rig_identification.mismatch.trial import Trial
from rig_identification.quantity import plain_figure, with_interval
from rig_identification.result import Finding, Mismatch

Array = NDArray[np.float64]


def effects_of(findings: Sequence[Finding]) -> str:
    """Effects by name, each once; what the contract's table has no word for, by its law and where it is."""
    return ", ".join(dict.fromkeys(called(f.effect, f.where) for f in findings))


def called(effect: str, where: Mapping[str, object]) -> str:
    """An effect by name; what the contract's table has no word for, by its law and where it is."""
    channel, law = where.get("channel"), where.get("law")
    if effect != "unknown":
        return effect
    if not channel:
        return effect if law is None else str(law)
    return f"what bends {channel}" if law is None else f"a {law} of {channel}"


def finding(
    trial: Trial,
    found: Estimates,
    evidence: dict[str, float | None],
) -> Finding:
    """The finding that a trial's effect amounts to.

    found: all parameters of the whole fit. evidence: see explained.evidence_of.
    """
    candidate = trial.candidate
    told = candidate.told(found)
    shown = {name: with_interval(value, std, unit) for name, (value, std, unit) in told.items()}
    where = dict(candidate.where)
    for place in (f"{candidate.effect}.point", f"{candidate.effect}.position"):
        if f"{place}.x" in found.values:
            where["position"] = [found.values[f"{place}.{a}"] for a in "xyz"]
    if candidate.effect == "imu_misalignment":
        where["axis"] = max("xyz", key=lambda a: abs(told[f"angle_{a}"][0]))
    first = next(iter(shown.values()))
    sentence = candidate.sentence.format(value=first, channel=where.get("channel"), told=shown)
    return Finding(
        candidate.effect,
        where,
        written(told),
        dict(evidence),
        f"{sentence} {candidate.advice}",
        numbers=_numbers(candidate, found),
    )


#: Of what is told of readings before anything is fitted.
NO_EVIDENCE: dict[str, float | None] = {
    "log_likelihood_gain": None,
    "holdout_error_before": None,
    "holdout_error_after": None,
}


def with_mended(mismatch: Mismatch, found: Sequence[Finding], so: str) -> Mismatch:
    """The mismatch with what was ``found`` in readings and mended before anything was fitted.

    so: how it was mended, as in "with ... every residual is noise".
    """
    if not found:
        return mismatch
    verdict, text = mismatch.verdict, mismatch.explanation
    if verdict == "none":
        verdict, text = "explained", f"With {so}, {text[:1].lower()}{text[1:]}"
    return replace(mismatch, verdict=verdict, explanation=text, findings=(*mismatch.findings, *found))


def rival(trial: Trial, gap: float) -> dict[str, object]:
    """An entry of ``alternatives``: a hypothesis that trails what is told by ``gap`` nats."""
    found = estimates(trial.problem, trial.evaluation)
    return {
        "effect": trial.candidate.effect,
        "where": dict(trial.candidate.where),
        "log_likelihood_gap": float(gap),
        "parameters": written(trial.candidate.told(found)),
        "experiment": experiment_for(trial.candidate.kind),
        "numbers": _numbers(trial.candidate, found),
    }


def _numbers(candidate: Candidate, found: Estimates) -> dict[str, tuple[float, float]]:
    """A hypothesis' parameters in the model, each with its std."""
    return {q.name: found.of(q.name) for q in candidate.parameters if q.name in found.values}


def written(told: Told) -> dict[str, dict[str, object]]:
    """Values with their std and unit as ``result.json`` has them."""
    return {name: {"value": float(v), "std": float(s), "unit": unit} for name, (v, s, unit) in told.items()}


def pushed(
    recording: str, start: float, end: float, force: Array, stds: Array, point: Array, beside: str = ""
) -> Finding:
    """A push from outside, without evidence.

    start, end: s after the recording's start. force, stds: (3,) N at the peak, world. point: (3,) m, body.
    beside: what else is to be said of it, a sentence and a space.
    """
    axis = int(np.argmax(np.abs(force)))
    where: dict[str, object] = {
        "channel": None,
        "axis": AXES[axis],
        "position": [float(v) for v in point],
        "times": [{"recording": recording, "start": round(start, 3), "end": round(end, 3)}],
    }
    peaks = {"peak_force": (float(force[axis]), float(stds[axis]), "N")}
    peaks |= {f"peak_force_{a}": (float(force[i]), float(stds[i]), "N") for i, a in enumerate(AXES)}
    size = float(np.linalg.norm(force))
    text = (
        f"Something pushes the body from {start:.2f} to {end:.2f} s of {recording}, with up to "
        f"{plain_figure(size)} N, mostly along {AXES[axis]}: a hand, a gust, a hose that catches. "
        f"{beside}These seconds are left out of the fit. Keep people and draughts away from the rig, or cut "
        "the recording there."
    )
    return Finding("external_force", where, written(peaks), {}, text)
