"""A study that goes on where it was left off: one line of a log for each job, of one state of the sources."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import rig_identification

Entry = dict[str, Any]


def fingerprint(*also: Path) -> str:
    """Of the sources that simulate and fit, and others: figures of two versions are not to be mixed."""
    package = Path(rig_identification.__file__).parent
    digest = hashlib.sha256()
    for room in ("model", "estimate", "simulate"):
        for file in sorted((package / room).rglob("*.py")):
            digest.update(file.read_bytes())
    for file in also:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def entries_of(
    log: Path,
    code: str,
    jobs: Iterable[tuple[Any, ...]],
    job_of: Callable[[Entry], tuple[Any, ...]],
    work: Callable[..., Entry],
    processes: int,
) -> list[Entry]:
    """Every entry of the log that bears this ``code``, with the jobs that were missing done and added.

    job_of: the arguments of ``work`` that an entry was made with.
    """
    lines = log.read_text().splitlines() if log.exists() else []
    entries = [e for e in map(json.loads, lines) if e["code"] == code]
    known = {job_of(e) for e in entries}
    left = [job for job in jobs if job not in known]
    with log.open("a") as file, ProcessPoolExecutor(processes) as pool:
        for future in as_completed([pool.submit(work, *job) for job in left]):
            entries.append(future.result())
            file.write(json.dumps(entries[-1]) + "\n")
            file.flush()
    return entries
