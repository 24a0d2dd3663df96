"""What lies in the folder, and what runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rig_identification.ui.desk import Desk, shown
from rig_identification.ui.folder import ANSWERS
from rig_identification.ui.pages.identify import answer_folder

#: Bytes of a result that is read for its verdict alone.
QUICK = 1 << 22


def _show(desk: Desk, _: Request) -> Response:
    sessions = [_session(desk, name) for name in desk.folder.sessions()]
    return desk.page(
        "overview.html.j2", "/", sessions=sessions, rigs=desk.folder.rigs(), jobs=desk.jobs.all(),
        answers=ANSWERS,
    )  # fmt: skip


def _session(desk: Desk, name: str) -> dict[str, Any]:
    """A session with the pages that there are of it."""
    folder = desk.folder.root / answer_folder(desk.folder, name)
    return {
        "name": name,
        "check": _below(desk, folder / "check.html"),
        "report": _below(desk, folder / "report.html"),
        "verdict": _verdict(folder / "result.json"),
    }


def _below(desk: Desk, file: Path) -> str:
    return desk.folder.name_of(file) if file.is_file() else ""


def _verdict(file: Path) -> str:
    """Verdict of a result; "" where there is none, or where reading it would take long."""
    try:
        if not file.is_file() or file.stat().st_size > QUICK:
            return ""
        verdict = json.loads(file.read_text(encoding="utf-8"))["mismatch"]["verdict"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return ""
    return str(verdict)[:20]


ROUTES = [Route("/", shown(_show))]
