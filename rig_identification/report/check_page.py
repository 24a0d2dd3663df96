"""``check.html``: the set-up on one self-contained page, with the part at fault marked in the drawing."""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from rig_identification import __version__
from rig_identification.examination import Examination
from rig_identification.report.page import page_environment
from rig_identification.report.rig_drawing import rig_svgs
from rig_identification.report.rig_scene import described_scene
from rig_identification.report.setup import faulty_parts, setup_view
from rig_identification.rig import Rig


def render_check(examination: Examination, rig: Rig) -> str:
    """HTML that loads nothing from anywhere."""
    environment, style = page_environment()
    faulty = faulty_parts(examination.faults, rig)
    return environment.get_template("check.html.j2").render(
        style=style,
        version=__version__,
        session=examination.session,
        setup=setup_view(examination),
        notes=examination.notes,
        faulty=", ".join(sorted(faulty)),
        views=[(name, Markup(svg)) for name, svg in rig_svgs(described_scene(rig, faulty))],
    )


def write_check(examination: Examination, rig: Rig, path: Path) -> None:
    """Write :func:`render_check` to a file."""
    path.write_text(render_check(examination, rig), encoding="utf-8")
