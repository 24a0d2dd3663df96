"""Axes of an IMU or an inclinometer that are exchanged or reversed, left-handed ones too."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, Reading, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.trajectory import rotation
from rig_identification.examination import SetupFault
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Which half of an IMU: columns, and the word for its readings.
HALVES: dict[str, tuple[tuple[slice, ...], str]] = {
    "imu": ((slice(0, 3), slice(3, 6)), "The IMU's axes"),
    "imu.gyroscope": ((slice(0, 3),), "The gyroscope's axes"),
    "imu.accelerometer": ((slice(3, 6),), "The accelerometer's axes"),
}
#: Cosine between measured and expected direction of gravity below which a permutation is not tried: half
#: of the 90 degrees by which another permutation misses.
ALIGNED = 0.7
#: Permutations of a gyroscope that are tried of 47: at worst one axis turns at all, and four have it right.
LIKELY = 6


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Signed permutations of the IMU, of each half of it, and of the inclinometer."""
    rig = evidence.session.rig
    if rig.imu is not None:
        upright = [turn for turn in signed_permutations(3) if _upright(evidence, turn)]
        for half in HALVES:
            for turn in _likely_rates(evidence) if half == "imu.gyroscope" else upright:
                yield _imu(rig, half, turn)
    if rig.inclinometer is not None:
        for turn in signed_permutations(2):
            yield _inclinometer(turn)


def signed_permutations(size: int) -> list[Array]:
    """Every matrix with one 1 or -1 in each row and column but the identity, fewest changes first."""
    out = []
    for order in permutations(range(size)):
        for signs in product((1.0, -1.0), repeat=size):
            turn = np.zeros((size, size))
            turn[np.arange(size), order] = signs
            out.append(turn)
    changes = [np.count_nonzero(turn != np.eye(size)) for turn in out]
    return [out[k] for k in np.argsort(changes, kind="stable") if changes[k]]


def _likely_rates(evidence: Evidence) -> list[Array]:
    """Permutations of the gyroscope nearest to the rate of a motion that is found without it, or with it."""
    rig = evidence.session.rig
    runs = evidence.session.runs
    # Of the first run alone a motion is known
    if rig.imu is None or not runs or "imu" not in runs[0].values or not evidence.plain.motions:
        return []
    R_imu = rotation(rig.imu)
    found = []
    for account in (evidence.without(frozenset(["imu.gyroscope"])), evidence.plain):
        rate = account.motions[0].trajectory.rate @ R_imu
        measured = runs[0].values["imu"][:, :3]
        known = np.isfinite(measured).all(axis=1)
        if not known.any():
            continue
        ranked = sorted(
            signed_permutations(3),
            key=lambda turn: float(np.mean((measured[known] @ turn.T - rate[known]) ** 2)),
        )
        found += ranked[:LIKELY]
    return [turn for k, turn in enumerate(found) if not any(np.array_equal(turn, t) for t in found[:k])]


def _upright(evidence: Evidence, turn: Array) -> bool:
    """Whether gravity points about where it should under a permutation; true where nothing tells."""
    account = evidence.without(frozenset(["imu.accelerometer"]))
    if account.rest is None or not evidence.session.at_rest:
        return True
    reading = evidence.session.at_rest[0].values.get("imu")
    expected = account.rest.expected[0].get("imu")
    if reading is None or expected is None or not np.isfinite(reading[0, 3:]).all():
        return True
    measured = turn @ reading[0, 3:]
    size = float(np.linalg.norm(measured) * np.linalg.norm(expected))
    return size == 0.0 or float(measured @ expected) > ALIGNED * size


def _imu(rig: Rig, half: str, turn: Array) -> Hypothesis:
    columns = HALVES[half][0]

    def right(values: Array, _: str) -> Array:
        out: Array = np.array(values)
        for part in columns:
            out[:, part] = values[:, part] @ turn.T
        return out

    def describe(rest: RestFit | None) -> SetupFault:
        where = {"channel": "imu", "part": half.partition(".")[2] or None, "permutation": written(turn)}
        statement, advice = _words(HALVES[half][1], turn)
        return fault("axes", where, {}, statement, advice, _corrected_mount(rig, half, turn))

    readings: dict[str, Reading] = {"imu": right}
    # Without any IMU the motion may be unknown, and a first-order step from there tells nothing
    return Hypothesis(Change(readings), describe, frozenset([half]), variants=47, fresh=half == "imu")


def _inclinometer(turn: Array) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        where = {"channel": "inclinometer", "permutation": written(turn)}
        return fault("axes", where, {}, *_words("The inclinometer's axes", turn))

    readings: dict[str, Reading] = {"inclinometer": lambda values, _: values @ turn.T}
    return Hypothesis(Change(readings), describe, frozenset(["inclinometer"]), variants=7)


def written(turn: Array) -> list[str]:
    """Which recorded axis stands for x, y and z: ['y', '-x', 'z']."""
    out = []
    for row in turn:
        k = int(np.argmax(np.abs(row)))
        out.append(("-" if row[k] < 0.0 else "") + "xyz"[k])
    return out


def _words(subject: str, turn: Array) -> tuple[str, str]:
    sources = written(turn)
    changed = [(axis, source) for axis, source in zip("xyz", sources, strict=False) if axis != source]
    told = ", ".join(f"{axis} is recorded as {source}" for axis, source in changed)
    if all(source == f"-{axis}" for axis, source in changed):
        told = " and ".join(axis for axis, _ in changed) + (" has" if len(changed) == 1 else " have")
        told += " the wrong sign" if len(changed) == 1 else " the wrong signs"
        statement = f"{subject}: {told}."
    else:
        statement = f"{subject} are exchanged: {told}."
    if np.linalg.det(turn) < 0.0:
        statement += " As recorded they are left-handed."
    right = ", ".join(f"{axis} = {source}" for axis, source in zip("xyz", sources, strict=False))
    return statement, f"Publish {right} of what is published now."


def _corrected_mount(rig: Rig, half: str, turn: Array) -> str:
    """Lines of the rig description that say the same of a right-handed IMU as a whole."""
    if half != "imu" or rig.imu is None or np.linalg.det(turn) < 0.0:
        return ""
    fixed = Rotation.from_quat(rig.imu.orientation) * Rotation.from_matrix(turn)
    numbers = ", ".join(f"{v:.7g}" for v in fixed.as_quat())
    return f"imu:\n  orientation: [{numbers}]"
