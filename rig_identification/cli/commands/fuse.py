"""One estimate of one body from several results or sessions, with shared errors counted once.

The sessions may hang the body in several poses or on several rigs; the body frame and the carrying frame are
the same in all. What no session determines alone several may determine together. Prints whether the sessions
agree and the ten numbers. Writes DIR/result.json, in the form of identify's, and DIR/report.html, both or
neither.

  rig-identification fuse high/result.json low/result.json --out both
  rig-identification fuse results/car_*/ --out car
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.several_options import add_several_options, sessions_given

RESULT, REPORT = "result.json", "report.html"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the results, what they share, and where to write."""
    add_several_options(parser)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help=f"folder for {RESULT} and {REPORT}"
    )


def run(arguments: argparse.Namespace) -> None:
    """Read or identify, fuse, write, and print."""
    from rig_identification.cli.commands.compare import verdict_line
    from rig_identification.cli.summary import table
    from rig_identification.report.several_json import write_fused
    from rig_identification.report.several_page import write_fused_page
    from rig_identification.several.fuse import fuse

    out: Path = arguments.out
    check_output_folder(out, (RESULT, REPORT))
    fused = fuse(*sessions_given(arguments, out))
    write_together(
        out,
        {
            RESULT: lambda path: write_fused(fused, path),
            REPORT: lambda path: write_fused_page(fused, path),
        },
    )
    print(f"{len(fused.comparison.results)} sessions: {verdict_line(fused.comparison)}")
    if fused.without_frame is None:
        print(table("95 % intervals", fused.total))
    else:
        print(table("with the carrying frame, 95 % intervals", fused.total))
        print(table("without the carrying frame, 95 % intervals", fused.without_frame))
    print(f"report: {out / REPORT}")
