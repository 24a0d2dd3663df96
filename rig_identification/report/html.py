"""``report.html``: one self-contained page for a lab engineer (ADR 0003)."""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from rig_identification import __version__
from rig_identification.recording import Session
from rig_identification.report.channels import finite_channels, recording_views
from rig_identification.report.determined import determinations, sensors_used
from rig_identification.report.do_next import next_steps
from rig_identification.report.doubts import doubt_groups
from rig_identification.report.findings import alternative_views, finding_views, placed_findings, shifts
from rig_identification.report.grades import grade
from rig_identification.report.identity import digest, recorded_on
from rig_identification.report.lights import lights
from rig_identification.report.narrower import narrower
from rig_identification.report.page import page_environment, script, vendored
from rig_identification.report.replay import replay_json
from rig_identification.report.residual_views import rms_table, whiteness_views
from rig_identification.report.rig_drawing import HEIGHT, WIDTH, picture_svg, rig_svgs
from rig_identification.report.rig_scene import rig_scene
from rig_identification.report.samples import samples_json
from rig_identification.report.setup import faulty_parts, setup_view
from rig_identification.report.ten_numbers import blocks
from rig_identification.report.textbook import textbook_views
from rig_identification.report.to_copy import to_copy
from rig_identification.report.vehicle import vehicle_view
from rig_identification.result import Identification

#: How the topic of a simulation's truth ends (recording contract).
TRUTH = "ground_truth/odometry"
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
    environment, style = page_environment()
    return environment.get_template("report.html.j2").render(
        style=style,
        version=__version__,
        scripts=script(environment, "to_copy.js", "explore.js", "replay.js"),
        library=vendored("uplot", "uPlot.iife.min.js"),
        library_style=vendored("uplot", "uPlot.min.css"),
        **_chapters(identification, session),
    )


def write_report(identification: Identification, session: Session, path: Path) -> None:
    """Write :func:`render_report` to a file."""
    path.write_text(render_report(identification, session), encoding="utf-8")


def _chapters(identification: Identification, session: Session) -> dict[str, object]:
    roles = {r.name: "at rest" if r.kind == "static" else ROLES[r.holdout] for r in session.recordings}
    channels, lost = finite_channels(identification.channels)
    recordings = recording_views(channels, roles)
    names = [view.name for view in recordings]
    examination = identification.examination
    faults = () if examination is None else examination.faults
    findings = identification.mismatch.findings
    faulty = faulty_parts((*faults, *findings), session.rig)
    spots = placed_findings(findings)
    scene = rig_scene(session.rig, identification.total, faulty, spots)
    ten = blocks(identification)
    told = frozenset[str]() if examination is None else frozenset(examination.warnings)
    return {
        "session": session,
        "identification": identification,
        "roles": roles,
        "notes": (*(note for note in identification.notes if note not in told), *lost),
        "setup": None if examination is None else setup_view(examination),
        "recorded": recorded_on(session),
        "digest": digest(session),
        "marked": ", ".join(sorted(scene.marked | {name for name, _ in scene.spots})),
        "lights": lights(identification),
        "steps": next_steps(identification, session),
        "narrower": narrower(identification),
        "grade": grade,
        "textbook": textbook_views(identification),
        "vehicle": vehicle_view(identification, wheels=session.rig.vehicle is not None),
        "blocks": ten,
        "principal": any(block.principal for block in ten),
        "truths": {q.topic for r in session.recordings for q in r.quality if q.topic.endswith(TRUTH)},
        "poses": Markup(replay_json(session.rig, identification.total, identification.motions)),
        "played": list(dict.fromkeys(motion.recording for motion in identification.motions)),
        "drawing": (WIDTH, HEIGHT),
        "recordings": recordings,
        "runs": list(dict.fromkeys(c.recording for c in channels if len(c.time) > 1)),
        "samples": Markup(samples_json(channels)),
        "rms_rows": rms_table(channels, names),
        "whiteness": [(v, whiteness_views(channels, v.name)) for v in recordings if v.role != "at rest"],
        "findings": finding_views(identification.mismatch, len(faults)),
        "alternatives": alternative_views(identification.mismatch),
        "shifts": shifts(identification),
        "determinations": determinations(identification, session),
        "sensors": sensors_used(session),
        "copy": to_copy(identification, session),
        "doubts": doubt_groups(identification.parameters),
        "picture": Markup(picture_svg(scene)),
        "views": [(name, Markup(svg)) for name, svg in rig_svgs(scene)],
    }
