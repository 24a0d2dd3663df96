"""A plan as files: a page, numbers for programs, a session description, and commands for the exciter."""

from rig_identification.plan_report.document import plan_document, write_plan
from rig_identification.plan_report.page import render_plan, write_plan_page
from rig_identification.plan_report.programme import session_text, write_commands, write_session_text

__all__ = [
    "plan_document",
    "render_plan",
    "session_text",
    "write_commands",
    "write_plan",
    "write_plan_page",
    "write_session_text",
]
