r"""Turn logs of other makes into the bags of a session: CSV, MAT, ROS 1, phyphox and others.

Each FILE becomes one recording. What its columns are, and in which unit, is guessed from their names and
shown as YAML. Without --out nothing is written: redirect the guess into a file, edit it, and give it with
--columns. With --out the guess is taken once you confirm it, or at once with --yes. DIR then holds one bag
a file and the columns.yaml that was used. 'rig-identification init DIR' writes the rest.

  rig-identification import run_1.csv > columns.yaml
  rig-identification import run_1.csv run_2.csv --columns columns.yaml --out session
  rig-identification import phone.zip --yes --out session
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.progress import StageProgress
from rig_identification.cli.session_options import watched
from rig_identification.errors import InputError

if TYPE_CHECKING:
    from rig_identification.logs.importing import Understood


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the logs, what their columns are, and where the bags go."""
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE", help="one a recording; or a folder")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the session's folder")
    parser.add_argument("--columns", type=Path, metavar="FILE", help="what the columns are, as YAML")
    parser.add_argument("--rate", type=_rate, metavar="HZ", help="of tables without a column of time")
    parser.add_argument("--yes", action="store_true", help="take the guess without asking")
    parser.add_argument("--overwrite", action="store_true", help="replace bags of the same names")


def run(arguments: argparse.Namespace) -> None:
    """Read, show what is understood, and write."""
    from rig_identification.logs.columns import FILE
    from rig_identification.logs.importing import recordings, understand, write_recordings

    out: Path | None = arguments.out
    if out is not None:
        check_output_folder(out, (FILE,))
    with StageProgress(sys.stderr) as progress:
        understood = understand(arguments.files, arguments.columns, arguments.rate, watched(progress))
    if out is None:
        print(understood.text, end="")
        return
    _confirm(understood, arguments.yes or arguments.columns is not None)
    with StageProgress(sys.stderr) as progress:
        found = recordings(understood)
        write_recordings(found, out, overwrite=arguments.overwrite, progress=watched(progress))
    write_together(out, {FILE: lambda path: _write(path, understood.text)})
    for recording in found:
        print(f"{out / recording.name}: {recording.duration:.1f} s")
    print(f"next: rig-identification init {out}")


def _confirm(understood: Understood, certain: bool) -> None:
    """Show a guess and ask. Raises InputError where nobody answers yes."""
    if certain:
        return
    print(understood.text, end="", flush=True)
    if not sys.stdin.isatty():
        raise InputError(
            "--out: nothing is written without a word: give --yes to take the guess, or --columns"
        )
    if input("Import so? [y/N] ").strip().lower() not in ("y", "yes"):
        raise InputError("--out: nothing is written; save the guess, edit it, and give it with --columns")


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _rate(text: str) -> float:
    """A rate in Hz."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value <= 1e6:
        raise argparse.ArgumentTypeError(f"{text!r} is no rate; give Hz, above 0")
    return value
