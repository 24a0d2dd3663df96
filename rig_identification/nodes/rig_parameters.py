"""The rig description out of a node's parameters: the same checks as for the file, the same words."""

from __future__ import annotations

from collections.abc import Collection
from difflib import get_close_matches
from pathlib import Path

from rclpy.node import Node

from rig_identification.errors import InputError
from rig_identification.rig import Rig
from rig_identification.session.fields import Fields
from rig_identification.session.rig_description import rig_from_fields

#: First parts of the rig description's names, besides the cables' own.
RIG_KEYS = (
    "gravity", "mass", "mass_std", "cable_linear_density", "frame", "cables", "imu", "inclinometer",
    "exciter", "mocap", "noise", "tolerance",
)  # fmt: skip
#: Parameters that rclpy itself declares.
_ROS = ("use_sim_time", "start_type_description_service", "qos_overrides")


def nested_parameters(node: Node, without: Collection[str]) -> dict[str, object]:
    """A node's parameters by the dots in their names, less those named in ``without``."""
    tree: dict[str, object] = {}
    for name, parameter in node.get_parameters_by_prefix("").items():
        if name in without or name.split(".")[0] in _ROS or parameter.value is None:
            continue
        *path, last = name.split(".")
        branch = tree
        for part in path:
            branch = branch.setdefault(part, {})  # type: ignore[assignment]
        value = parameter.value
        branch[last] = value if isinstance(value, str | bool | int | float) else list(value)
    return tree


def refuse_misspelt(node: Node, own: Collection[str]) -> None:
    """Refuse a parameter that looks like one of the node's own misspelt; others belong to other tools.

    Raises
    ------
    InputError
        Its name and the one that was probably meant.
    """
    cables = node.get_parameter("cables").value if node.has_parameter("cables") else []
    described = {*RIG_KEYS, *_ROS, *(cables or [])}
    for name in node.get_parameters_by_prefix(""):
        close = get_close_matches(name, own, n=1, cutoff=0.8)
        if name not in own and name.split(".")[0] not in described and close:
            raise InputError(f"parameter {name}: unknown; did you mean {close[0]}?")


def rig_of(node: Node, own: Collection[str]) -> Rig:
    """The rig that a node's parameters describe.

    Raises
    ------
    InputError
        The first fault, with the parameter's name and value.
    """
    where = Path(f"parameters of {node.get_fully_qualified_name()}")
    return rig_from_fields(Fields(where, "", nested_parameters(node, own)))
