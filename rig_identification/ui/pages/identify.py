"""Check and identify a session of the folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rig_identification.api.asking import asked
from rig_identification.model.work import WORK
from rig_identification.ui.desk import Desk, posted, shown
from rig_identification.ui.folder import ANSWERS, Folder

#: Units of work that may be asked for: more than a day of two cores is a slip.
MOST_WORK = 1e5


def answer_folder(folder: Folder, session: str) -> str:
    """Name of the folder that a session's answers go to."""
    name = folder.root.name if session == "." else session
    return f"{ANSWERS}/{name}"


def _shows(task: str) -> Any:
    def show(desk: Desk, request: Request) -> Response:
        return desk.page(
            f"{task}ing.html.j2",
            f"/{task}",
            sessions=desk.folder.sessions(),
            chosen=request.query_params.get("session", ""),
            work=WORK,
        )

    return shown(show)


def _check(desk: Desk, given: Mapping[str, Any]) -> dict[str, Any]:
    return _started(desk, "check", _request(desk, given, ("session", "namespace")))


def _identify(desk: Desk, given: Mapping[str, Any]) -> dict[str, Any]:
    request = _request(desk, given, ("session", "namespace", "work"))
    fields = asked("form", given)
    request["work"] = fields.number("work", "units", above=0.0, at_most=MOST_WORK)
    return _started(desk, "identify", request)


def _started(desk: Desk, task: str, request: Mapping[str, Any]) -> dict[str, Any]:
    out = desk.folder.name_of(Path(request["out"]))
    job = desk.jobs.start(task, f"{task.capitalize()} {Path(request['session']).name}", request, out)
    return {"go": f"/jobs/{job.id}"}


def _request(desk: Desk, given: Mapping[str, Any], known: tuple[str, ...]) -> dict[str, Any]:
    """Paths and options of a task on a session."""
    fields = asked("form", given)
    fields.refuse_unknown(known)
    name = fields.text("session", "a session")
    path: Path = desk.folder.below(name) if name != "." else desk.folder.root
    if not (path / "session.yaml").is_file():
        raise fields.fault("session", f"{name[:80]!r} holds no session.yaml; choose one of the list")
    return {
        "session": str(path),
        "root": str(desk.folder.root),
        "namespace": fields.text("namespace", "the topics' namespace, as /rig"),
        "out": str(desk.folder.below(answer_folder(desk.folder, desk.folder.name_of(path)))),
    }


ROUTES = [
    Route("/check", _shows("check"), methods=["GET"]),
    Route("/check/start", posted(_check), methods=["POST"]),
    Route("/identify", _shows("identify"), methods=["GET"]),
    Route("/identify/start", posted(_identify), methods=["POST"]),
]
