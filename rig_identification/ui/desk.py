"""What every part of the page works with, and what its answers are made of."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response

from rig_identification import __version__
from rig_identification.errors import FieldError, InputError
from rig_identification.report.page import page_environment
from rig_identification.ui.folder import Folder
from rig_identification.ui.graph import Graphs
from rig_identification.ui.jobs import Jobs

#: The tasks, as they stand above every page: path, name.
TASKS = (
    ("/", "Overview"),
    ("/rig", "Rig"),
    ("/check", "Check"),
    ("/plan", "Plan"),
    ("/simulate", "Simulate"),
    ("/balance", "Centre of mass"),
    ("/identify", "Identify"),
    ("/live", "Live"),
    ("/history", "History"),
)
#: A report is shown as a document without an origin: its own scripts run, and can ask this page nothing. It
#: may be anybody's.
APART = (
    "sandbox allow-scripts allow-downloads allow-modals; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)


@dataclass(frozen=True)
class Desk:
    """One page over one folder."""

    folder: Folder
    jobs: Jobs = field(default_factory=Jobs)
    graphs: Graphs = field(default_factory=Graphs)
    templates: Environment = field(default_factory=lambda: _templates())

    def page(self, template: str, here: str, status: int = 200, **values: Any) -> HTMLResponse:
        """A page of its own, with the tasks above it. here: path of the task."""
        values |= {"tasks": TASKS, "here": here, "version": __version__, "folder": str(self.folder.root)}
        return HTMLResponse(self.part(template, **values), status)

    def part(self, template: str, **values: Any) -> str:
        """A template filled in; every text is escaped."""
        return self.templates.get_template(template).render(**values)


def _templates() -> Environment:
    environment, _ = page_environment()
    own = PackageLoader("rig_identification.ui", "templates")
    assert environment.loader is not None
    environment.loader = ChoiceLoader([own, environment.loader])
    environment.filters["typed"] = lambda value: f"{value:.10g}"  # a number as a person types it
    return environment


def shown(function: Callable[[Desk, Request], Response]) -> Callable[[Request], Any]:
    """An endpoint that shows something; what cannot be shown is told on a page."""

    async def endpoint(request: Request) -> Response:
        desk: Desk = request.app.state.desk
        try:
            return await run_in_threadpool(function, desk, request)
        except InputError as error:
            return desk.page("error.html.j2", "", 404, message=str(error))

    return endpoint


def posted(function: Callable[[Desk, Mapping[str, Any]], dict[str, Any]]) -> Callable[[Request], Any]:
    """An endpoint that takes an object of JSON and answers one.

    A fault is answered as ``{"fault": {"key", "problem"}}``: where in the form it belongs, and what it is.
    """

    async def endpoint(request: Request) -> Response:
        if request.headers.get("content-type", "").partition(";")[0] != "application/json":
            return JSONResponse({"fault": {"key": "", "problem": "the request is no JSON"}}, 415)
        try:
            given = json.loads(await request.body(), parse_constant=_no_number)
            if not isinstance(given, dict):
                raise ValueError("no object")
        except (ValueError, RecursionError):
            return JSONResponse({"fault": {"key": "", "problem": "the request is no object of JSON"}}, 400)
        desk: Desk = request.app.state.desk
        try:
            return JSONResponse(await run_in_threadpool(function, desk, given))
        except FieldError as error:
            return JSONResponse({"fault": {"key": error.key, "problem": error.problem}}, 422)
        except InputError as error:
            return JSONResponse({"fault": {"key": "", "problem": str(error)}}, 422)

    return endpoint


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is no number")


def apart(text: str) -> Response:
    """A page of the package's reports, without an origin."""
    return Response(
        text, headers={"content-security-policy": APART, "content-type": "text/html; charset=utf-8"}
    )
