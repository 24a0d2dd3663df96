"""Show the tasks of a lab as a page in a browser: describe, check, plan, simulate, identify.

Prints the link to open. The page works on the sessions and rigs below one folder, writes its answers into
DIR/answers, and needs no connection. It is this machine's alone unless --host says otherwise; whoever has the
link can use it. Ctrl-C ends it and its tasks.

  rig-identification ui --folder sessions
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rig_identification.errors import InputError

HOST, PORT = "127.0.0.1", 8765


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the folder, and where to listen."""
    parser.add_argument(
        "--folder", type=Path, default=Path(), metavar="DIR", help="of sessions and rigs (default: this one)"
    )
    parser.add_argument("--port", type=int, default=PORT, help="default: %(default)s; 0: any that is free")
    parser.add_argument(
        "--host",
        default=HOST,
        metavar="ADDRESS",
        help="address to listen on; other than %(default)s others on the network reach the page, unencrypted",
    )


def run(arguments: argparse.Namespace) -> None:
    """Serve until Ctrl-C."""
    from rig_identification.optional import needed

    for module in ("starlette", "uvicorn"):
        needed(module, "the page", "ui")
    from rig_identification.ui.server import serve

    if not arguments.folder.is_dir():
        raise InputError(f"--folder {arguments.folder}: is no folder; name one that holds sessions")
    if not 0 <= arguments.port <= 65535:
        raise InputError(f"--port {arguments.port}: give 0 to 65535")
    serve(arguments.folder, arguments.host, arguments.port)
