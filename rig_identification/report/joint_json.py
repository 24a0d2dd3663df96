"""``joint`` of ``result.json``: what ``compare`` and ``fuse`` need of a session beside its ten numbers.

A matrix stands as base64 of its upper triangle, row by row, in little-endian doubles: exact, and one line.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig_identification.joint import Doubt, JointInformation, Weighing
from rig_identification.report.plain import plain
from rig_identification.rig import CarryingFrame

Array = NDArray[np.float64]

#: Of the form below: one that reads another one says so.
FORM = 1


def joint_to_dict(joint: JointInformation) -> dict[str, object]:
    """The joint information as JSON; a doubt is "name unit nominal tolerance distance/tolerance"."""
    frame, scale = joint.frame, joint.weighing
    return {
        "form": FORM,
        "elements": plain(joint.elements),
        "doubts": [_line(d) for d in joint.doubts],
        "root": _packed(joint.root),
        "weak": _packed(joint.weak),
        "weak_gradient": plain(joint.weak_gradient),
        "belief": plain(joint.belief),
        "weighing": None if scale is None else {"mass": scale.mass, "std": scale.std},
        "frame": None
        if frame is None
        else plain({"mass": frame.mass, "center_of_mass": frame.center_of_mass, "inertia": frame.inertia}),
        "ceiling": plain(joint.ceiling),
        "mounts": plain(joint.mounts),
        "start_ns": joint.start_ns,
    }


def joint_from_dict(document: Mapping[str, Any]) -> JointInformation:
    """Inverse of :func:`joint_to_dict`. Raises KeyError, TypeError or ValueError where it is none."""
    if document["form"] != FORM:
        raise ValueError(f"joint.form is {document['form']!r}, not {FORM}")
    doubts = tuple(_doubt(line) for line in document["doubts"])
    frame, scale = document["frame"], document["weighing"]
    return JointInformation(
        elements=_numbers(document["elements"], (10,)),
        doubts=doubts,
        root=np.triu(_unpacked(document["root"], 10 + len(doubts))),
        weak=_mirrored(_unpacked(document["weak"], 10)),
        weak_gradient=_numbers(document["weak_gradient"], (10,)),
        belief=_numbers(document["belief"], (10,)),
        weighing=None if scale is None else Weighing(float(scale["mass"]), float(scale["std"])),
        frame=None
        if frame is None
        else CarryingFrame(
            float(frame["mass"]), _numbers(frame["center_of_mass"], (3,)), _numbers(frame["inertia"], (3, 3))
        ),
        ceiling={str(k): _numbers(v, (3,)) for k, v in document["ceiling"].items()},
        mounts={str(k): _numbers(v, (7,)) for k, v in document["mounts"].items()},
        start_ns=int(document["start_ns"]),
    )


def _line(doubt: Doubt) -> str:
    # numpy's own numbers call themselves np.float64(...)
    nominal, prior_std, at = map(float, (doubt.nominal, doubt.prior_std, doubt.at))
    return f"{doubt.name} {doubt.unit} {nominal!r} {prior_std!r} {at!r}"


def _doubt(line: str) -> Doubt:
    name, unit, *numbers = line.split(" ")
    nominal, prior_std, at = map(float, numbers)
    return Doubt(name, unit, nominal, prior_std, at)


def _packed(matrix: Array) -> str:
    upper = matrix[np.triu_indices(len(matrix))]
    return base64.b64encode(np.ascontiguousarray(upper, dtype="<f8").tobytes()).decode("ascii")


def _unpacked(text: str, size: int) -> Array:
    """(size, size) with zeros below its diagonal. Raises ValueError where the text is none of that size."""
    numbers = np.frombuffer(base64.b64decode(text, validate=True), dtype="<f8")
    if numbers.size != size * (size + 1) // 2 or not np.all(np.isfinite(numbers)):
        raise ValueError(f"a matrix holds {numbers.size} numbers, not {size * (size + 1) // 2} finite ones")
    out = np.zeros((size, size))
    out[np.triu_indices(size)] = numbers
    return out


def _mirrored(upper: Array) -> Array:
    return np.asarray(upper + np.triu(upper, 1).T)


def _numbers(values: object, shape: tuple[int, ...]) -> Array:
    numbers = np.array(values, dtype=float)
    if numbers.shape != shape or not np.all(np.isfinite(numbers)):
        raise ValueError(f"{values!r} is not {' x '.join(map(str, shape))} finite numbers")
    return numbers
