"""Every channel of every recording: measured against predicted, and the residual in units of its noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from html import escape

import numpy as np
from markupsafe import Markup

from rig_identification.quantity import decimals, number, significant, unit_text
from rig_identification.report.envelope import envelope, worst_stretch
from rig_identification.report.grades import grade
from rig_identification.report.line_chart import Curve, Panel, chart_svg, padded_limits
from rig_identification.report.words import device_words, words
from rig_identification.result import ChannelFit

#: Bytes that all charts of a page may take; a page then stays well under five megabytes.
BUDGET = 2_500_000
BYTES_PER_COLUMN = 3 * 2 * 6  # three curves, two samples a column, some six characters a sample
MOST_COLUMNS = 456  # one a pixel


@dataclass(frozen=True)
class ChannelView:
    """One channel of one recording."""

    label: str
    anchor: str
    rms: float
    grade: str  # of the residual: good, fair, bad
    noise: str  # "2.1 N, from the rig description"
    readings: tuple[str, str, str] | None  # measured, predicted, unit: of a single sample, which is no curve
    full: Markup | None
    close_up: Markup | None  # the stretch where the residual is largest


@dataclass(frozen=True)
class RecordingView:
    """All channels of one recording."""

    name: str
    role: str  # "held out", "fitted", "at rest"
    rms: float
    grade: str
    channels: tuple[ChannelView, ...]
    open: bool

    @property
    def charts(self) -> tuple[ChannelView, ...]:
        """Channels that are drawn."""
        return tuple(c for c in self.channels if c.full is not None)

    @property
    def single(self) -> tuple[ChannelView, ...]:
        """Channels of one sample, which stand in a table."""
        return tuple(c for c in self.channels if c.readings is not None)


def finite_channels(channels: tuple[ChannelFit, ...]) -> tuple[tuple[ChannelFit, ...], tuple[str, ...]]:
    """Drop samples without a finite prediction, and channels that are left with none; a sentence for each.

    A fit that did not converge may predict nonsense; the page still has to show the rest.
    """
    kept, notes = [], []
    for fit in channels:
        finite = np.isfinite(fit.residual_in_sigma)
        lost = len(finite) - int(np.count_nonzero(finite))
        if lost:
            notes.append(f"{fit.recording}, {channel_label(fit)}: {lost} samples have no finite prediction.")
        if lost < len(finite):
            kept.append(
                replace(
                    fit, time=fit.time[finite], measured=fit.measured[finite], predicted=fit.predicted[finite]
                )
            )
    return tuple(kept), tuple(notes)


def channel_label(fit: ChannelFit) -> str:
    """Name of a channel for a person: ``imu angular rate x``."""
    parts = [device_words(fit.channel), words(fit.quantity), fit.axis or ""]
    return " ".join(part for part in parts if part)


def channel_anchor(fit: ChannelFit) -> str:
    """Fragment of the page that shows a channel."""
    parts = [fit.recording, fit.channel, fit.quantity, fit.axis or ""]
    return "-".join("".join(c if c.isalnum() or c == "_" else "_" for c in w) for w in parts if w)


def recording_views(channels: tuple[ChannelFit, ...], roles: dict[str, str]) -> list[RecordingView]:
    """Group the channels by recording, held-out ones first, then the fitted and those at rest.

    Parameters
    ----------
    channels : tuple of ChannelFit
    roles : dict
        Recording name -> "held out", "fitted" or "at rest".
    """
    order = {"held out": 0, "fitted": 1, "at rest": 2}
    names = sorted(dict.fromkeys(c.recording for c in channels), key=lambda n: order.get(roles.get(n, ""), 3))
    pictures = sum(1 if roles.get(c.recording) == "at rest" else 2 for c in channels)
    columns = int(np.clip(BUDGET / BYTES_PER_COLUMN / max(pictures, 1), 40, MOST_COLUMNS))
    views = []
    for name in names:
        fits = [c for c in channels if c.recording == name]
        role = roles.get(name, "")
        shown = tuple(_channel_view(c, columns, len(channels), close_up=role != "at rest") for c in fits)
        residual = np.concatenate([c.residual_in_sigma for c in fits])
        rms = float(np.sqrt(np.mean(residual**2)))
        told = grade(rms, len(residual), len(names))
        views.append(RecordingView(name, role, rms, told, shown, open=name == names[0]))
    return views


def _channel_view(fit: ChannelFit, columns: int, compared: int, *, close_up: bool) -> ChannelView:
    """compared: channels of the whole page."""
    drawn = len(fit.time) > 1
    start, end = float(fit.time[0]), float(fit.time[-1])
    width = float(np.clip((end - start) / 6.0, 2.0, 6.0))
    where = worst_stretch(fit.time, fit.residual_in_sigma, width)
    close_up = close_up and end - start > 2.0 * width
    source = "estimated from the recordings" if fit.noise_estimated else "from the rig description"
    return ChannelView(
        label=channel_label(fit),
        anchor=channel_anchor(fit),
        rms=fit.rms_in_sigma,
        grade=grade(fit.rms_in_sigma, len(fit.time), compared),
        noise=f"{significant(fit.noise_std, 2)} {unit_text(fit.unit)}, {source}",
        readings=None if drawn else _readings(fit),
        full=_chart(fit, (start, end), columns) if drawn else None,
        close_up=_chart(fit, where, columns) if close_up else None,
    )


def _readings(fit: ChannelFit) -> tuple[str, str, str]:
    """Measured and predicted to the digits of the noise, and their unit."""
    places = decimals(fit.noise_std)
    measured, predicted = (number(float(v[0]), places) for v in (fit.measured, fit.predicted))
    return measured, predicted, unit_text(fit.unit)


def _chart(fit: ChannelFit, window: tuple[float, float], columns: int) -> Markup:
    inside = (fit.time >= window[0]) & (fit.time <= window[1])
    time, measured, predicted = fit.time[inside], fit.measured[inside], fit.predicted[inside]
    residual = fit.residual_in_sigma[inside]
    reach = max(4.0, 1.05 * float(np.max(np.abs(residual), initial=0.0)))
    signal = Panel(
        curves=(
            Curve(*envelope(time, measured, columns), "measured"),
            Curve(*envelope(time, predicted, columns), "predicted"),
        ),
        height=130,
        limits=padded_limits(measured, predicted),
        label=escape(unit_text(fit.unit)),
    )
    strip = Panel(
        curves=(Curve(*envelope(time, residual, columns), "residual"),),
        height=64,
        limits=(-reach, reach),
        bands=((-1.96, 1.96, "band"),),
        label="residual, σ",
    )
    limits = window if window[1] > window[0] else (window[0] - 0.5, window[1] + 0.5)
    return Markup(
        chart_svg(
            [signal, strip],
            x_limits=limits,
            x_label="s",
            title=escape(f"{fit.recording} {channel_label(fit)}"),
        )
    )
