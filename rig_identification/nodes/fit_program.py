"""The program that fits, in a process of its own: a fit in the node's process would hold its messages up.

``python -m rig_identification.nodes.fit_program SESSION``: lines of JSON on standard output, ``progress``
ones and then one ``result`` or ``error``. It ends when its standard input does, so that it outlives no node.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import traceback
from typing import NoReturn

from rig_identification.errors import InputError


def _say(kind: str, **content: object) -> None:
    print(json.dumps({"kind": kind, **content}, allow_nan=False), flush=True)


def _end_with_input() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


def fit(path: str) -> dict[str, object]:
    """Result of a session in result.json's terms, with notes on what it rests on.

    Raises InputError.
    """
    from rig_identification.identification import identify_prepared, prepare
    from rig_identification.live.excitation import motion_in_noise, moves
    from rig_identification.report.result_json import result_to_dict
    from rig_identification.session import read_raw

    def begun(stage: str) -> None:
        _say("progress", stage=stage, fraction=0.0)

    prepared = prepare(read_raw(path, progress=begun), begun)
    session = prepared.session
    for recording in session.training:
        if not moves(recording):
            raise InputError(
                f"{recording.name}: the body does not move (readings scatter by "
                f"{motion_in_noise(recording):.2f} times their noise): shake it, or record it as static"
            )
    identification = identify_prepared(
        prepared, lambda stage, fraction: _say("progress", stage=stage, fraction=fraction)
    )
    notes = list(identification.notes)
    for recording in session.recordings:
        for quality in recording.quality:
            left_out = quality.count - quality.used
            if left_out or quality.gaps:
                notes.append(
                    f"{recording.name} {quality.topic}: {left_out} of {quality.count} samples left out, "
                    f"{quality.missing} missing in {quality.gaps} gaps"
                )
            notes += [f"{recording.name} {quality.topic}: {note}" for note in quality.notes]
        notes += [f"{recording.name}: {cable.name} was silent" for cable in session.rig.cables
                  if cable.name not in recording.tension]  # fmt: skip
    return {
        "result": result_to_dict(identification),
        "explanation": identification.mismatch.explanation,
        "converged": identification.converged,
        "recordings": [recording.name for recording in session.recordings],
        "notes": notes,
    }


def main(path: str) -> NoReturn:
    """Fit and say so."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(1))
    threading.Thread(target=_end_with_input, daemon=True).start()
    try:
        _say("result", **fit(path))
    except InputError as error:
        _say("error", message=str(error))
    except Exception as error:
        traceback.print_exc()
        _say("error", message=f"defect: {type(error).__name__}: {' '.join(str(error).split())}")
    os._exit(0)  # the thread that waits for the input's end holds its lock to the last


if __name__ == "__main__":
    main(sys.argv[1])
