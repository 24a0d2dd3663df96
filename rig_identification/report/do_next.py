"""What to do next, most urgent first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig_identification.quantity import significant
from rig_identification.recording import Session
from rig_identification.report.determined import determinations
from rig_identification.report.doubts import doubt_groups
from rig_identification.report.findings import alternative_views
from rig_identification.report.words import words
from rig_identification.result import Finding, Identification

#: Steps that are shown; what follows is of less use than what stands before it.
MOST = 6
#: Nats by which an explanation trails beyond which it needs no experiment: three standard deviations.
DECIDED = 4.5
#: σ from which on a larger figure says no more.
BEYOND_DOUBT = 30.0


@dataclass(frozen=True)
class Step:
    """One thing to do."""

    what: str
    why: str
    evidence: str  # "evidence 12 σ": how surely it is needed; "" where that has no number


def next_steps(identification: Identification, session: Session) -> list[Step]:
    """Steps in order of urgency.

    Faults of the set-up come first, then what was found in the rig, what could not be determined, which
    numbers of the description to measure again, and what would tell rival explanations apart.
    """
    steps = [
        *_set_up(identification),
        *_converged(identification),
        *_found(identification),
        *_not_determined(identification, session),
        *_held_out(session),
        *_measure_again(identification),
        *_rivals(identification),
    ]
    return steps[:MOST]


def in_sigma(nats: float | None) -> str:
    """A gain of log likelihood as the deviation that is as unlikely: ``sqrt(2 gain)`` standard deviations."""
    if nats is None or not np.isfinite(nats) or nats <= 0.0:
        return ""
    sigma = float(np.sqrt(2.0 * nats))
    return f"{significant(sigma, 2)} σ" if sigma < BEYOND_DOUBT else f"over {BEYOND_DOUBT:.0f} σ"


def _evidence(nats: float | None) -> str:
    return f"evidence {told}" if (told := in_sigma(nats)) else ""


def _set_up(identification: Identification) -> Iterator[Step]:
    examination = identification.examination
    faults = () if examination is None else examination.faults
    for fault in sorted(faults, key=lambda f: (f.corrected, -f.gain)):
        done = (
            "This answer is corrected for it." if fault.corrected else "This answer is not corrected for it."
        )
        yield Step(fault.advice or fault.statement, f"{fault.statement} {done}", _evidence(fault.gain))


def _converged(identification: Identification) -> Iterator[Step]:
    if not identification.converged:
        yield Step("Do not use the numbers.", "The fit did not settle.", "")


def _found(identification: Identification) -> Iterator[Step]:
    """Findings of the fit: what would confirm each, by an experiment that does not rest on this fit."""
    from rig_identification.mismatch.experiments import (
        experiment_for,  # a check of the set-up needs no search
    )

    examination = identification.examination
    own = identification.mismatch.findings[0 if examination is None else len(examination.faults) :]
    together: dict[tuple[str, str], list[Finding]] = {}
    for finding in sorted(own, key=lambda f: -(f.evidence.get("log_likelihood_gain") or 0.0)):
        verb = "Confirm" if finding.effect != "unknown" or finding.where.get("law") else "Find"
        if experiment := experiment_for(_kind(finding)):
            together.setdefault((verb, experiment), []).append(finding)
    for (verb, experiment), findings in together.items():
        names = ", ".join(dict.fromkeys(_called(finding) for finding in findings))
        told = " ".join(finding.statement for finding in findings)
        strongest = findings[0].evidence.get("log_likelihood_gain")
        yield Step(f"{verb} {names}: {experiment}.", told, _evidence(strongest))


def _kind(finding: Finding) -> str:
    law = finding.where.get("law")
    return f"{finding.effect} {law}" if finding.effect == "unknown" and law else finding.effect


def _called(finding: Finding) -> str:
    if finding.effect == "unknown":
        return str(finding.where.get("law") or "what has no name")
    channel = finding.where.get("channel")
    return words(finding.effect) + (f" at {channel}" if isinstance(channel, str) else "")


def _not_determined(identification: Identification, session: Session) -> Iterator[Step]:
    """Elements that lack for the same reason as one step."""
    reasons: dict[str, list[str]] = {}
    for row in determinations(identification, session):
        if not row.element.observable:
            reasons.setdefault(row.reason, []).append(row.element.symbol + row.element.index)
    for reason, names in reasons.items():
        yield Step(f"Add a recording that determines {', '.join(names)}, if you need it.", reason, "")


def _held_out(session: Session) -> Iterator[Step]:
    if session.training and not session.holdouts:
        yield Step(
            "Record a second run and mark it holdout: true.",
            "Nothing checks a fit but a run that it did not see.",
            "",
        )


def _measure_again(identification: Identification) -> Iterator[Step]:
    doubts = [(g.device, d) for g in doubt_groups(identification.parameters) for d in g.doubts if d.notable]
    if not doubts:
        return
    ranked = sorted(doubts, key=lambda pair: -abs(pair[1].shift or 0.0))
    names = ", ".join(f"{device} {doubt.name}" for device, doubt in ranked[:MOST])
    device, first = ranked[0]
    yield Step(
        f"Measure again: {names}{' and others' if len(ranked) > MOST else ''}.",
        f"{device} {first.name} is described as {first.nominal} {first.unit} and estimated as {first.value} "
        f"± {first.half_width} {first.unit}.",
        f"up to {significant(abs(first.shift or 0.0), 2)} tolerances off",
    )


def _rivals(identification: Identification) -> Iterator[Step]:
    """What would decide between explanations that these recordings leave open."""
    entries = identification.mismatch.alternatives
    for view, entry in zip(alternative_views(identification.mismatch), entries, strict=True):
        gap = entry.get("log_likelihood_gap")
        if not view.experiment or not isinstance(gap, (int, float)) or not gap < DECIDED:
            continue
        called = (str(entry.get("effect")) != "unknown" and view.effect) or view.where or view.effect
        told = f" ({view.amount})" if view.amount else ""
        yield Step(
            f"To decide on {called}: {view.experiment}.",
            f"These recordings neither show nor exclude it{told}.",
            f"{in_sigma(gap) or '0 σ'} apart so far",
        )
