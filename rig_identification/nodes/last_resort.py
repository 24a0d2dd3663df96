"""An end that nothing holds up: the middleware's own clean-up may hang.

Seen in about one of a hundred graphs whose processes all end at the same moment: the destruction of the node
does not come back. It is a call into C++ that may hold Python's lock, so that nothing in Python can end it.
"""

from __future__ import annotations

import ctypes
import sys

#: <signal.h>, <time.h>: a timer that calls a function in a thread of its own; the clock it counts on.
_SIGEV_THREAD, _CLOCK_MONOTONIC = 2, 1


class _SigEvent(ctypes.Structure):
    """struct sigevent of a 64-bit Linux: 64 bytes."""

    _fields_ = (
        ("value", ctypes.c_void_p),
        ("number", ctypes.c_int),
        ("notify", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("attributes", ctypes.c_void_p),
        ("rest", ctypes.c_byte * 32),
    )


class _TimerSpec(ctypes.Structure):
    """struct itimerspec: interval, then time to the first, each s and ns."""

    _fields_ = (("interval", ctypes.c_long * 2), ("first", ctypes.c_long * 2))


def exit_after(seconds: int) -> None:
    """End the process with status 0 in so many seconds, whatever it does by then.

    The C library itself calls ``_exit(0)``: files have to be closed before. Nothing happens where the
    C library is another.
    """
    if sys.platform != "linux" or ctypes.sizeof(ctypes.c_void_p) != 8:
        return
    libc = ctypes.CDLL(None)
    try:
        create, start = libc.timer_create, libc.timer_settime
    except AttributeError:
        return  # glibc before 2.34 has them elsewhere
    event = _SigEvent(notify=_SIGEV_THREAD, function=ctypes.cast(libc._exit, ctypes.c_void_p).value)
    timer = ctypes.c_void_p()
    if create(_CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)) == 0:
        spec = _TimerSpec((0, 0), (seconds, 0))
        start(timer, 0, ctypes.byref(spec), None)
