"""A task under way: how far it is, stop, and what it found."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from markupsafe import Markup
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from rig_identification.errors import InputError
from rig_identification.report.rig_drawing import HEIGHT, WIDTH
from rig_identification.ui.desk import Desk, shown
from rig_identification.ui.jobs import RUNNING, Job


def _job(desk: Desk, request: Request) -> Job:
    job = desk.jobs.get(request.path_params["id"])
    if job is None:
        raise InputError("this task is not known any more; its files are where it wrote them")
    return job


def _show(desk: Desk, request: Request) -> Response:
    job = _job(desk, request)
    if job.state == RUNNING:
        return desk.page("job.html.j2", f"/{job.task}", job=job)
    values: dict[str, Any] = {"job": job, "out": job.out, "drawing": (WIDTH, HEIGHT)}
    values["poses"] = Markup(job.answer.get("poses", ""))  # replay_json leaves no "<" in it
    return desk.page("job.html.j2", f"/{job.task}", **values)


def _state(desk: Desk, request: Request) -> Response:
    return JSONResponse(_job(desk, request).told())


def _stop(desk: Desk, request: Request) -> Response:
    job = _job(desk, request)
    desk.jobs.stop(job)
    return JSONResponse(job.told())


def _route(path: str, function: Callable[[Desk, Request], Response], method: str = "GET") -> Route:
    return Route(path, shown(function), methods=[method])


ROUTES = [
    _route("/jobs/{id}", _show),
    _route("/jobs/{id}/state", _state),
    _route("/jobs/{id}/stop", _stop, "POST"),
]
