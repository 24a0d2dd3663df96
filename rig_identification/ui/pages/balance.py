"""The thesis' first window: angles and lengths in; pose, cable forces and centre of mass out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from markupsafe import Markup
from scipy.spatial.transform import Rotation
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rig_identification.api.asking import asked
from rig_identification.api.balancing import Balance, center_of_mass, example
from rig_identification.api.describing import read_rig
from rig_identification.quantity import NOT_DETERMINED, number, value_and_half_width
from rig_identification.report.rig_drawing import rig_svgs
from rig_identification.report.rig_scene import described_scene, rig_scene
from rig_identification.result import InertialEstimate
from rig_identification.rig import Rig
from rig_identification.statics import StaticPose, without_frame
from rig_identification.ui.desk import Desk, posted, shown

#: Name of the example among the rigs.
EXAMPLE = "Table 2.1 of the thesis"
#: Statuses of a solution that is an answer.
SOUND = ("determined",)


def _show(desk: Desk, request: Request) -> Response:
    chosen = request.query_params.get("rig", "")
    rig, readings = _of(desk, chosen)
    return desk.page(
        "balance.html.j2", "/balance", rigs=desk.folder.rigs(), chosen=chosen, example=EXAMPLE, rig=rig,
        readings=readings,
    )  # fmt: skip


def _of(desk: Desk, name: str) -> tuple[Rig, Mapping[str, Any]]:
    """A rig by its name, and readings to begin with."""
    if not name:
        return example()
    rig = read_rig(desk.folder.below(name))
    lengths = {cable.name: float(cable.length) for cable in rig.cables}
    return rig, {"mass": rig.mass, "lengths": lengths, "rest": [{"name": "bare"}, {"name": "loaded"}]}


def _solve(desk: Desk, given: Mapping[str, Any]) -> dict[str, Any]:
    rig, _ = _of(desk, asked("form", given).text("rig", "a rig") if given.get("rig") else "")
    found = center_of_mass(rig, {key: value for key, value in given.items() if key != "rig"})
    return {"html": {"answer": desk.part("balanced.html.j2", **_view(found))}}


def _view(found: Balance) -> dict[str, Any]:
    """What the page shows of a solution."""
    solution, rig = found.solution, found.rig
    known = np.all(np.isfinite(solution.center_of_mass))
    bodies = [
        (
            "Body" if rig.frame is None else "Body with its carrying frame",
            _center(solution.center_of_mass, solution.std),
        )
    ]
    if rig.frame is not None and known:
        _, center, covariance = without_frame(solution, rig.frame)
        bodies.append(("Body without its carrying frame", _center(center, np.sqrt(np.diag(covariance)))))
    return {
        "solution": solution,
        "sound": solution.status in SOUND,
        "bodies": bodies,
        "mass": value_and_half_width(solution.mass, solution.mass_std)
        if rig.mass is None and np.isfinite(solution.mass)
        else None,
        "poses": [_pose(pose, rig) for pose in solution.poses],
        "views": [(name, Markup(svg)) for name, svg in rig_svgs(_scene(found, bool(known)))],
    }


def _center(value: Any, std: Any) -> list[tuple[str, str, str]]:
    """Axis, value and half-width of the 95 % interval."""
    return [(axis, *_told(v, s)) for axis, v, s in zip("xyz", value, std, strict=True)]


def _told(value: float, std: float) -> tuple[str, str]:
    if not (np.isfinite(value) and np.isfinite(std)):
        return NOT_DETERMINED, ""
    return value_and_half_width(float(value), float(std))


def _pose(pose: StaticPose, rig: Rig) -> dict[str, Any]:
    turn = Rotation.from_quat(pose.orientation)
    forces = zip(rig.cables, pose.tension, pose.tension_std, strict=True)
    return {
        "name": pose.name,
        "position": [number(v, 6) for v in pose.position],
        "angles": [number(v, 6) for v in turn.as_euler("XYZ", degrees=True)],
        "cosines": [[number(v, 6) for v in row] for row in turn.as_matrix().T],
        "forces": [(cable.name, *_told(t, s)) for cable, t, s in forces],
    }


def _scene(found: Balance, known: bool) -> Any:
    if not known:
        return described_scene(found.rig)
    values = np.concatenate([[found.solution.mass], found.solution.center_of_mass, np.full(6, np.nan)])
    tensor = ("Jxx", "Jxy", "Jxz", "Jyy", "Jyz", "Jzz")
    return rig_scene(found.rig, InertialEstimate(values, np.full((10, 10), np.nan), tensor))


ROUTES = [
    Route("/balance", shown(_show), methods=["GET"]),
    Route("/balance/solve", posted(_solve), methods=["POST"]),
]
