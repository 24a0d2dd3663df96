"""An answer in result.json's terms as ROS messages; what was not determined is NaN."""

from __future__ import annotations

from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import InertiaStamped
from numpy.typing import NDArray
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from rig_identification.nodes.rig_node import OK, WARN, diagnostic
from rig_identification.quantity import with_interval
from rig_identification.result import ELEMENTS

_NAN = float("nan")


def _number(value: float | None) -> float:
    return _NAN if value is None else float(value)


def _shown(parameter: dict[str, Any]) -> str:
    """A finding's number with its 95 % interval, as the report has it; "–" where there is none."""
    value, std = parameter["value"], parameter["std"]
    if not isinstance(value, (int, float)):
        return "–" if value is None else str(value)
    return with_interval(value, 0.0 if std is None else std, parameter["unit"] or "1")


def inertia_message(result: dict[str, Any], stamp: Time) -> InertiaStamped:
    """Mass, centre of mass and inertia about it, in frame ``body``."""
    J = result["inertia"]["value"]
    six = [J[0][0], J[0][1], J[0][2], J[1][1], J[1][2], J[2][2]]
    return inertia_of([result["mass"]["value"], *result["center_of_mass"]["value"], *six], stamp)


def inertia_of(elements: list[float | None] | NDArray[np.float64], stamp: Time) -> InertiaStamped:
    """Ten numbers in the order of ELEMENTS."""
    ten = [_number(value) for value in elements]
    message = InertiaStamped()
    message.header.frame_id, message.header.stamp = "body", stamp
    inertia = message.inertia
    inertia.m, inertia.com.x, inertia.com.y, inertia.com.z = ten[:4]
    inertia.ixx, inertia.ixy, inertia.ixz, inertia.iyy, inertia.iyz, inertia.izz = ten[4:]
    return message


def matrix_message(rows: list[list[float | None]] | NDArray[np.float64]) -> Float64MultiArray:
    """A square matrix; its dimensions are labelled by the elements' names."""
    data = [_number(value) for row in rows for value in row]
    size = len(rows)
    label = " ".join(ELEMENTS[:size])
    dims = [
        MultiArrayDimension(label=label, size=size, stride=size * size),
        MultiArrayDimension(label=label, size=size, stride=size),
    ]
    message = Float64MultiArray(data=data)
    message.layout.dim = dims
    return message


def mismatch_message(answer: dict[str, Any], stamp: Time) -> DiagnosticArray:
    """The verdict, then one line a finding."""
    mismatch = answer["result"]["mismatch"]
    verdict = mismatch["verdict"]
    level = WARN if verdict == "unexplained" else OK
    status = [diagnostic("mismatch", level, f"{verdict}: {answer['explanation']}")]
    for finding in mismatch["findings"]:
        values = {name: _shown(p) for name, p in finding["parameters"].items()}
        values.update({key: str(value) for key, value in finding["where"].items()})
        status.append(diagnostic(f"mismatch: {finding['effect']}", WARN, finding["statement"], **values))
    message = DiagnosticArray(status=status)
    message.header.stamp = stamp
    return message
