"""Estimate mass, centre of mass and inertia from a recorded session.

Writes DIR/result.json and DIR/report.html, both or neither.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.progress import StageProgress
from rig_identification.recording import Session
from rig_identification.result import Identification

RESULT, REPORT = "result.json", "report.html"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the session, where to write, and what its topics are called."""
    parser.add_argument(
        "session", type=Path, metavar="SESSION", help="folder with a session.yaml, or that file"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for result and report")
    parser.add_argument("--namespace", default="/rig", help="namespace of the topics (default: %(default)s)")
    parser.add_argument(
        "--topic",
        type=_mapping,
        action="append",
        default=[],
        metavar="NAME=TOPIC",
        help="a topic of another name: imu/data_raw=/xsens/imu; may be repeated",
    )


def run(arguments: argparse.Namespace) -> None:
    """Read, identify, write, and print the ten numbers."""
    identify_session(arguments.session, arguments.out, arguments.namespace, dict(arguments.topic))


def identify_session(
    path: Path, out: Path, namespace: str = "/rig", topics: dict[str, str] | None = None
) -> None:
    """Identify the session at ``path`` into the folder ``out`` and print the ten numbers.

    Raises
    ------
    InputError
        The session or the folder cannot be used; the folder is as it was.
    """
    check_output_folder(out, (RESULT, REPORT))
    with StageProgress(sys.stderr) as progress:
        session = _read(path, namespace, topics or {}, progress)
        identification = _identify(session, progress)
        progress("writing the report")
        _write(identification, session, out)
    _print(identification, out)


def _read(path: Path, namespace: str, topics: dict[str, str], progress: StageProgress) -> Session:
    from rig_identification.session import read_session

    # Where nobody watches, a session that cannot be read is one line on standard error and no more.
    watched = progress if progress.terminal else None
    return read_session(path, namespace=namespace, topics=topics, progress=watched)


def _identify(session: Session, progress: StageProgress) -> Identification:
    from rig_identification.mismatch import identify

    return identify(session, progress=progress)


def _write(identification: Identification, session: Session, out: Path) -> None:
    from rig_identification.report import write_report, write_result

    write_together(
        out,
        {
            RESULT: lambda path: write_result(identification, path),
            REPORT: lambda path: write_report(identification, session, path),
        },
    )


def _print(identification: Identification, out: Path) -> None:
    from rig_identification.cli.summary import summary

    print(summary(identification))
    print(f"report: {out / REPORT}")


def _mapping(text: str) -> tuple[str, str]:
    name, equals, topic = text.partition("=")
    if not (name and equals and topic):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=TOPIC, as in imu/data_raw=/xsens/imu")
    return name, topic
