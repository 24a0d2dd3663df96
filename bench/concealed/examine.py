"""Run ``rig-identification identify`` on session after session; start again where it was left."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

IDENTIFY = (sys.executable, "-m", "rig_identification.cli.main", "identify")
RESULT, SECONDS, ERROR = "result.json", "seconds.txt", "stderr.txt"


def to_do(sessions: Path, out: Path) -> list[Path]:
    """Folders of sessions that have no result yet, by name."""
    found = sorted(p.parent for p in sessions.glob("*/session.yaml"))
    return [p for p in found if not (out / p.name / RESULT).is_file()]


def examine(
    session: Path, out: Path, limit: float | None = None, command: Sequence[str] | None = None
) -> str | None:
    """Identify one session into the folder ``out``; return what went wrong, None where nothing did.

    ``limit``: seconds after which it is given up. ``command``: what takes the session, ``--out`` and a
    folder; by default :data:`IDENTIFY`.

    ``out`` holds ``seconds.txt``, and ``stderr.txt`` where there is no result.
    """
    # Worked on aside and moved in whole: a run that is broken off leaves no half result.
    work = out / ".work"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    start = time.monotonic()
    code, stderr = _run([*(command or IDENTIFY), str(session), "--out", str(work)], limit)
    (out / SECONDS).write_text(f"{time.monotonic() - start:.2f}\n")
    (out / ERROR).unlink(missing_ok=True)
    done = code == 0 and (work / RESULT).is_file()
    if done:
        # The result comes last: where it is, everything is.
        for path in sorted(work.iterdir(), key=lambda p: p.name == RESULT):
            path.replace(out / path.name)
    shutil.rmtree(work)
    if done:
        return None
    (out / ERROR).write_text(stderr, encoding="utf-8")
    lines = stderr.strip().splitlines()
    ended = "given up" if code is None else f"exit {code}"
    return f"{ended}: {lines[-1] if lines else 'nothing on standard error'}"


def _run(command: Sequence[str], limit: float | None) -> tuple[int | None, str]:
    """Exit status, None if it took longer than ``limit``, and standard error."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=limit)
    except subprocess.TimeoutExpired:
        return None, f"no end after {limit:.0f} s"
    return done.returncode, done.stderr


def examine_all(
    sessions: Iterable[Path],
    out: Path,
    jobs: int,
    limit: float | None,
    told: Callable[[Path, str | None], None],
) -> int:
    """Identify all, ``jobs`` at a time; ``told`` hears of each as it ends. Returns how many failed."""
    failed = 0
    with ThreadPoolExecutor(jobs) as pool:
        waiting = {pool.submit(examine, s, out / s.name, limit): s for s in sessions}
        try:
            for future in as_completed(waiting):
                wrong = future.result()
                failed += wrong is not None
                told(waiting[future], wrong)
        except BaseException:  # Ctrl-C must not wait for all that are queued
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return failed


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: 0, or 1 where a session failed."""
    parser = argparse.ArgumentParser(prog="python -m bench.concealed.examine", description=__doc__)
    parser.add_argument("--sessions", type=Path, required=True, help="folder of session folders")
    parser.add_argument("--out", type=Path, required=True, help="folder for one folder of results a session")
    parser.add_argument("--jobs", type=int, default=1, help="sessions at a time (default: %(default)s)")
    parser.add_argument("--limit", type=float, default=3600.0, help="give a session up after (s)")
    options = parser.parse_args(arguments)
    left = to_do(options.sessions, options.out)
    options.out.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("identify", total=len(left))

        def told(session: Path, wrong: str | None) -> None:
            bar.advance(task)
            took = (options.out / session.name / SECONDS).read_text().strip()
            console.print(f"{session.name}: {wrong or 'done'} ({took} s)", markup=False, highlight=False)

        failed = examine_all(left, options.out, options.jobs, options.limit, told)
    print(f"{len(left)} examined, {failed} without a result")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
