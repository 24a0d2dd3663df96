"""The page as an ASGI application: which path leads to which part."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from rig_identification.errors import InputError
from rig_identification.report.page import page_environment, script, vendored
from rig_identification.ui.desk import APART, Desk, shown
from rig_identification.ui.folder import Folder
from rig_identification.ui.guard import App, Guard
from rig_identification.ui.pages import balance, history, identify, jobs, live, overview, plan, rig, simulate

#: Endings of the files that the page shows, and as what.
SHOWN = {
    ".html": "text/html; charset=utf-8",
    ".json": "application/json",
    ".yaml": "text/plain; charset=utf-8",
    ".csv": "text/csv; charset=utf-8",
}
HERE = Path(__file__).parent


def application(root: Path, token: str, address: str, port: int) -> App:
    """The page over the folder ``root``. token, address, port: see :class:`~.guard.Guard`."""
    desk = Desk(Folder(root.resolve()))

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        yield
        desk.jobs.end()
        desk.graphs.end()

    routes = [
        Route("/static/{name}", _static),
        Route("/files/{name:path}", shown(_file)),
        *overview.ROUTES,
        *rig.ROUTES,
        *balance.ROUTES,
        *identify.ROUTES,
        *plan.ROUTES,
        *simulate.ROUTES,
        *history.ROUTES,
        *live.ROUTES,
        *jobs.ROUTES,
    ]
    app = Starlette(routes=routes, lifespan=lifespan)
    app.state.desk = desk
    return Guard(app, token, address, port)


def _file(desk: Desk, request: Request) -> Response:
    """A file of the folder as it is."""
    name = request.path_params["name"]
    path = desk.folder.below(name)
    kind = SHOWN.get(path.suffix)
    hidden = any(part.startswith(".") for part in name.split("/"))
    if kind is None or hidden or not path.is_file():
        raise InputError(f"{name[:200]}: is no file that this page shows")
    return FileResponse(path, headers={"content-security-policy": APART}, media_type=kind)


async def _static(request: Request) -> Response:
    """Style and scripts of the page."""
    made = _STATIC.get(request.path_params["name"])
    if made is None:
        return Response("There is no such file.", 404, media_type="text/plain")
    return Response(made(), media_type=_KIND[request.path_params["name"].rpartition(".")[2]])


def _own(name: str) -> str:
    return (HERE / "static" / name).read_text(encoding="utf-8")


def _style() -> str:
    return f"{page_environment()[1]}\n{vendored('uplot', 'uPlot.min.css')}\n{_own('ui.css')}"


def _replay() -> str:
    return str(script(page_environment()[0], "replay.js"))


_KIND = {"css": "text/css", "js": "text/javascript"}
_STATIC: dict[str, Any] = {
    "style.css": _style,
    "ui.js": lambda: _own("ui.js"),
    "charts.js": lambda: _own("charts.js"),
    "live.js": lambda: _own("live.js"),
    "uplot.js": lambda: str(vendored("uplot", "uPlot.iife.min.js")),
    "replay.js": _replay,
}
