"""What a session's identification looks like to other tools (JSON) and to people (one HTML page)."""

from rig_identification.report.html import render_report, write_report
from rig_identification.report.result_json import result_to_dict, write_result

__all__ = ["render_report", "result_to_dict", "write_report", "write_result"]
