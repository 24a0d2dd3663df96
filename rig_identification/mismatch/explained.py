"""What a search ends with: a fit with effects in it, and what is told of it."""

from __future__ import annotations

from dataclasses import dataclass

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.mixture import Bodies
from rig_identification.estimate.solve import Problem, excess
from rig_identification.estimate.verdict import Heard, hear, weighed_otherwise
from rig_identification.mismatch.trial import Trial
from rig_identification.result import Mismatch

#: Share of the ideal model's excess, and mean square beyond noise, up to which what is left is a trace: no
#: model of a swinging liquid or a dry hinge is perfect.
TRACE, TRACE_SQUARE = 0.01, 1.03
#: Where the ideal model left a hundred times as much again, of which no model follows the last part in ten
#: thousand, what is left may come to a held-out error of 1.1, which the contract calls explained.
NEXT_TO_NONE, NEXT_TO_NONE_SQUARE = 1e-4, 1.1**2


@dataclass(frozen=True)
class Explained:
    """A fit with effects in it; beside it the cautious fit of the ideal model where that was needed."""

    fitted: Fitted
    mismatch: Mismatch
    ideal: Ideal
    loose: float = 1.0  # factor on every variance where a trace is left
    trace: bool = False  # whether something is left at all, be it next to nothing
    bodies: Bodies = ()  # what rivals make of the body
    possible: bool = True  # whether every effect in it has an amount and a place that it can have
    effects: tuple[Trial, ...] = ()  # of the catalogue that are in its model
    plain: Problem | None = None  # the problem without them

    @property
    def told(self) -> bool:
        """Whether it explains the session, but for a trace perhaps."""
        return self.mismatch.verdict == "explained"

    @property
    def wholly(self) -> bool:
        """Whether it does, and every residual is noise."""
        return self.told and not self.trace


def only_a_trace(ideal: Fitted, fitted: Fitted, square: float = TRACE_SQUARE) -> bool:
    """Whether what ``fitted`` leaves is next to nothing beside what the ``ideal`` model leaves.

    square: mean square of whitened residuals up to which it may be.
    """
    share = excess(fitted.evaluation) / max(excess(ideal.evaluation), 1.0)
    allowed = max(square, NEXT_TO_NONE_SQUARE) if share < NEXT_TO_NONE else square
    return fitted.converged and share < TRACE and misfit(fitted.evaluation) < allowed


def trace_of(ideal: Fitted, fitted: Fitted) -> Heard | None:
    """What is heard of a fit that leaves but a trace; None: its residuals show more than that.

    What the ground scale contradicts is no trace, though it is one number among a hundred thousand; nor is a
    held-out run that cannot be followed, of which there is no residual to hear.
    """
    if fitted.lost or weighed_otherwise(fitted) is not None or not only_a_trace(ideal, fitted):
        return None
    heard = hear(fitted)
    return None if heard.contradicted else heard


def held_out_errors(before: float | None, after: float | None) -> str:
    """The two errors that a person asks for first, as a sentence."""

    def number(value: float | None) -> str:
        return "not known" if value is None else f"{value:.3g}"

    return f"Held-out error {number(before)} before, {number(after)} after (1 is a perfect model)."


def evidence_of(ideal: Ideal, fitted: Fitted, after: float | None) -> dict[str, float | None]:
    """``evidence`` of a finding: what the fit with it gains over the ideal model's. after: held-out error."""
    return {
        "log_likelihood_gain": float(ideal.fitted.evaluation.cost - fitted.evaluation.cost),
        "holdout_error_before": ideal.scores.holdout,
        "holdout_error_after": after,
    }
