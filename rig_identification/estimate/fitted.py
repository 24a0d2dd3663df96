"""A solved session: what was fitted, how it came out, and how it predicts what was held out."""

from __future__ import annotations

from dataclasses import dataclass

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.prediction import Linearised
from rig_identification.estimate.solve import Evaluation, Point, Problem
from rig_identification.estimate.stretching import Stretched
from rig_identification.estimate.valley import Valley, valley_of
from rig_identification.model.motion import State


@dataclass(frozen=True)
class HeldPart:
    """A stretch of a recording in which something beside the rig acts on the body."""

    recording: str
    start: float  # s after the recording's start
    end: float  # s


@dataclass(frozen=True)
class Fitted:
    """A solved problem and how its held-out runs came out."""

    problem: Problem
    evaluation: Evaluation
    converged: bool
    rest: State  # pose at rest, roughly
    holdout_runs: tuple[Run, ...]
    holdouts: tuple[Linearised, ...]
    notes: tuple[str, ...] = ()
    guess: Point | None = None  # where the fit started: everything about the rig as described
    held_parts: tuple[HeldPart, ...] = ()
    lost: tuple[Run, ...] = ()  # held-out runs that cannot be followed from any start state
    unfollowed: tuple[str, ...] = ()  # recordings that the model could not follow when the fit began
    stretch: Stretched | None = None  # where the cables of the ideal model stretch from the first guess on
    valley: Valley | None = None  # what its fit's valleys allow of the ten numbers; None: not asked


def sure_of(fitted: Fitted) -> Valley | None:
    """What the valleys about a fit allow of the ten numbers; None where nothing is to be asked."""
    known = fitted.valley
    if known is not None and known.evaluation is fitted.evaluation:
        return known
    return valley_of(fitted.problem, fitted.evaluation, lower=False)
