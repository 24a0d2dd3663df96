"""Run the thesis' case studies again and set its published errors beside four estimators.

Writes DIR/thesis.json, DIR/report.html and an SVG for each figure, all or none. Each case is simulated
without noise; (a) is the thesis' own estimator, (b) has the gyroscopic term, (c) is a regression on momentum,
and (d) is this package's estimator, with its standard deviation under realistic noise. With case 14 comes
a session of it that is examined with the thesis' assumptions.

  rig-identification thesis --out thesis
  rig-identification thesis --case 14 --case 18b --out civic
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.progress import StageProgress
from rig_identification.errors import InputError

if TYPE_CHECKING:
    from rig_identification.thesis import Case

RESULT, REPORT = "thesis.json", "report.html"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the cases and where to write."""
    parser.add_argument(
        "--case",
        action="append",
        default=[],
        metavar="N",
        help="1 to 18, or 18a to 18d; may be repeated (default: all, and the trackers of chapter 3)",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for result and report")
    parser.add_argument(
        "--workers", type=int, default=2, metavar="K", help="processes side by side (default: %(default)s)"
    )


def run(arguments: argparse.Namespace) -> None:
    """Run, write, and print the table."""
    from rig_identification.thesis import load_cases
    from rig_identification.thesis_report import (
        case_figures,
        rerun_document,
        text_table,
        write_json,
        write_page,
    )
    from rig_identification.thesis_rerun import rerun

    check_output_folder(arguments.out, (RESULT, REPORT))
    if arguments.workers < 1:
        raise InputError(f"--workers {arguments.workers}: give at least 1")
    cases = chosen_cases(arguments.case) if arguments.case else load_cases()
    begun = time.monotonic()
    with StageProgress(sys.stderr) as progress:
        found = rerun(cases, progress, arguments.workers, tracking=not arguments.case)
    seconds = time.monotonic() - begun
    figures = case_figures(found)
    write_together(
        arguments.out,
        {
            RESULT: lambda path: write_json(rerun_document(found, seconds), path),
            REPORT: lambda path: write_page(found, figures, seconds, path),
            **{name: _writer(svg) for name, svg in figures.files.items()},
        },
    )
    print(text_table(found))
    if found.examination is not None:
        print(found.examination.statement)
    print(f"report: {arguments.out / REPORT}")


def chosen_cases(labels: list[str]) -> tuple[Case, ...]:
    """Cases of labels such as ``14`` and ``18b``; ``18`` is all four variants. Each once, in the given order.

    Raises InputError for a label that is no case.
    """
    from rig_identification.thesis import load_case

    found: dict[str, Case] = {}
    for label in labels:
        number, variant = label.rstrip("abcd"), label.lstrip("0123456789")
        if not number.isdecimal():
            raise InputError(f"--case {label}: is no case study; give 1 to 18, or 18a to 18d")
        variants = "abcd" if number == "18" and not variant else (variant,)
        for one in variants:
            case = load_case(int(number), one)
            found[case.label] = case
    return tuple(found.values())


def _writer(text: str):  # type: ignore[no-untyped-def]
    return lambda path: path.write_text(text, encoding="utf-8")
