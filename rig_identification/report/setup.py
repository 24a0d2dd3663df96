"""The set-up as ``check`` found it, written out: faults, readings at rest and topics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby

from rig_identification.examination import Examination, RestReading, SetupFault, TopicAccount
from rig_identification.quantity import decimals, number, significant, unit_text
from rig_identification.report.findings import place_text
from rig_identification.report.words import device_words, title, words
from rig_identification.result import Finding
from rig_identification.rig import Rig

#: Beyond this many standard deviations a reading at rest is not as described (0.3 % of sound ones by chance).
FAR = 3.0
#: What a fault's ``channel`` says where it is in every device, or in every load cell.
_ALL = "all"
_ALL_CELLS = frozenset({"cables", "all_cells", "load_cells"})


@dataclass(frozen=True)
class TieView:
    """What explains a fault's readings as well."""

    statement: str
    gap: str  # nats


@dataclass(frozen=True)
class FaultView:
    """One fault, written out."""

    title: str
    anchor: str
    statement: str
    advice: str
    correction: str  # corrected lines, as they stand in the file
    done: str  # what the fit makes of it
    where: tuple[tuple[str, str], ...]
    gain: str  # nats
    ties: tuple[TieView, ...]


@dataclass(frozen=True)
class RestView:
    """One reading at rest beside what the description says of it."""

    recording: str
    reading: str
    measured: str
    expected: str
    unit: str
    off: str  # standard deviations
    is_far: bool


@dataclass(frozen=True)
class TopicView:
    """One topic of one bag."""

    topic: str
    message_type: str
    count: str
    rate: str
    start: str
    end: str
    gaps: int
    longest_gap: str
    clock: str
    used: bool
    note: str


@dataclass(frozen=True)
class SetupView:
    """The whole set-up, written out."""

    headline: str
    short: str  # faults and warnings, counted
    faults: list[FaultView]
    warnings: tuple[str, ...]
    rest: list[RestView]
    far: int  # readings at rest that are not as described
    topics: list[tuple[str, list[TopicView]]]  # by recording
    used: int
    unused: int


def setup_view(examination: Examination) -> SetupView:
    """Write out an examination."""
    rest, used = rest_views(examination), sum(topic.used for topic in examination.topics)
    return SetupView(
        headline=headline(examination),
        short=", ".join(filter(None, counts(examination))),
        faults=fault_views(examination),
        warnings=examination.warnings,
        rest=rest,
        far=sum(view.is_far for view in rest),
        topics=topic_views(examination),
        used=used,
        unused=len(examination.topics) - used,
    )


def counts(examination: Examination) -> tuple[str, str]:
    """Faults and warnings, counted in words; "" where there are none."""
    pairs = (("fault", len(examination.faults)), ("warning", len(examination.warnings)))
    faults, warnings = (f"{n} {word}{'s' if n > 1 else ''}" if n else "" for word, n in pairs)
    return faults, warnings


def headline(examination: Examination) -> str:
    """One sentence on faults and warnings."""
    faults, warnings = counts(examination)
    told = f"{faults or 'No fault'} of the set-up {'were' if len(examination.faults) > 1 else 'was'} found"
    return f"{told}{f', {warnings}' if warnings else ''}."


def fault_views(examination: Examination) -> list[FaultView]:
    """Write out every fault."""
    return [_fault(fault, index) for index, fault in enumerate(examination.faults, start=1)]


def rest_views(examination: Examination) -> list[RestView]:
    """Write out the readings at rest, recording by recording."""
    return [_rest(reading) for reading in examination.rest]


def topic_views(examination: Examination) -> list[tuple[str, list[TopicView]]]:
    """Name of each recording, and its topics."""
    grouped = groupby(examination.topics, key=lambda topic: topic.recording)
    return [(name, [_topic(topic) for topic in topics]) for name, topics in grouped]


def faulty_parts(told: Iterable[SetupFault | Finding], rig: Rig) -> frozenset[str]:
    """Cables and devices that faults or findings name, by the contract's words, alone or all together."""
    cables = {cable.name for cable in rig.cables}
    known = cables | {"imu", "inclinometer", "exciter", "mocap"}
    named = {word for fault in told for word in _words_in((fault.where, fault.parameters))}
    if named & _ALL_CELLS:
        named |= cables
    return frozenset(known if _ALL in named else known & named)


def _words_in(value: object) -> Iterator[str]:
    """Words of a value, and of what it holds; several names stand in one text with commas."""
    if isinstance(value, str):
        yield from value.split(", ")
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _words_in(item)
    elif isinstance(value, (list, tuple, set, frozenset)):
        for item in value:
            yield from _words_in(item)


def _fault(fault: SetupFault, index: int) -> FaultView:
    return FaultView(
        title=title(fault.effect),
        anchor=f"fault-{index}",
        statement=fault.statement,
        advice=fault.advice,
        correction=fault.correction.strip("\n"),
        done="corrected before the fit" if fault.corrected else "not corrected; left out, or told only",
        where=tuple((key, place_text(key, value)) for key, value in fault.where.items() if value is not None),
        gain=significant(fault.gain, 3),
        ties=tuple(_tie(alternative) for alternative in fault.alternatives),
    )


def _tie(alternative: Mapping[str, object]) -> TieView:
    gap = alternative.get("log_likelihood_gap")
    statement = str(alternative.get("statement") or alternative.get("effect") or "")
    return TieView(statement, significant(float(gap), 3) if isinstance(gap, (int, float)) else "–")


def _rest(reading: RestReading) -> RestView:
    off = (reading.measured - reading.expected) / reading.std if reading.std > 0.0 else 0.0
    places = decimals(reading.std)
    name = " ".join(filter(None, (device_words(reading.device), words(reading.quantity), reading.axis)))
    return RestView(
        reading.recording, name, number(reading.measured, places), number(reading.expected, places),
        unit_text(reading.unit), number(off, 1) if abs(off) < 1e4 else significant(off, 2), abs(off) > FAR,
    )  # fmt: skip


def _topic(topic: TopicAccount) -> TopicView:
    timed = topic.device is not None
    return TopicView(
        topic=topic.topic,
        message_type=topic.message_type,
        count=number(topic.count, 0),
        rate=_seconds(topic.rate, 1) if topic.rate else "–",
        start=_seconds(topic.start, 2) if timed else "–",
        end=_seconds(topic.end, 2) if timed else "–",
        gaps=topic.gaps,
        longest_gap=_seconds(topic.longest_gap, 3) if topic.gaps else "–",
        clock=_clock(topic.clock),
        used=topic.used,
        note=topic.note,
    )


def _seconds(value: float, places: int) -> str:
    """Ordinary numbers with fixed places; what a broken stamp says with a power of ten."""
    return number(value, places) if abs(value) < 1e5 else significant(value, 3)


def _clock(seconds: float | None) -> str:
    """How long after its stamp a message was received."""
    if seconds is None:
        return "–"
    return f"{number(1e3 * seconds, 1)} ms" if abs(seconds) < 1.0 else f"{_seconds(seconds, 1)} s"
