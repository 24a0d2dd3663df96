"""The thesis behind this rig: its printed tables, its 18 case studies and its own estimator."""

from rig_identification.thesis.case import Case, Published, load_case, load_cases
from rig_identification.thesis.force import ForceProgram, HarmonicForce, StepForce
from rig_identification.thesis.tables import (
    CASE_NUMBERS,
    read_case_table,
    read_static_table,
    read_text_remarks,
)

__all__ = [
    "CASE_NUMBERS",
    "Case",
    "ForceProgram",
    "HarmonicForce",
    "Published",
    "StepForce",
    "load_case",
    "load_cases",
    "read_case_table",
    "read_static_table",
    "read_text_remarks",
]
