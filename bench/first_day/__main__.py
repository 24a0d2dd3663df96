"""Are set-up faults named, quickly and alone? Faults in clean sessions, and sessions without one.

Every fault of ``faults/`` is put into clean sessions of three kinds of rig; the examination's first word is
held against it. Clean sessions, and ones with an ordinary effect of the catalogue, must be told none. The
sessions come from a cache, which ``python -m bench.first_day.generate`` fills. Tasks go to a log as they are
done; a second call goes on where the first stopped. A log entry of other source code is left out.

    python -m bench.first_day [--clean 200] [--ordinary 200] [--identify 40] [--jobs 2]
"""

from __future__ import annotations

import argparse
import json
import time
import zlib
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path
from typing import Any

from bench.first_day.bases import bases
from bench.first_day.faults import GROUPS, all_cases
from bench.first_day.run import Task, done, fingerprint
from bench.first_day.sessions import DEFAULT_CACHE, all_kept
from bench.first_day.table import as_markdown, figures, kind_of

HERE = Path(__file__).parent.parent


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: run what is missing, write the figures."""
    options = _parser().parse_args(arguments)
    tasks = [*_fault_tasks(options), *_quiet_tasks(options), *_recorded_tasks(options)]
    entries = _run(tasks, options.log, options.jobs, options.minutes)
    code = fingerprint()
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "first_day_results.json").write_text(json.dumps(figures(entries), indent=1) + "\n")
    (options.out / "first_day_results.md").write_text(as_markdown(entries, code, len(tasks)))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m bench.first_day", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--cache", type=Path, default=DEFAULT_CACHE, help="folder of sessions")
    parser.add_argument(
        "--sets", type=int, default=1, help="sessions of each kind of rig (default: %(default)s)"
    )
    parser.add_argument("--groups", nargs="*", choices=GROUPS, default=list(GROUPS))
    parser.add_argument("--only", default="", help="part of a fault's name")
    parser.add_argument("--every", type=int, default=1, help="one fault in so many, evenly drawn by its name")
    parser.add_argument("--clean", type=int, default=200, help="clean sessions (default: %(default)s)")
    parser.add_argument("--ordinary", type=int, default=200, help="with one effect (default: %(default)s)")
    parser.add_argument("--identify", type=int, default=0, help="faults after which J is identified")
    parser.add_argument(
        "--recorded", type=Path, nargs="*", default=[], help="recorded sessions, no fault known"
    )
    parser.add_argument(
        "--recorded-fault", nargs=2, action="append", default=[], metavar=("FOLDER", "WANTED"),
        help='a recorded session and what is wrong with it, as "unit imu"',
    )  # fmt: skip
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no task after so many")
    parser.add_argument("--log", type=Path, default=DEFAULT_CACHE / "first_day.jsonl", help="one line a task")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of first_day_results.md and .json")
    return parser


def _fault_tasks(options: argparse.Namespace) -> list[Task]:
    tasks = []
    for rig, one in bases(options.cache, options.sets) if options.groups else ():
        wanted = (c.name for c in all_cases(one.read()) if c.group in options.groups)
        names = [
            n for n in wanted if options.only in n and zlib.crc32(f"{rig} {n}".encode()) % options.every == 0
        ]
        tasks += [Task("fault", options.cache, one.name, rig, name) for name in names]
    # A sample for J, the same for the same number, spread over everything
    drawn = sorted(tasks, key=lambda t: zlib.crc32(f"J {t.key}".encode()))[: options.identify]
    chosen = {task.key for task in drawn}
    return [replace(task, identify=task.key in chosen) for task in tasks]


def _quiet_tasks(options: argparse.Namespace) -> list[Task]:
    wanted = (("clean", options.clean), ("ordinary", options.ordinary))
    return [Task(kind, options.cache, s.name) for kind, n in wanted for s in all_kept(options.cache, kind, n)]


def _recorded_tasks(options: argparse.Namespace) -> list[Task]:
    tasks = [Task("recorded", folder, folder.name) for folder in options.recorded]
    for folder, wanted in options.recorded_fault:
        tasks.append(Task("recorded", Path(folder), Path(folder).name, case=wanted))
    return tasks


def _run(tasks: Sequence[Task], log: Path, jobs: int, minutes: float) -> list[dict[str, Any]]:
    """Entries of the tasks in their order; what the log has is not done again.

    One of each kind of fault comes first, then another of each: what is done when the time is up is a sample
    of all kinds, drawn by the tasks' names.
    """
    code = fingerprint()
    known: dict[str, dict[str, Any]] = {}
    if log.exists():
        lines = (json.loads(line) for line in log.read_text().splitlines())
        known = {e["key"]: e for e in lines if e["code"] == code}
    log.parent.mkdir(parents=True, exist_ok=True)
    missing = [task for task in _in_turn(tasks) if task.key not in known]
    stop = time.monotonic() + 60.0 * minutes
    with log.open("a") as stream:

        def keep(entry: dict[str, Any]) -> None:
            known[entry["key"]] = entry | {"code": code}
            stream.write(json.dumps(known[entry["key"]]) + "\n")
            stream.flush()

        if jobs == 1:
            for task in missing:
                if time.monotonic() > stop:
                    break
                keep(done(task))
        else:
            with ProcessPoolExecutor(jobs) as pool:
                for future in as_completed([pool.submit(_in_time, task, stop) for task in missing]):
                    if (entry := future.result()) is not None:
                        keep(entry)
    return [known[task.key] for task in tasks if task.key in known]


def _in_turn(tasks: Sequence[Task]) -> list[Task]:
    """Tasks in an order drawn by their names, one of each kind after the other."""
    drawn = sorted(tasks, key=lambda task: zlib.crc32(task.key.encode()))
    ranks: Counter[str] = Counter()
    placed = []
    for task in drawn:
        kind = (
            kind_of(task.case) if task.kind == "fault" else f"{task.kind} {zlib.crc32(task.key.encode()) % 8}"
        )
        placed.append((ranks[kind], task))
        ranks[kind] += 1
    return [task for _, task in sorted(placed, key=lambda place: place[0])]


def _in_time(task: Task, stop: float) -> dict[str, Any] | None:
    return done(task) if time.monotonic() <= stop else None


if __name__ == "__main__":
    raise SystemExit(main())
