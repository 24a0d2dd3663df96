"""The page as a program reaches it: a real server in a thread of its own, and requests with any headers."""

from __future__ import annotations

import http.client
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn

from rig_identification.ui.app import application
from rig_identification.ui.server import listening

TOKEN = "a-token-of-the-tests"
#: s until a task of the tests has ended: whoever compiles the model first takes minutes on a busy machine.
PATIENCE = 1200.0


@dataclass(frozen=True)
class Answer:
    """Status, headers by their lower-case names, and body of an answer."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def text(self) -> str:
        return self.body.decode()

    @property
    def json(self) -> Any:
        return json.loads(self.body)


@dataclass(frozen=True)
class Client:
    """Asks one server; ``folder``: what the page works on."""

    port: int
    folder: Path

    @property
    def host(self) -> str:
        return f"127.0.0.1:{self.port}"

    @property
    def link(self) -> str:
        return f"http://{self.host}/?token={TOKEN}"

    @property
    def cookie(self) -> str:
        return f"rig_identification_{self.port}={TOKEN}"

    def ask(
        self, path: str, method: str = "GET", body: bytes | None = None, known: bool = True, **headers: str
    ) -> Answer:
        """One request; ``known``: with the page's cookie. Headers: underscores stand for dashes."""
        sent = {name.replace("_", "-"): value for name, value in headers.items()}
        if known:
            sent.setdefault("Cookie", self.cookie)
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60.0)
        try:
            connection.request(method, path, body, sent)
            got = connection.getresponse()
            body = b""
            with suppress(ConnectionResetError):  # a refused request is closed before it is read
                body = got.read()
            return Answer(got.status, {k.lower(): v for k, v in got.getheaders()}, body)
        finally:
            connection.close()

    def post(self, path: str, values: object, **headers: str) -> Answer:
        """An object as JSON, as the page's own script sends it."""
        sent = {"Content_Type": "application/json", "Origin": f"http://{self.host}", **headers}
        return self.ask(path, "POST", json.dumps(values).encode(), **sent)

    def ended(self, go: str) -> dict[str, Any]:
        """State of a task once it has ended."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            told: dict[str, Any] = self.ask(f"{go}/state").json
            if told["state"] != "running":
                return told
            time.sleep(0.1)
        raise AssertionError(f"{go} did not end: {told}")


@contextmanager
def served(folder: Path) -> Iterator[Client]:
    """The page over a folder."""
    bound = listening("127.0.0.1", 0)
    port = bound.getsockname()[1]
    config = uvicorn.Config(application(folder, TOKEN, "127.0.0.1", port), log_level="error", ws="none")
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]}, daemon=True)
    thread.start()
    until = time.monotonic() + 30.0
    while not server.started and time.monotonic() < until:
        time.sleep(0.02)
    assert server.started
    try:
        yield Client(port, folder)
    finally:
        server.should_exit = True
        thread.join(30.0)
        bound.close()
        assert not thread.is_alive()
