"""The table of ``docs/set-up-faults.md``: one example of every fault, and what the examination says of it.

Each fault is put into the first clean session that can show it. Statements and advice are those of the code
that runs, so that the page never says what the tool does not.

    python -m bench.first_day.pages [--cache DIR] [--page docs/set-up-faults.md]
"""

from __future__ import annotations

import argparse
import re
import zlib
from collections.abc import Sequence
from pathlib import Path

from bench.first_day.bases import bases
from bench.first_day.faults import GROUPS, all_cases
from bench.first_day.faults.base import Case, devices
from bench.first_day.judge import marked
from bench.first_day.sessions import DEFAULT_CACHE
from rig_identification.check.examine import examine
from rig_identification.errors import InputError
from rig_identification.identification import fault_text
from rig_identification.raw import RawSession

PAGE = Path(__file__).parents[2] / "docs" / "set-up-faults.md"
BEGIN, END = "<!-- table: python -m bench.first_day.pages -->", "<!-- end of the table -->"


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: examine one example of every fault, and write the table into the page."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.first_day.pages", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--cache", type=Path, default=DEFAULT_CACHE, help="folder of clean sessions")
    parser.add_argument("--page", type=Path, default=PAGE)
    options = parser.parse_args(arguments)
    sessions = [one.read() for _, one in bases(options.cache)]
    lines = ["| put in | told as | what the tool says |", "| --- | --- | --- |"]
    for words, (raw, case) in examples(sessions).items():
        lines.append(row(words, raw, case))
        print(lines[-1], flush=True)
    options.page.write_text(with_table(options.page.read_text(encoding="utf-8"), lines), encoding="utf-8")
    return 0


def examples(sessions: Sequence[RawSession]) -> dict[tuple[str, ...], tuple[RawSession, Case]]:
    """The first case of each kind that its session can show."""
    found: dict[tuple[str, ...], tuple[RawSession, Case]] = {}
    for raw in sessions:
        for case in all_cases(raw):
            if not case.untellable:
                found.setdefault(kind(raw, case), (raw, case))
    return dict(sorted(found.items(), key=lambda item: GROUPS.index(item[0][0])))


def kind(raw: RawSession, case: Case) -> tuple[str, ...]:
    """What a case's name says besides device and strength."""
    parts = case.name.split("/")
    if parts[0] == "unit":
        return parts[0], parts[-1]
    known = {*devices(raw), "all_cells", "all"}
    return (*parts[:2], *(p for p in parts[2:] if re.fullmatch("[a-z_]+", p) and p not in known))


def row(words: Sequence[str], raw: RawSession, case: Case) -> str:
    """One line of the table."""
    put_in = ", ".join(word.replace("_", " ") for word in words)
    try:
        examination = examine(case.session(raw, zlib.crc32(raw.name.encode()))).examination
    except InputError as error:
        return f"| {put_in} | refused | {_cell(str(error))} |"
    if not examination.faults:
        return f"| {put_in} | nothing |  |"
    first, marks = examination.faults[0], marked(examination, case)
    wrong = "" if marks.outcome in ("named", "tie") else f" (put in: `{case.effect}`)"
    return f"| {put_in} | `{first.effect}`{wrong} | {_cell(fault_text(first))} |"


def with_table(page: str, lines: Sequence[str]) -> str:
    """The page with its table replaced. Raises InputError where the marks of the table are missing."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise InputError(f"the page lacks {BEGIN} or {END}: put them where the table belongs")
    return "\n".join([before + BEGIN, *lines, END + after])


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "/").split())


if __name__ == "__main__":
    raise SystemExit(main())
