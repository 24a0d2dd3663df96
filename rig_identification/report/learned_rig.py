"""The rig as the recordings have it: the description with what was estimated of it in its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from rig_identification.result import ParameterEstimate
from rig_identification.rig import Cable, Mount, Rig, Vector
from rig_identification.rig_document import rig_document

_AXES = "xyz"


def learned_rig(rig: Rig, parameters: Sequence[ParameterEstimate]) -> Rig:
    """Hinges, lengths and mounts as estimated. What is no geometry (gains, biases, clocks) stays aside."""
    values = {p.name: p.value for p in parameters}
    return replace(
        rig,
        cables=tuple(_cable(cable, values) for cable in rig.cables),
        imu=_mount("imu", rig.imu, values),
        inclinometer=_mount("inclinometer", rig.inclinometer, values),
        exciter=_mount("exciter", rig.exciter, values),
    )


def learned_rig_text(rig: Rig, parameters: Sequence[ParameterEstimate], session: str) -> str:
    """A rig.yaml of :func:`learned_rig`; tolerances are the lab's own still."""
    head = [
        f"# Estimated from {session}. Hinges, lengths and mounts are those that explain its recordings best.",
        "# They depend on each other: use all of them, or measure again. Tolerances are as described before.",
    ]
    return "\n".join([*head, *_yaml(rig_document(learned_rig(rig, parameters)))]) + "\n"


def _cable(cable: Cable, values: Mapping[str, float]) -> Cable:
    return replace(
        cable,
        ceiling_point=_vector(f"{cable.name}.ceiling_point", cable.ceiling_point, values),
        body_point=_vector(f"{cable.name}.body_point", cable.body_point, values),
        length=values.get(f"{cable.name}.length", cable.length),
    )


def _mount(name: str, mount: Mount | None, values: Mapping[str, float]) -> Mount | None:
    """A mount moved and turned: its error turns it in body axes, after the described orientation.

    Of the IMU the error of its place is estimated, of the exciter the place itself.
    """
    if mount is None:
        return None
    position = _vector(f"{name}.position", mount.position, values)
    if name == "imu":
        position = mount.position + _vector(f"{name}.position", np.zeros(3), values)
    turn = _vector(f"{name}.orientation", np.zeros(3), values)
    turned = (Rotation.from_rotvec(turn) * Rotation.from_quat(mount.orientation)).as_quat()
    return Mount(position, turned)


def _vector(name: str, described: Vector, values: Mapping[str, float]) -> Vector:
    return np.array([values.get(f"{name}.{a}", float(d)) for a, d in zip(_AXES, described, strict=True)])


def _yaml(value: object, depth: int = 0) -> list[str]:
    """Lines of a mapping of mappings, lists and plain values."""
    assert isinstance(value, dict)
    lines = []
    for key, inner in value.items():
        name = f"{'  ' * depth}{key}:"
        lines += [name, *_yaml(inner, depth + 1)] if isinstance(inner, dict) else [f"{name} {_plain(inner)}"]
    return lines


def _plain(value: object) -> str:
    """A number to a micrometre and better, a word, or a list of them."""
    if isinstance(value, list):
        return f"[{', '.join(map(_plain, value))}]"
    if isinstance(value, float):
        text = f"{value:.7g}"
        return text if any(sign in text for sign in ".en") else f"{text}.0"
    return str(value)
