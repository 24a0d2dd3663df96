"""One long task of the page: a request on standard input, progress and the answer as lines of JSON.

``python -m rig_identification.ui.worker`` is started by the page and by nobody else.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, TextIO

from rig_identification.errors import InputError, MissingDescription
from rig_identification.ui.jobs import DONE, FAILED, STOPPED

#: s between two lines of progress within one stage.
OFTEN = 0.2


class Told:
    """Progress as lines of JSON."""

    def __init__(self, stream: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._clock = clock
        self._stage, self._last = "", 0.0

    def __call__(self, stage: str, fraction: float | None = None) -> None:
        """Tell a stage and how far it is, 0 to 1."""
        now = self._clock()
        if stage == self._stage and now - self._last < OFTEN:
            return
        self._stage, self._last = stage, now
        self.line({"stage": stage, "fraction": fraction})

    def line(self, told: Mapping[str, Any]) -> None:
        """Write one line."""
        self._stream.write(json.dumps(told) + "\n")
        self._stream.flush()


def main() -> None:
    """Do the task of the first line, and end with the page."""
    stream = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what anything prints is no line of the answer
    told = Told(stream)
    request = json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with_the_page, daemon=True).start()
    told.line(_outcome(request, told))


def _outcome(request: Mapping[str, Any], progress: Told) -> dict[str, Any]:
    """How a task ended."""
    from rig_identification.ui.tasks import TASKS

    try:
        return {"state": DONE, "answer": TASKS[request["task"]](request, progress)}
    except MissingDescription as error:
        return {"state": FAILED, "message": str(error), "answer": {"proposal": error.proposal}}
    except InputError as error:
        return {"state": FAILED, "message": str(error)}
    except MemoryError:
        return {"state": FAILED, "message": "this machine has not enough memory for it"}
    except KeyboardInterrupt:
        return {"state": STOPPED, "message": "Stopped before there was an answer; nothing was written."}
    except Exception as error:
        return {"state": FAILED, "message": f"defect: {type(error).__name__}: {error}. Please report it"}


def _end_with_the_page() -> None:
    while sys.stdin.readline():
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    main()
