"""A tracker's poses: units, order of the quaternion, axes of place and turn, mirrored frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.faults.axes import signed_permutations, written
from rig_identification.check.consistency.faults.unit import LENGTHS
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, Reading, fault
from rig_identification.check.consistency.measured import Measured, seen
from rig_identification.check.consistency.rest import RestFit
from rig_identification.examination import SetupFault

Array = NDArray[np.float64]
ABOUT = frozenset(["mocap"])
#: Permutations of the place alone that are tried of 47: those nearest to the motion that the others tell.
LIKELY = 6


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Units of length, two other orders of a quaternion, and signed permutations of the axes."""
    if not any("mocap" in r.values for r in evidence.session.recordings):
        return
    for unit, factor in LENGTHS.items():
        yield _unit(unit, factor)
    yield _one(
        "quaternion_order", lambda p: _turned(p, p[:, [4, 5, 6, 3]]), 2,
        "The tracker's quaternions are written w first, in the order w x y z.",
        "Write quaternions as x y z w (geometry_msgs/msg/Quaternion).",
    )  # fmt: skip
    yield _one(
        "quaternion_inverse", lambda p: _turned(p, p[:, 3:] * [-1.0, -1.0, -1.0, 1.0]), 2,
        "The tracker's quaternions are inverted: they rotate tracker vectors into the marker's frame.",
        "Publish the inverse rotation: the marker's orientation in the tracker's frame.",
    )  # fmt: skip
    for turn in signed_permutations(3):
        yield _axes(turn)
    for turn in _likely_places(evidence):
        yield _place_alone(turn)
        if np.linalg.det(turn) > 0.0:
            yield _turn_alone(turn.T)


def _likely_places(evidence: Evidence) -> list[Array]:
    """Permutations of a tracker's place that bring it nearest to the motion without it.

    Its attitudes tell how the tracker's frame lies in the room, where the marker is described.
    """
    rig, account = evidence.session.rig, evidence.without(ABOUT)
    runs = [r for r in evidence.session.runs if "mocap" in r.values]
    if rig.mocap is None or not runs or not account.motions:
        return []
    at, poses = account.motions[0].trajectory, runs[0].values["mocap"]
    frame = Measured.of(rig).frame(poses, at.R0)
    if frame is None or len(at.position) != len(poses):
        return []
    known = seen(poses)
    moved = frame.apply((at.position + at.R @ rig.mocap.position)[known])
    moved, place = moved - moved.mean(axis=0), poses[known, :3] - poses[known, :3].mean(axis=0)
    miss = [float(np.mean((place @ turn.T - moved) ** 2)) for turn in signed_permutations(3)]
    return [signed_permutations(3)[k] for k in np.argsort(miss, kind="stable")[:LIKELY]]


def _place_alone(turn: Array) -> Hypothesis:
    def right(poses: Array, _: str) -> Array:
        return np.concatenate([poses[:, :3] @ turn.T, poses[:, 3:]], axis=1)

    said = "The tracker's positions are in other axes than its orientations."
    return _part_alone(turn, "position", right, said, "Publish positions as {} of what is published now.", 47)


def _turn_alone(turn: Array) -> Hypothesis:
    def right(poses: Array, _: str) -> Array:
        known, quaternions = seen(poses), poses[:, 3:].copy()
        turned = Rotation.from_matrix(turn) * Rotation.from_quat(quaternions[known])
        quaternions[known] = turned.as_quat()
        return _turned(poses, quaternions)

    said = "The tracker's orientations are in other axes than its positions."
    advice = "Turn the orientations into the positions' frame: {} of what is published now."
    return _part_alone(turn, "orientation", right, said, advice, 23)


def _part_alone(
    turn: Array, part: str, right: Reading, statement: str, advice: str, variants: int
) -> Hypothesis:
    """One part of a pose in other axes than the other. advice: with {} for the axes."""

    def describe(rest: RestFit | None) -> SetupFault:
        names = ", ".join(f"{axis} = {source}" for axis, source in zip("xyz", written(turn), strict=True))
        where = {"channel": "mocap", "part": part, "permutation": written(turn)}
        return fault("axes", where, {}, statement, advice.format(names))

    return Hypothesis(Change({"mocap": right}), describe, ABOUT, variants=variants)


def _turned(poses: Array, quaternions: Array) -> Array:
    out: Array = np.array(poses)
    out[:, 3:] = quaternions
    return out


def _unit(unit: str, factor: float) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        return fault(
            "unit",
            {"channel": "mocap", "quantity": "position", "unit": unit},
            {"factor": (factor, 0.0, f"m per {unit}")},
            f"The tracker's positions are recorded in {unit}, not in m.",
            f"Multiply by {factor:g} in the bridge: publish m.",
        )

    change = Change({"mocap": lambda poses, _: poses * np.repeat([factor, 1.0], [3, 4])})
    return Hypothesis(change, describe, ABOUT, variants=len(LENGTHS))


def _one(
    kind: str, right: Callable[[Array], Array], variants: int, statement: str, advice: str
) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        return fault("axes", {"channel": "mocap", "kind": kind}, {}, statement, advice)

    return Hypothesis(Change({"mocap": lambda poses, _: right(poses)}), describe, ABOUT, variants=variants)


def _axes(turn: Array) -> Hypothesis:
    """Place and turn in the same wrong axes; left-handed ones reverse the sense of every turn."""
    sense = float(np.linalg.det(turn))

    def right(poses: Array, _: str) -> Array:
        out: Array = np.array(poses)
        out[:, :3] = poses[:, :3] @ turn.T
        out[:, 3:6] = sense * poses[:, 3:6] @ turn.T
        return out

    def describe(rest: RestFit | None) -> SetupFault:
        names = ", ".join(f"{axis} = {source}" for axis, source in zip("xyz", written(turn), strict=True))
        handed = (
            "mirrored: its frame is left-handed" if sense < 0.0 else "turned: its z axis does not point up"
        )
        return fault(
            "axes",
            {
                "channel": "mocap",
                "kind": "mirrored" if sense < 0.0 else "turned",
                "permutation": written(turn),
            },
            {},
            f"The tracker's frame is {handed}.",
            f"Publish {names} of what is published now, and turn the quaternions likewise.",
        )

    return Hypothesis(Change({"mocap": right}), describe, ABOUT, variants=47)
