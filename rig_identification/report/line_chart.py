"""Line charts as inline SVG whose colours are the page's own (see ADR 0003)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEFT, RIGHT = 56, 16  # px beside the plot, for tick labels
HEAD, FOOT = 17, 22  # px above each panel, for its label, and below the last, for the x axis


@dataclass(frozen=True)
class Curve:
    """One line of a panel; ``style`` is a class of the page's style sheet."""

    x: Array
    y: Array
    style: str


@dataclass(frozen=True)
class Panel:
    """One plot of a chart."""

    curves: tuple[Curve, ...]
    height: int  # px
    limits: tuple[float, float]  # y
    bands: tuple[tuple[float, float, str], ...] = ()  # lower, upper, style
    label: str = ""
    log: bool = False  # y to the base ten


def ticks(lower: float, upper: float, count: int) -> list[float]:
    """Round numbers (1, 2 or 5 times a power of ten) between two limits, about ``count`` of them."""
    span = upper - lower
    if not np.isfinite(span) or span <= 0.0:
        return []
    raw = span / max(count, 1)
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(m for m in (1.0, 2.0, 5.0, 10.0) if m * power >= 0.6 * raw)
    first = np.ceil(lower / step - 1e-9)
    last = np.floor(upper / step + 1e-9)
    return [float(k * step) for k in np.arange(first, last + 1)]


#: Part of a curve's size by which it has to move to be drawn as one that does.
BARELY = 1e-9


def padded_limits(*series: Array, margin: float = 0.06) -> tuple[float, float]:
    """Limits that hold every finite value of the series, with a margin, never empty."""
    values = np.concatenate([s[np.isfinite(s)] for s in series])
    if not len(values):
        return -1.0, 1.0
    lower, upper = float(values.min()), float(values.max())
    size = max(abs(lower), abs(upper))
    # Where rounding alone moves it ticks would be so close that they are one number
    barely = upper - lower <= BARELY * size
    pad = max(1e-3 * size, 1e-9) if barely else margin * (upper - lower)
    return lower - pad, upper + pad


def tick_label(value: float, step: float) -> str:
    """As many digits as the step needs, with a true minus sign."""
    if abs(value) >= 1e5 or 0.0 < step < 1e-4:
        text = f"{value:.1e}" if value else "0"
    else:
        digits = max(0, -int(np.floor(np.log10(step) + 1e-9)))
        text = f"{value:.{digits}f}"
        if float(text) == 0.0:
            text = text.lstrip("-")
    return text.replace("-", "−")


def path_data(x: Array, y: Array) -> str:
    """SVG path through points in tenths of a pixel, relative and whole: short text."""
    points = np.rint(10.0 * np.column_stack([x, y])).astype(int)
    if not len(points):
        return ""
    moves = np.diff(points, axis=0)
    moves = moves[np.any(moves != 0, axis=1)]
    steps = "".join(f"{dx}{dy}" if dy < 0 else f"{dx} {dy}" for dx, dy in _joined(moves))
    return f"M{points[0, 0]} {points[0, 1]}l{steps}" if steps else f"M{points[0, 0]} {points[0, 1]}h1"


def _joined(moves: NDArray[np.int_]) -> list[tuple[str, int]]:
    """Horizontal moves as text, with a separator before all but the first and the negative ones."""
    return [(f" {dx}" if k and dx >= 0 else str(dx), int(dy)) for k, (dx, dy) in enumerate(moves.tolist())]


def chart_svg(
    panels: Sequence[Panel],
    *,
    x_limits: tuple[float, float],
    x_label: str,
    title: str,
    width: int = 520,
    x_log: bool = False,
) -> str:
    """Draw panels below each other on one x axis.

    Parameters
    ----------
    panels : sequence of Panel
    x_limits : (float, float)
    x_label, title : str
        ``title`` is for readers who hear the page.
    width : int
        px of the drawing's own coordinates; the page scales it.
    x_log : bool
        x to the base ten.
    """
    heads = [HEAD if p.label else HEAD // 3 for p in panels]
    total = sum(p.height for p in panels) + sum(heads) + FOOT
    parts = [f'<svg class="chart" viewBox="0 0 {width} {total}" role="img"><title>{title}</title>']
    y = 0
    for panel, head in zip(panels, heads, strict=True):
        parts.append(_panel_svg(panel, x_limits, width, y + head, x_log))
        y += panel.height + head
    parts.append(_x_axis_svg(x_limits, x_label, width, y, x_log))
    return "".join(parts) + "</svg>"


def _scaled(values: Array, limits: tuple[float, float], size: float, log: bool) -> Array:
    """Position along an axis of ``size`` px; what lies outside stays on the edge."""
    low, high = np.log10(limits) if log else limits
    with np.errstate(divide="ignore", invalid="ignore"):
        level = np.log10(values) if log else np.asarray(values, dtype=float)
    return np.asarray(np.clip((level - low) / (high - low), 0.0, 1.0) * size)


def _axis_ticks(limits: tuple[float, float], count: int, log: bool) -> list[tuple[float, str]]:
    if log:
        exponents = range(int(np.ceil(np.log10(limits[0]) - 1e-9)), int(np.log10(limits[1]) + 1e-9) + 1)
        every = max(1, len(exponents) // (count + 1))
        return [(10.0**e, f"{10.0**e:g}") for e in exponents if e % every == 0]
    values = ticks(*limits, count)
    step = values[1] - values[0] if len(values) > 1 else limits[1] - limits[0]
    return [(v, tick_label(v, step)) for v in values]


def _panel_svg(panel: Panel, x_limits: tuple[float, float], width: int, top: int, x_log: bool) -> str:
    inner = width - LEFT - RIGHT
    height = panel.height

    def down(values: Array) -> Array:
        return height - _scaled(values, panel.limits, height, panel.log)

    parts = [f'<g transform="translate({LEFT} {top})">']
    for lower, upper, style in panel.bands:
        y_upper, y_lower = down(np.array([upper, lower]))
        parts.append(
            f'<rect class="{style}" y="{y_upper:.1f}" width="{inner}" height="{y_lower - y_upper:.1f}"/>'
        )
    for value, text in _axis_ticks(panel.limits, max(3, height // 36), panel.log):
        y = float(down(np.array([value]))[0])
        parts.append(
            f'<path class="grid" d="M0 {y:.1f}h{inner}"/>'
            f'<text x="-6" y="{y + 4:.1f}" class="end">{text}</text>'
        )
    parts.append('<g transform="scale(.1)">')
    for curve in panel.curves:
        data = path_data(_scaled(curve.x, x_limits, inner, x_log), down(curve.y))
        parts.append(f'<path class="{curve.style}" d="{data}"/>')
    parts.append("</g>")
    if panel.label:
        parts.append(f'<text class="panel" x="0" y="-5">{panel.label}</text>')
    return "".join(parts) + "</g>"


def _x_axis_svg(limits: tuple[float, float], label: str, width: int, top: int, log: bool) -> str:
    inner = width - LEFT - RIGHT
    parts = [f'<g transform="translate({LEFT} {top})"><path class="axis" d="M0 0h{inner}"/>']
    for value, text in _axis_ticks(limits, max(2, inner // 90), log):
        x = float(_scaled(np.array([value]), limits, inner, log)[0])
        parts.append(
            f'<path class="axis" d="M{x:.1f} 0v4"/><text x="{x:.1f}" y="17" class="mid">{text}</text>'
        )
    parts.append(f'<text x="-10" y="17" class="end">{label}</text></g>')
    return "".join(parts)
