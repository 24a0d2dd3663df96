"""The thesis' Figures 4.1 and 4.2: error of the pose that is integrated from the body's own sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.report.line_chart import Curve, Panel, chart_svg, padded_limits
from rig_identification.thesis_rerun.integration import IntegrationCheck

Array = NDArray[np.float64]

HEIGHT = 64  # px of one panel
#: With sensor noise and without.
STYLES = ("residual", "predicted")


def integration_figures(check: IntegrationCheck) -> list[tuple[str, str]]:
    """(caption, svg): the centre of mass' coordinates, and the elements of T, world into body."""
    noisy, ideal = check.noisy, check.ideal
    center = [
        _panel(f"{axis}, percent", ideal.time, noisy.center_percent[:, k], ideal.center_percent[:, k])
        for k, axis in enumerate("xyz")
    ]
    turn = [
        _panel(f"T{i + 1}{j + 1}, percent", ideal.time, noisy.T_percent[:, i, j], ideal.T_percent[:, i, j])
        for i in range(3)
        for j in range(3)
    ]
    x_limits = (0.0, float(ideal.time[-1]))
    return [
        (caption, chart_svg(panels, x_limits=x_limits, x_label="s", title=f"Case {check.case}: {caption}"))
        for caption, panels in (
            ("error of the integrated centre", center),
            ("error of the integrated T", turn),
        )
    ]


def _panel(label: str, time: Array, noisy: Array, ideal: Array) -> Panel:
    curves = []
    for values, style in zip((noisy, ideal), STYLES, strict=True):
        there = np.isfinite(values)
        curves.append(Curve(time[there], values[there], style))
    # Where an element of T passes through zero its percentage runs away: draw nine tenths of them
    shown = [np.sort(values[np.isfinite(values)]) for values in (noisy, ideal)]
    middle = [part[round(0.05 * part.size) : max(1, round(0.95 * part.size))] for part in shown]
    return Panel(tuple(curves), HEIGHT, padded_limits(*middle, np.zeros(1), margin=0.15), label=label)
