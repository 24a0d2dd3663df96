"""One executable a node: quiet from the first moment to the last, whatever signal arrives when.

The node's own module is imported after the signals are taken, because imports take seconds and a
rig is often stopped while it still starts.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

from rig_identification.errors import InputError

SIGNALS = (signal.SIGINT, signal.SIGTERM)
UNUSABLE = 2
#: s after which a node that prepares itself says so.
SOON = 15.0


class StopRequest:
    """Set by SIGINT and SIGTERM; further ones change nothing."""

    def __init__(self) -> None:
        self.requested = False
        self.notify: Callable[[], None] | None = None  # None: nothing runs yet, leave at once

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        if self.requested:
            return
        self.requested = True
        if self.notify is None:
            os._exit(0)  # nothing was opened yet; an exception here would surface inside some import
        self.notify()


def take_signals() -> StopRequest:
    """Handle SIGINT and SIGTERM from now on."""
    stop = StopRequest()
    for number in SIGNALS:
        signal.signal(number, stop)
    return stop


def prepare(module: str, work: Callable[[], None] | None) -> None:
    """Let a node do what takes long and opens nothing: a signal ends the process meanwhile.

    In a thread, because a signal is taken by this one only between two steps of its own.
    """
    if work is None:
        return
    thread = threading.Thread(target=work, name="prepare", daemon=True)
    thread.start()
    thread.join(SOON)
    if thread.is_alive():
        print(f"{module}: compiles its machine code, once after installation: some minutes", file=sys.stderr)
    while thread.is_alive():
        thread.join(0.1)


def run(module: str, arguments: list[str] | None = None) -> int:
    """Run the node in ``<module>.py`` until a signal; exit status 0, or 2 for bad input."""
    stop = take_signals()
    node_module = importlib.import_module(f"rig_identification.nodes.{module}")
    spinning = importlib.import_module("rig_identification.nodes.spinning")
    prepare(module, getattr(node_module, "prepare", None))
    try:
        spinning.spin(node_module.create, stop, arguments)
    except InputError as error:
        print(f"{module}: {error}", file=sys.stderr)
        return UNUSABLE
    finally:
        # While it ends, which takes a while, the interpreter gives signals their deadly default back,
        # ignored ones excepted. Blocking them would not do: any other thread would still take them.
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
    return 0


def _executable(module: str) -> Callable[[], Any]:
    def main() -> int:
        return run(module)

    main.__doc__ = f"Executable of the node in ``{module}.py``."
    return main


load_cells = _executable("load_cells")
imu = _executable("imu")
inclinometer = _executable("inclinometer")
tracker = _executable("tracker")
preprocessor = _executable("preprocessor")
identifier = _executable("identifier")
rig_simulator = _executable("rig_simulator")
recorder = _executable("recorder")
replay = _executable("replay")
