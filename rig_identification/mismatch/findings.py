"""A fitted hypothesis in the words of the recording contract."""

from __future__ import annotations

from rig_identification.mismatch.search import Trial
from rig_identification.result import Finding


def finding(
    trial: Trial,
    values: dict[str, float],
    stds: dict[str, float],
    gain: float,
    before: float | None,
    after: float | None,
) -> Finding:
    """The finding that a trial's effect amounts to.

    values, stds: of all parameters of the whole fit by name. gain: nats. before, after: held-out errors.
    """
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
