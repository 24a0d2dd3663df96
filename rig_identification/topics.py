"""The contract's topics: their names, message types and what a session does with each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from rig_identification.errors import InputError, did_you_mean
from rig_identification.rig import Rig

WRENCH = "geometry_msgs/msg/WrenchStamped"
POSE, POINT, ANGLE = "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PointStamped", "std_msgs/msg/Float64"
DEFAULT_NAMESPACE = "/rig"

#: Channels besides the cables: contract name -> (channel, message type).
FIXED_TOPICS = {
    "exciter/wrench": ("exciter_force", WRENCH),
    "exciter/joint_states": ("exciter_shaft", "sensor_msgs/msg/JointState"),
    "imu/data_raw": ("imu", "sensor_msgs/msg/Imu"),
    "inclinometer/angles": ("inclination", "geometry_msgs/msg/Vector3Stamped"),
    "mocap/pose": ("mocap", POSE),
    "ground_truth/odometry": ("ground_truth", "nav_msgs/msg/Odometry"),
}

#: Other types in which a channel may come, of devices that measure a part of it.
IN_PART = {"mocap": (POINT, ANGLE)}

#: First parts of the fixed topics: no cable may be named so.
DEVICES = frozenset(name.partition("/")[0] for name in FIXED_TOPICS)


@dataclass(frozen=True)
class Topic:
    """One topic that a session looks for in its bags."""

    name: str  # in the bag
    channel: str  # "tension" or a channel of FIXED_TOPICS
    message_type: str
    cable: str | None = None

    @property
    def message_types(self) -> tuple[str, ...]:
        """Types of message that the channel may come in, the contract's own first."""
        return (self.message_type, *IN_PART.get(self.channel, ()))


def expected_topics(
    cables: tuple[str, ...], namespace: str = DEFAULT_NAMESPACE, renamed: Mapping[str, str] | None = None
) -> dict[str, Topic]:
    """Topics of a rig by their names in the bag.

    Parameters
    ----------
    cables : tuple of str
        The cables' names.
    namespace : str
        What precedes every topic that is not in ``renamed``.
    renamed : mapping, optional
        Contract name, with or without ``/rig/`` (``imu/data_raw``), to the name in the bag.

    Raises
    ------
    InputError
        ``renamed`` has a key that is no topic of this rig, or two topics get one name.
    """
    prefix = "/" + namespace.strip("/") if namespace.strip("/") else ""
    contract: dict[str, tuple[str, str, str | None]] = {
        f"{cable}/wrench": ("tension", WRENCH, cable) for cable in cables
    }
    contract.update({name: (channel, kind, None) for name, (channel, kind) in FIXED_TOPICS.items()})
    names = {name: f"{prefix}/{name}" for name in contract}
    for key, bag_name in (renamed or {}).items():
        short = key.strip("/").removeprefix(DEFAULT_NAMESPACE.strip("/") + "/")
        if short not in contract:
            raise InputError(
                f"topic mapping: {key} is no topic of this rig; known are {', '.join(contract)}"
                f"{did_you_mean(short, contract)}"
            )
        names[short] = bag_name if bag_name.startswith("/") else f"/{bag_name}"
    topics = {names[name]: Topic(names[name], *contract[name]) for name in contract}
    if len(topics) < len(contract):
        raise InputError(
            "topic mapping: two topics of the rig are mapped to one topic of the bag; map each to its own"
        )
    return topics


def foreign_cable(name: str, namespace: str = DEFAULT_NAMESPACE) -> str | None:
    """Cable that topic ``name`` would belong to by its form ``<namespace>/<cable>/wrench``, else None."""
    prefix = "/" + namespace.strip("/") if namespace.strip("/") else ""
    parts = name.removeprefix(prefix).strip("/").split("/")
    if name.startswith(prefix) and len(parts) == 2 and parts[1] == "wrench" and parts[0] not in DEVICES:
        return parts[0]
    return None


def check_mapped(
    renamed: Mapping[str, str], expected: Mapping[str, Topic], listed: Iterable[Mapping[str, str]]
) -> None:
    """Refuse a mapping to a topic that no bag holds: who names a topic wants it used.

    renamed: as given to :func:`expected_topics`. listed: for each bag, every topic and its type.

    Raises
    ------
    InputError
        Names the topics of the right type that are there.
    """
    held = {name: kind for bag in listed for name, kind in bag.items()}
    for key, given in renamed.items():
        name = given if given.startswith("/") else f"/{given}"
        if name in held:
            continue
        kind = expected[name].message_type
        alike = sorted(other for other, its in held.items() if its in expected[name].message_types)
        there = f"of type {kind} they hold {', '.join(alike)}" if alike else f"none holds a {kind}"
        raise InputError(
            f"--topic {key}={given}: no bag holds {name}; {there}{did_you_mean(name, alike or held)}"
        )


def other_namespace(listed: Iterable[str], rig: Rig, namespace: str) -> str:
    """Ending of a message that names the namespace under which the contract's topics are, or nothing."""
    endings = [f"/{cable.name}/wrench" for cable in rig.cables] + [f"/{name}" for name in FIXED_TOPICS]
    found = {name.removesuffix(end) for name in listed for end in endings if name.endswith(end)}
    others = sorted(found - {"/" + namespace.strip("/")})
    return f"; did you mean --namespace {others[0] or '/'}?" if others else ""
