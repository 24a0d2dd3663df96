"""Say whether results or sessions agree on one body, and which number does not.

What the sessions of one rig share (tolerances of the rig, scale errors of its sensors, one weighing) is no
difference between them, and is taken out. Prints chi-square and p of each number and of all together. --out
writes DIR/compare.json and DIR/compare.html, both or neither. Disagreement is a result: the exit status is 0.

  rig-identification compare monday/result.json friday/result.json --out agreement
  rig-identification compare results/*/ --out trend
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.several_options import add_several_options, sessions_given
from rig_identification.errors import InputError

if TYPE_CHECKING:
    from rig_identification.several.compare import Comparison

DOCUMENT, PAGE = "compare.json", "compare.html"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the results, what they share, the level of the test, and where to write."""
    add_several_options(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help=f"folder for {DOCUMENT} and {PAGE}")
    parser.add_argument(
        "--level",
        type=float,
        default=0.01,
        help="share of agreeing sets that may be said to disagree (default: %(default)s)",
    )


def run(arguments: argparse.Namespace) -> None:
    """Read or identify, compare, write, and print."""
    from rig_identification.several.compare import compare

    if not 0.0 < arguments.level < 1.0:
        raise InputError(f"--level {arguments.level:g}: give a share between 0 and 1")
    out: Path | None = arguments.out
    if out is not None:
        check_output_folder(out, (DOCUMENT, PAGE))
    found = compare(*sessions_given(arguments, out), arguments.level)
    if out is not None:
        from rig_identification.report.several_json import write_comparison
        from rig_identification.report.several_page import write_comparison_page

        write_together(
            out,
            {
                DOCUMENT: lambda path: write_comparison(found, path),
                PAGE: lambda path: write_comparison_page(found, path),
            },
        )
    print(comparison_text(found))
    if out is not None:
        print(f"page: {out / PAGE}")


def comparison_text(found: Comparison) -> str:
    """The verdict and every test, for a terminal."""
    lines = [verdict_line(found), f"{'':<10}{'chi-square':>12}{'freedom':>9}{'p':>10}"]
    tests = [("together", found.together), *found.numbers.items()]
    tests += [(f"without {name}", test) for name, test in found.sessions.items()]
    for name, test in tests:
        mark = "  disagrees" if name in found.disagreeing else ""
        lines.append(f"{name:<10}{test.chi_square:>12.2f}{test.freedom:>9}{test.p:>10.2g}{mark}")
    return "\n".join(lines)


def verdict_line(found: Comparison) -> str:
    """One sentence: whether the sessions agree, and what does not."""
    if not found.numbers:
        return "no number is determined by two of the sessions: nothing can be compared"
    if found.agree:
        return f"they agree (p {found.p:.2g}, {found.shared} doubts about the rig are shared)"
    named = ", ".join(found.disagreeing) or "no number by itself"
    return f"they disagree (p {found.p:.2g}, {found.shared} doubts about the rig are shared): {named}"
