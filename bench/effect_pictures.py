"""What a simulated effect looks like in the ideal model's residuals: measured, and drawn as a small SVG."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import periodogram

import rig_identification as ri
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import Scores, fit_session, scores
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.screen import screen
from rig_identification.recording import Recording
from rig_identification.report.envelope import envelope, worst_stretch
from rig_identification.report.line_chart import Curve, Panel, chart_svg, padded_limits
from rig_identification.result import ChannelFit

Array = NDArray[np.float64]

#: The run that is drawn, and of how many periods of the residual (s at least and at most).
RUN, PERIODS, NARROWEST, WIDEST = "run_1", 4.0, 2.0, 12.0
#: Root mean square of a channel's residual, in std of the noise, up to which the ideal model leaves none.
NOISE = 1.15
#: Columns of a long series in the picture, and its width, px.
COLUMNS, WIDTH = 320, 680
#: Colours of an effect, and of what is left without it.
STYLE = (
    "<style>text{font:12px sans-serif;fill:#333}.end{text-anchor:end}.mid{text-anchor:middle}"
    ".grid{stroke:#ddd}.axis{stroke:#888}path{fill:none}.without,.effect{stroke-width:14}"
    ".without{stroke:#8a8a8a}.effect{stroke:#c0392b}</style>"
)


@dataclass(frozen=True)
class Shown:
    """The channel of a run that shows an effect most, and what else could explain the session."""

    fit: ChannelFit  # of the ideal model
    plain: tuple[Array, Array]  # (n,) s and the channel without the effect, without noise
    noise: tuple[Array, Array]  # (n,) s and what is left once the effect is in the model, std of the noise
    at_rest: ChannelFit | None  # what shows it most at rest, where anything does
    held_out: float | None  # error of the held-out run, std
    doubt: tuple[str, float]  # of the rig, which the ideal model moves most: its name, tolerances
    gains: dict[str, float]  # nats that a kind of effect would take away, to first order, most first

    @property
    def taken_up(self) -> bool:
        """Whether the ideal model leaves none of it: a number of the description took it."""
        return self.fit.rms_in_sigma < NOISE

    @property
    def difference(self) -> Array:
        """(n,) the channel with the effect less the one without it, in std of the noise."""
        return np.asarray((self.fit.measured - np.interp(self.fit.time, *self.plain)) / self.fit.noise_std)

    @property
    def left(self) -> Array:
        """(n,) what is drawn: the ideal model's residual, or where it leaves none the difference."""
        return self.difference if self.taken_up else self.fit.residual_in_sigma

    @property
    def window(self) -> tuple[float, float]:
        """From when to when (s) it is drawn: some periods of what is drawn, where that is largest."""
        time, left = self.fit.time, self.left
        hertz, power = periodogram(left - np.mean(left), 1.0 / float(np.median(np.diff(time))))
        main = float(hertz[1 + int(np.argmax(power[1:]))])
        return worst_stretch(time, left, float(np.clip(PERIODS / main, NARROWEST, WIDEST)))

    @property
    def name(self) -> str:
        """The channel in words."""
        axis = "" if self.fit.axis is None else f" {self.fit.axis}"
        return f"{self.fit.channel} {self.fit.quantity.replace('_', ' ')}{axis}"


def shown(made: ri.Simulated, clean: ri.Simulated, without: ri.Simulated, *, rivals: bool) -> Shown:
    """What the ideal model makes of a session.

    clean: the same without noise. without: the same without noise and without the effect. rivals: whether
    every hypothesis is screened.
    """
    fitted = fit_session(made.session)
    told = scores(fitted)
    fits = [c for c in told.channels if c.recording == RUN and c.quantity != "orientation"]
    seen = [_seen(made, clean, without, fitted, told, fit) for fit in fits]
    most = max(seen, key=lambda one: one.fit.rms_in_sigma)
    if most.taken_up:
        most = max(seen, key=lambda one: float(np.mean(one.difference**2)))
    return replace(most, gains=_gains(fitted, float(made.values[0]))) if rivals else most


def _seen(
    made: ri.Simulated,
    clean: ri.Simulated,
    without: ri.Simulated,
    fitted: Fitted,
    told: Scores,
    fit: ChannelFit,
) -> Shown:
    time, values = series_of(made, fit)
    noise = (values - series_of(clean, fit)[1]) / fit.noise_std
    theta, free = fitted.evaluation.point.theta, fitted.problem.bench.parameters.free
    moved = np.array([0.0 if p.unknown else z for p, z in zip(free, theta[INERTIAL:], strict=True)])
    i = int(np.argmax(np.abs(moved)))
    doubt = free[i].name, float(moved[i])
    return Shown(fit, series_of(without, fit), (time, noise), _at_rest(told), told.holdout, doubt, {})


def _at_rest(told: Scores) -> ChannelFit | None:
    still = [c for c in told.channels if c.time.size == 1]
    return max(still, key=lambda c: c.rms_in_sigma, default=None)


def _gains(fitted: Fitted, mass: float) -> dict[str, float]:
    promises = screen(fitted.problem, fitted.evaluation, catalogue(fitted.problem), mass)
    gains: dict[str, float] = {}
    for promise in promises:  # best first
        gains.setdefault(promise.candidate.kind, promise.gain)
    return gains


def series_of(made: ri.Simulated, fit: ChannelFit) -> tuple[Array, Array]:
    """(n,) s and (n,) values of a channel as it was recorded."""
    (recording,) = (r for r in made.session.recordings if r.name == fit.recording)
    return _series(recording, fit)


def _series(recording: Recording, fit: ChannelFit) -> tuple[Array, Array]:
    axis = 0 if fit.axis is None else "xyz".index(fit.axis)
    if fit.quantity == "tension":
        series = recording.tension[fit.channel]
    elif fit.quantity == "inclination":
        assert recording.inclination is not None
        series = recording.inclination
    elif fit.quantity == "position":
        assert recording.mocap is not None
        series = recording.mocap
    else:
        assert recording.imu is not None
        series, axis = recording.imu, axis + 3 * (fit.quantity == "specific_force")
    return series.time, series.values[:, axis]


def drawn(what: Shown, effect: str) -> str:
    """SVG of two panels: the channel with and without the effect, and what the ideal model leaves of it."""
    begin, end = what.window
    fit = what.fit

    def cut(time: Array, values: Array, style: str) -> Curve:
        inside = (time >= begin) & (time <= end)
        return Curve(*envelope(time[inside], values[inside], COLUMNS), style)

    course = (cut(*what.plain, "without"), cut(fit.time, fit.measured, "effect"))
    # The effect's residual below the noise where it is the smaller one
    left = (cut(fit.time, what.left, "effect"), cut(*what.noise, "without"))
    key = KEY[2] if what.taken_up else KEY[1]
    panels = [
        Panel(course, 130, padded_limits(*(c.y for c in course)), (), f"{what.name} ({fit.unit}): {KEY[0]}"),
        Panel(left, 110, padded_limits(*(c.y for c in left)), (), f"in std of the noise: {key}"),
    ]
    svg = chart_svg(panels, x_limits=(begin, end), x_label="t (s)", title=effect, width=WIDTH)
    head, _, rest = svg.partition("</title>")
    head = head.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
    return f'{head}</title>{STYLE}<rect width="100%" height="100%" fill="#fff"/>{rest}\n'


#: What the colours of both panels are.
KEY = (
    "red with the effect, grey without",
    "red the ideal model's residual, grey that with the effect in the model",
    "red with the effect less without it, grey the noise",
)
