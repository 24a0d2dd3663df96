"""The thesis' simulator window: a body, its force, where it begins; the motion played back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rig_identification.api.asking import asked
from rig_identification.api.cases import case_named
from rig_identification.errors import InputError
from rig_identification.result import ELEMENTS
from rig_identification.ui.desk import Desk, posted, shown

if TYPE_CHECKING:
    from rig_identification.session.fields import Fields

#: Case studies of the thesis, as they are chosen.
CASES = tuple(f"case {n}" for n in (*range(1, 18), "18a", "18b", "18c", "18d"))
STARTS = ("at rest", "pulled aside", "off its rest")
FORCES = ("none", "unbalanced mass")
PLANES = ("xy", "xz", "yz")
UNITS = ("kg", "m", "m", "m", *("kg m²",) * 6)
#: Where simulated sessions go.
SIMULATED = "simulated"
#: Of a run, s: what the page draws and a person waits for.
LONGEST = 300.0


def _show(desk: Desk, request: Request) -> Response:
    chosen = request.query_params.get("rig", CASES[13])
    case = case_named(chosen.removeprefix("case ")) if chosen in CASES else None
    return desk.page(
        "simulating.html.j2", "/simulate", rigs=[*CASES, *desk.folder.rigs()], chosen=chosen, case=case,
        starts=STARTS, forces=FORCES, planes=PLANES, elements=list(zip(ELEMENTS, UNITS, strict=True)),
    )  # fmt: skip


def _start(desk: Desk, given: Mapping[str, Any]) -> dict[str, Any]:
    fields = asked("form", given)
    options = {**_hung(desk, fields), **_begun(fields), **_shaken(fields)}
    options["duration"] = fields.number("duration", "s", at_least=1.0, at_most=LONGEST)
    options["seed"] = int(fields.number("seed", "1", at_least=0.0, at_most=1e9))
    options["noise"] = options["doubts"] = fields.flag("real")
    out = ""
    if fields.has("keep"):
        out = f"{SIMULATED}/{_name(fields)}"
        if desk.folder.below(out).exists():
            raise fields.fault("keep", f"{out} exists already; give another name")
    options["rest"] = 10.0 if out else 0.0
    path = str(desk.folder.below(out)) if out else None
    job = desk.jobs.start("simulate", f"Simulate {given['rig']}", {"options": options, "out": path}, out)
    return {"go": f"/jobs/{job.id}"}


def rig_file(desk: Desk, fields: Fields) -> Path:
    """The file of a rig that a form names. Raises FieldError."""
    name = fields.text("rig", "a rig")
    try:
        path = desk.folder.below(name)
    except InputError as error:
        raise fields.fault("rig", str(error)) from error
    if not path.is_file():
        raise fields.fault("rig", f"{name[:80]!r} is no file; choose one of the list")
    return path


def _name(fields: Fields) -> str:
    """Name of the session's new folder. Raises FieldError."""
    name = fields.text("keep", "a name")
    if not name.replace("_", "").replace("-", "").isalnum() or len(name) > 80:
        raise fields.fault("keep", "give letters, figures, - and _ alone")
    return name


def _hung(desk: Desk, fields: Fields) -> dict[str, Any]:
    """Which body on which rig."""
    rig = fields.text("rig", "a rig or a case")
    if rig in CASES:
        return {"case": rig.removeprefix("case ")}
    body = fields.section("body", "the ten numbers")
    ten = [body.number(name, unit) for name, unit in zip(ELEMENTS, UNITS, strict=True)]
    return {"rig": str(rig_file(desk, fields)), "body": ten}


def _begun(fields: Fields) -> dict[str, Any]:
    """Where the runs begin."""
    start = fields.choice("start", STARTS)
    if start == STARTS[0]:
        return {"start": "rest"}
    if start == STARTS[1]:
        return {"start": "pulled", "pull": fields.number("pull", "of the weight", above=0.0, at_most=0.5)}
    shift = fields.vector("shift", 3, "m", limit=10.0)
    turn = fields.vector("turn_deg", 3, "°", limit=90.0)
    return {"displaced": [*map(float, shift), *(math.radians(angle) for angle in turn)]}


def _shaken(fields: Fields) -> dict[str, Any]:
    """The force: of a mass that turns, m r (2 pi f)^2 at full speed."""
    if fields.choice("force", FORCES) == FORCES[0]:
        return {}
    newton = fields.number("newton", "N", above=0.0, at_most=1e6)
    frequency = fields.number("frequency", "Hz", above=0.0, at_most=20.0)
    unbalance = newton / (2.0 * math.pi * frequency) ** 2
    return {"motor": [unbalance, 1.0, frequency], "plane": fields.choice("plane", PLANES)}


ROUTES = [
    Route("/simulate", shown(_show), methods=["GET"]),
    Route("/simulate/start", posted(_start), methods=["POST"]),
]
