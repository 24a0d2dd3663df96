"""The whole examination: stamps first, then copies, each channel by itself, and channels against each other.

Copies agree to the last bit, whatever else is wrong with them: what is wrong with the original is told once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rig_identification.check import consistency, readings, stamps
from rig_identification.check.consistency.judge import judged
from rig_identification.check.consistency.rest_readings import readings_at_rest
from rig_identification.check.found import examiners
from rig_identification.check.inventory import inventory
from rig_identification.check.left_aside import left_aside
from rig_identification.check.order import out_of_order
from rig_identification.check.stamps.streams import in_order
from rig_identification.cleaning.damaged import session_without_damaged
from rig_identification.examination import Examination, SetupFault
from rig_identification.raw import RawSession

#: Order of the examiners of stamps after which stamps that jump are mended. What is still out of order then
#: are messages that overtook others on their way: a stamp that was set on arrival is never one of them.
MENDED = 60


@dataclass(frozen=True)
class Examined:
    """What an examination found, and the session as it is to be used."""

    examination: Examination
    session: RawSession  # corrected


def examine(raw: RawSession, progress: Callable[[str], None] | None = None) -> Examined:
    """Examine a session. progress: called with one sentence before each stage."""
    session, faults = session_without_damaged(raw), list[SetupFault]()
    for stage, package in (("stamps", stamps), ("copies", consistency), ("readings", readings)):
        if progress is not None:
            progress(f"checking {stage}")
        for examiner in examiners(package):
            if package is stamps and examiner.ORDER > MENDED:
                session = in_order(session)
            for found in examiner.find(session):
                session = found.session
                faults.append(found.fault)
        if package is stamps:
            session = in_order(session)
    if progress is not None:
        progress("checking how channels agree")
    verdict = judged(session)
    for found in verdict.found:
        session = found.session
        faults.append(found.fault)
    rest = readings_at_rest(verdict.evidence) if verdict.evidence is not None else ()
    topics = inventory(raw, session)
    aside = left_aside(raw, session, topics)
    notes = (*raw.notes, *(note for recording in raw.recordings for note in recording.notes), *aside.notes)
    warnings = (*aside.warnings, *out_of_order(raw))
    return Examined(Examination(raw.name, topics, rest, tuple(faults), warnings, notes), session)
