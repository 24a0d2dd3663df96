"""Estimate mass, centre of mass and inertia from a recorded session.

The set-up is checked first, as ``check`` does: what is certain is corrected and told as a finding.
Writes DIR/result.json and DIR/report.html, both or neither. Interrupted (Ctrl-C) once the ideal model is
fitted it writes the best answer until then, marked as interrupted; the exit status is then 130.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TextIO

from rig_identification.api.result import REPORT, RESULT, Result
from rig_identification.cli.output import check_output_folder, written
from rig_identification.cli.progress import StageProgress
from rig_identification.cli.session_options import add_session_options, read_recorded, watched
from rig_identification.cli.shown import add_shown_options, progress_stream, status_of
from rig_identification.model.work import WORK
from rig_identification.result import Identification

VERDICTS = ("explained", "unexplained")


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the session, where to write, and what its topics are called."""
    add_session_options(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for result and report")
    parser.add_argument(
        "--work",
        type=units,
        default=WORK,
        metavar="UNITS",
        help="after so many units of work the search for what the ideal model leaves out begins nothing new; "
        f"default {WORK:g}, about two minutes of two cores",
    )
    add_shown_options(parser, "the result", VERDICTS)


def run(arguments: argparse.Namespace) -> int:
    """Read, identify, write, and print the ten numbers."""
    result = identify_session(
        arguments.session,
        arguments.out,
        arguments.namespace,
        dict(arguments.topic),
        work=arguments.work,
        show=_as_json if arguments.json else _nothing if arguments.quiet else None,
        stream=progress_stream(arguments),
    )
    return status_of(arguments, result.verdict)


def units(text: str) -> float:
    """A number of units of work above none."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text!r} is no number above 0; give units of work")
    return value


def identify_session(
    path: Path,
    out: Path,
    namespace: str = "/rig",
    topics: dict[str, str] | None = None,
    *,
    remark: Callable[[Identification], str] | None = None,
    work: float = WORK,
    show: Callable[[Result], None] | None = None,
    stream: TextIO | None = None,
) -> Result:
    """Identify the session at ``path`` into the folder ``out`` and print the ten numbers.

    remark: what else there is to say of the answer; printed before the report's name.
    show: prints the answer in place of the ten numbers. stream: where progress goes; standard error.

    Raises
    ------
    InputError
        The session or the folder cannot be used; the folder is as it was.
    KeyboardInterrupt
        The user broke it off. Once the ideal model is fitted, the best answer until then is written and
        printed, marked as interrupted; before, the folder is as it was.
    """
    from rig_identification.api import Stopped

    check_output_folder(out, (RESULT, REPORT))
    with StageProgress(stream or sys.stderr) as progress:
        try:
            result = answered(path, namespace, topics or {}, progress, work)
        except Stopped as stopped:
            result = stopped.result
        progress("writing the report")
        written(result, out)
    if show is None:
        _print(result.identification, out, remark)
    else:
        show(result)
    if result.identification.interrupted:
        raise KeyboardInterrupt("interrupted: result and report hold the best answer until then")
    return result


def answered(
    path: Path, namespace: str, topics: dict[str, str], progress: StageProgress, work: float = WORK
) -> Result:
    """What ``identify`` finds in the session at ``path``.

    Raises
    ------
    InputError
        The session cannot be used.
    Stopped
        The user broke the search off when there was an answer already; it is in ``result``.
    """
    from rig_identification.api import Stopped, identify
    from rig_identification.cli.searching import Searching
    from rig_identification.identification import prepare
    from rig_identification.session.provenance import file_digests

    recorded = read_recorded(path, namespace, topics, progress)
    digests = file_digests(path, watched(progress))
    prepared = prepare(recorded.raw, watched(progress))
    try:
        searching = Searching(progress, work)
        found = identify(prepared, progress=searching, work=work, watcher=searching.better)
        return replace(found, digests=digests)
    except Stopped as stopped:
        raise Stopped(replace(stopped.result, digests=digests)) from stopped


def _as_json(result: Result) -> None:
    print(json.dumps(result.to_dict(), indent=2, allow_nan=False, ensure_ascii=False))


def _nothing(_: Result) -> None:
    """Print nothing."""


def _print(identification: Identification, out: Path, remark: Callable[[Identification], str] | None) -> None:
    from rig_identification.cli.summary import summary

    print(summary(identification))
    if remark is not None:
        print(remark(identification))
    print(f"report: {out / REPORT}")
