"""Whether the ideal model explains the recordings, read off the residuals alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rig_identification.estimate.constancy import (
    Departure,
    departure,
    log_predictive,
)
from rig_identification.estimate.evidence import Run
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import Linearised, linearise_run
from rig_identification.estimate.whiteness import Band, bands
from rig_identification.model.definite import definite, integrated_out
from rig_identification.quantity import plain_figure, with_interval
from rig_identification.result import Mismatch, ParameterEstimate

if TYPE_CHECKING:
    from rig_identification.estimate.fitted import Fitted

Array = NDArray[np.float64]

#: Chance of calling a session that the model does explain unexplained.
FALSE_ALARM = 0.005


@dataclass(frozen=True)
class Witness:
    """One band of one residual, and how unlikely it is as noise."""

    recording: str
    channel: str
    axis: str | None
    band: Band


def residual_witnesses(run: Run, linearised: Linearised, residual: Array) -> list[Witness]:
    """Band powers of every channel of a run. residual (m,): whitened, in the rows of ``linearised``."""
    out = []
    for index, channel in enumerate(run.channels):
        for a in channel.axes:
            rows = (linearised.channel == index) & (linearised.axis == a)
            rate = (np.count_nonzero(rows) - 1) / max(float(np.ptp(channel.time)), 1e-9)
            axis = channel.axis_name(a)
            out += [
                Witness(run.recording.name, channel.device, axis, band)
                for band in bands(residual[rows], rate, partial(channel.power_of_noise, a))
            ]
    return out


def predictive_residual(shared: Array, full: Linearised) -> Array:
    """Held-out innovations less what the parameters' own uncertainty accounts for.

    The fit's posterior N(theta, shared^-1) is carried into the held-out run: the residual that stays after
    the best step within it (and in the run's own start) is what no parameter inside its stated
    uncertainty explains.
    """
    p = shared.shape[0]
    normal = full.jacobian.T @ full.jacobian
    normal[:p, :p] += shared
    step = np.linalg.lstsq(normal, full.jacobian.T @ full.residual, rcond=1e-14)[0]
    return np.asarray(full.residual - full.jacobian @ step)


#: How many explanations a search would have: a doubt beyond what is ordinary has to stand out among them all.
HYPOTHESES = 250
#: How many times as likely as another hypothesis a tolerance that is exceeded counts.
DOUBTED = 8.0
#: Std of a doubt that is let go, in tolerances: next to no belief.
LET_GO = 100.0


def _pressed(fitted: Fitted, ordinary: float) -> dict[str, float]:
    """Doubts that the recordings significantly want beyond what is ordinary, and how far (tolerances).

    A doubt is let go by taking its belief away: what the recordings alone make of it, and what that gains. An
    error of many tolerances hardly moves a doubt that is believed to one, and shows in nothing else. Where
    every doubt is an ordinary one the gain is half a chi-square, which counts against how many are asked
    (Bonferroni). Others that stand at their bound stay there.
    """
    parameters, evaluation = fitted.problem.bench.parameters, fitted.evaluation
    theta, gradient, information = evaluation.point.theta, evaluation.gradient, evaluation.information
    limit = 0.5 * float(chi2.isf(DOUBTED * FALSE_ALARM / max(HYPOTHESES, len(parameters.free)), 1))
    doubts = [i for i, p in enumerate(parameters.free, start=INERTIAL) if p.described and not p.ratio]
    held = {i for i in doubts if abs(theta[i]) >= ordinary * (1.0 - 1e-6) and theta[i] * gradient[i] > 0.0}
    out = {}
    for i in doubts:
        free = np.array([k for k in range(gradient.size) if k == i or k not in held])
        at = int(np.flatnonzero(free == i)[0])
        inside, pull = information[np.ix_(free, free)].copy(), gradient[free].copy()
        inside[at, at] -= 1.0 - LET_GO**-2
        pull[at] += theta[i] * (1.0 - LET_GO**-2)
        step = np.linalg.solve(definite(inside), pull)
        gain = 0.5 * float(step @ pull)
        wanted = float(theta[i] + step[at])
        if gain > limit and abs(wanted) > ordinary:
            out[parameters.free[i - INERTIAL].name] = wanted
    return out


#: Variance, in parts of what both claim, by which a held-out run's parameters may differ and the model still
#: be called an approximation: three standard deviations, beyond which nothing is ordinary.
APPROXIMATE = 9.0


@dataclass(frozen=True)
class Heard:
    """What every run says of a fit."""

    witnesses: list[Witness]
    departures: list[Departure]  # of held-out runs

    @property
    def tests(self) -> int:
        """How many there are."""
        return len(self.witnesses) + len(self.departures)

    def unlikely(self, log10_p: float) -> bool:
        """Whether chance, of so many tests, hardly ever goes so far."""
        return log10_p < float(np.log10(FALSE_ALARM / max(1, self.tests)))

    def contradicting(self) -> list[Departure]:
        """Held-out runs that ask for other parameters."""
        return [d for d in self.departures if self.unlikely(d.log10_p)]

    @property
    def contradicted(self) -> bool:
        """Whether a held-out run asks for parameters so far off that the model is none of the rig.

        What the fitted runs show to be left of the model moves the parameters as well, and counts.
        """
        return any(d.excess > max(APPROXIMATE, self._loudest) for d in self.contradicting())

    @property
    def looseness(self) -> float:
        """How many times too much a fit claims to know: 1 where its residuals are noise.

        The largest power of a band that is not noise, in units of white noise, or the variance of what
        held-out runs ask for beyond their fit's, whichever is larger.
        """
        return max([self._loudest, *(d.excess for d in self.contradicting())])

    @property
    def _loudest(self) -> float:
        """The largest power of a band that is not noise, in units of white noise; 1 where there is none."""
        return max([1.0, *(w.band.power for w in self.witnesses if self.unlikely(w.band.log10_p))])


def hear(fitted: Fitted) -> Heard:
    """Band powers of every channel of every run, fitted and held out; what held-out runs ask for."""
    witnesses: list[Witness] = []
    departures: list[Departure] = []
    for run, linearised in zip(fitted.problem.runs, fitted.evaluation.runs, strict=True):
        witnesses += residual_witnesses(run, linearised, linearised.residual)
    shared = integrated_out(fitted.evaluation.information, fitted.problem.bench.parameters.size)
    for run, full in _held_out(fitted):
        witnesses += residual_witnesses(run, full, predictive_residual(shared, full))
        departures.append(departure(run.recording.name, shared, full))
    return Heard(witnesses, departures)


def _held_out(fitted: Fitted) -> Iterator[tuple[Run, Linearised]]:
    """Every held-out run about the fit, with all that is free in the model among its columns."""
    for run, linearised in zip(fitted.holdout_runs, fitted.holdouts, strict=True):
        start = linearised.motion.state(0)
        full = linearise_run(fitted.problem.bench, run, fitted.evaluation.point.theta, start)
        if full is not None:
            yield run, full


def held_out_densities(fitted: Fitted) -> dict[tuple[str, float], float]:
    """Log density (nats) of every held-out run after the fit, by its recording's name and its offset (s)."""
    shared = integrated_out(fitted.evaluation.information, fitted.problem.bench.parameters.size)
    return {run.begins: log_predictive(shared, full) for run, full in _held_out(fitted)}


def weighed_otherwise(fitted: Fitted) -> str | None:
    """What the ground scale says against the fit, where chance does not account for it."""
    if fitted.problem.mass is None:
        return None
    value, std = fitted.problem.mass
    mass = float(fitted.problem.bench.parameters.elements(fitted.evaluation.point.theta)[0])
    if chi2.sf(((mass - value) / std) ** 2, 1) > 0.5 * FALSE_ALARM:
        return None
    return f"the rig carries {mass:.6g} kg, the scale says {with_interval(value, std, 'kg')}"


def _restless(fitted: Fitted, tried: int) -> list[str]:
    """Recordings at rest whose means the fit misses by more than chance does. tried: tests in all."""
    limit = FALSE_ALARM / max(1, tried)
    out = []
    for evidence, rest in zip(fitted.problem.rests, fitted.evaluation.rests, strict=True):
        if chi2.sf(float(np.sum(rest.residual**2)), rest.residual.size) < limit:
            out.append(f"at rest in {evidence.recording.name} the means lie up to {_farthest(rest.residual)}")
    return out


def _farthest(residual: Array) -> str:
    return f"{plain_figure(float(np.max(np.abs(residual))))} of their standard deviations off"


def as_sentence(reasons: list[str]) -> str:
    """Reasons as one sentence; units and names keep their capitals."""
    told = "; ".join(reasons)
    return f"{told[:1].upper()}{told[1:]}."


def judge(
    fitted: Fitted,
    parameters: tuple[ParameterEstimate, ...],
    holdout_error: float | None,
    training_error: float,
    ordinary: float,
) -> Mismatch:
    """Verdict ``none`` or ``unexplained`` with its reason."""
    heard = hear(fitted)
    witnesses = heard.witnesses
    pressed = _pressed(fitted, ordinary)
    heavy = weighed_otherwise(fitted)
    beyond = [(p.name, pressed[p.name]) for p in parameters if p.name in pressed]
    reasons = []
    if witnesses:
        worst = min(witnesses, key=lambda w: w.band.log10_p)
        if heard.unlikely(worst.band.log10_p):
            where = worst.channel + (f" {worst.axis}" if worst.axis else "")
            reasons.append(
                f"the residual of {where} in {worst.recording} is not noise: "
                f"between {worst.band.low:.2g} and {worst.band.high:.2g} Hz "
                f"it has {plain_figure(worst.band.power)} times the power of white noise"
            )
    for d in heard.contradicting():
        reasons.append(
            f"{d.recording}, held out, asks for other parameters than the fitted ones: squared deviations "
            f"come to {plain_figure(d.statistic)} where {d.directions} are to be expected"
        )
    reasons += [
        f"{run.recording.name}, held out, cannot be followed with these parameters from any start"
        for run in fitted.lost
    ]
    reasons += [
        f"{name} cannot be followed with the rig as described: it is left out of the fit"
        for name in fitted.unfollowed
    ]
    reasons += _restless(fitted, heard.tests + len(fitted.problem.rests))
    if not fitted.converged:
        reasons.append("the fit did not settle")
    if heavy is not None:
        reasons.append(heavy)
    if beyond:
        wanted = ", ".join(f"{name} {off:+.1f}" for name, off in beyond[:3])
        reasons.append(
            f"without its tolerance a number of the rig description would leave it by more than "
            f"{ordinary:.0f} tolerances: {wanted}{' and others' if len(beyond) > 3 else ''} "
            "(with the tolerance the fit holds it nearer)"
        )
    scores = (
        f"Held-out error {holdout_error:.3g}, fitted {training_error:.3g} (1 is a perfect model)."
        if (holdout_error is not None)
        else f"Fitted error {training_error:.3g} (1 is a perfect model); no held-out run."
    )
    judged = "Judged by the residuals alone."
    if reasons:
        return Mismatch("unexplained", f"{as_sentence(reasons)} {scores} {judged}")
    return Mismatch("none", f"Every residual is noise within its sensor's own. {scores} {judged}")
