"""The live graph as the page sees it: a program beside the page listens (nodes/view_program.py).

The program runs while somebody looks, and some seconds longer. Without ROS it says so in its first line.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import secrets
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Mapping
from typing import Any

from rig_identification.errors import InputError

PROGRAM = (sys.executable, "-m", "rig_identification.nodes.view_program")
#: What a namespace may be called.
NAMESPACE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]{0,60}){0,6}/?")
#: s that the program goes on when nobody looks, and within which a request is answered.
LINGER, PATIENCE = 20.0, 15.0
#: Lines of one kind that are kept for who comes later; of every other kind the latest.
KEPT = {"running": 2000, "diagnostic": 200, "answer": 0}
#: Graphs at once.
MOST = 4


class Graph:
    """One namespace, and what was heard of it."""

    def __init__(self, namespace: str) -> None:
        self.namespace = namespace
        self._lock = threading.Condition()
        self._kept: dict[str, deque[tuple[int, str]]] = {}
        self._count = 0
        self._answers: dict[str, dict[str, Any]] = {}
        self._process = _process(namespace)
        self.looked = time.monotonic()
        self._follower = threading.Thread(target=self._follow, daemon=True)
        self._follower.start()

    @property
    def running(self) -> bool:
        """Whether the program does, or something that it said is still to be taken in."""
        return self._follower.is_alive()

    def since(self, count: int) -> tuple[int, list[str]]:
        """Lines of JSON that came after the first ``count``, and how many there are by now."""
        self.looked = time.monotonic()
        with self._lock:
            new = [line for kept in self._kept.values() for line in kept if line[0] > count]
            return self._count, [text for _, text in sorted(new)]

    def ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Hand on a request and wait for its answer. Raises InputError where none comes."""
        name = secrets.token_urlsafe(9)
        stream = self._process.stdin
        assert stream is not None
        try:
            stream.write(json.dumps({"id": name, **request}) + "\n")
            stream.flush()
        except (OSError, ValueError) as error:
            raise InputError(
                "the program that listens to the graph has ended; open the page again"
            ) from error
        with self._lock:
            if not self._lock.wait_for(lambda: name in self._answers, PATIENCE):
                raise InputError("the graph does not answer")
            return self._answers.pop(name)

    def end(self) -> None:
        """End the program."""
        if self.running:
            self._process.kill()
        self._follower.join(5.0)

    def _follow(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            try:
                said = json.loads(line)
                kind = str(said["kind"])
            except (ValueError, KeyError, TypeError):
                continue  # what a library prints
            with self._lock:
                if kind == "answer":
                    self._answers[str(said["id"])] = said
                else:
                    self._keep(kind, line.strip())
                self._lock.notify_all()
        code = self._process.wait()
        self._process.stdout.close()
        with self._lock:
            self._close_input()
            if "missing" not in self._kept:
                self._keep("ended", json.dumps({"kind": "ended", "message": f"it ended with {code}"}))

    def _close_input(self) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # what waits to be written goes nowhere
            self._process.stdin.close()

    def _keep(self, kind: str, line: str) -> None:
        self._count += 1
        self._kept.setdefault(kind, deque(maxlen=KEPT.get(kind, 1))).append((self._count, line))


class Graphs:
    """The graphs that somebody looks at."""

    def __init__(self) -> None:
        self._graphs: dict[str, Graph] = {}
        self._lock = threading.Lock()

    def of(self, namespace: str) -> Graph:
        """The graph below a namespace. Raises InputError: it cannot be called so, or too many are open."""
        if not NAMESPACE.fullmatch(namespace):
            raise InputError(f"{namespace[:60]!r}: is no namespace; give one as /rig")
        with self._lock:
            self._tidy()
            found = self._graphs.get(namespace)
            if found is None or not found.running:
                if len(self._graphs) >= MOST and found is None:
                    raise InputError(f"{len(self._graphs)} graphs are looked at; close a page first")
                found = self._graphs[namespace] = Graph(namespace)
                threading.Thread(target=self._watch, daemon=True).start()
            found.looked = time.monotonic()
            return found

    def _watch(self) -> None:
        """End what nobody looks at any longer."""
        while self._graphs:
            time.sleep(2.0)
            with self._lock:
                self._tidy()

    def _tidy(self) -> None:
        now = time.monotonic()
        for name, graph in list(self._graphs.items()):
            if now - graph.looked > LINGER:
                graph.end()
                del self._graphs[name]

    def end(self) -> None:
        """End all programs."""
        with self._lock:
            for graph in self._graphs.values():
                graph.end()
            self._graphs.clear()


def _process(namespace: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        (*PROGRAM, namespace), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        text=True, encoding="utf-8", start_new_session=True, env=dict(os.environ),
    )  # fmt: skip
