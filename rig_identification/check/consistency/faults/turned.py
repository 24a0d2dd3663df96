"""An IMU that sits otherwise than described: at a mount that no line of the description gives.

The motion that the other devices tell says how the IMU lies and where it sits. Its angular rate is the body's
in its own axes, and its specific force is the body's at its place:

    rate    R^T w
    force   R^T (a + w' x r + w x (w x r)),    a: proper acceleration of the datum

R is the rotation that brings both together (Kabsch, Acta Cryst. A32, 1976), and given R the place r is
linear. Both are found in turn.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.evidence import Account, Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, fault
from rig_identification.check.consistency.measured import ORDINARY, TINY
from rig_identification.check.consistency.motion import INDEPENDENT
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.rest_model import BIAS
from rig_identification.check.consistency.trajectory import rotation
from rig_identification.examination import SetupFault
from rig_identification.model.so3 import nearest_rotation, skew
from rig_identification.quantity import with_interval
from rig_identification.rig import Mount, Rig

Array = NDArray[np.float64]

#: Turns in which orientation and place settle along one motion, and motions that are fitted.
ROUNDS, FITS = 4, 3
#: rad and m; a mount that differs by less from another device's was copied from it.
SAME = 1e-6
#: Std by which a mount has to be off the described one before it is asked what it explains.
CLEAR = 3.0
#: m; a body is at least so large.
LEAST = 1e-3
#: Instants below which no mount is sought.
FEWEST = 20


@dataclass(frozen=True)
class Found:
    """A mount as the motion tells it, and how well: rad and m."""

    mount: Mount
    turn_std: float
    place_std: float


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """The IMU turned by whatever the motion says, in the described place or any; in another place alone."""
    rig = evidence.session.rig
    if rig.imu is None or evidence.bound(frozenset(["imu"])) <= 0.0:
        return
    for found, moved in zip(_sought(evidence, rig, rig.imu), (False, True), strict=False):
        yield of_mount(rig, rig.imu, found, moved=moved)
    aside = _aside(evidence, rig, rig.imu)
    if aside is not None:
        yield of_place(rig.imu, aside)


def of_mount(rig: Rig, described: Mount, found: Found, *, moved: bool) -> Hypothesis:
    """That the IMU lies as found. moved: whether its place is another than described as well."""
    copied = _copied_from(rig, described)
    turn = Rotation.from_quat(described.orientation).inv() * Rotation.from_quat(found.mount.orientation)
    angle, away = float(turn.magnitude()), float(np.linalg.norm(found.mount.position - described.position))
    known = found.turn_std < ORDINARY  # else it would still miss by more than ordinary errors make it

    def describe(rest: RestFit | None) -> SetupFault:
        where: dict[str, object] = {"channel": "imu"}
        statement = "The IMU does not lie as described."
        if copied is not None:
            where |= {"kind": "another_mount", "mount": copied}
            statement = f"The rig description gives the IMU the mount of the {copied}, where it does not lie."
        numbers = {"angle": (angle, found.turn_std, "rad")} if known else {}
        if known and moved:
            numbers["distance"] = (away, found.place_std, "m")
        lies = f"it is turned by {with_interval(angle, found.turn_std, 'rad')}"
        lies += f" and sits {with_interval(away, found.place_std, 'm')} away" if moved else ""
        statement += f" By the body's motion {lies}." if known else ""
        until = "the mount is estimated from the motion" if known else "it is left out"
        return fault(
            "imu_misalignment" if copied is None else "wiring", where, numbers, statement,
            "Measure how the IMU is mounted, and correct its mount in the rig description. Until then "
            f"{until}.",
            _lines(found.mount) if known else "", corrected=known,
        )  # fmt: skip

    def measured(one: Rig) -> Rig:
        # The fit has to find the mount more closely: it may be off by what the motion leaves open
        doubt = {"imu_orientation": found.turn_std} | ({"imu_position": found.place_std} if moved else {})
        wider = {name: max(std, one.tolerance[name]) for name, std in doubt.items()}
        return replace(one, imu=found.mount, tolerance={**one.tolerance, **wider})

    settled = Change(rig=measured) if known else Change(left_out=("imu",))
    return Hypothesis(
        Change(rig=lambda one: replace(one, imu=found.mount)), describe, frozenset(["imu"]), variants=2,
        free=6 if moved else 3, fresh=True, fitted=lambda rest: settled,
    )  # fmt: skip


def of_place(described: Mount, found: Found) -> Hypothesis:
    """That the IMU sits elsewhere, its axes as described."""
    away = found.mount.position - described.position

    def describe(rest: RestFit | None) -> SetupFault:
        told = ", ".join(with_interval(float(v), found.place_std, "m") for v in away)
        return fault(
            "imu_position",
            {"channel": "imu"},
            {f"error_{a}": (float(v), found.place_std, "m") for a, v in zip("xyz", away, strict=True)},
            "The IMU does not sit where the description says: by the body's motion it is off by "
            f"{told} along x, y and z.",
            "Measure where the IMU sits, and correct its position in the rig description. Until then the "
            "position is estimated from the motion.",
            f"imu:\n  position: [{', '.join(f'{v:.6g}' for v in found.mount.position)}]",
        )

    def measured(one: Rig) -> Rig:
        wider = max(found.place_std, one.tolerance["imu_position"])
        return replace(one, imu=found.mount, tolerance={**one.tolerance, "imu_position": wider})

    return Hypothesis(
        Change(rig=lambda one: replace(one, imu=found.mount)), describe, frozenset(["imu"]), variants=2,
        free=3, fresh=True, fitted=lambda rest: Change(rig=measured),
    )  # fmt: skip


def _copied_from(rig: Rig, described: Mount) -> str | None:
    """The device whose described orientation the IMU's is; None where it is the IMU's own.

    Axes along the body's are nobody's own: any device may lie so.
    """
    turn = Rotation.from_quat(described.orientation)
    if turn.magnitude() < SAME:
        return None
    others = {"exciter": rig.exciter, "inclinometer": rig.inclinometer, "mocap": rig.mocap}
    for name, mount in others.items():
        if mount is not None and (turn.inv() * Rotation.from_quat(mount.orientation)).magnitude() < SAME:
            return name
    return None


def _lines(mount: Mount) -> str:
    place, turn = (", ".join(f"{v:.6g}" for v in part) for part in (mount.position, mount.orientation))
    return f"imu:\n  position: [{place}]\n  orientation: [{turn}]"


def _sought(evidence: Evidence, rig: Rig, described: Mount) -> tuple[Found, ...]:
    """The mounts that agree best with the motion, in the described place and in any.

    The other devices tell the motion first; with the IMU on that mount all tell it better. How well the mount
    is known only the motion says that does without the IMU. None where that tells none, or the described one.
    """
    beside = _beside(evidence)
    if beside is None:
        return ()
    known, read, account = beside
    still, alone = evidence.session.at_rest[0].values.get("imu"), _along(rig, account, known)
    size = _size_of(rig)
    out: tuple[Found, ...] = ()
    for fit in range(FITS):
        if account.rest is None or not account.motions:
            break
        at, hangs = _along(rig, account, known), None
        if not at.is_finite:
            return ()
        if still is not None and np.isfinite(still[0, 3:]).all():
            hangs = (still[0, 3:], rig.gravity * account.rest.poses[0][1][2])
        mounts = [mounted(described, at, read, hangs, within) for within in (None, size)]
        out = tuple(Found(mount, *_doubt(mount, alone, read)) for mount in mounts)
        if not _contradicted(described, out[1]):
            return ()
        if fit < FITS - 1:
            # Where no turn tells the place a guess at it would bend the motion
            moved = out[1].place_std < ORDINARY * size
            account = evidence.judged(of_mount(rig, described, out[moved], moved=moved))
    return out


def _aside(evidence: Evidence, rig: Rig, described: Mount) -> Found | None:
    """The place at which an IMU with the described axes agrees best with the motion.

    The other devices tell the motion first; with the IMU in that place all tell it better. None where the
    motion leaves the described place open.
    """
    beside = _beside(evidence)
    if beside is None:
        return None
    known, read, account = beside
    alone, R = _along(rig, account, known), rotation(described)
    size, found = _size_of(rig), None
    for _ in range(FITS):
        if account.rest is None or not account.motions:
            break
        at = _along(rig, account, known)
        if not at.is_finite:
            return None
        place = _place(at.lever, read[:, 3:] @ R.T - at.proper, described.position, size)
        mount = replace(described, position=place)
        found = Found(mount, *_doubt(mount, alone, read))
        if float(np.linalg.norm(place - described.position)) < max(ORDINARY * size, CLEAR * found.place_std):
            return None
        account = evidence.judged(of_place(described, found))
    return found


def _beside(evidence: Evidence) -> tuple[NDArray[np.bool_], Array, Account] | None:
    """Instants (n,) at which the IMU reads, what it reads at them (k, 6), and the motion without it.

    None where nothing else tells a motion, or the IMU reads hardly anything.
    """
    runs, account = evidence.session.runs, evidence.without(frozenset(["imu"]))
    if not runs or not account.motions:
        return None
    values = runs[0].values.get("imu", np.full((1, 6), np.nan))
    known = np.asarray(np.isfinite(values).all(axis=1))
    return (known, values[known], account) if np.count_nonzero(known) >= FEWEST else None


def _size_of(rig: Rig) -> float:
    """m, the hinges' largest distance along an axis: a body is at least so large."""
    return max(float(np.ptp([c.body_point for c in rig.cables], axis=0).max()), LEAST)


def _contradicted(described: Mount, found: Found) -> bool:
    """Whether the IMU lies otherwise than described, by more than the motion leaves open.

    What a smaller turn brings over from other axes is an ordinary error, and the search's.
    """
    turn = Rotation.from_quat(described.orientation).inv() * Rotation.from_quat(found.mount.orientation)
    return bool(turn.magnitude() > max(ORDINARY, CLEAR * found.turn_std))


@dataclass(frozen=True)
class Along:
    """What a body's motion brings to an IMU on it, by instant, body axes."""

    rate: Array  # (N, 3) rad/s
    proper: Array  # (N, 3) m/s^2, specific force at the datum
    lever: Array  # (N, 3, 3) 1/s^2, times a place: specific force there beyond the datum's

    @property
    def is_finite(self) -> bool:
        """Whether the motion is one at all."""
        return bool(np.isfinite(self.proper).all() and np.isfinite(self.lever).all())


def _along(rig: Rig, account: Account, known: NDArray[np.bool_]) -> Along:
    at = account.motions[0].trajectory
    rate = at.rate[known]
    turning = skew(rate)
    lever = skew(at.rate_change[known]) + turning @ turning
    return Along(rate, at.proper_acceleration(rig.gravity)[known], lever)


def mounted(
    described: Mount, along: Along, read: Array, hangs: tuple[Array, Array] | None, size: float | None = None
) -> Mount:
    """The mount with which an IMU reads ``read`` (N, 6) along a motion.

    hangs: specific force (3,) at rest, m/s^2, as read and in body axes. size: m, of the body, on which the
    place is sought as well; None: the described one holds.
    """
    place, R = described.position, np.eye(3)
    for _ in range(ROUNDS):
        force = along.proper + along.lever @ place
        pairs = [
            _weighed(_about_mean(read[:, :3]), _about_mean(along.rate)),
            _weighed(_about_mean(read[:, 3:]), _about_mean(force)),
        ]
        if hangs is not None:
            std = BIAS * float(np.linalg.norm(hangs[1]))
            pairs.append((hangs[0][None] / std, hangs[1][None] / std))
        seen, true = (np.vstack([pair[k] for pair in pairs]) for k in (0, 1))
        R = nearest_rotation(true.T @ seen)
        if size is not None:
            place = _place(along.lever, read[:, 3:] @ R.T - along.proper, described.position, size)
    return Mount(place, Rotation.from_matrix(R).as_quat())


def _doubt(mount: Mount, along: Along, read: Array) -> tuple[float, float]:
    """Std of a mount's turn (rad) and place (m), by what an IMU on it misses of a motion."""
    R = rotation(mount)
    rate, force = read[:, :3] @ R.T, read[:, 3:] @ R.T
    missed = _size(rate - along.rate) / max(_size(rate), TINY)
    aside = _size(force - along.proper - along.lever @ mount.position)
    arm = _size(along.lever.reshape(len(read), -1)) / float(np.sqrt(3.0))  # m/s^2 a metre
    alone = float(np.sqrt(INDEPENDENT))
    return missed / alone, aside / alone / max(arm, TINY)


def _size(rows: Array) -> float:
    """Root mean square length of rows (n, k) about their mean."""
    return float(np.sqrt(np.mean(np.sum(_about_mean(rows) ** 2, axis=1))))


def _weighed(seen: Array, true: Array) -> tuple[Array, Array]:
    """Rows (n, 3) over what they may ordinarily miss by, as INDEPENDENT observations in all."""
    std = max(ORDINARY * _size(seen), TINY) * np.sqrt(len(seen) / INDEPENDENT)
    return seen / std, true / std


def _about_mean(rows: Array) -> Array:
    return np.asarray(rows - rows.mean(axis=0))


def _place(lever: Array, miss: Array, described: Array, size: float) -> Array:
    """(3,) m: the arm with which ``lever`` (n, 3, 3) makes the acceleration ``miss`` (n, 3), less a bias.

    size: m, of the body, on which the IMU sits somewhere: what no turn tells stays as described.
    """
    std = max(ORDINARY * _size(miss), TINY) * np.sqrt(len(miss) / INDEPENDENT)
    rows = (lever - lever.mean(axis=0)).reshape(-1, 3) / std
    right = _about_mean(miss).reshape(-1) / std - rows @ described
    return np.asarray(described + np.linalg.solve(rows.T @ rows + np.eye(3) / size**2, rows.T @ right))
