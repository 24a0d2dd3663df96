"""A batch from start to end: what is done, what is left, a record a session, the rows of the table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rig_identification.batch.fingerprint import files_of, fingerprint, seen_files
from rig_identification.batch.processes import Ended, side_by_side
from rig_identification.batch.record import DONE, SETTLED, Record, read_record, write_record
from rig_identification.batch.sessions import Listed
from rig_identification.batch.table import RESULT, row

#: Identifies the session in a folder into another one.
Identify = Callable[[Path, Path], Ended]


@dataclass(frozen=True)
class Step:
    """One session of a batch that was settled."""

    session: Listed
    record: Record
    again: bool  # whether it was so already


@dataclass(frozen=True)
class Batch:
    """Sessions, where their results go, and what their answers depend on beside their files."""

    sessions: tuple[Listed, ...]
    out: Path
    options: Mapping[str, object]

    def run(
        self, identify: Identify, jobs: int, stop: Callable[[], None], heard: Callable[[Step], None]
    ) -> list[dict[str, object]]:
        """Settle every session and return the table's rows, in the order of the sessions.

        identify: called for what is not done, ``jobs`` at once. heard: called with each session once it is
        settled. Interrupted, it stops what runs; what was settled until then stays.
        """
        records: dict[str, Record] = {}

        def settle(session: Listed) -> Step:
            return self._settled(session, identify)

        for session, step in side_by_side(settle, self.sessions, jobs, stop):
            records[session.name] = step.record
            heard(step)
        return [row(s, records[s.name], self.folder(s)) for s in self.sessions]

    def folder(self, session: Listed) -> Path:
        """Where a session's result lies."""
        return self.out / session.name

    def _settled(self, session: Listed, identify: Identify) -> Step:
        folder = self.folder(session)
        before = read_record(folder)
        files = files_of(session.folder)
        seen = seen_files(files, {} if before is None else before.files)
        key = fingerprint(session.folder, seen, self.options)
        if before is not None and before.hash == key and self._stands(before, folder):
            if before.files != seen:  # copied or touched: not to be read again the next time
                write_record(replace(before, files=seen), folder)
            return Step(session, before, True)
        ended = identify(session.folder, folder)
        record = Record(ended.status, key, ended.message, seen)
        write_record(record, folder)
        return Step(session, record, False)

    def _stands(self, record: Record, folder: Path) -> bool:
        """Whether a record of the same hash needs no second try."""
        return record.status in SETTLED and (record.status != DONE or (folder / RESULT).is_file())


def failed(rows: Sequence[Mapping[str, object]]) -> int:
    """Sessions without a result."""
    return sum(told["status"] != DONE for told in rows)
