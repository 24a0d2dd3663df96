"""Say within seconds what was set up wrongly: units, axes, wiring, stamps, topics.

Nothing is fitted. Each fault is told with what to change in driver, description or wiring. identify begins
with the same check, corrects what is certain, and tells the rest. With --out it writes DIR/check.json and
DIR/check.html, a page with a drawing of the rig, both or neither. Faults are results: the exit status is 0.

  rig-identification check session
  rig-identification check session --out checked
  rig-identification check session --json | jq .faults
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.progress import StageProgress
from rig_identification.cli.session_options import add_session_options, read_recorded, watched
from rig_identification.errors import InputError

if TYPE_CHECKING:
    from rig_identification.examination import Examination
    from rig_identification.raw import RawSession
    from rig_identification.rig import Rig

DOCUMENT, PAGE = "check.json", "check.html"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the session, what its topics are called, and where to write."""
    add_session_options(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help=f"folder for {DOCUMENT} and {PAGE}")
    parser.add_argument("--json", action="store_true", help="print the examination as JSON and nothing else")


def run(arguments: argparse.Namespace) -> None:
    """Read, examine, write, and print."""
    from rig_identification.report.examination_json import examination_text

    out: Path | None = arguments.out
    if out is not None:
        check_output_folder(out, (DOCUMENT, PAGE))
    with StageProgress(sys.stderr) as progress:
        raw = read_recorded(arguments.session, arguments.namespace, dict(arguments.topic), progress)
        examination = examined(raw, progress)
        if out is not None:
            _write(examination, raw.rig, out)
    if arguments.json:
        print(examination_text(examination))
        return
    from rig_identification.cli.checked import print_examination

    print_examination(examination, sys.stdout)
    if out is not None:
        print(f"page: {out / PAGE}")


def examined(raw: RawSession, progress: StageProgress) -> Examination:
    """The examination of a session, with a warning where ``identify`` will refuse what is left of it.

    Raises
    ------
    InputError
        The session cannot be used, and no fault that was found says why.
    """
    from rig_identification.check.examine import examine
    from rig_identification.session import clean

    found = examine(raw, watched(progress))
    try:
        clean(found.session)
    except InputError as error:
        if not found.examination.faults:
            raise
        refused = f"identify cannot use the session as it is: {error}."
        return replace(found.examination, warnings=(*found.examination.warnings, refused))
    return found.examination


def _write(examination: Examination, rig: Rig, out: Path) -> None:
    from rig_identification.report import write_check, write_examination

    write_together(
        out,
        {
            DOCUMENT: lambda path: write_examination(examination, path),
            PAGE: lambda path: write_check(examination, rig, path),
        },
    )
