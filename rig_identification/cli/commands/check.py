"""Say within seconds what was set up wrongly: units, axes, wiring, stamps, topics.

Nothing is fitted. Each fault is told with what to change in driver, description or wiring. identify begins
with the same check, corrects what is certain, and tells the rest. With --out it writes DIR/check.json and
DIR/check.html, a page with a drawing of the rig, both or neither. Faults are results: the exit status is 0,
unless --fail-on fault is given.

  rig-identification check session
  rig-identification check session --out checked
  rig-identification check session --json | jq .faults
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rig_identification.api.checking import DOCUMENT, PAGE
from rig_identification.cli.output import check_output_folder, written
from rig_identification.cli.progress import StageProgress
from rig_identification.cli.session_options import add_session_options, read_recorded, watched
from rig_identification.cli.shown import add_shown_options, progress_stream, status_of

FILES = (DOCUMENT, PAGE)
#: What ``--fail-on`` names where anything was set up wrongly.
FAULT = "fault"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the session, what its topics are called, and where to write."""
    add_session_options(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help=f"folder for {DOCUMENT} and {PAGE}")
    add_shown_options(parser, "the examination", (FAULT,))


def run(arguments: argparse.Namespace) -> int:
    """Read, examine, write, and print."""
    from rig_identification.api import check
    from rig_identification.report.examination_json import examination_text

    out: Path | None = arguments.out
    if out is not None:
        check_output_folder(out, FILES)
    with StageProgress(progress_stream(arguments)) as progress:
        recorded = read_recorded(arguments.session, arguments.namespace, dict(arguments.topic), progress)
        checked = check(recorded, progress=watched(progress))
        if out is not None:
            written(checked, out)
    status = status_of(arguments, "sound" if checked.sound else FAULT)
    if arguments.json:
        print(examination_text(checked.examination))
    elif not arguments.quiet:
        from rig_identification.cli.checked import print_examination

        print_examination(checked.examination, sys.stdout)
        if out is not None:
            print(f"page: {out / PAGE}")
    return status
