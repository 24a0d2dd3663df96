"""The program that looks at a window while it is recorded, beside the node that records it.

``python -m rig_identification.nodes.watch_program RIG SECONDS AIM NAMESPACE [COMMANDS]``. COMMANDS holds the
exciter's planned force (session/exciter_commands.py). Each line of its standard input names a file of
:mod:`gathered` and whether its last window is whole. Each is answered by one line of
JSON, ``{"kind": "watched", ...}``. It runs when nobody else wants the core, and ends with its input.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
import traceback
from pathlib import Path
from typing import Any, TextIO

from rig_identification.errors import InputError
from rig_identification.nodes.gathered import read_gathered
from rig_identification.raw import RawSession

#: Steps by which it gives way to others.
NICE = 10


def told(watching: Any, raw: RawSession, whole: bool) -> dict[str, Any]:
    """What a look says, in result.json's terms."""
    from rig_identification.report.result_json import estimate_part

    found = watching.look(raw, whole)
    return {
        "recording": found.recording,
        "seconds": found.seconds,
        "faults": list(found.faults),
        "verdict": found.verdict,
        "text": found.text,
        "error": found.error,
        "cause": found.cause,
        "parameters": found.parameters,
        "body": None if found.estimate is None else estimate_part(found.estimate, None),
        "forecast": found.forecast,
    }


def main(rig_file: str, seconds: str, aim: str, namespace: str, commands: str = "") -> None:
    """Answer each line until there are no more."""
    stream = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what anything prints is no line of an answer
    with contextlib.suppress(AttributeError, OSError):  # not everywhere
        os.nice(NICE)
    from rig_identification.session import read_rig
    from rig_identification.session.exciter_commands import read_commands
    from rig_identification.watching import Expected, Watching

    rig = read_rig(Path(rig_file))
    forces = read_commands(Path(commands)) if commands else {}
    watching = Watching(Expected(float(seconds), float(aim), forces))
    for line in sys.stdin:
        asked = json.loads(line)
        begun = time.monotonic()
        try:
            raw = RawSession("live", rig, read_gathered(Path(asked["file"])), namespace)
            answer = told(watching, raw, bool(asked["whole"]))
        except InputError as error:
            answer = {"text": str(error)}
        except Exception as error:
            traceback.print_exc()
            answer = {"text": f"defect: {type(error).__name__}: {' '.join(str(error).split())}"}
        _say(stream, {"kind": "watched", **answer, "took": time.monotonic() - begun})


def _say(stream: TextIO, answer: dict[str, Any]) -> None:
    stream.write(json.dumps(answer, allow_nan=False) + "\n")
    stream.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
