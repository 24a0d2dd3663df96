"""The long tasks, each of one request and told as it goes: check, identify, plan, simulate.

A request names paths that the page has found inside of its folder. An answer is what the page shows of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from rig_identification.ui.folder import Folder


class Progress(Protocol):
    """Tells a stage and how far it is, 0 to 1."""

    def __call__(self, stage: str, fraction: float | None = None) -> None: ...


def check(request: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Examine a session and write its page."""
    from rig_identification.api import check as examined

    session = _session(request)
    found = examined(session, namespace=request["namespace"], progress=progress)
    found.write(request["out"])
    return {"faults": [fault.statement for fault in found.examination.faults]}


def identify(request: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Identify a session and write result and report; stopped, the best answer until then."""
    from rig_identification.api import Stopped
    from rig_identification.api import identify as identified

    session = _session(request)
    try:
        result = identified(session, namespace=request["namespace"], work=request["work"], progress=progress)
    except Stopped as stopped:
        result = stopped.result
    progress("writing the report")
    result.write(request["out"])
    return {"verdict": result.verdict, "interrupted": result.identification.interrupted}


def plan(request: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Plan a session and write its files."""
    from rig_identification.api.describing import read_rig
    from rig_identification.api.planning import boxed, means_of, plan_session
    from rig_identification.plan_report.page import summary

    body = boxed(read_rig(request["rig"]), request["box"], request["mass"])
    found = plan_session(request["rig"], body, means_of(**request["means"]), progress=progress)
    progress("writing the plan")
    found.write(request["out"])
    return {"summary": summary(found.plan)}


def simulate(request: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Simulate a session, keep it where that is asked for, and show how the body moves."""
    from rig_identification.api import simulate as simulated
    from rig_identification.ui.shown_motion import shown_motion

    progress("simulating")
    made = simulated(**request["options"])
    if request["out"] is not None:
        progress("writing the session")
        made.write(request["out"])
    return shown_motion(made)


def _session(request: Mapping[str, Any]) -> Path:
    """The session's folder, once all that its description names is known to lie in the page's folder."""
    from rig_identification.api.reading import named_files

    session = Path(request["session"])
    Folder(Path(request["root"])).check_inside(*named_files(session))
    return session


TASKS: Mapping[str, Callable[[Mapping[str, Any], Progress], dict[str, Any]]] = {
    "check": check,
    "identify": identify,
    "plan": plan,
    "simulate": simulate,
}
