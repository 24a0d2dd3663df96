"""Identify every session below a folder, several at once, and tabulate the answers.

Writes OUT/SESSION/result.json and report.html as identify does, OUT/SESSION/batch.json with what became of
the session, and the table as OUT/index.json and OUT/index.csv. A session is not done again while its bags,
its descriptions, the version and the options are the same. A session that fails stops no other; the exit
status is then 3. An array job gives each of its N jobs --shard K/N; a last call without it does nothing anew
and writes the table of all.

  rig-identification batch sessions --out results --jobs 4
  rig-identification batch sessions --out results --shard $SLURM_ARRAY_TASK_ID/100
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.commands.identify import units
from rig_identification.cli.output import check_output_folder
from rig_identification.cli.session_options import add_topic_options
from rig_identification.errors import InputError
from rig_identification.model.work import WORK

if TYPE_CHECKING:
    from rig_identification.batch.sessions import Shard

INDEX, TABLE = "index.json", "index.csv"
#: Exit status where some sessions have no result.
INCOMPLETE = 3


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the folder, where to write, how many at once, and the options of identify."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder with sessions in it, at any depth")
    parser.add_argument("--out", type=Path, required=True, metavar="OUT", help="folder for results and table")
    parser.add_argument(
        "--jobs", type=_count, default=1, metavar="N", help="sessions at once (default: %(default)s)"
    )
    parser.add_argument("--shard", type=_shard, metavar="K/N", help="do the K-th of N parts alone, K from 1")
    add_topic_options(parser)
    parser.add_argument(
        "--work", type=units, default=WORK, metavar="UNITS", help="as of identify; default %(default)g"
    )


def run(arguments: argparse.Namespace) -> int:
    """Settle every session, write the table, and say how many have no result."""
    from rig_identification import __version__
    from rig_identification.batch.batch import Batch, failed
    from rig_identification.batch.processes import Processes
    from rig_identification.batch.record import write_text
    from rig_identification.batch.sessions import sessions_in
    from rig_identification.batch.table import table_csv, table_json
    from rig_identification.cli.batch_progress import BatchProgress
    from rig_identification.estimate.side_by_side import cores

    out: Path = arguments.out
    listed = sessions_in(arguments.folder)
    shard: Shard | None = arguments.shard
    chosen = listed if shard is None else shard.of(listed)
    index, table = names(shard)
    check_output_folder(out, (index, table))
    processes = Processes(max(1, cores() // arguments.jobs))
    given = _options(arguments)
    batch = Batch(chosen, out, _answer_depends_on(arguments))
    with BatchProgress(sys.stderr, len(chosen)) as progress:
        rows = batch.run(
            lambda session, into: processes.identify(session, into, given),
            arguments.jobs,
            processes.stop,
            progress,
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_text(out / index, table_json(rows, __version__))
        write_text(out / table, table_csv(rows))
    except OSError as error:
        raise InputError(f"--out {out}: {error.strerror or error}; free it or name another folder") from error
    lost = failed(rows)
    print(f"{len(rows) - lost} of {len(rows)} sessions have a result")
    for told in (told for told in rows if told["status"] != "done"):
        print(f"  {told['session']}: {told['status']}: {told['message']}")
    print(f"table: {out / table}")
    return INCOMPLETE if lost else 0


def names(shard: Shard | None) -> tuple[str, str]:
    """Names of the index and the table; those of a part bear its number."""
    if shard is None:
        return INDEX, TABLE
    part = f"{shard.number}-of-{shard.count}"
    return f"index.{part}.json", f"index.{part}.csv"


def _options(arguments: argparse.Namespace) -> list[str]:
    """The options of identify, as for its command line."""
    out = ["--namespace", arguments.namespace, "--work", repr(arguments.work)]
    for name, topic in arguments.topic:
        out += ["--topic", f"{name}={topic}"]
    if arguments.effects is not None:
        out += ["--effects", str(arguments.effects)]
    return out


def _answer_depends_on(arguments: argparse.Namespace) -> dict[str, object]:
    """What an answer depends on beside a session's files."""
    import os

    from rig_identification.own import VARIABLE

    folder = os.environ.get(VARIABLE, "")  # --effects is there as well
    effects = sorted(Path(folder).glob("*.py")) if folder else []
    return {
        "namespace": arguments.namespace,
        "topics": sorted(map(list, arguments.topic)),
        "work": arguments.work,
        "effects": {file.name: file.read_text(encoding="utf-8") for file in effects},
    }


def _count(text: str) -> int:
    """A whole number from 1."""
    if not text.isdecimal() or not int(text):
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 1")
    return int(text)


def _shard(text: str) -> Shard:
    from rig_identification.batch.sessions import Shard

    found = re.fullmatch(r"(\d+)/(\d+)", text)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise argparse.ArgumentTypeError(f"{text!r} is not K/N with K from 1 to N, as in 3/100")
    return Shard(int(found[1]), int(found[2]))
