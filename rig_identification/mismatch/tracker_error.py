"""The finding that a tracker reads the body otherwise as it turns."""

from __future__ import annotations

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.pose_error_told import ADVICE, LAW, UNITS, pose_error_text, pose_errors
from rig_identification.mismatch.findings import written
from rig_identification.result import Finding


def tracker_findings(fitted: Fitted, evidence: dict[str, float | None]) -> list[Finding]:
    """One finding where a tracker's error that goes with the pose shows, none elsewhere."""
    errors = pose_errors(fitted)
    if not errors:
        return []
    return [
        Finding(
            "unknown",
            {"channel": "mocap", "axis": None, "law": LAW},
            written({f"{e.quantity}_error": (e.value, e.std, UNITS[e.quantity]) for e in errors}),
            evidence,
            f"{pose_error_text(errors)} {ADVICE}",
        )
    ]
