"""The program that fits, in a process of its own: a fit in the node's process would hold its messages up.

``python -m rig_identification.nodes.fit_program SESSION [--work UNITS] [--out DIR]``. It speaks as
:mod:`worker_program` says; with ``--out`` it writes the files that ``rig-identification identify`` writes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.errors import InputError
from rig_identification.nodes.worker_program import begun, run, say

if TYPE_CHECKING:
    from rig_identification.identification import Prepared
    from rig_identification.recording import Session
    from rig_identification.result import Identification

#: Files of an answer.
RESULT, REPORT = "result.json", "report.html"


def fit(path: Path, work: float | None = None, out: Path | None = None) -> dict[str, object]:
    """Result of a session in result.json's terms, with notes on what it rests on.

    work: units of work after which the search begins nothing new. out: folder for result and report.

    Raises
    ------
    InputError
        The session or the folder cannot be used.
    KeyboardInterrupt
        Interrupted before there was an answer.
    """
    from rig_identification.identification import prepare
    from rig_identification.report import provenance, result_to_dict, write_report, write_result
    from rig_identification.session import read_raw
    from rig_identification.session.provenance import file_digests, session_digest

    digests = file_digests(path, begun)
    prepared = prepare(read_raw(path, progress=begun), begun)
    session = prepared.session
    refuse_still_runs(session)
    found = _identified(prepared, work)
    origin = provenance(session, digests)
    files: dict[str, str] = {}
    if out is not None:
        from rig_identification.files import write_together

        begun("writing the report", 1.0)
        write_together(
            out,
            {
                RESULT: lambda file: write_result(found, file, origin),
                REPORT: lambda file: write_report(found, session, file),
            },
        )
        files = {name: str(out.absolute() / name) for name in (RESULT, REPORT)}
    return {
        "result": result_to_dict(found, origin),
        "explanation": found.mismatch.explanation,
        "converged": found.converged,
        "interrupted": found.interrupted,
        "recordings": [recording.name for recording in session.recordings],
        "notes": [*found.notes, *left_out(session)],
        "session_sha256": session_digest(digests),
        "files": files,
    }


def _identified(prepared: Prepared, work: float | None) -> Identification:
    """The answer; once there is one, an interrupt makes it the best until then."""
    from rig_identification.identification import identify_prepared
    from rig_identification.report.result_json import estimate_part
    from rig_identification.result import Interrupted

    def shown(answer: Identification) -> None:
        say("numbers", body=estimate_part(answer.total, None))

    try:
        return identify_prepared(prepared, begun, work, shown)
    except Interrupted as stopped:
        return stopped.answer


def refuse_still_runs(session: Session) -> None:
    """Refuse a dynamic recording in which the body hangs still. Raises InputError."""
    from rig_identification.live.excitation import motion_in_noise, moves

    for recording in session.training:
        if not moves(recording):
            raise InputError(
                f"{recording.name}: the body does not move (readings scatter by "
                f"{motion_in_noise(recording):.2f} times their noise): shake it, or record it as static"
            )


def left_out(session: Session) -> list[str]:
    """What was left out of the data, topic by topic, and silent cables."""
    notes = []
    for recording in session.recordings:
        for quality in recording.quality:
            count = quality.count - quality.used
            if count or quality.gaps:
                notes.append(
                    f"{recording.name} {quality.topic}: {count} of {quality.count} samples left out, "
                    f"{quality.missing} missing in {quality.gaps} gaps"
                )
            notes += [f"{recording.name} {quality.topic}: {note}" for note in quality.notes]
        notes += [f"{recording.name}: {cable.name} was silent" for cable in session.rig.cables
                  if cable.name not in recording.tension]  # fmt: skip
    return notes


def main(arguments: Sequence[str]) -> None:
    """Fit and say so."""
    parser = argparse.ArgumentParser(prog="fit_program")
    parser.add_argument("session", type=Path)
    parser.add_argument("--work", type=float)
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args(arguments)
    run(lambda: fit(chosen.session, chosen.work, chosen.out))


if __name__ == "__main__":
    main(sys.argv[1:])
