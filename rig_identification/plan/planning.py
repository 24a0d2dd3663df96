"""The use case: what to record with the time there is, what it would tell, and what else would help."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.estimate.enough import SECONDS
from rig_identification.plan.apart import SURE, Tie, deciding, ties_of
from rig_identification.plan.before import Before
from rig_identification.plan.choose import Choice, Chosen, choose, relative_std, worst
from rig_identification.plan.doubts import Doubts, doubts
from rig_identification.plan.elsewhere import Other, others
from rig_identification.plan.information import Laboratory, informations, laboratory
from rig_identification.plan.limits import Margins, within_limits
from rig_identification.plan.means import Means
from rig_identification.plan.menu import Item, bare, menu, usual
from rig_identification.result import InertialEstimate
from rig_identification.rig import Rig
from rig_identification.simulate import SessionSpec

Array = NDArray[np.float64]
Notify = Callable[[str, float], None]

#: Name that a held-out run ends with.
HELD_OUT = "holdout"


@dataclass(frozen=True)
class Planned:
    """One recording of the plan."""

    item: Item  # as long as it is to be
    role: str  # "at rest", "fitted" or "held out"
    margins: Margins


@dataclass(frozen=True)
class Decision:
    """What the plan makes of a tie that an earlier session left."""

    told: str  # what that session told; "": nothing beyond the ideal model
    rival: str
    gap: float  # nats by which the rival trails so far
    nats: float | None  # that the fitted recordings are expected to tell; None: cannot be predicted
    chance: float | None  # of a decision
    best: str  # the recording that tells most of it
    experiment: str  # what would decide otherwise

    @property
    def decided(self) -> bool:
        """Whether the plan is as good as sure to decide it."""
        return self.chance is not None and self.chance >= SURE


@dataclass(frozen=True)
class Plan:
    """Everything that a plan says."""

    spec: SessionSpec  # rig and body; no runs
    means: Means
    recordings: tuple[Planned, ...]
    expected: InertialEstimate  # of what is fitted; covariance with what stays undecided
    alone: Array  # (10, 10) covariance if the model lacks nothing
    relative: Array  # (10,) expected std as a share of each element's natural size
    chosen: Chosen  # step by step
    usual_worst: float | None  # worst relative std of inertia by a release and one speed, equally long
    doubts: Doubts | None
    others: tuple[Other, ...]  # what else would help
    left_out: tuple[str, ...]  # of the menu: limits allow hardly any of it
    decisions: tuple[Decision, ...] = ()  # on the ties of an earlier session
    before: Array | None = None  # (10,) std of an earlier session's answer, which counts in what is expected

    @property
    def worst(self) -> float:
        """Worst expected relative std of what of the inertia can be determined."""
        return worst(self.relative, self.chosen.determined)


def plan(
    rig: Rig,
    elements: Array,
    means: Means,
    notify: Notify | None = None,
    before: Before | None = None,
) -> Plan:
    """The best use of the minutes that there are for a body (10,) on a rig.

    before: an earlier session of that body on that rig. What decides its ties is recorded first, and what is
    expected is what both sessions tell together.

    Raises
    ------
    InputError
        The time does not hold one run and one held out, no device tells anything, or the limits allow no run.
    """
    tell = notify or (lambda stage, fraction: None)
    spec = SessionSpec("plan", rig, elements, rates=means.rates)
    _check(spec, means)
    tell("limits of each run", 0.0)
    allowed, left_out = _allowed(spec, menu(rig, elements, means), means)
    first = next((item for item, _ in allowed.values() if item.run is not None), None)
    if first is None:
        raise InputError(
            f"--travel {means.travel:g}: no run keeps hinges within it and cables taut; allow more room"
        )
    earlier = before or Before()
    lab = laboratory(spec, first, earlier.known)
    tell("what each run would tell", 0.15)
    choices = _told(lab, [item for item, _ in allowed.values()])
    fitted = 60.0 * means.minutes - means.block - means.changeover
    still = next((c for c in choices if c.item.name == bare(means).name), None)
    tell("choosing runs", 0.5)
    ties = ties_of(lab, [choice.item for choice in choices], earlier) if earlier.rivals else ()
    firsts = _firsts(choices, still, ties, fitted, means)
    chosen = choose(lab, choices, fitted, SECONDS, firsts, means.changeover)
    recordings = _recordings(lab, chosen, choices, means)
    expected = lab.expected(chosen.information)
    tell("what the model may lack", 0.6)
    blocks = _counted(chosen)
    found = doubts(lab, blocks, expected.covariance)
    widened = expected.covariance if found is None else found.widened
    scale = np.sqrt(np.diag(widened) / np.diag(expected.covariance))
    tell("what else would help", 0.8)
    return Plan(
        lab.spec,
        means,
        recordings,
        replace(expected, covariance=widened),
        expected.covariance,
        relative_std(lab, chosen.information) * scale,
        chosen,
        _usual_worst(lab, chosen, means),
        found,
        others(lab, blocks, chosen),
        left_out,
        tuple(_decision(tie, chosen) for tie in ties),
        None if before is None else before.std,
    )


def _firsts(
    choices: Sequence[Choice], still: Choice | None, ties: Sequence[Tie], seconds: float, means: Means
) -> list[Choice]:
    """What is recorded anyhow: the body at rest, then what decides ties."""
    first = [] if still is None else [still]
    left = seconds - sum(choice.item.seconds + means.changeover for choice in first)
    open_ = [c.item for c in choices if c is not still]
    times = deciding(ties, open_, left, SECONDS, means.changeover)
    by_name = {choice.item.name: choice for choice in choices}
    return first + [by_name[name] for name, n in times.items() for _ in range(n)]


def _decision(tie: Tie, chosen: Chosen) -> Decision:
    blocks = chosen.blocks()
    if not tie.sides:
        return Decision(tie.told, tie.rival, tie.gap, None, None, "", tie.experiment)
    nats = tie.nats(blocks)
    best = max(blocks, key=lambda name: tie.nats({name: blocks[name]}))
    return Decision(tie.told, tie.rival, tie.gap, nats, tie.chance(nats), best, tie.experiment)


def session_of(found: Plan) -> SessionSpec:
    """The planned session as one to simulate, with noise and doubts."""
    items = [planned.item for planned in found.recordings]
    return replace(
        found.spec,
        runs=tuple(item.run for item in items if item.run is not None),
        statics=tuple(item.static for item in items if item.static is not None),
        noise=True,
        doubts=True,
    )


def _check(spec: SessionSpec, means: Means) -> None:
    least = means.rest + 2.0 * means.block + 3.0 * means.changeover
    if 60.0 * means.minutes < least:
        raise InputError(
            f"--minutes {means.minutes:g}: rest, a run and one held out take {least / 60.0:.2g} at least"
        )
    missing = [name for name in _noise_names(spec) if name not in spec.rig.noise]
    if missing:
        raise InputError(
            f"rig: noise.{missing[0]}: missing; how well a device tells anything follows from it: "
            f"give {', '.join(missing)}"
        )


def _noise_names(spec: SessionSpec) -> list[str]:
    """Noise of every device that would record."""
    rates, rig = spec.rates, spec.rig
    asked = [
        (rates.tension > 0.0, ("tension",)),
        (rates.imu > 0.0 and rig.imu is not None, ("angular_rate", "specific_force")),
        (rates.inclinometer > 0.0 and rig.inclinometer is not None, ("inclination",)),
        (rates.mocap > 0.0, ("mocap_position", "mocap_orientation")),
        (rates.exciter > 0.0 and rig.exciter is not None, ("exciter_force",)),
    ]
    return [name for there, names in asked if there for name in names]


def _allowed(
    spec: SessionSpec, items: Sequence[Item], means: Means
) -> tuple[dict[str, tuple[Item, Margins]], tuple[str, ...]]:
    """What limits allow by name, with the margins of each, and the names of the rest."""
    found = [(item.name, within_limits(spec, item, means)) for item in items]
    kept = {name: limited for name, limited in found if limited is not None}
    return kept, tuple(name for name, limited in found if limited is None)


def _told(lab: Laboratory, items: list[Item]) -> list[Choice]:
    told = zip(items, informations(lab, items), strict=True)
    return [Choice(item, information) for item, information in told if information is not None]


def _counted(chosen: Chosen) -> list[tuple[Choice, int]]:
    """Each item that was chosen, and how often."""
    by_name = {step.choice.item.name: step.choice for step in chosen.steps}
    return [(by_name[name], times) for name, times in chosen.blocks().items()]


def _recordings(lab: Laboratory, chosen: Chosen, choices: list[Choice], means: Means) -> tuple[Planned, ...]:
    """At rest first, then the runs, one a kind; last a run held out."""
    out = []
    for choice, times in sorted(_counted(chosen), key=lambda pair: pair[0].item.run is not None):
        role = "at rest" if choice.item.run is None else "fitted"
        out.append(_planned(lab, choice.item.lasting(times), role, means))
    held = _held_out(lab, chosen, choices)
    if held.run is None:
        raise AssertionError("what is held out moves")
    name = f"{held.name}_{HELD_OUT}"
    held = replace(held, name=name, run=replace(held.run, name=name, holdout=True))
    return (*out, _planned(lab, held, "held out", means))


def _planned(lab: Laboratory, item: Item, role: str, means: Means) -> Planned:
    """An item as long as it is to be, weaker where in that time it would pass a limit that a block keeps."""
    limited = within_limits(lab.spec, item, means)
    if limited is None:
        raise AssertionError(f"{item.name}: a block of it keeps the limits")
    return Planned(limited[0], role, limited[1])


def _held_out(lab: Laboratory, chosen: Chosen, choices: list[Choice]) -> Item:
    """The run that would tell most after those that are fitted: another one, if there is another."""
    taken = set(chosen.blocks())
    runs = [c for c in choices if c.item.run is not None]
    fresh = [c for c in runs if c.item.name not in taken] or runs

    def after(choice: Choice) -> float:
        return worst(relative_std(lab, chosen.information + choice.information), chosen.determined)

    return min(fresh, key=after).item


def _usual_worst(lab: Laboratory, chosen: Chosen, means: Means) -> float | None:
    """Worst relative std of inertia by the usual session of equal length (menu.usual)."""
    limited = [
        (item, within_limits(lab.spec, item, means)) for item in usual(lab.spec.rig, lab.spec.elements, means)
    ]
    items = [found[0] for _, found in limited if found is not None]
    runs = [item for item in items if item.run is not None]
    told = informations(lab, items)
    if not runs or any(part is None for part in told):
        return None
    rest = sum(item.seconds for item in items if item.run is None) + len(items) * means.changeover
    blocks = max(1.0, min(SECONDS, chosen.steps[-1].seconds - rest) / means.block)
    total = lab.before
    for item, part in zip(items, told, strict=True):
        if part is not None:
            total = total + (1.0 if item.run is None else blocks / len(runs)) * part
    return worst(relative_std(lab, total), chosen.determined)
