"""How well a session hangs together: one number in nats from rest, motion and forces.

The same number without a device bounds what any hypothesis about that device can gain. Families of
hypotheses that cannot gain their price are not tried.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rig_identification.check.consistency.forces import ForceModel
from rig_identification.check.consistency.hypothesis import Hypothesis
from rig_identification.check.consistency.measured import ORDINARY, Measured
from rig_identification.check.consistency.motion import (
    INDEPENDENT,
    MotionFit,
    MotionModel,
    nats,
)
from rig_identification.check.consistency.reduced import Reduced, ReducedSession
from rig_identification.check.consistency.rest import RestFit, fit_rest, joined
from rig_identification.check.consistency.rest_model import Loosened
from rig_identification.check.consistency.tracker import TrackerModel, slanted
from rig_identification.rig import Rig

#: Runs looked at: a fault of the set-up shows in any.
RUNS = 1
#: Devices whose readings tell how the body moves.
MOVING = frozenset(["imu", "imu.gyroscope", "imu.accelerometer", "inclinometer", "mocap"])
#: What a hypothesis is about that makes another rig: no device bounds what it can gain.
EVERYTHING = "everything"
#: Nats below which readings at rest agree: less than any fault costs.
PRICELESS = 9.0


@dataclass(frozen=True)
class Account:
    """One evaluation."""

    rest: RestFit | None
    motions: tuple[MotionFit, ...]
    cost: float  # nats by which the session fails to hang together
    parts: Mapping[str, float]


#: Of what cannot be.
IMPOSSIBLE = Account(None, (), float("inf"), {})


@dataclass
class Evidence:
    """Evaluations of one session under hypotheses."""

    session: ReducedSession
    readings: int = field(init=False)
    _without: dict[frozenset[str], Account] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.readings = max(sum(_readings(r) for r in self.session.at_rest), 1)
        # Cells that read nonsense turn the body at rest, and a motion about that pose is lost
        without_cells = self._account(self._lacking(self.cells))
        self.plain = self._account(self.session, None, without_cells)
        self._without[self.cells] = self._account(self._lacking(self.cells), None, self.plain, moved=False)

    @property
    def cells(self) -> frozenset[str]:
        """Names of all cables."""
        return frozenset(c.name for c in self.session.rig.cables)

    def without(self, devices: frozenset[str]) -> Account:
        """The session without some devices' readings; ``imu.gyroscope`` stands for one half of an IMU."""
        if devices not in self._without:
            lacking = self._lacking(devices)
            self._without[devices] = self._account(lacking, None, self.plain, bool(devices & MOVING))
        return self._without[devices]

    def _lacking(self, devices: frozenset[str]) -> ReducedSession:
        recordings = tuple(_lacking(r, devices) for r in self.session.recordings)
        return ReducedSession(self.session.rig, recordings)

    def bound(self, devices: frozenset[str]) -> float:
        """Nats that a hypothesis about these devices can gain at most.

        "rest": what the description says of the body at rest, on which the forces of its motion rest as well.
        """
        if EVERYTHING in devices:
            return self.plain.cost
        if "rest" in devices:
            return sum(nats for name, nats in self.plain.parts.items() if _of_the_body(name))
        return self.plain.cost - self.without(devices).cost

    def judged(self, hypothesis: Hypothesis, thorough: bool = False, most: float = np.inf) -> Account:
        """The session under a hypothesis; unless thorough, to first order about it without its devices.

        most: nats beyond which the account does not matter. It breaks off once it costs more.
        """
        changed = hypothesis.change.reduced(self.session)
        fresh = thorough or hypothesis.fresh
        start = None if fresh else self.without(hypothesis.about)
        if start is None or start.rest is None:
            moved = bool(hypothesis.about & MOVING) or hypothesis.change.rig is not None
            # Where the body may move otherwise nothing is known of what its motion costs at least
            spared = most if moved else most - self._beside_rest(hypothesis.about)
            account = self._account(changed, hypothesis.loosened, self.plain, moved, spared)
            rest = account.rest
            if rest is None or not hypothesis.possible(rest):
                return IMPOSSIBLE
            return account if not thorough or hypothesis.confirmed(rest) else IMPOSSIBLE
        devices = frozenset(name.partition(".")[0] for name in hypothesis.about)
        if hypothesis.about == {"imu.gyroscope"}:
            rest = self.plain.rest or start.rest
        else:
            rest = joined(start.rest, changed.rig, changed.at_rest, devices, hypothesis.loosened)
        if not hypothesis.possible(rest):
            return IMPOSSIBLE
        parts = {"rest": self._rest_nats(rest.square)}
        for k, run in enumerate(changed.runs[:RUNS]):
            motion = start.motions[k]
            if hypothesis.about & MOVING:
                model = MotionModel(changed.rig, run, *start.rest.poses[0])
                motion = model.once(run.values, motion.trajectory)
            parts |= _parts(changed.rig, run, self._body(start), motion, rest)
        return Account(start.rest, start.motions, float(sum(parts.values())), parts)

    def plain_beside(self, other: Account) -> float:
        """Nats of the session as it is once the motion of another account may be its own as well.

        Readings that are hardly more than noise leave the motion open, and forces tell such motions apart:
        what a hypothesis gains by its motion alone is no gain.
        """
        if self.plain.rest is None or not other.motions:
            return self.plain.cost
        cost = self.plain.parts["rest"]
        for run, motion in zip(self.session.runs[:RUNS], other.motions, strict=False):
            begun = _best_motion(self.session.rig, run, self.plain.rest, motion, moved=True)[1]
            cost += sum(begun.values())
        return min(self.plain.cost, cost)

    def _beside_rest(self, about: frozenset[str]) -> float:
        """Nats that motion, forces and tracker cost at least under a hypothesis about these devices."""
        account = self.plain if "rest" in about else self.without(about)
        changed = _of_the_body if "rest" in about else "rest".__eq__
        return account.cost - sum(nats for name, nats in account.parts.items() if changed(name))

    def _body(self, start: Account) -> RestFit:
        """The body at rest by all readings where they agree, else by those that a hypothesis leaves alone."""
        assert start.rest is not None
        agree = self.plain.rest is not None and self.plain.parts["rest"] < PRICELESS
        return self.plain.rest if agree and self.plain.rest is not None else start.rest

    def _rest_nats(self, square: float) -> float:
        """Nats by which rest disagrees: as for motion, how large ordinary errors are here is not known."""
        each = np.array([max(square, 0.0) / self.readings])
        return float(self.readings / INDEPENDENT * nats(each, np.full(1, ORDINARY))[0])

    def _account(
        self,
        session: ReducedSession,
        loosened: Loosened | None = None,
        begun: Account | None = None,
        moved: bool = True,
        most: float = np.inf,
    ) -> Account:
        """Evaluate a session from scratch.

        begun: another account, from whose motions a fit is tried as well. moved: whether the motion may
        differ from those at all. most: nats at rest beyond which nothing else is looked at.
        """
        rest = fit_rest(session.rig, session.at_rest, loosened)
        if rest is None:
            return IMPOSSIBLE
        parts = {"rest": self._rest_nats(rest.square)}
        if parts["rest"] > most:
            return Account(rest, (), float("inf"), parts)
        motions = []
        for k, run in enumerate(session.runs[:RUNS]):
            before = begun.motions[k] if begun is not None and begun.motions else None
            motion, more = _best_motion(session.rig, run, rest, before, moved)
            motions.append(motion)
            parts |= more
        return Account(rest, tuple(motions), float(sum(parts.values())), parts)


def _of_the_body(part: str) -> bool:
    """Whether a part of the cost depends on the body's mass and where its centre of mass is."""
    return part == "rest" or part.endswith(".forces")


def _readings(recording: Reduced) -> int:
    """Numbers that a recording holds of the body at rest: angular rate tells nothing there."""
    held = (v[0, 3:] if device == "imu" else v[0] for device, v in recording.values.items())
    return sum(int(np.count_nonzero(np.isfinite(one))) for one in held)


def _best_motion(
    rig: Rig, run: Reduced, rest: RestFit, begun: MotionFit | None, moved: bool
) -> tuple[MotionFit, dict[str, float]]:
    """The motion that agrees best with all readings of one run.

    Tried are another account's, the same settled, and one from rest. With the other account's motion itself
    among them a session without a device never agrees worse than with it.
    """
    model = MotionModel(rig, run, *rest.poses[0])
    tried = []
    if begun is not None:
        tried.append(model.at(run.values, begun.trajectory))
    if moved or begun is None:
        tried.append(model.settled(run.values))
        if begun is not None:
            tried.append(model.settled(run.values, begun.trajectory))
    judged = [(motion, _parts(rig, run, rest, motion)) for motion in tried]
    return min(judged, key=lambda pair: sum(pair[1].values()))


def _parts(
    rig: Rig, run: Reduced, rest: RestFit, motion: MotionFit, cells: RestFit | None = None
) -> dict[str, float]:
    """Nats of one run's motion, forces and tracker. cells: the fit at rest that tells the cells' gains."""
    parts = {f"{run.name}.{name}": value for name, value in motion.cost.items()}
    told = bool({"gyroscope", "accelerometer"} & motion.cost.keys())
    if told:
        parts[f"{run.name}.forces"] = ForceModel(rig, motion.trajectory, rest, cells).cost(run.values)[0]
    if "mocap_turn" in motion.cost:
        frame = Measured.of(rig).frame(run.values["mocap"], motion.trajectory.R0)
        parts[f"{run.name}.mocap_up"] = 0.0 if frame is None else slanted(frame.as_matrix())
    elif "mocap" in run.values:
        known = motion.trajectory if {"gyroscope", "accelerometer"} <= motion.cost.keys() else None
        tracker = TrackerModel(rig, *rest.poses[0], known)
        parts[f"{run.name}.mocap"] = tracker.cost(run.values["mocap"])
    return parts


def _lacking(recording: Reduced, devices: frozenset[str]) -> Reduced:
    values = {d: v for d, v in recording.values.items() if d not in devices}
    if "imu" in values:
        imu = values["imu"].copy()
        if "imu.gyroscope" in devices:
            imu[:, :3] = np.nan
        if "imu.accelerometer" in devices:
            imu[:, 3:] = np.nan
        values["imu"] = imu
    return Reduced(
        recording.name, recording.kind, recording.holdout, recording.dummy, recording.time,
        recording.kernel, values, recording.start_ns,
    )  # fmt: skip
