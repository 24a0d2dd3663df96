"""A process that has closed its files ends, even where the middleware's clean-up hangs."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from rig_identification.nodes.last_resort import exit_after

HANG = "import ctypes; from rig_identification.nodes.last_resort import exit_after; exit_after(1); {}"


@pytest.mark.skipif(sys.platform != "linux", reason="the timer is Linux's")
def test_a_hanging_clean_up_is_left_behind_with_status_0() -> None:
    begun = time.monotonic()
    # PyDLL keeps Python's lock while the function runs
    program = HANG.format("ctypes.PyDLL(None).sleep(100)")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=90.0)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")
    assert 1.0 <= time.monotonic() - begun < 80.0


def test_an_end_in_time_is_its_own() -> None:
    done = subprocess.run([sys.executable, "-c", HANG.format("raise SystemExit(3)")], timeout=90.0)
    assert done.returncode == 3
    assert callable(exit_after)
