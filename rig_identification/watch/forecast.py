"""How well the ten numbers will be known when the run under way is longer, before it is.

The model is linearised about the present estimate over the run as it would go on. Of the rows of that
Jacobian, whitened by a filter that looks back alone, those up to an instant hold all that a run of that
length tells. Each length therefore takes one sum of squares, and its readings are not needed:

    F(T) = F(now) - J(now)^T J(now) + J(T)^T J(T)

with F the information of all recordings and priors, and J the run's part. What the readings will be does not
enter. A model that does not explain the motion has no such forecast: its errors are none of noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run, prepare
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.prediction import Linearised, linearise_run
from rig_identification.result import natural_size
from rig_identification.rig import Rig
from rig_identification.watch.part import Force, going_on

Array = NDArray[np.float64]

#: Lengths of the run that are looked at, from now to the last.
LENGTHS = 16
#: Half-width of a normal distribution's 95 % interval, in std.
NORMAL_95 = 1.96


@dataclass(frozen=True)
class Forecast:
    """Standard deviations of the ten numbers by the length of the run under way."""

    recording: str
    seconds: Array  # (k,) ascending; the first is what was recorded
    std: Array  # (k, 10) order m cx cy cz J: kg, m, kg m^2
    share: Array  # (k,) largest 95 % half-width of J, as a share of what it is held against (natural_size)

    def enough(self, aim: float) -> float | None:
        """Length (s) from which on no element of J is uncertain by more than ``aim``; None: not by the end.

        aim: share, 95 % half-width of each element over its natural size. Between two lengths a line is
        drawn in the logarithms.
        """
        if self.share[0] <= aim:
            return float(self.seconds[0])
        if self.share[-1] > aim:
            return None
        k = int(np.argmax(self.share <= aim))
        ends, shares = np.log(self.seconds[k - 1 : k + 1]), np.log(self.share[k - 1 : k + 1])
        along = (np.log(aim) - shares[0]) / (shares[1] - shares[0])
        return float(np.exp(ends[0] + along * (ends[1] - ends[0])))


def forecast(fitted: Fitted, name: str, seconds: float, force: Force | None = None) -> Forecast | None:
    """What a fit like ``fitted`` would tell if its run ``name`` went on.

    Parameters
    ----------
    fitted : Fitted
        To what was recorded so far.
    name : str
        Recording under way; of one in several parts the last part goes on.
    seconds : float
        Length of the recording to which is looked.
    force : callable, optional
        Planned force of the exciter at times of the recording; None: it goes on as it was last.

    Returns
    -------
    Forecast or None
        None where the run is not among the fitted ones, is as long already, or cannot be followed so far.
    """
    problem, evaluation = fitted.problem, fitted.evaluation
    index = max((i for i, run in enumerate(problem.runs) if run.recording.name == name), default=None)
    if index is None:
        return None
    run, now, start = problem.runs[index], evaluation.runs[index], evaluation.point.starts[index]
    if run.offset + run.grid.duration >= seconds:
        return None
    longer = _longer(problem.bench.rig, run, seconds, force)
    whole = linearise_run(problem.bench, longer, evaluation.point.theta, start)
    if whole is None:
        return None
    size = problem.bench.parameters.size
    before = sum(r.jacobian.shape[1] - size for r in evaluation.runs[:index])
    own = now.jacobian.shape[1] - size
    columns = np.concatenate([np.arange(size), size + before + np.arange(own)])
    others = evaluation.information.copy()
    others[np.ix_(columns, columns)] -= now.jacobian.T @ now.jacobian
    lengths = np.geomspace(run.grid.duration, longer.grid.duration, LENGTHS)
    std = []
    for told in _told_by(whole, lengths / longer.grid.step):
        information = others.copy()
        information[np.ix_(columns, columns)] += told
        estimate = inertial_estimate(problem, replace(evaluation, information=information))
        std.append(np.sqrt(np.diag(estimate.covariance)))
    out = np.array(std)
    size_of = natural_size(problem.bench.parameters.elements(evaluation.point.theta))
    share = NORMAL_95 * np.max(out[:, 4:] / size_of[4:], axis=1)
    return Forecast(name, run.offset + lengths, out, share)


def _told_by(whole: Linearised, nodes: Array) -> Sequence[Array]:
    """What the rows up to each of ``nodes`` tell: (p + starts, p + starts) each."""
    ends = np.searchsorted(whole.nodes, nodes, side="right")
    out, total, first = [], np.zeros((whole.jacobian.shape[1],) * 2), 0
    for end in ends:
        rows = whole.jacobian[first:end]
        total = total + rows.T @ rows
        first = int(end)
        out.append(total)
    return out


def _longer(rig: Rig, run: Run, seconds: float, force: Force | None) -> Run:
    """The run as if it went on, on the same nodes and with the same noise."""
    step = run.grid.step
    made = prepare(rig, going_on(run.recording, seconds, force), step)
    first = round(run.offset / step)
    if first:
        made = made.between(first, made.grid.nodes - 1)
    known = {channel.key: channel for channel in run.channels}
    channels = tuple(
        replace(c, noise=known[c.key].noise, wander=known[c.key].wander)
        for c in made.channels
        if c.key in known
    )
    return replace(
        made, channels=channels, exciter_noise=run.exciter_noise, R_tracker_mean=run.R_tracker_mean,
        turning=run.turning, unknown=(),
    )  # fmt: skip
