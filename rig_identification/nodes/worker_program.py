"""What the programs beside a node share: how they speak, and when they end.

Lines of JSON on standard output: ``progress`` and ``numbers`` ones, then one of ``result``, ``error`` and
``cancelled``. A program ends when its standard input does, so that it outlives no node. SIGINT asks it, once,
for the best answer until then.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from types import FrameType
from typing import NoReturn

from rig_identification.errors import InputError

#: File descriptor of standard output.
STDOUT = 1


class Voice:
    """Says one whole line at a time: an interrupt waits until the line is out."""

    def __init__(self) -> None:
        self._speaking = self._interrupted = False
        self._lock = threading.Lock()

    def say(self, kind: str, **content: object) -> None:
        """Write a line. Raises KeyboardInterrupt, after it, where SIGINT came meanwhile."""
        line = json.dumps({"kind": kind, **content}, allow_nan=False).encode() + b"\n"
        main = threading.current_thread() is threading.main_thread()  # signals are heeded there alone
        if main:
            self._speaking = True
        try:
            with self._lock:
                # Past the buffers of sys.stdout, which a signal between two pieces of a line can leave torn
                while line:
                    line = line[os.write(STDOUT, line) :]
        finally:
            if main:
                self._speaking = False
        if main and self._interrupted:
            self._interrupted = False
            raise KeyboardInterrupt

    def on_interrupt(self, number: int, frame: FrameType | None) -> None:
        """Handle SIGINT; a second one is ignored."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if self._speaking:
            self._interrupted = True
        else:
            raise KeyboardInterrupt


VOICE = Voice()
say = VOICE.say


def begun(stage: str, fraction: float = 0.0) -> None:
    """Say which stage begins, and how far the work is."""
    say("progress", stage=stage, fraction=fraction)


def _end_with_input() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


def run(work: Callable[[], dict[str, object]]) -> NoReturn:
    """Do the work and say what came of it."""
    signal.signal(signal.SIGTERM, lambda *_: os._exit(1))
    signal.signal(signal.SIGINT, VOICE.on_interrupt)
    threading.Thread(target=_end_with_input, daemon=True).start()
    try:
        begun("reading")
        say("result", **work())
    except InputError as error:
        say("error", message=str(error))
    except KeyboardInterrupt:
        say("cancelled")
    except Exception as error:
        traceback.print_exc()
        say("error", message=f"defect: {type(error).__name__}: {' '.join(str(error).split())}")
    os._exit(0)  # the thread that waits for the input's end holds its lock to the last
