"""A fitted hypothesis in the words of the recording contract."""

from __future__ import annotations

from rig_identification.estimate.identify import parameter_estimates
from rig_identification.mismatch.candidate import Told
from rig_identification.mismatch.experiments import experiment_for
from rig_identification.mismatch.trial import Trial
from rig_identification.result import Finding


def finding(
    trial: Trial,
    values: dict[str, float],
    stds: dict[str, float],
    evidence: dict[str, float | None],
) -> Finding:
    """The finding that a trial's effect amounts to.

    values, stds: of all parameters of the whole fit by name. evidence: see explained.evidence_of.
    """
    candidate = trial.candidate
    told = candidate.told(values, stds)
    first = next(iter(told.values()))
    shown = f"{first[0]:.4g} ± {first[1]:.2g}" + ("" if first[2] == "1" else f" {first[2]}")
    where = dict(candidate.where)
    for place in (f"{candidate.effect}.point", f"{candidate.effect}.position"):
        if f"{place}.x" in values:
            where["position"] = [float(values[f"{place}.{a}"]) for a in "xyz"]
    if candidate.effect == "imu_misalignment":
        where["axis"] = max("xyz", key=lambda a: abs(told[f"angle_{a}"][0]))
    sentence = candidate.sentence.format(value=shown, channel=where.get("channel"))
    return Finding(
        candidate.effect,
        where,
        written(told),
        dict(evidence),
        f"{sentence} {candidate.advice}",
    )


def rival(trial: Trial, gap: float) -> dict[str, object]:
    """An entry of ``alternatives``: a hypothesis that trails what is told by ``gap`` nats."""
    estimates = parameter_estimates(trial.problem, trial.evaluation)
    values, stds = {p.name: p.value for p in estimates}, {p.name: p.std for p in estimates}
    return {
        "effect": trial.candidate.effect,
        "where": dict(trial.candidate.where),
        "log_likelihood_gap": float(gap),
        "parameters": written(trial.candidate.told(values, stds)),
        "experiment": experiment_for(trial.candidate.effect),
    }


def written(told: Told) -> dict[str, dict[str, object]]:
    """Values with their std and unit as ``result.json`` has them."""
    return {name: {"value": float(v), "std": float(s), "unit": unit} for name, (v, s, unit) in told.items()}
