"""What is wrong, told by the motion that was measured and not by the ideal model's.

Where the ideal model fails by far its motion is out of step with the real one, and what first order says
about it is hardly worth more than a guess: of twenty hypotheses each takes about half away. The motion that
was measured is another matter (measured.py). Along it the missing wrench is known, and of what it is made
up, dry hinges or a hose, is a regression. So is what is wrong with a device: a wrench bends the motion and
each of the other devices sees that, so that an error of one is told by its own numbers for less. Where no
wrench leaves only noise nothing that acts on the body would do so, and devices and rig alone are looked at,
and cables that stretch (stretched.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.solve import Point, Problem, excess, shortened
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.first_fits import BEATEN, CLOSE, DIRECT
from rig_identification.mismatch.measured import ENOUGH, driven
from rig_identification.mismatch.screen import Promise, promises_of, screen, with_reference
from rig_identification.mismatch.stretched import stretched_along
from rig_identification.mismatch.trial import Trial, mass_of

#: Seconds of each run that are looked at: along a known motion nothing adds up, and they have it all.
LOOKED_AT = 12.0
#: Promises that are fitted at most: of what is fitted in a second, and of what is fitted slowly.
FEW, SLOW = 4, 3


@dataclass(frozen=True)
class Along:
    """What first order says about the motion that was measured."""

    promises: list[Promise]  # best first; of forces only where a wrench explains that motion
    beyond: bool = False  # whether no wrench does: devices contradict each other, or the rig

    @property
    def worthy(self) -> list[Promise]:
        """Those that are worth a fit, what has a few numbers first.

        That is fitted in a second; a hose takes many, and bends to what is none. Cables that stretch have
        shown how much they take; of a device first order far from the noise promises more than there is.
        """
        shown = [p for p in self.promises if p.candidate.build is not None and p.share > DIRECT]
        if self.beyond and shown:
            return shown[:1]
        most = max((p.gain for p in self.promises), default=0.0)
        if most < BEATEN:
            return []
        slow = [p for p in self.promises if p.candidate.slow and p.gain > CLOSE * most]
        soon = [p for p in self.promises if not p.candidate.slow]
        best = max((p.gain for p in soon), default=0.0)
        soon = [p for p in soon if p.gain > CLOSE * best] if best > CHIEF * most else []
        return [*_needed(soon)[:FEW], *slow[:SLOW]]

    @property
    def sure(self) -> list[Promise]:
        """Those that something beside them is looked for with at once.

        They promise nearly all; or the larger part, and nothing else comes close.
        """
        worthy = self.worthy
        least = CHIEF if len(worthy) == 1 else DIRECT
        return [p for p in worthy if p.share > least]


def _needed(promises: list[Promise]) -> list[Promise]:
    """Those of ``promises`` all of whose numbers are needed.

    A cell's curve has its zero's number and more of its own: these are worth a fit where they promise the
    larger part of what the zero leaves. What is beside the zero bends them all, to a little of that. Where
    it promises all, a tenth more is no reason.
    """
    names = [{q.name for q in p.candidate.parameters} for p in promises]

    def needless(k: int) -> bool:
        share = promises[k].share
        return any(
            own < names[k] and share - p.share < CHIEF * max(1.0 - p.share, 1.0 - DIRECT)
            for p, own in zip(promises, names, strict=True)
        )

    return [p for k, p in enumerate(promises) if not needless(k)]


def along_measured(ideal: Ideal, candidates: list[Candidate]) -> Along:
    """Promises about the measured motion."""
    fitted = ideal.fitted
    problem = shortened(with_reference(fitted.problem, fitted.rest), LOOKED_AT)
    point = fitted.evaluation.point
    if ideal.pieces is not None and ideal.careful is not None:
        # Whole runs bend the body by far more than short pieces do, and the wrench has that to make up for
        there = ideal.careful[1].point
        begun = {run.begins: start for run, start in zip(ideal.pieces.runs, there.starts, strict=True)}
        if all(run.begins in begun for run in problem.runs):
            starts = tuple(begun[run.begins] for run in problem.runs)
            point = replace(point, theta=there.theta, starts=starts)
    guess = None if fitted.guess is None else fitted.guess.theta
    mass = mass_of(problem, fitted.evaluation)
    stretch = partial(stretched_along, problem, fitted.evaluation, mass, guess)
    return _along(problem, point, stretch, candidates, mass)


def along_beside(first: Trial, candidates: list[Candidate], mass: float) -> Along:
    """Promises about the measured motion with a first effect in the model, on the pieces it is fitted to.

    A fit with one effect of two is as far out of step as the ideal model's.
    """
    stretch = partial(stretched_along, first.problem, first.evaluation, mass)
    return _along(first.problem, first.evaluation.point, stretch, candidates, mass)


def _along(
    problem: Problem,
    point: Point,
    stretch: Callable[[], Promise | None],
    candidates: list[Candidate],
    mass: float,
) -> Along:
    """Promises about the motion that was measured, from a point of a problem; stretch: of its cables."""
    seen = driven(problem, point, mass)
    if seen is None:
        # On rigid cables the motion cannot even be followed
        stretched = stretch()
        return Along([] if stretched is None else [stretched], beyond=True)
    if misfit(seen[1]) <= ENOUGH:
        return Along(screen(*seen, candidates, mass))
    promises = promises_of(*seen, [c for c in candidates if not acts(c)])
    left = max(1.0, excess(seen[1]))
    promises = [replace(p, share=p.gain / left) for p in promises]
    stretched = stretch()
    if stretched is not None:
        promises.append(replace(stretched, gain=stretched.share * left))
    return Along(sorted(promises, key=lambda p: -p.gain), beyond=True)


def acts(candidate: Candidate) -> bool:
    """Whether a hypothesis is a force, and no number of rig or devices that the lab doubts."""
    return not candidate.doubted and all(p.kind == "physics" for p in candidate.parameters)
