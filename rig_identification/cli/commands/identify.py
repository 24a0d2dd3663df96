"""Estimate mass, centre of mass and inertia from a recorded session.

The set-up is checked first, as ``check`` does: what is certain is corrected and told as a finding.
Writes DIR/result.json and DIR/report.html, both or neither.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.progress import StageProgress
from rig_identification.cli.session_options import add_session_options, read_recorded, watched
from rig_identification.recording import Session
from rig_identification.result import Identification

RESULT, REPORT = "result.json", "report.html"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the session, where to write, and what its topics are called."""
    add_session_options(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for result and report")


def run(arguments: argparse.Namespace) -> None:
    """Read, identify, write, and print the ten numbers."""
    identify_session(arguments.session, arguments.out, arguments.namespace, dict(arguments.topic))


def identify_session(
    path: Path,
    out: Path,
    namespace: str = "/rig",
    topics: dict[str, str] | None = None,
    remark: Callable[[Identification], str] | None = None,
) -> None:
    """Identify the session at ``path`` into the folder ``out`` and print the ten numbers.

    remark: what else there is to say of the answer; printed before the report's name.

    Raises
    ------
    InputError
        The session or the folder cannot be used; the folder is as it was.
    """
    from rig_identification.identification import identify_prepared, prepare

    check_output_folder(out, (RESULT, REPORT))
    with StageProgress(sys.stderr) as progress:
        raw = read_recorded(path, namespace, topics or {}, progress)
        prepared = prepare(raw, watched(progress))
        identification = identify_prepared(prepared, progress)
        progress("writing the report")
        _write(identification, prepared.session, out)
    _print(identification, out, remark)


def _write(identification: Identification, session: Session, out: Path) -> None:
    from rig_identification.report import write_report, write_result

    write_together(
        out,
        {
            RESULT: lambda path: write_result(identification, path),
            REPORT: lambda path: write_report(identification, session, path),
        },
    )


def _print(identification: Identification, out: Path, remark: Callable[[Identification], str] | None) -> None:
    from rig_identification.cli.summary import summary

    print(summary(identification))
    if remark is not None:
        print(remark(identification))
    print(f"report: {out / REPORT}")
