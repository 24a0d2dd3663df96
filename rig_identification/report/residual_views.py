"""Residuals at a glance: their size in a table, and each channel's distribution, spectrum and correlation."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np
from markupsafe import Markup

from rig_identification.report.channels import channel_anchor, channel_label
from rig_identification.report.envelope import envelope
from rig_identification.report.grades import heat
from rig_identification.report.line_chart import Curve, Panel, chart_svg
from rig_identification.report.residuals import ResidualSummary, summarise_residual
from rig_identification.result import ChannelFit

WIDTH, HEIGHT = 300, 84  # px


@dataclass(frozen=True)
class Cell:
    """Residual of one channel in one recording."""

    rms: float
    anchor: str
    heat: int  # percent: 0 as noise may be, 100 some ten times that (grades.heat)


@dataclass(frozen=True)
class Row:
    """One channel over all recordings."""

    label: str
    cells: tuple[Cell | None, ...]


@dataclass(frozen=True)
class WhitenessView:
    """Three small pictures of one residual."""

    label: str
    anchor: str
    summary: ResidualSummary
    distribution: Markup
    spectrum: Markup | None
    correlation: Markup | None


def rms_table(channels: tuple[ChannelFit, ...], recordings: list[str]) -> list[Row]:
    """Root mean square of each residual in units of its noise, a column for each recording."""
    found: dict[str, dict[str, Cell]] = {}
    for fit in channels:
        rms = fit.rms_in_sigma
        cell = Cell(rms, channel_anchor(fit), heat(rms, len(fit.time), len(channels)))
        found.setdefault(channel_label(fit), {})[fit.recording] = cell
    return [Row(label, tuple(cells.get(name) for name in recordings)) for label, cells in found.items()]


def whiteness_views(channels: tuple[ChannelFit, ...], recording: str) -> list[WhitenessView]:
    """Distribution, spectrum and correlation of the residuals of one recording."""
    return [_whiteness(fit) for fit in channels if fit.recording == recording]


def _whiteness(fit: ChannelFit) -> WhitenessView:
    summary = summarise_residual(fit.time, fit.residual_in_sigma)
    label = escape(channel_label(fit))
    return WhitenessView(
        label=channel_label(fit),
        anchor=channel_anchor(fit),
        summary=summary,
        distribution=_distribution(summary, label),
        spectrum=_spectrum(summary, label) if len(summary.power) else None,
        correlation=_correlation(summary, label) if len(summary.correlation) else None,
    )


def _distribution(summary: ResidualSummary, label: str) -> Markup:
    at = np.linspace(-5.0, 5.0, 101)
    normal = np.exp(-0.5 * at**2) / np.sqrt(2.0 * np.pi)
    half = 0.5 * (summary.density_at[1] - summary.density_at[0])
    edges = np.ravel(np.column_stack([summary.density_at - half, summary.density_at + half]))
    panel = Panel(
        curves=(Curve(edges, np.repeat(summary.density, 2), "residual"), Curve(at, normal, "predicted")),
        height=HEIGHT,
        limits=(0.0, 1.1 * max(0.4, float(summary.density.max()))),
    )
    return _small(panel, (-5.0, 5.0), f"{label}: distribution")


def _spectrum(summary: ResidualSummary, label: str) -> Markup:
    floor = max(float(summary.power.max()) * 1e-6, 1e-3)
    panel = Panel(
        curves=(
            Curve(summary.frequency, np.maximum(summary.power, floor), "residual"),
            Curve(summary.frequency[[0, -1]], np.ones(2), "predicted"),
        ),
        height=HEIGHT,
        limits=(
            min(0.1, max(floor, 0.5 * float(summary.power.min()))),
            max(10.0, 2.0 * float(summary.power.max())),
        ),
        log=True,
    )
    limits = (float(summary.frequency[0]), float(summary.frequency[-1]))
    return _small(panel, limits, f"{label}: spectrum", x_log=True)


def _correlation(summary: ResidualSummary, label: str) -> Markup:
    lowest = min(-0.25, 1.1 * float(summary.correlation.min()))
    highest = max(0.25, 1.1 * float(summary.correlation.max()))
    panel = Panel(
        curves=(Curve(*envelope(summary.lag, summary.correlation, WIDTH), "residual"),),
        height=HEIGHT,
        limits=(lowest, highest),
        bands=((-summary.white_band, summary.white_band, "band"),),
    )
    return _small(panel, (0.0, float(summary.lag[-1])), f"{label}: autocorrelation")


def _small(panel: Panel, limits: tuple[float, float], title: str, *, x_log: bool = False) -> Markup:
    return Markup(chart_svg([panel], x_limits=limits, x_label="", title=title, width=WIDTH, x_log=x_log))
