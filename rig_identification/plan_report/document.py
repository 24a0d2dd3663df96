"""``plan.json``: every number of a plan, SI units."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from rig_identification import __version__
from rig_identification.plan.planning import Plan, Planned
from rig_identification.report.plain import plain
from rig_identification.result import ELEMENTS
from rig_identification.simulate import Multisine, Pulled, UnbalancedMass


def plan_document(plan: Plan) -> dict[str, object]:
    """The plan as plain JSON; what cannot be determined is null."""
    expected, seen = plan.expected, [name not in plan.expected.unobservable for name in ELEMENTS]
    std = np.where(seen, np.sqrt(np.diag(expected.covariance)), np.nan)
    found = plan.doubts
    document: dict[str, object] = {
        "version": __version__,
        "minutes": plan.means.minutes,
        "body": dict(zip(ELEMENTS, expected.values, strict=True)),
        "expected_std": dict(zip(ELEMENTS, std, strict=True)),
        "expected_std_if_nothing_is_left_out": dict(
            zip(ELEMENTS, np.where(seen, np.sqrt(np.diag(plan.alone)), np.nan), strict=True)
        ),
        "expected_relative_std": dict(zip(ELEMENTS, np.where(seen, plan.relative, np.nan), strict=True)),
        "worst_relative_std_of_inertia": plan.worst,
        "worst_relative_std_of_inertia_of_usual_session": plan.usual_worst,
        "unobservable": list(expected.unobservable),
        "recordings": [_recording(planned) for planned in plan.recordings],
        "steps": [
            {
                "item": step.choice.item.name,
                "minutes": step.seconds / 60.0,
                "relative_std": dict(zip(ELEMENTS, step.relative, strict=True)),
            }
            for step in plan.chosen.steps
        ],
        "undecided": [] if found is None else list(found.undecided),
        "bias_at_half_detection_limit": [] if found is None else [asdict(bias) for bias in found.biases],
        "what_else": [asdict(other) for other in plan.others],
        "left_out_of_the_menu": list(plan.left_out),
        **_after(plan),
    }
    return {key: plain(value) for key, value in document.items()}


def _after(plan: Plan) -> dict[str, object]:
    """What an earlier session adds to a plan; nothing without one."""
    if plan.before is None:
        return {}
    return {
        "earlier_std": dict(zip(ELEMENTS, plan.before, strict=True)),
        "ties": [{**asdict(d), "decided": d.decided} for d in plan.decisions],
    }


def _recording(planned: Planned) -> dict[str, object]:
    item, margins = planned.item, planned.margins
    out: dict[str, object] = {
        "name": item.name,
        "role": planned.role,
        "seconds": item.seconds,
        "do": item.text,
    }
    if item.static is not None and item.static.dummy is not None:
        dummy = item.static.dummy
        out["dummy"] = {"mass": dummy.mass, "position": dummy.position}
    if item.run is not None:
        out |= {
            "travel": margins.travel,
            "least_tension_share": margins.tension,
            "amplitude": margins.amplitude,
        }
        start, force = item.run.start, item.run.force
        if isinstance(start, Pulled):
            out["pull"] = {"force_world": start.force, "point_body": start.point}
        if isinstance(force, (UnbalancedMass, Multisine)):
            out["exciter"] = {"kind": type(force).__name__, **asdict(force)}
    return out


def write_plan(plan: Plan, path: Path) -> None:
    """Write :func:`plan_document` as strict JSON."""
    text = json.dumps(plan_document(plan), indent=2, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
