"""The live page: what the graph says, as events; windows by buttons."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from rig_identification.api.asking import asked
from rig_identification.errors import InputError
from rig_identification.ui.desk import Desk, posted, shown
from rig_identification.ui.graph import Graph

DEFAULT = "/rig"
#: s between looks for what is new.
OFTEN = 0.04
KINDS = ("dynamic", "static")


def _show(desk: Desk, request: Request) -> Response:
    return desk.page(
        "live.html.j2", "/live", namespace=request.query_params.get("namespace", DEFAULT), kinds=KINDS
    )


async def _events(request: Request) -> Response:
    """What is heard of the graph, as server-sent events, for as long as the page is open."""
    desk: Desk = request.app.state.desk
    try:
        graph = await asyncio.to_thread(desk.graphs.of, request.query_params.get("namespace", DEFAULT))
    except InputError as error:
        return PlainTextResponse(str(error), 404)
    return StreamingResponse(_told(graph, request), media_type="text/event-stream")


async def _told(graph: Graph, request: Request) -> AsyncIterator[str]:
    count = 0
    yield "retry: 2000\n\n"
    while True:
        running = graph.running
        count, lines = graph.since(count)
        for line in lines:
            yield f"data: {line}\n\n"
        if not running and not lines:
            # What it said last was told; the page asks again after the time above
            await asyncio.sleep(2.0)
            return
        if await request.is_disconnected():
            return
        await asyncio.sleep(OFTEN)


def _window(desk: Desk, given: Mapping[str, Any]) -> dict[str, Any]:
    fields = asked("form", given)
    fields.refuse_unknown(("do", "namespace", "window", "name", "holdout", "dummy_mass", "dummy_position"))
    do = fields.text("do", "start or stop")
    if do not in ("start", "stop"):
        raise fields.fault("do", "is unknown; give start or stop")
    request: dict[str, Any] = {"do": do}
    if do == "start":
        window = fields.text("window", "dynamic or static")
        if window not in KINDS:
            raise fields.fault("window", f"is unknown; give {' or '.join(KINDS)}")
        mass = fields.number("dummy_mass", "kg", at_least=0.0, at_most=1e6) if "dummy_mass" in given else 0.0
        place = fields.vector("dummy_position", 3, "m") if "dummy_position" in given else (0.0, 0.0, 0.0)
        request |= {
            "window": window,
            "name": fields.text("name", "a folder's name") if given.get("name") else "",
            "holdout": given.get("holdout") is True and window == "dynamic",
            "dummy_mass": mass if window == "static" else 0.0,
            "dummy_position": [float(x) for x in place],
        }
    answer = desk.graphs.of(fields.text("namespace", "as /rig")).ask(request)
    if not answer["success"]:
        raise InputError(str(answer["message"]))
    return {"told": str(answer["message"])}


ROUTES = [
    Route("/live", shown(_show), methods=["GET"]),
    Route("/live/events", _events, methods=["GET"]),
    Route("/live/window", posted(_window), methods=["POST"]),
]
