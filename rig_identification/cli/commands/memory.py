"""What the sessions of a rig taught of it: lengths, hinges, gains, and what moved in which session.

The sessions may have hung any bodies. Writes DIR/memory.json. With --for it also writes DIR/result.json: the
ten numbers of one more session, with all that the others taught of the rig as its prior.

  rig-identification memory results/*/ --out rig
  rig-identification memory results/*/ --for today/result.json --out today_with_memory
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.several_options import add_several_options, read_all, sessions_given
from rig_identification.errors import InputError
from rig_identification.files import Writer

if TYPE_CHECKING:
    from rig_identification.several.memory import Memory, Moved
    from rig_identification.several.session_result import SessionResult
    from rig_identification.several.ties import Sharing

MEMORY, RESULT = "memory.json", "result.json"
#: Doubts that are printed: those of which most was learned.
PRINTED = 10


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the results, what they share, the session to come, and where to write."""
    add_several_options(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help=f"folder for {MEMORY}")
    parser.add_argument(
        "--for", type=Path, dest="to_come", metavar="RESULT", help="session that is to use it"
    )
    parser.add_argument(
        "--level",
        type=float,
        default=0.01,
        help="share of sessions that may be said wrongly to have something moved (default: %(default)s)",
    )


def run(arguments: argparse.Namespace) -> None:
    """Learn, recall where that is asked for, write, and print."""
    from rig_identification.report.memory_json import write_memory
    from rig_identification.several.memory import learned
    from rig_identification.several.ties import ties

    if not 0.0 < arguments.level < 1.0:
        raise InputError(f"--level {arguments.level:g}: give a share between 0 and 1")
    out: Path = arguments.out
    check_output_folder(out, (MEMORY, RESULT))
    results, sharing = sessions_given(arguments, out)
    new = [] if arguments.to_come is None else read_all([arguments.to_come], out)
    # Rigs of all together: the new session has to be on the one that the memory is of
    rigs = ties([*results, *new], _with_new(sharing, new)).rigs
    memory = learned(results, replace(sharing, rigs=rigs[: len(results)]), arguments.level)
    if not memory.sessions:
        raise InputError(
            f"{results[0].name}: no session holds joint information; identify the sessions again"
        )
    writers: dict[str, Writer] = {MEMORY: partial(write_memory, memory)}
    lines = [memory_text(memory)]
    if new:
        text, writers[RESULT] = _recalled(new[0], memory, replace(sharing, rigs=rigs[-1:]))
        lines.append(text)
    write_together(out, writers)
    print("\n".join([*lines, f"memory: {out / MEMORY}"]))


def _recalled(session: SessionResult, memory: Memory, sharing: Sharing) -> tuple[str, Writer]:
    """A session's body with the memory as prior: the ten numbers for a terminal, and what writes them."""
    from rig_identification.cli.summary import table
    from rig_identification.report.memory_json import write_recalled
    from rig_identification.several.memory import recalled, without_frame

    total = recalled(session, memory, sharing)
    alone = without_frame(session, total)
    text = table(f"{session.name} with the memory of its rig, 95 % intervals", total)
    return text, partial(write_recalled, session, total, alone)


def memory_text(memory: Memory) -> str:
    """What was learned best, and what moved."""
    from rig_identification.quantity import with_interval

    lines = [f"{len(memory.sessions)} sessions, {len(memory.doubts)} doubts about the rig; learned best:"]
    best = sorted(zip(memory.std, memory.doubts, strict=True), key=lambda pair: float(pair[0]))
    for std, doubt in best[:PRINTED]:
        off = with_interval(doubt.prior_std * doubt.at, doubt.prior_std * float(std), doubt.unit)
        lines.append(f"  {doubt.name}: {off} off its description")
    lines += [moved_line(moved) for moved in memory.moved]
    return "\n".join(lines)


def moved_line(moved: Moved) -> str:
    """One sentence on a part that moved."""
    shifts = ", ".join(
        f"{name.rpartition('.')[2]} {v:+.2g} ± {1.96 * s:.1g}" for name, (v, s) in moved.shift.items()
    )
    return (
        f"{moved.session}: {moved.part} is not where the sessions before had it: {shifts} (p {moved.p:.1g})"
    )


def _with_new(sharing: Sharing, new: list[SessionResult]) -> Sharing:
    """Rigs that were named are those of the results; one more session is on the last of them."""
    return replace(sharing, rigs=sharing.rigs + sharing.rigs[-1:] * len(new)) if sharing.rigs else sharing
