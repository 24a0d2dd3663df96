"""The page's server: one socket, one token, until it is interrupted."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Callable
from pathlib import Path

import uvicorn

from rig_identification.errors import InputError
from rig_identification.ui.app import application

#: Connections at once: a browser opens six.
MOST_CONNECTIONS = 64


def serve(folder: Path, host: str, port: int, say: Callable[[str], None] | None = None) -> None:
    """Serve the page over ``folder`` and print its link.

    port: 0 takes any that is free. say: takes the line with the link in place of standard output. Raises
    InputError where the address cannot be listened on.
    """
    bound = listening(host, port)
    taken = bound.getsockname()[1]
    token = secrets.token_urlsafe(24)
    config = uvicorn.Config(
        application(folder, token, host, taken),
        log_level="warning",
        access_log=False,  # it would write the token
        server_header=False,
        ws="none",
        limit_concurrency=MOST_CONNECTIONS,
        timeout_keep_alive=30,
        timeout_graceful_shutdown=2,
    )
    name = f"[{host}]" if ":" in host else host
    (say or _printed)(f"open http://{name}:{taken}/?token={token}")
    uvicorn.Server(config).run(sockets=[bound])


def _printed(line: str) -> None:
    print(line, flush=True)


def listening(host: str, port: int) -> socket.socket:
    """A socket that listens; port 0: any that is free. Raises InputError."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    found = socket.socket(family)
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((host, port))
        found.listen(MOST_CONNECTIONS)
    except OSError as error:
        found.close()
        raise InputError(
            f"{host}:{port}: cannot be listened on ({error.strerror or error}); name another --port"
        ) from error
    return found
