"""``report.html``: one self-contained page for a lab engineer (ADR 0004)."""

from __future__ import annotations

from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from rig_identification import __version__
from rig_identification.recording import Session
from rig_identification.report.channels import finite_channels, recording_views
from rig_identification.report.determined import determinations, sensors_used
from rig_identification.report.doubts import doubt_groups
from rig_identification.report.findings import alternative_views, finding_views, shifts
from rig_identification.report.residual_views import rms_table, whiteness_views
from rig_identification.report.rig_drawing import rig_scene, rig_svgs
from rig_identification.report.ten_numbers import blocks
from rig_identification.result import Identification

ROLES = {True: "held out", False: "fitted"}


def render_report(identification: Identification, session: Session) -> str:
    """Render the page.

    Parameters
    ----------
    identification : Identification
    session : Session
        What was identified; gives roles of the recordings, data quality and the rig.

    Returns
    -------
    str
        HTML that loads nothing from anywhere.
    """
    environment = Environment(
        loader=PackageLoader("rig_identification.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    source = environment.loader.get_source(environment, "style.css")[0] if environment.loader else ""
    return environment.get_template("report.html.j2").render(
        style=Markup(source), version=__version__, **_chapters(identification, session)
    )


def write_report(identification: Identification, session: Session, path: Path) -> None:
    """Write :func:`render_report` to a file."""
    path.write_text(render_report(identification, session), encoding="utf-8")


def _chapters(identification: Identification, session: Session) -> dict[str, object]:
    roles = {r.name: "at rest" if r.kind == "static" else ROLES[r.holdout] for r in session.recordings}
    channels, lost = finite_channels(identification.channels)
    recordings = recording_views(channels, roles)
    names = [view.name for view in recordings]
    return {
        "session": session,
        "identification": identification,
        "roles": roles,
        "notes": (*identification.notes, *lost),
        "blocks": blocks(identification),
        "recordings": recordings,
        "rms_rows": rms_table(channels, names),
        "whiteness": [(v, whiteness_views(channels, v.name)) for v in recordings if v.role != "at rest"],
        "findings": finding_views(identification.mismatch),
        "alternatives": alternative_views(identification.mismatch),
        "shifts": shifts(identification),
        "determinations": determinations(identification, session),
        "sensors": sensors_used(session),
        "doubts": doubt_groups(identification.parameters),
        "views": [
            (name, Markup(svg)) for name, svg in rig_svgs(rig_scene(session.rig, identification.total))
        ],
    }
