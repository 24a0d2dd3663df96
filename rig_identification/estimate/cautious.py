"""Body and intervals where the ideal model does not explain the recordings.

An output-error fit of a model that lacks something bends every parameter to swallow it and
states an interval that is far too small. Two measures limit the harm until the missing
physics is found: runs are fitted in short pieces (segments.py), and every channel is
weighed by what the residual really has at the frequencies of the motion, instead of by its
sensor's noise. A channel that contradicts the model then counts for as little as it deserves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.growing import HOPELESS_SQUARE, misfit
from rig_identification.estimate.rest_evidence import RestEvidence
from rig_identification.estimate.solve import (
    PATIENCE,
    POLISH,
    Damping,
    Evaluation,
    Point,
    Problem,
    evaluate,
    solve,
)

Array = NDArray[np.float64]

#: Frequencies at which rigid rigs move, Hz.
MOTION_BAND = 5.0
#: Rounds of weighing and fitting, and steps of each fit.
ROUNDS = 4
STEPS = 4
#: Std of white noise's power up to which more than it counts as chance.
CHANCE = 3.0
#: Evaluations that a step may take on average, of a fit whose weights are made anew after it.
HASTY = 1.0


Axis = tuple[str, str, int]  # device, quantity, axis


def _powers(problem: Problem, evaluation: Evaluation) -> dict[Axis, list[Array]]:
    """Power of the whitened residual of each axis and run, at the frequencies of the motion."""
    power: dict[Axis, list[Array]] = {}
    for run, linearised in zip(problem.runs, evaluation.runs, strict=True):
        for index, channel in enumerate(run.channels):
            for axis in channel.axes:
                rows = linearised.residual[(linearised.channel == index) & (linearised.axis == axis)]
                if rows.size < 8:
                    continue
                rate = (rows.size - 1) / max(float(np.ptp(channel.time)), 1e-9)
                ordinates = np.abs(np.fft.rfft(rows)) ** 2 / rows.size
                inside = np.arange(ordinates.size) * rate / rows.size <= MOTION_BAND
                power.setdefault((channel.device, channel.quantity, axis), []).append(ordinates[inside])
    return power


def band_inflation(problem: Problem, evaluation: Evaluation) -> dict[Axis, float]:
    """Factor on the noise of each axis: root of the residual's power where motion is."""
    power = _powers(problem, evaluation)
    return {key: float(np.sqrt(max(1.0, float(np.mean(np.concatenate(v)))))) for key, v in power.items()}


def coherence(problem: Problem, evaluation: Evaluation) -> float:
    """How much louder than on average over the motion's frequencies what is left is at its loudest one.

    The largest such ratio of any axis; white residuals have about 1. An error that follows the motion lies at
    the motion's own frequency, and there it counts as one error, not as many small ones.
    """
    ratios = [1.0]
    for parts in _powers(problem, evaluation).values():
        size = max(part.size for part in parts)
        mean = np.mean([part for part in parts if part.size == size], axis=0)
        ratios.append(float(np.max(mean) / max(1.0, np.mean(mean))))
    return max(ratios)


def left_beyond_noise(problem: Problem, sensed: tuple[Run, ...], evaluation: Evaluation) -> float:
    """Squared length of what a fit leaves beyond its sensors' noise where motion is, in its own weights.

    sensed: the runs of ``problem``, each channel with its sensor's own noise. With r what is left and J the
    derivatives, a number is off by a' I^-1 J' r, which is no more than its std times the length of r (Cauchy
    and Schwarz): so far may what a model lacks bend it, if all of it looks like this number's error. Infinite
    where the fit cannot be evaluated.
    """
    bare = replace(problem, runs=sensed)
    there = evaluate(bare, evaluation.point, residuals_only=True)
    if there is None:
        return np.inf
    factors = {
        (c.device, c.quantity, axis): float(heavy.noise[k] / c.noise[k])
        for weighed, run in zip(problem.runs, sensed, strict=True)
        for heavy, c in zip(weighed.channels, run.channels, strict=True)
        for k, axis in enumerate(c.axes)
    }
    total = 0.0
    for key, parts in _powers(bare, there).items():
        lines = np.concatenate(parts)
        # Each line stands for itself and its negative; white noise's sum has a std of root n
        left = float(np.sum(lines)) - lines.size - CHANCE * np.sqrt(lines.size)
        total += 2.0 * max(0.0, left) / factors[key] ** 2
    return total


def once(problem: Problem, evaluation: Evaluation) -> Problem:
    """The problem with what follows the motion counted as one error each, not as many small ones (coherence).

    Taken as many independent ones they would outweigh what a tape measure says of the rig, and bend it.
    """
    factor = np.sqrt(coherence(problem, evaluation))
    runs = tuple(
        replace(run, channels=tuple(replace(c, noise=factor * c.noise) for c in run.channels))
        for run in problem.runs
    )
    return replace(problem, runs=runs)


def reweighted(problem: Problem, evaluation: Evaluation) -> Problem:
    """The problem with every channel's noise, and every rest mean's, as large as its residuals say."""
    factors = band_inflation(problem, evaluation)
    runs = []
    for run in problem.runs:
        channels = []
        for c in run.channels:
            scale = np.array([factors.get((c.device, c.quantity, a), 1.0) for a in c.axes])
            channels.append(replace(c, noise=c.noise * scale))
        runs.append(replace(run, channels=tuple(channels)))
    rests = []
    for evidence, rest in zip(problem.rests, evaluation.rests, strict=True):
        rests.append(_reweighted_rest(evidence, rest.predicted))
    return replace(problem, runs=tuple(runs), rests=tuple(rests))


def _reweighted_rest(evidence: RestEvidence, predicted: tuple[Array, ...]) -> RestEvidence:
    channels = []
    for c, p in zip(evidence.channels, predicted, strict=True):
        channels.append(replace(c, variance=np.maximum(c.variance, (c.mean - p) ** 2)))
    return replace(evidence, channels=tuple(channels))


def solve_cautiously(parts: Problem, point: Point, *, hasty: bool = False) -> tuple[Problem, Evaluation]:
    """A fit in pieces (segments.in_pieces) weighed by the residuals themselves: the weighed problem, and it.

    Weights start from the residuals at ``point`` and follow them down, so that what the model
    lacks is never large against the weights and bends nothing on the way. hasty: where no model fits a search
    goes on from here, and all but the last of the weights, which are made anew, are worth no fit to its end.
    """
    current = evaluate(parts, point, residuals_only=True)
    if current is None:
        return parts, solve(parts, point, iterations=ROUNDS * STEPS)[0]
    weighed, evaluation, damped = parts, current, Damping()
    hasty = hasty and misfit(current) > HOPELESS_SQUARE
    for k in range(ROUNDS):
        weighed = reweighted(parts, current)
        polish, patience = (POLISH, HASTY) if hasty and k + 1 < ROUNDS else (0.0, PATIENCE)
        evaluation, _ = solve(
            weighed,
            current.point,
            damped=damped if hasty else None,
            iterations=STEPS,
            tolerance=0.5,
            polish=polish,
            patience=patience,
        )
        current = evaluate(parts, evaluation.point, residuals_only=True) or current
    return weighed, evaluation
