"""Linear acceleration in place of specific force: the driver has taken gravity out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, Reading, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.trajectory import rotation
from rig_identification.examination import SetupFault
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: An accelerometer that reads less than this share of gravity at rest does not feel it.
NOTHING = 0.2
#: m/s^2: so noisy an accelerometer tells nothing.
DEAF = 1e3


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Gravity put back by the attitude that the other devices tell."""
    rig = evidence.session.rig
    about = frozenset(["imu.accelerometer"])
    if rig.imu is None or evidence.bound(about) <= 0.0:
        return
    account = evidence.without(about)
    if account.rest is None:
        return
    still = evidence.session.at_rest[0].values.get("imu")
    if still is None or not np.linalg.norm(still[0, 3:]) < NOTHING * rig.gravity:
        return
    R_imu = rotation(rig.imu)
    at_rest = account.rest.expected[0]["imu"][None]
    missing: dict[str, Array] = {r.name: at_rest for r in evidence.session.recordings}
    yield Hypothesis(Change({"imu": _with(missing)}), _describe_level, about, variants=2)
    for run, motion in zip(evidence.session.runs, account.motions, strict=False):
        missing = {**missing, run.name: rig.gravity * motion.trajectory.R[:, 2] @ R_imu}
    silent = Change({"imu": _silent}, rig=_deaf)
    yield Hypothesis(
        Change({"imu": _with(missing)}), _describe, about, variants=2, fitted=lambda rest: silent
    )


def _with(missing: Mapping[str, Array]) -> Reading:
    """Specific force with what is missing put back, where it is known at every instant."""

    def right(values: Array, name: str) -> Array:
        out: Array = np.array(values)
        add = missing.get(name)
        if add is not None and len(add) in (1, len(out)):
            out[:, 3:] += add
        return out

    return right


def _describe_level(rest: RestFit | None) -> SetupFault:
    return fault(
        "axes",
        {"channel": "imu", "part": "accelerometer", "kind": "gravity_removed"},
        {},
        "The accelerometer reads about 0 at rest: its reading there has been taken off as if it were a bias.",
        "Publish the raw specific force, +9.81 m/s^2 upwards at rest, and zero the accelerometer by no more "
        "than its bias.",
    )


def _describe(rest: RestFit | None) -> SetupFault:
    return fault(
        "axes",
        {"channel": "imu", "part": "accelerometer", "kind": "gravity_removed"},
        {},
        "The accelerometer reads about 0 at rest: the driver has taken gravity out of its readings.",
        "Publish the raw specific force, +9.81 m/s^2 upwards at rest. Until then it is left out: gravity "
        "was taken out by an attitude that the driver guessed.",
        corrected=False,
    )


def _silent(values: Array, name: str) -> Array:
    out: Array = np.array(values)
    out[:, 3:] = np.where(np.isfinite(out[:, 3:]), 0.0, np.nan)
    return out


def _deaf(rig: Rig) -> Rig:
    return replace(rig, noise={**rig.noise, "specific_force": DEAF})
