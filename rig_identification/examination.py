"""What ``check`` finds out about a session before any model is fitted: frozen values, SI units."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class TopicAccount:
    """One topic of one bag."""

    recording: str
    topic: str
    message_type: str
    device: str | None  # the contract's word; None: no topic of the contract
    used: bool  # False: left aside, ``note`` says why
    count: int  # messages
    rate: float  # Hz, median; 0 where there are fewer than two stamps
    start: float  # s after the recording's first stamp
    end: float
    gaps: int  # intervals longer than 1.5 median ones
    longest_gap: float  # s
    clock: float | None  # s, median receive time less stamp; None where receive times tell nothing
    note: str = ""


@dataclass(frozen=True)
class RestReading:
    """One number measured at rest beside what the description says of it."""

    recording: str
    device: str
    quantity: str  # "tension", "inclination", "specific_force"
    axis: str | None
    unit: str
    measured: float
    expected: float  # of the described rig with the body that fits all readings at rest best
    std: float  # of the difference, from noise and tolerances


@dataclass(frozen=True)
class SetupFault:
    """One fault of wiring, units, axes, stamps or description."""

    effect: str  # word of the effects' table: "unit", "axes", "wiring", "stamp_error", ...
    where: dict[str, object]  # as in a finding: channel, axis, recordings, times
    parameters: dict[str, dict[str, object]]  # name -> {"value", "std", "unit"}; std 0: discrete
    statement: str  # what is wrong, in a sentence
    advice: str  # what to change in driver, description or wiring
    correction: str  # the corrected lines of rig.yaml, session.yaml or the mapping; "" where there are none
    corrected: bool  # True: the fit uses corrected data; False: the channel is left out, or it is only told
    gain: float  # nats by which the fault explains the recordings better than none
    alternatives: tuple[dict[str, object], ...] = ()  # {"effect", "where", "statement", "log_likelihood_gap"}


@dataclass(frozen=True)
class Examination:
    """Everything that ``check`` says about a session."""

    session: str
    topics: tuple[TopicAccount, ...]
    rest: tuple[RestReading, ...]
    faults: tuple[SetupFault, ...]
    warnings: tuple[str, ...] = ()  # sentences: what is mounted and not recorded, topics not used, ...
    notes: tuple[str, ...] = field(default_factory=tuple)  # sentences on how bags were read
