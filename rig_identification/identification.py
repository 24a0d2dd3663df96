"""The use case under every front end: a session as recorded is examined, corrected, identified and told.

Command line and nodes read the bags, hand them on, and say what comes out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from rig_identification.check.examine import Examined, examine
from rig_identification.errors import InputError
from rig_identification.examination import Examination, SetupFault
from rig_identification.raw import RawSession
from rig_identification.recording import Session
from rig_identification.result import Finding, Identification, Interrupted, Mismatch
from rig_identification.session import clean

Progress = Callable[[str, float], None]
Watcher = Callable[[Identification], None]


@dataclass(frozen=True)
class Prepared:
    """A session ready to be identified, and what was wrong with it before."""

    session: Session  # corrected and cleaned
    examination: Examination | None  # None: a session in memory, which nobody wired


def check_raw(raw: RawSession, progress: Callable[[str], None] | None = None) -> Examined:
    """Examine a session. One that ``identify`` will refuse bears a warning that says why.

    Raises
    ------
    InputError
        The session cannot be used, and no fault that was found says why.
    """
    found = examine(raw, progress)
    try:
        clean(found.session)
    except InputError as error:
        if not found.examination.faults:
            raise
        refused = f"identify cannot use the session as it is: {error}."
        warnings = (*found.examination.warnings, refused)
        return replace(found, examination=replace(found.examination, warnings=warnings))
    return found


def prepare(raw: RawSession, progress: Callable[[str], None] | None = None) -> Prepared:
    """Examine a session, undo the faults that can be undone, and choose the usable samples.

    progress: called with one sentence before each stage of the examination.

    Raises
    ------
    InputError
        What is left cannot be used; the line names the faults that were found too.
    """
    return prepare_examined(examine(raw, progress))


def prepare_examined(examined: Examined) -> Prepared:
    """Choose the usable samples of a session that is examined. Raises InputError as :func:`prepare`."""
    try:
        return Prepared(clean(examined.session), examined.examination)
    except InputError as error:
        if not examined.examination.faults:
            raise
        found = " ".join(fault_text(fault) for fault in examined.examination.faults)
        raise InputError(f"{error}. Found before: {found}") from error


def identify_prepared(
    prepared: Prepared,
    progress: Progress | None = None,
    work: float | None = None,
    watcher: Watcher | None = None,
) -> Identification:
    """Identify the body, and tell the faults of the set-up with what the fit found.

    work: units of work after which the search for what the ideal model leaves out begins nothing new; None:
    as many as mismatch/budget.py has. watcher: is shown each better answer while the search runs, without
    what the examination found.

    Raises
    ------
    InputError
        The session holds nothing to fit.
    Interrupted
        The user broke the search off; it holds the best answer until then.
    """
    from rig_identification.search.identify import identify  # compiles: not before a session is there

    try:
        found = identify(prepared.session, progress=progress, work=work, watcher=watcher)
    except Interrupted as stopped:
        raise Interrupted(with_examination(stopped.answer, prepared.examination)) from stopped
    return with_examination(found, prepared.examination)


def with_examination(found: Identification, examination: Examination | None) -> Identification:
    """The answer with the set-up's faults as its first findings, ties as alternatives, warnings as notes."""
    if examination is None:
        return found
    return replace(
        found,
        mismatch=_with_faults(found.mismatch, examination.faults),
        notes=(*examination.warnings, *examination.notes, *found.notes),
        examination=examination,
    )


def fault_text(fault: SetupFault) -> str:
    """What is wrong, what to do, and the corrected lines, as one line."""
    lines = [line.strip() for line in fault.correction.splitlines() if line.strip()]
    joined = "; ".join(lines).replace(":; ", ": ")  # a heading and what stands below it
    return " ".join(filter(None, [fault.statement, fault.advice, f"Corrected: {joined}." if lines else ""]))


def _with_faults(mismatch: Mismatch, faults: tuple[SetupFault, ...]) -> Mismatch:
    """All is noise once the faults are undone: explained, and not none."""
    if not faults:
        return mismatch
    count = "One fault" if len(faults) == 1 else f"{len(faults)} faults"
    was = "was" if len(faults) == 1 else "were"
    ties = tuple(dict(alternative) for fault in faults for alternative in fault.alternatives)
    return Mismatch(
        verdict="explained" if mismatch.verdict == "none" else mismatch.verdict,
        explanation=f"{count} of the set-up {was} found before anything was fitted. {mismatch.explanation}",
        findings=(*map(_finding, faults), *(f for f in mismatch.findings if not _told_before(f, faults))),
        alternatives=(*ties, *mismatch.alternatives),
    )


def _told_before(finding: Finding, faults: tuple[SetupFault, ...]) -> bool:
    """Whether a finding says of an end of range what the examination has said already."""
    place = ("channel", "quantity", "axis")
    return finding.effect == "unknown" and any(
        fault.effect == "saturation" and all(fault.where.get(k) == finding.where.get(k) for k in place)
        for fault in faults
    )


def _finding(fault: SetupFault) -> Finding:
    """A fault in the contract's form. Held-out errors are not known: nothing is fitted without correction."""
    evidence = {"log_likelihood_gain": fault.gain, "holdout_error_before": None, "holdout_error_after": None}
    return Finding(
        fault.effect, dict(fault.where), dict(fault.parameters), evidence, fault_text(fault), fault.advice,
        fault.correction,
    )  # fmt: skip
