"""The thesis, rerun: its case studies simulated, and four estimators side by side on each of them."""

from rig_identification.thesis_rerun.comparison import Comparison, compare, signed_error, worst_percent
from rig_identification.thesis_rerun.integration import IntegratedPose
from rig_identification.thesis_rerun.motion import CaseMotion, fly_case
from rig_identification.thesis_rerun.oddities import GIVEN_BACK, points_apart
from rig_identification.thesis_rerun.patient import Examination
from rig_identification.thesis_rerun.rerun import CaseResult, Rerun, Trace, rerun, rerun_case

__all__ = [
    "GIVEN_BACK",
    "CaseMotion",
    "CaseResult",
    "Comparison",
    "Examination",
    "IntegratedPose",
    "Rerun",
    "Trace",
    "compare",
    "fly_case",
    "points_apart",
    "rerun",
    "rerun_case",
    "signed_error",
    "worst_percent",
]
