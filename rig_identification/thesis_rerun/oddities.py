"""What is peculiar to single cases, measured rather than quoted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.thesis.case import Case
from rig_identification.thesis.tables import read_case_table
from rig_identification.thesis_rerun.comparison import Comparison, signed_error
from rig_identification.thesis_rerun.motion import STEP, CaseMotion
from rig_identification.thesis_rerun.readings import DIAGONAL, Readings, try_readings

Array = NDArray[np.float64]

#: A published error counts as given back within so many percentage points on the diagonal.
GIVEN_BACK = 0.3


def odd_statements(motion: CaseMotion, comparison: Comparison) -> tuple[str, ...]:
    """Sentences for the report."""
    special = {3: _case_3, 6: _case_6, 7: _case_7, 8: _case_8, 12: _case_12}.get(motion.case.number)
    found = [special(motion)] if special else []
    reproduced = given_back(motion, comparison)
    if reproduced is not None:
        found.append(reproduced)
    if motion.least_tension < 0.0:
        found.append(
            f"A cable would have to push with {-motion.least_tension:.0f} N: the thesis' rods do, "
            "ropes would go slack."
        )
    return tuple(found)


def given_back(motion: CaseMotion, comparison: Comparison) -> str | None:
    """How close (a) comes to the published errors; None where none are published."""
    case = motion.case
    apart = points_apart(case, comparison)
    if apart is None:
        return None
    if apart <= GIVEN_BACK:
        return f"(a) gives the published diagonal errors back within {apart:.2f} percentage points."
    miss = f"(a) misses the published diagonal errors by up to {apart:.2f} percentage points."
    readings = try_readings(motion)
    parts = [miss, REASONS.get(case.number, ""), "" if readings is None else _told(readings)]
    return " ".join(part for part in parts if part)


def points_apart(case: Case, comparison: Comparison) -> float | None:
    """Percentage points between the diagonal errors of (a) and the published ones; None: none published."""
    if case.published is None:
        return None
    ours = np.abs(signed_error(case, comparison.tensors["a"]))
    return float(np.max(np.abs(np.diag(ours - case.published.error))))


def _told(readings: Readings) -> str:
    """What the readings that the thesis leaves open make of a miss."""
    low, high = readings.tried.min(axis=0), readings.tried.max(axis=0)
    spans = ", ".join(f"{name} {a:.2f} to {b:.2f}" for name, a, b in zip(DIAGONAL, low, high, strict=True))
    harmonic = "phase and sense of the harmonic force, " if readings.harmonic else ""
    told = (
        f"Under {len(readings.tried)} readings of what is not printed ({harmonic}which sample of moment goes "
        f"with a step, the search's criterion) (a) gives {spans} percent; the nearest single reading is "
        f"{readings.nearest:.2f} points off."
    )
    if readings.outside:
        return (
            f"{told} None of them reaches the published {listed(readings.outside)}, and no reason was found; "
            "the thesis' own samples are not printed."
        )
    return f"{told} Each published element lies in its span: the miss is no larger than what is not printed."


def listed(names: tuple[str, ...]) -> str:
    """Names with commas and an "and"."""
    return " and ".join(part for part in (", ".join(names[:-1]), names[-1]) if part)


#: Why a published figure cannot be had from the published data, beyond what the readings tell.
REASONS = {
    3: "With the force left out of the wrench the yaw equation holds too little for the one-step predictor; "
    "what it makes of Jzz depends on samples that are not published.",
    4: "No force acts in the window, so that leaving it out changes nothing, and free motion determines "
    "every element of noise-free samples; errors of 388 percent need samples other than these.",
    8: "Released at rest from the printed pose the noise-free samples determine every element; the "
    "published errors need another motion. The pose is case 7's at 1.2 s, where the body moves; its "
    "velocity is not printed.",
}


def _case_3(motion: CaseMotion) -> str:
    return (
        "The force is estimated together with the tensor: see the row with the unknown force. "
        "The estimators (a) to (c) leave it out, as the thesis does; (d) in the table has it."
    )


def _case_6(motion: CaseMotion) -> str:
    early = motion.samples((0.1, 25.1))
    late = motion.samples((50.1, 75.1))
    ranges = [np.ptp(motion.center[part], axis=0) for part in (early, late)]
    return (
        "Nothing in the model takes energy away, so the body keeps swinging about the displaced equilibrium: "
        f"the centre of mass covers {1e3 * ranges[0][0]:.0f} and {1e3 * ranges[0][1]:.0f} mm along x and y "
        f"in the first 25 s of constant force, {1e3 * ranges[1][0]:.0f} and {1e3 * ranges[1][1]:.0f} mm in "
        "the last 25 s. That is why the thesis identifies nothing here. The release at 75.1 s still sets it "
        "free, and all four estimators work on what follows."
    )


def _case_7(motion: CaseMotion) -> str:
    quoted = read_case_table(7)["printed"]["quoted_pose"]
    k = round(quoted["time"] / STEP)
    away = float(np.linalg.norm(motion.center[k] - np.array(quoted["center_of_gravity"])))
    turned = float(np.max(np.abs(motion.R_world_body[k].T - np.array(quoted["T"]))))
    return (
        f"At {quoted['time']} s the centre of mass is {1e3 * away:.1f} mm from the quoted pose and T differs "
        f"by at most {turned:.4f}. No identification is published."
    )


def _case_8(motion: CaseMotion) -> str:
    hinges = np.array([cable.body_point for cable in motion.case.rig.cables])
    ceiling = np.array([cable.ceiling_point for cable in motion.case.rig.cables])
    quoted = read_case_table(8)["printed"]
    T = np.array(read_case_table(7)["printed"]["quoted_pose"]["T"])
    center = np.array(quoted["center_of_gravity"])
    spans = center + (hinges - motion.case.center_of_mass) @ T - ceiling
    off = float(np.max(np.abs(np.linalg.norm(spans, axis=1) - quoted["cable_length"])))
    return (
        "The quoted pose, its T taken as world into body, keeps all four cables at their length within "
        f"{1e3 * off:.2f} mm."
    )


def _case_12(motion: CaseMotion) -> str:
    published = read_case_table(12)["published"]
    swapped = np.array(published["original"])
    return (
        "The thesis prints the identified and the true tensor in each other's place; exchanged back, Jxx "
        f"{swapped[0, 0]:.1f} against {motion.case.inertia[0, 0]:.0f} kg m² is the printed "
        f"{published['error'][0][0]} percent."
    )
