"""Open or describe a rig: a form, and beside it the rig as it would hang."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rig_identification.api.describing import read_rig, rig_of, rig_parameters, rig_schema, rig_text
from rig_identification.errors import FieldError, InputError
from rig_identification.files import write_together
from rig_identification.report.rig_drawing import rig_svgs
from rig_identification.report.rig_scene import described_scene
from rig_identification.rig import Rig
from rig_identification.ui.desk import Desk, posted, shown
from rig_identification.ui.rig_form import rig_form

#: What a new description begins with: a plate of 2 m by 1 m that hangs level on four cables.
BEGINNING: dict[str, Any] = {
    "gravity": 9.80665,
    "cables": [f"cable_{i}" for i in range(1, 5)],
    **{
        f"cable_{i}": {
            "ceiling_point": [x, y, 3.0],
            "body_point": [x, y, 0.0],
            "length": 2.0,
            "load_cell": "ceiling",
        }
        for i, (x, y) in enumerate(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)), start=1)
    },
}
#: Of the form, beside the description.
FILE, REPLACE = "file", "replace"


def _show(desk: Desk, request: Request) -> Response:
    name, fault, values = request.query_params.get("file", ""), "", BEGINNING
    if name:
        try:
            values = dict(rig_parameters(read_rig(desk.folder.below(name))))
        except InputError as error:
            fault = str(error)
    form = rig_form(rig_schema(), values)
    return desk.page(
        "describing.html.j2", "/rig", form=form, kept=json.dumps(dict(form.kept)),
        file=name or "rig.yaml", fault=fault, opened=bool(name), rigs=desk.folder.rigs(),
    )  # fmt: skip


def _draw(desk: Desk, given: Mapping[str, Any]) -> dict[str, Any]:
    """The drawing of a description as far as it is one; else its first fault, and the drawing as it was."""
    rig = rig_of(_description(given))
    return {"html": {"drawing": desk.part("drawing.html.j2", views=_views(rig))}}


def _views(rig: Rig) -> list[tuple[str, Markup]]:
    return [(name, Markup(svg)) for name, svg in rig_svgs(described_scene(rig))]


def _save(desk: Desk, given: Mapping[str, Any]) -> dict[str, Any]:
    name = given.get(FILE)
    if not isinstance(name, str) or not name.endswith((".yaml", ".yml")):
        raise FieldError(f"{FILE}: is no name of a YAML file", FILE, "give a name that ends in .yaml")
    try:
        path = desk.folder.below(name)
    except InputError as error:
        raise FieldError(f"{FILE}: {error}", FILE, str(error)) from error
    if path.name == "session.yaml" or any(part.startswith(".") for part in Path(name).parts):
        raise FieldError(f"{FILE}: is no rig's name", FILE, "give another name, as rig.yaml")
    text = rig_text(rig_of(_description(given)))
    if path.exists() and given.get(REPLACE) is not True:
        raise FieldError(f"{FILE}: exists", FILE, "exists already; tick “replace it”, or give another name")
    try:
        write_together(path.parent, {path.name: lambda aside: _write(aside, text)})
    except InputError as error:
        raise FieldError(f"{FILE}: {error}", FILE, str(error)) from error
    return {"html": {"saved": desk.part("saved.html.j2", name=desk.folder.name_of(path))}}


def _description(given: Mapping[str, Any]) -> Mapping[str, Any]:
    return {key: value for key, value in given.items() if key not in (FILE, REPLACE)}


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


ROUTES = [
    Route("/rig", shown(_show), methods=["GET"]),
    Route("/rig/drawing", posted(_draw), methods=["POST"]),
    Route("/rig/save", posted(_save), methods=["POST"]),
]
