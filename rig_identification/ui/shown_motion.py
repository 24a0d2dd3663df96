"""How a simulated body moves: its runs for the drawing that plays them back, and their charts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rig_identification.quantity import significant
from rig_identification.report.replay import replay_json
from rig_identification.result import BodyMotion, InertialEstimate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig_identification.api import Simulated
    from rig_identification.recording import Recording, Series

#: Points of one chart: twice the pixels of a wide one.
MOST_POINTS = 2000


def shown_motion(made: Simulated) -> dict[str, Any]:
    """Poses of the runs, charts by run, and what is to be said of each."""
    runs = [r for r in made.session.recordings if r.kind == "dynamic"]
    known = InertialEstimate(made.values, np.zeros((10, 10)))
    motions = [m for run in runs if (m := _motion(run)) is not None]
    return {
        "poses": replay_json(made.spec.rig, known, motions),
        "played": [motion.recording for motion in motions],
        "charts": {run.name: _charts(run) for run in runs},
        "notes": [_tension_note(name, least) for name, least in made.truth.least_tension.items()],
    }


def _motion(run: Recording) -> BodyMotion | None:
    """Where the body truly is; None where no truth was recorded."""
    truth = run.ground_truth
    if truth is None:
        return None
    return BodyMotion(run.name, truth.time, truth.values[:, :3], truth.values[:, 3:7])


def _charts(run: Recording) -> list[dict[str, Any]]:
    """Force, tensions, rates and accelerations as the devices read them."""
    found = []
    if run.exciter_force is not None:
        found.append(_chart("exciter force", "N", run.exciter_force, ["x", "y", "z"]))
    for name, series in run.tension.items():
        found.append(_chart(f"{name}: tension", "N", series, ["tension"]))
    if run.imu is not None:
        found.append(_chart("angular rate, IMU axes", "rad/s", run.imu, ["x", "y", "z"]))
        found.append(_chart("specific force, IMU axes", "m/s²", run.imu, ["x", "y", "z"], first=3))
    if run.inclination is not None:
        found.append(_chart("inclination", "rad", run.inclination, ["x", "y"]))
    return found


def _chart(label: str, unit: str, series: Series, lines: list[str], first: int = 0) -> dict[str, Any]:
    every = max(1, -(-len(series.time) // MOST_POINTS))
    values = series.values[::every, first : first + len(lines)]
    return {
        "label": label,
        "unit": unit,
        "lines": lines,
        "time": _rounded(series.time[::every]),
        "values": [_rounded(column) for column in values.T],
    }


def _rounded(values: NDArray[np.float64]) -> list[float | None]:
    return [float(f"{v:.6g}") if np.isfinite(v) else None for v in values]


def _tension_note(run: str, least: float) -> str:
    if least <= 0.0:
        return f"{run}: a cable goes slack; pull or shake less where the ideal model is to hold."
    return f"{run}: the least tension of any cable is {significant(least, 3)} N."
