"""What an examination said against the fault that is in the session."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bench.first_day.faults.base import Case
from rig_identification.examination import Examination, SetupFault
from rig_identification.raw import RawSession

#: A rival that explains the recordings as well to within this is a stated tie (recording contract's 3 nats).
TIE = 3.0
#: Words for "all cells" that a fault of all cells may give as its channel.
ALL_CELLS = frozenset({"cables", "cells", "load_cells", "all_cells", "tension", "tensions"})


@dataclass(frozen=True)
class Marks:
    """One examination, marked."""

    outcome: str  # "named", "other kind", "tie", "later", "wrong", "silent"
    said: tuple[str, ...]  # effect and channel of every fault told, in order
    amount_right: bool | None  # the parameter that was asked for; None: none was asked for
    corrected: bool | None  # of the named fault: whether the fit uses corrected data
    statement: str = ""  # of the first fault


def marked(examination: Examination, case: Case) -> Marks:
    """Mark an examination of a session with ``case`` in it."""
    faults = examination.faults
    said = tuple(told(fault) for fault in faults)
    statement = faults[0].statement if faults else ""
    right = [k for k, fault in enumerate(faults) if _place_right(fault.effect, fault.where, case)]
    named = next((k for k in right if _kind_right(faults[k], case)), None)
    if named is not None:
        fault = faults[named]
        outcome = "named" if named == 0 else "later"
        return Marks(outcome, said, _parameters_right(fault, case), fault.corrected, statement)
    if faults and any(_rival_right(rival, case) for rival in faults[0].alternatives):
        return Marks("tie", said, None, faults[0].corrected, statement)
    if right:
        return Marks("other kind", said, None, faults[right[0]].corrected, statement)
    return Marks("wrong" if faults else "silent", said, None, None, statement)


def told(fault: SetupFault) -> str:
    """Effect, channels and kind in a line: stamp_error imu clock_drift."""
    return " ".join([fault.effect, *sorted(channels_of(fault.where)), *sorted(kinds_of(fault))])


def channels_of(where: Mapping[str, object]) -> frozenset[str]:
    """Contract words of the devices that a ``where`` names, however it lists them."""
    words: set[str] = set()
    for key in ("channel", "channels"):
        value = where.get(key)
        parts = value if isinstance(value, (list, tuple)) else [value]
        for part in parts:
            if part is not None:
                words.update(w for w in re.split(r"[\s,;+]+|\band\b", str(part)) if w)
    return frozenset(words)


def kinds_of(fault: SetupFault) -> frozenset[str]:
    """What a fault says of its kind: ``where.kind``, or a parameter's value or name."""
    words = {str(fault.where["kind"])} if fault.where.get("kind") else set()
    if "kind" in fault.parameters:
        words.add(str(fault.parameters["kind"].get("value")))
    return frozenset(words)


def _place_right(effect: str, where: Mapping[str, object], case: Case) -> bool:
    if effect != case.effect and effect not in case.also:
        return False
    named = channels_of(where)
    if not case.channels:
        return True
    if len(case.channels) > 1 and (not named or named <= ALL_CELLS):
        return True
    return bool(named) and named <= frozenset(case.channels)


def _kind_right(fault: SetupFault, case: Case) -> bool:
    said = kinds_of(fault) | frozenset(fault.parameters)
    return not case.kinds or fault.effect != case.effect or bool(said & frozenset(case.kinds))


def _rival_right(rival: Mapping[str, object], case: Case) -> bool:
    gap = rival.get("log_likelihood_gap")
    where = rival.get("where")
    near = isinstance(gap, (int, float)) and gap <= TIE
    return near and _place_right(str(rival.get("effect")), where if isinstance(where, Mapping) else {}, case)


def _parameters_right(fault: SetupFault, case: Case) -> bool | None:
    """Whether what was asked for is told, in size; a unit's factor as itself or as its inverse."""
    if not case.expected:
        return None
    for name, true in case.expected.items():
        value = fault.parameters.get(name, {}).get("value")
        if not isinstance(value, (int, float)) or value == 0.0:
            return False
        off = [abs(np.log(abs(value / true)))]
        if name == "factor":
            off.append(abs(np.log(abs(value * true))))
        if min(off) > np.log1p(case.within):
            return False
    return True


@dataclass(frozen=True)
class Remains:
    """What differs between the corrected session and the session without fault."""

    values: float  # rms over the noise of the worst channel that is left
    stamps: float  # s, the worst channel's rms difference of stamps, but for a constant
    left_out: tuple[str, ...]  # devices that the corrected session has no more

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def remains(corrected: RawSession, clean: RawSession) -> Remains:
    """Compare message by message where counts agree, else by interpolation."""
    values, stamps, gone = 0.0, 0.0, set()
    for before, after in zip(clean.recordings, corrected.recordings, strict=False):
        for channel in before.channels:
            if channel.channel in ("ground_truth", "exciter_shaft"):
                continue
            now = next((c for c in after.channels if c.topic == channel.topic), None)
            if now is None or not np.isfinite(now.values).all(axis=1).any():
                gone.add(channel.device)
                continue
            noise = _noise(channel.values)
            if len(now.values) == len(channel.values):
                difference = now.values - channel.values
                late = (now.stamp_ns - channel.stamp_ns) / 1e9
                stamps = max(stamps, float(np.std(late)))
            else:
                at = [np.interp(now.stamp_ns, channel.stamp_ns, v) for v in channel.values.T]
                difference = now.values - np.stack(at, axis=1)
            rms = np.sqrt(np.nanmean(difference**2, axis=0)) / noise
            values = max(values, float(np.nanmax(rms)))
    return Remains(values, stamps, tuple(sorted(gone)))


def _noise(values: np.ndarray) -> np.ndarray:
    """(width,) of white noise, from second differences."""
    return np.asarray(np.sqrt(np.mean(np.diff(values, n=2, axis=0) ** 2, axis=0) / 6.0) + 1e-12)
