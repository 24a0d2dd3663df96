"""How far off a tracker is seen to read as the body turns, and in which words that is told."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.unseen import unseen_of
from rig_identification.estimate.unseen_sway import likeliest_sway, without_sway
from rig_identification.quantity import with_interval

Array = NDArray[np.float64]

#: Log likelihood (nats) that the errors of all axes together gain before they are told: decisive evidence
#: (Kass and Raftery, Journal of the American Statistical Association 90, 1995).
TOLD = 5.0
#: Unit of each quantity that a tracker measures, and what it is called.
UNITS = {"position": "m", "orientation": "rad"}


@dataclass(frozen=True)
class PoseError:
    """The largest error of a quantity at any turn, and its std."""

    quantity: str
    value: float
    std: float


def pose_errors(fitted: Fitted) -> tuple[PoseError, ...]:
    """The largest error of place and of turn in the fitted runs; nothing where it does not show."""
    found = list(_errors(fitted))
    if sum(gain for gain, _ in found) < TOLD:
        return ()
    out = []
    for quantity in UNITS:
        mine = [error for _, error in found if error.quantity == quantity]
        if mine:
            out.append(max(mine, key=lambda error: error.value))
    return tuple(out)


def _errors(fitted: Fitted) -> Iterator[tuple[float, PoseError]]:
    """(gain in nats, the largest error) of each axis of each run."""
    bench = fitted.problem.bench
    for run, linearised in zip(fitted.problem.runs, fitted.evaluation.runs, strict=True):
        if np.any(linearised.noise.Q):
            # Where a random wrench whitens the residuals nothing else is integrated out of them
            continue
        which, axis, variance = linearised.channel, linearised.axis, linearised.variance
        for off in unseen_of(bench.rig, bench.unseen, run, which, axis, variance):
            if not off.at_samples.shape[1]:
                continue
            left = linearised.plain[off.rows] / np.sqrt(variance[off.rows])
            first = off.at_nodes.shape[1]
            gain = _explained(off.seen, left) - _explained(off.seen[:, :first], left)
            amounts = likeliest_sway(off.seen, left)[first:]
            known = np.linalg.inv(off.seen.T @ off.seen + np.eye(off.seen.shape[1]))
            k = int(np.argmax(np.abs(amounts)))
            std = float(np.max(off.at_samples[:, k]))
            spread = float(np.sqrt(known[first + k, first + k]))
            quantity = run.channels[off.channel].quantity
            yield gain, PoseError(quantity, std * abs(float(amounts[k])), std * spread)


def _explained(seen: Array, left: Array) -> float:
    """Log likelihood (nats) that residuals ``left`` (m,) gain by shapes ``seen`` (m, n) of any amount."""
    if not seen.shape[1]:
        return 0.0
    whitened = left[:, None].copy()
    log_spread = without_sway(seen, whitened)
    return 0.5 * float(left @ left - whitened[:, 0] @ whitened[:, 0]) - log_spread


def pose_error_text(errors: tuple[PoseError, ...]) -> str:
    """The errors in a sentence."""
    told = " and ".join(
        f"{with_interval(error.value, error.std, UNITS[error.quantity])} of {error.quantity}"
        for error in errors
    )
    return (
        f"The tracker's pose is off by up to {told}, by the same each time that the body turns so: markers "
        "that hide behind the body as it turns, or lenses. The fit takes that error for no motion."
    )


#: What a finding calls it.
LAW = "pose error"
#: What to do about it.
ADVICE = (
    "Have two cameras see every marker at each turn of the body, or calibrate the markers while it turns."
)
