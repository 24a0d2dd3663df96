"""A fault of stamps in words: who has it, in which recordings, with which numbers."""

from __future__ import annotations

from collections.abc import Sequence

from rig_identification.check.found import Found
from rig_identification.check.stamps.streams import GROUND_TRUTH
from rig_identification.examination import SetupFault
from rig_identification.raw import RawSession

#: Gain (nats) from which a kind is told. A session has some 30 streams, each tried for nine kinds with up to
#: ten variants. Chance passes a gain g with probability exp(-g) at most (Chernoff's bound of a likelihood
#: ratio): 2700 exp(-20) is one false alarm in two hundred thousand sessions.
PRICE = 20.0

_NAMES = {
    "imu": "the IMU", "inclinometer": "the inclinometer", "exciter": "the exciter", "mocap": "the tracker",
    GROUND_TRUTH: "the ground truth",
}  # fmt: skip


def devices_of(session: RawSession) -> frozenset[str]:
    """Every device of the session; ground truth is none."""
    every = {channel.device for recording in session.recordings for channel in recording.channels}
    return frozenset(every - {GROUND_TRUTH})


def together(session: RawSession, devices: frozenset[str]) -> str:
    """``where``'s channel for some devices: "all", or their names with commas."""
    named = devices - {GROUND_TRUTH}
    everyone = devices_of(session)
    return "all" if len(everyone) > 1 and named == everyone else ", ".join(sorted(named))


def owner(session: RawSession, devices: frozenset[str]) -> str:
    """The subject of a sentence about these devices, in the genitive: "The IMU's"."""
    channel = together(session, devices)
    if channel == "all":
        return "All devices'"
    names = [_NAMES.get(name, f"{name}") for name in channel.split(", ")]
    text = names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
    return text[:1].upper() + text[1:] + "'s"


def recordings_text(session: RawSession, names: Sequence[str]) -> str:
    """Where a fault lies, to end a sentence with: nothing where it is in every recording."""
    if len(names) == len(session.recordings):
        return ""
    return " in " + (names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1])


def quantity(value: float, std: float, unit: str) -> dict[str, object]:
    """A parameter of a fault."""
    return {"value": float(value), "std": float(std), "unit": unit}


def found(
    session: RawSession,
    corrected: RawSession,
    devices: frozenset[str],
    kind: str,
    recordings: Sequence[str],
    *,
    parameters: dict[str, dict[str, object]],
    statement: str,
    advice: str,
    gain: float,
    undone: bool = True,
    times: Sequence[dict[str, object]] = (),
) -> Found:
    """The fault of these devices in these recordings, and the session without it."""
    where: dict[str, object] = {
        "channel": together(session, devices), "kind": kind, "recordings": list(dict.fromkeys(recordings)),
    }  # fmt: skip
    if times:
        where["times"] = list(times)
    fault = SetupFault(
        "stamp_error", where, parameters, statement, advice, correction="", corrected=undone, gain=float(gain)
    )
    return Found(fault, corrected)
