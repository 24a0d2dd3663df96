"""The thesis' rerun for other tools (JSON), for people (one page) and as figures."""

from rig_identification.thesis_report.document import rerun_document, write_json
from rig_identification.thesis_report.figures import Figures, case_figures
from rig_identification.thesis_report.page import write_page
from rig_identification.thesis_report.table import text_table

__all__ = ["Figures", "case_figures", "rerun_document", "text_table", "write_json", "write_page"]
