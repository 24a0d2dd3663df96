"""What a session's identification looks like to other tools (JSON) and to people (one HTML page)."""

from rig_identification.report.check_page import render_check, write_check
from rig_identification.report.examination_json import (
    examination_text,
    examination_to_dict,
    write_examination,
)
from rig_identification.report.html import render_report, write_report
from rig_identification.report.identity import provenance
from rig_identification.report.result_json import result_to_dict, write_result

__all__ = [
    "examination_text",
    "examination_to_dict",
    "provenance",
    "render_check",
    "render_report",
    "result_to_dict",
    "write_check",
    "write_examination",
    "write_report",
    "write_result",
]
