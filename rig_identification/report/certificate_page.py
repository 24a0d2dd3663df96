"""``certificate.html``: the certificate as one self-contained page, which prints on two sheets."""

from __future__ import annotations

from pathlib import Path

from rig_identification import __version__
from rig_identification.report.certificate import Certificate
from rig_identification.report.certificate_view import (
    REMARKS,
    budget_table,
    correlation_table,
    numbers_table,
    origin_table,
    verdict_sentence,
)
from rig_identification.report.page import page_environment


def render_certificate(certificate: Certificate) -> str:
    """HTML that loads nothing from anywhere."""
    environment, style = page_environment()
    return environment.get_template("certificate.html.j2").render(
        style=style,
        version=__version__,
        session=certificate.provenance.get("session", "session"),
        recorded=certificate.provenance.get("recorded", ""),
        verdict=verdict_sentence(certificate),
        findings=certificate.findings,
        remarks=REMARKS,
        bodies=[
            (body.heading, numbers_table("Values", body.numbers), budget_table(body), correlation_table(body))
            for body in certificate.bodies
        ],
        vehicle=numbers_table("Vehicle", certificate.vehicle) if certificate.vehicle else None,
        origin=origin_table(certificate),
    )


def write_certificate_page(certificate: Certificate, path: Path) -> None:
    """Write :func:`render_certificate` to a file."""
    path.write_text(render_certificate(certificate), encoding="utf-8")
