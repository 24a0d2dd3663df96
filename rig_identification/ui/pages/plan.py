"""Plan a session on a rig of the folder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rig_identification.api.asking import asked
from rig_identification.api.planning import EXCITERS, LIMITS
from rig_identification.ui.desk import Desk, posted, shown
from rig_identification.ui.pages.simulate import rig_file

#: Where plans go, one folder a rig.
PLANS = "plans"
#: Means: key, what it is, unit, and what it begins with.
MEANS = (
    ("minutes", "Time in all", "min", 5.0),
    ("force", "Largest force of the exciter", "share of the weight", 0.05),
    ("pull", "Largest pull aside", "share of the weight", 0.06),
    ("highest", "Highest frequency of the exciter", "Hz", 2.0),
    ("travel", "Largest movement of any hinge", "m", 0.15),
    ("taut", "Tension that each cable keeps", "share of that at rest", 0.1),
    ("rest", "Length of a recording at rest", "s", 10.0),
)


def _show(desk: Desk, request: Request) -> Response:
    return desk.page(
        "planning.html.j2", "/plan", rigs=desk.folder.rigs(), chosen=request.query_params.get("rig", ""),
        means=MEANS, exciters=EXCITERS,
    )  # fmt: skip


def _start(desk: Desk, given: Mapping[str, Any]) -> dict[str, Any]:
    fields = asked("form", given)
    fields.refuse_unknown(("rig", "box", "mass", "exciter", *LIMITS))
    rig = rig_file(desk, fields)
    means: dict[str, Any] = {
        name: fields.number(name, unit, above=0.0, at_most=LIMITS[name]) for name, _, unit, _ in MEANS
    }
    means["exciter"] = fields.choice("exciter", EXCITERS)
    box = [float(edge) for edge in fields.vector("box", 3, "m", limit=100.0)]
    if min(box) <= 0.0:
        raise fields.fault("box", "edges must be positive")
    name = desk.folder.name_of(rig)
    out = f"{PLANS}/{name.rpartition('.')[0]}"
    request = {
        "rig": str(rig),
        "box": box,
        "mass": fields.number("mass", "kg", above=0.0, at_most=1e6) if fields.has("mass") else None,
        "means": means,
        "out": str(desk.folder.below(out)),
    }
    return {"go": f"/jobs/{desk.jobs.start('plan', f'Plan for {name}', request, out).id}"}


ROUTES = [
    Route("/plan", shown(_show), methods=["GET"]),
    Route("/plan/start", posted(_start), methods=["POST"]),
]
