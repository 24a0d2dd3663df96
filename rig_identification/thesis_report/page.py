"""``report.html`` of the rerun: one self-contained page."""

from __future__ import annotations

from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from rig_identification import __version__
from rig_identification.thesis import read_text_remarks
from rig_identification.thesis_report.figures import Figures
from rig_identification.thesis_report.sections import add_sections
from rig_identification.thesis_report.summary import grouped_modes, summary
from rig_identification.thesis_report.table import ELEMENTS, absolute_elements, case_rows, number
from rig_identification.thesis_rerun import Rerun


def write_page(found: Rerun, figures: Figures, seconds: float, path: Path) -> None:
    """Render and write the page, which loads nothing from anywhere."""
    environment = Environment(
        loader=PackageLoader("rig_identification.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = environment.loader.get_source(environment, "style.css")[0] if environment.loader else ""
    environment.filters["number"] = number
    page = environment.get_template("thesis.html.j2").render(
        style=Markup(style),
        version=__version__,
        seconds=seconds,
        elements=ELEMENTS,
        cases=[(result, case_rows(result), absolute_elements(result)) for result in found.cases],
        drawings={
            label: [(caption, Markup(svg)) for caption, svg in drawn]
            for label, drawn in figures.by_case.items()
        },
        summary=summary(found),
        swings=grouped_modes(found.cases),
        searches_apart=max((r.comparison.searches_apart for r in found.cases), default=None),
        chapter_2=found.statics is not None,
        tracking=found.tracking,
        examination=found.examination,
        remarks=read_text_remarks(),
    )
    path.write_text(add_sections(page, environment, found), encoding="utf-8")
