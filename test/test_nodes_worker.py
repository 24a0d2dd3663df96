"""How a program beside a node speaks, and how it is interrupted."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import pytest

from rig_identification.nodes.worker_process import WorkerProcess

#: Speaks all the time, or works in silence; asked for its best answer until then, it has one or none.
PROGRAM = """
import sys, time
from rig_identification.nodes.worker_program import run, say

def work():
    count = 0
    try:
        while True:
            count += 1
            if sys.argv[1] == "talks":
                say("progress", stage="x" * 5000, fraction=0.5)
            else:
                time.sleep(0.01)
    except KeyboardInterrupt:
        if sys.argv[2] == "none":
            raise
    return {"count": count}

run(work)
"""


def started(*manner: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-c", PROGRAM, *manner]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)


@pytest.mark.parametrize("manner", ["talks", "works"])
@pytest.mark.parametrize("best", ["some", "none"])
def test_an_interrupt_never_tears_a_line(manner: str, best: str) -> None:
    with started(manner, best) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["stage"] == "reading"
        time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGINT)  # a second one changes nothing
        lines = [json.loads(line) for line in process.stdout]
        assert process.wait(timeout=60.0) == 0
    assert lines[-1]["kind"] == ("cancelled" if best == "none" else "result")
    assert {line["kind"] for line in lines[:-1]} <= {"progress"}


def test_a_program_ends_with_its_node() -> None:
    with started("works", "some") as process:
        assert process.stdout is not None
        assert process.stdin is not None
        process.stdout.readline()
        process.stdin.close()
        assert process.wait(timeout=60.0) == 1


def wait_for(process: WorkerProcess) -> None:
    end = time.monotonic() + 60.0
    while not process.look():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_process_that_has_not_spoken_is_ended_at_once() -> None:
    process = WorkerProcess("fit_program", "/nowhere")
    process.interrupt()
    wait_for(process)
    assert process.answer == {"kind": "cancelled"}
    process.end()


def test_what_cannot_be_read_is_said() -> None:
    process = WorkerProcess("check_program", "/nowhere")
    wait_for(process)
    assert process.answer is not None
    assert process.answer["kind"] == "error"
    assert "/nowhere" in process.answer["message"]
    process.end()
