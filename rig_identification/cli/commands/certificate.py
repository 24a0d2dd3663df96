"""Write a certificate: the ten numbers with their uncertainty budget by source.

Takes a result.json of identify (or the folder with it), or a session, which is then identified first. Writes
DIR/certificate.json and DIR/certificate.html, with --pdf DIR/certificate.pdf as well, with --dcc
DIR/certificate.xml, all or none. The budget has a row for each channel, each tolerance of the rig
description, and for other explanations of the recordings; the rows add up to the variance of each number.
Where the rig description says at which points a vehicle's wheels touch the ground (vehicle), the height of
the centre of mass, axle shares and radii of gyration stand beside it.

  rig-identification certificate answer/result.json --out certified --pdf
  rig-identification certificate session --out certified
  rig-identification certificate answer/result.json --out certified --dcc lab.yaml
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.cli.commands.identify import answered
from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.progress import StageProgress
from rig_identification.cli.session_options import add_session_options

if TYPE_CHECKING:
    from rig_identification.laboratory import Laboratory
    from rig_identification.report.certificate import Certificate

DOCUMENT, PAGE, PRINT = "certificate.json", "certificate.html", "certificate.pdf"
DIGITAL = "certificate.xml"
RESULT = "result.json"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the result or the session, and where to write."""
    add_session_options(parser, metavar="RESULT_OR_SESSION", what="result.json, or a session")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help=f"folder for {DOCUMENT} and {PAGE}"
    )
    parser.add_argument("--pdf", action="store_true", help=f"write {PRINT} as well; needs the extra 'pdf'")
    parser.add_argument(
        "--dcc",
        type=Path,
        metavar="LAB.yaml",
        help=f"write {DIGITAL} as well, a digital calibration certificate of PTB; "
        "LAB.yaml names laboratory, customer and body",
    )


def run(arguments: argparse.Namespace) -> None:
    """Read or identify, certify, write."""
    from rig_identification.report.certificate import certificate_of
    from rig_identification.report.certificate_pdf import check_pdf
    from rig_identification.session.laboratory_description import read_laboratory

    wanted = [(PRINT, arguments.pdf), (DIGITAL, arguments.dcc)]
    check_output_folder(arguments.out, (DOCUMENT, PAGE, *(name for name, asked in wanted if asked)))
    if arguments.pdf:
        check_pdf()
    laboratory = read_laboratory(arguments.dcc) if arguments.dcc else None
    document, where = document_of(arguments)
    certificate = certificate_of(document, where)
    _write(certificate, arguments.out, pdf=arguments.pdf, laboratory=laboratory)
    print(f"certificate: {arguments.out / (PRINT if arguments.pdf else PAGE)}")


def document_of(arguments: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """The result to certify, read or made, and what messages call it. Raises InputError."""
    from rig_identification.report.certificate import read_result

    path: Path = arguments.session
    if path.suffix == ".json":
        return read_result(path), str(path)
    if (path / RESULT).is_file() and not (path / "session.yaml").is_file():
        return read_result(path / RESULT), str(path / RESULT)
    return identified(arguments), str(path)


def identified(arguments: argparse.Namespace) -> dict[str, Any]:
    """The result of a session, identified now."""
    with StageProgress(sys.stderr) as progress:
        topics = dict(arguments.topic)
        return answered(arguments.session, arguments.namespace, topics, progress).to_dict()


def _write(certificate: Certificate, out: Path, *, pdf: bool, laboratory: Laboratory | None) -> None:
    from rig_identification.report.certificate import write_certificate
    from rig_identification.report.certificate_dcc import write_certificate_dcc
    from rig_identification.report.certificate_page import write_certificate_page
    from rig_identification.report.certificate_pdf import write_certificate_pdf

    writers = {
        DOCUMENT: lambda path: write_certificate(certificate, path),
        PAGE: lambda path: write_certificate_page(certificate, path),
    }
    if pdf:
        writers[PRINT] = lambda path: write_certificate_pdf(certificate, path)
    if laboratory is not None:
        writers[DIGITAL] = lambda path: write_certificate_dcc(certificate, laboratory, path)
    write_together(out, writers)
