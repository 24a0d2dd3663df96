"""What the rig is given: the session description to record under, and the exciter's commands over time."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from rig_identification.plan.planning import Plan
from rig_identification.session.exciter_commands import HEAD
from rig_identification.simulate import Multisine, Pulled, UnbalancedMass

#: Rows a second of the exciter's commands.
COMMAND_RATE = 50.0


def session_text(plan: Plan, rig: str) -> str:
    """``session.yaml`` of the plan, with what to do in comments. rig: the description's name."""
    lines = [
        "# Made by rig-identification plan. Record each bag under its name.",
        f"rig: {rig}",
        "recordings:",
    ]
    for planned in plan.recordings:
        item = planned.item
        lines.append(f"  # {item.seconds:g} s {planned.role}: {instruction(plan, item.name)}")
        parts = [f"bag: {item.name}", f"kind: {'static' if item.run is None else 'dynamic'}"]
        if item.static is not None and item.static.dummy is not None:
            place = ", ".join(f"{v:g}" for v in item.static.dummy.position)
            parts.append(f"dummy: {{mass: {item.static.dummy.mass:g}, position: [{place}]}}")
        if planned.role == "held out":
            parts.append("holdout: true")
        lines.append(f"  - {{{', '.join(parts)}}}")
    return "\n".join(lines) + "\n"


def instruction(plan: Plan, name: str) -> str:
    """What a person does for one recording, with its strength."""
    item = next(p.item for p in plan.recordings if p.item.name == name)
    if item.run is None:
        return item.text
    told = [item.text]
    if isinstance(item.run.start, Pulled):
        told.append(f"pull of {np.linalg.norm(item.run.start.force):.3g} N")
    if isinstance(item.run.force, UnbalancedMass):
        told.append(f"unbalance of {item.run.force.unbalance:.3g} kg m")
    if isinstance(item.run.force, Multisine):
        told.append(f"at most {item.run.force.largest:.3g} N on each axis")
    return "; ".join(told)


def write_session_text(plan: Plan, rig: str, path: Path) -> None:
    """Write :func:`session_text`."""
    path.write_text(session_text(plan, rig), encoding="utf-8")


def write_commands(plan: Plan, path: Path) -> None:
    """Write the exciter's commands: a line a fiftieth of a second of every run that it drives.

    Forces are in the exciter frame. Speed and angle are those of an unbalanced mass' shaft, else empty.
    """
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(HEAD)
        for planned in plan.recordings:
            run = planned.item.run
            if run is None or not isinstance(run.force, (UnbalancedMass, Multisine)):
                continue
            time = np.arange(0.0, run.duration, 1.0 / COMMAND_RATE)
            force = run.force(time)
            shaft = run.force.shaft(time) if isinstance(run.force, UnbalancedMass) else None
            for i, t in enumerate(time):
                turning = (
                    ("", "") if shaft is None else (f"{shaft[i, 1] / (2 * np.pi):.5g}", f"{shaft[i, 0]:.6g}")
                )
                table.writerow((planned.item.name, f"{t:.2f}", *turning, *(f"{f:.5g}" for f in force[i])))
