"""One way in which a session may have been set up wrongly, and how its readings are put right."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.consistency.reduced import Reduced, ReducedSession
from rig_identification.check.consistency.rest import RestFit
from rig_identification.check.consistency.rest_model import Loosened
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.recording import Dummy
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Readings (N, width) of one device to what they should have been; the second argument names the recording.
Reading = Callable[[Array, str], Array]


@dataclass(frozen=True)
class Change:
    """What undoes a fault."""

    readings: Mapping[str, Reading] = field(default_factory=dict)  # device -> its readings put right
    wires: Mapping[str, str] = field(
        default_factory=dict
    )  # cable -> cable under whose topic its cell is found
    rig: Callable[[Rig], Rig] | None = None
    dummies: Mapping[str, Dummy | None] | None = None  # recording -> what truly hung
    less: Mapping[str, tuple[str, ...]] = field(
        default_factory=dict
    )  # cable -> cables that are in its reading
    left_out: tuple[str, ...] = ()  # devices that cannot be put right
    dropped: tuple[str, ...] = ()  # recordings that cannot be used

    def reduced(self, session: ReducedSession) -> ReducedSession:
        """The reduced session without the fault."""
        kept = (r for r in session.recordings if r.name not in self.dropped)
        recordings = tuple(self._reduced(r) for r in kept)
        return ReducedSession(self.rig(session.rig) if self.rig else session.rig, recordings)

    def _reduced(self, recording: Reduced) -> Reduced:
        values = dict(recording.values)
        for cable, source in self.wires.items():
            if source in recording.values:
                values[cable] = recording.values[source]
            else:
                values.pop(cable, None)
        for cable, others in self.less.items():
            if {cable, *others} <= recording.values.keys():
                values[cable] = recording.values[cable] - sum(recording.values[o] for o in others)
        for device, right in self.readings.items():
            if device in values:
                values[device] = right(values[device], recording.name)
        for device in self.left_out:
            values.pop(device, None)
        changed = replace(recording, values=values)
        if self.dummies is not None and recording.name in self.dummies:
            changed = replace(changed, dummy=self.dummies[recording.name])
        return changed

    def raw(self, session: RawSession) -> RawSession:
        """The recorded session without the fault."""
        kept = (r for r in session.recordings if r.name not in self.dropped)
        recordings = tuple(self._raw(r) for r in kept)
        rig = self.rig(session.rig) if self.rig else session.rig
        return replace(session, rig=rig, recordings=recordings)

    def _raw(self, recording: RawRecording) -> RawRecording:
        channels = []
        by_cable = {c.cable: c for c in recording.channels if c.cable}
        for channel in recording.channels:
            one: RawChannel | None = channel
            cable = channel.cable or ""
            if cable in self.wires:
                source = by_cable.get(self.wires[cable])
                one = None if source is None else replace(source, topic=channel.topic, cable=channel.cable)
            if one is None or one.device in self.left_out:
                continue
            others = [by_cable[o] for o in self.less.get(cable, ()) if o in by_cable]
            if others:
                one = replace(one, values=_without(one, others))
            if one.device in self.readings and one.channel != "exciter_shaft":
                one = replace(one, values=self.readings[one.device](one.values, recording.name))
            channels.append(one)
        changed = replace(recording, channels=tuple(channels))
        if self.dummies is not None and recording.name in self.dummies:
            changed = replace(changed, dummy=self.dummies[recording.name])
        return changed


def _without(total: RawChannel, others: list[RawChannel]) -> Array:
    """(n, 1) a channel's readings less those of others, taken at its stamps."""
    stamp = total.stamp_ns.astype(float)
    out: Array = np.array(total.values)
    for other in others:
        order = np.argsort(other.stamp_ns, kind="stable")
        out[:, 0] -= np.interp(stamp, other.stamp_ns[order].astype(float), other.values[order, 0])
    return out


@dataclass(frozen=True)
class Hypothesis:
    """One fault, its change, and its words. Words may need the fit, so that they are made at the end."""

    change: Change
    describe: Callable[[RestFit | None], SetupFault]  # gain is filled in later
    about: frozenset[str]  # devices on whose readings the hypothesis can gain; "rest": on rest alone
    variants: int = 1  # members of the family it belongs to
    loosened: Loosened = field(default_factory=Loosened)
    #: What remains to be changed once the fit is known (zeros of cells, the known mass), or None.
    fitted: Callable[[RestFit], Change] | None = None
    #: Whether the fault may have the numbers that the fit gives it.
    possible: Callable[[RestFit], bool] = lambda rest: True
    #: ... and whether a thorough fit, which knows them best, leaves no doubt that it has.
    confirmed: Callable[[RestFit], bool] = lambda rest: True
    free: int = 0  # numbers that the hypothesis fits
    penalty: float = 0.0  # nats that speak against it before any reading is looked at
    fresh: bool = False  # no first-order evaluation: the description itself changes


def fault(
    effect: str,
    where: Mapping[str, object],
    parameters: Mapping[str, tuple[float, float, str]],
    statement: str,
    advice: str,
    correction: str = "",
    corrected: bool = True,
) -> SetupFault:
    """A fault whose gain is not known yet. parameters: name -> (value, std, unit)."""
    numbers: dict[str, dict[str, object]] = {
        name: {"value": value, "std": std, "unit": unit} for name, (value, std, unit) in parameters.items()
    }
    return SetupFault(effect, dict(where), numbers, statement, advice, correction, corrected, 0.0)
