"""Figures in the order of the thesis: position, acceleration, rotational velocity of each case; maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.report.line_chart import Curve, Panel, chart_svg, padded_limits
from rig_identification.thesis_report.integration_figures import integration_figures
from rig_identification.thesis_rerun import CaseResult, Rerun, Trace

Array = NDArray[np.float64]

#: Styles of the report's page, for a drawing that stands alone.
STYLE = (
    "<style>text{font:11.5px sans-serif;fill:#667080}.end{text-anchor:end}"
    ".mid{text-anchor:middle}path{fill:none}"
    ".grid{stroke:#dfe3e8}.axis{stroke:#667080}.measured{stroke:#b4bdc8;stroke-width:26}"
    ".predicted{stroke:#1b5fa7;stroke-width:11}.residual{stroke:#b3261e;stroke-width:9}</style>"
)
HEIGHT = 84  # px of one panel
STYLES = {"a": "residual", "d": "predicted"}
FLOOR = 1e-6  # percent below which an error is not drawn
LINE = 17  # px of a line of text below a drawing that stands alone

#: What the colours are, by how a caption begins; any other is one of the case's motion.
KEYS = {
    "error of the integrated": "without sensor noise (blue), with it (red)",
    "error by start": "of (a) (red) and (d) (blue); σ of (d) under sensor noise (grey)",
    "estimated force": "as applied (grey) and as estimated (blue)",
    "": "measured (grey), as the tensor of (a) predicts it (red), as that of (d) does (blue)",
}


@dataclass(frozen=True)
class Figures:
    """Drawings by case label, in order, and the same as files."""

    by_case: dict[str, tuple[tuple[str, str], ...]]  # label -> (caption, svg)
    files: dict[str, str]  # name -> text


def case_figures(found: Rerun) -> Figures:
    """Draw everything."""
    by_case, files = {}, {}
    for result in found.cases:
        label = result.case.label
        drawings = [] if result.integration is None else integration_figures(result.integration)
        drawings += [(t.quantity, _trace_svg(label, t)) for t in result.traces]
        if result.windows is not None:
            drawings.append(("error by start of the window", _map_svg(result)))
        if result.unknown_force is not None:
            drawings.append(("estimated force", _force_svg(result)))
        by_case[label] = tuple((f"{caption}: {_key(caption)}", svg) for caption, svg in drawings)
        for k, (caption, svg) in enumerate(drawings, start=1):
            name = (
                f"case_{label.rjust(2 + len(result.case.variant), '0')}_{k}_{caption.replace(' ', '_')}.svg"
            )
            files[name] = _alone(svg, f"Case {label}, {caption}", _key(caption))
    return Figures(by_case, files)


def _key(caption: str) -> str:
    return next(key for begin, key in KEYS.items() if caption.startswith(begin))


def _alone(svg: str, title: str, key: str) -> str:
    """A drawing as a file of its own, with what it shows written below."""
    head, _, rest = svg.partition(">")
    width, height = (int(number) for number in head.split('viewBox="0 0 ')[1].split('"')[0].split())
    head = head.replace(f'"0 0 {width} {height}"', f'"0 0 {width} {height + 2 * LINE + 6}"')
    told = "".join(
        f'<text x="{width // 2}" y="{height + (k + 1) * LINE}" class="mid">{text}</text>'
        for k, text in enumerate((title, key))
    )
    body = rest.removesuffix("</svg>")
    return f'{head} xmlns="http://www.w3.org/2000/svg">{STYLE}{body}{told}</svg>\n'


def _trace_svg(label: str, trace: Trace) -> str:
    panels = []
    for axis in range(3):
        curves = [Curve(trace.time, trace.measured[:, axis], "measured")]
        # A prediction that ran away must not flatten what was measured
        limits = padded_limits(trace.measured[:, axis], margin=0.25)
        for key in "ad":
            if key in trace.predicted:
                curves.append(Curve(trace.time, trace.predicted[key][:, axis], STYLES[key]))
        panels.append(Panel(tuple(curves), HEIGHT, limits, label=f"{'xyz'[axis]}, {trace.unit}"))
    return chart_svg(
        panels,
        x_limits=(0.0, float(trace.time[-1])),
        x_label="s",
        title=f"Case {label}: {trace.quantity} as measured and as identified",
    )


def _map_svg(result: CaseResult) -> str:
    windows, true = result.windows, result.case.inertia
    if windows is None:
        raise ValueError("this case has no windows")
    panels = []
    for name, (i, j) in (
        ("Jxx", (0, 0)),
        ("Jyy", (1, 1)),
        ("Jzz", (2, 2)),
        ("Jxy", (0, 1)),
        ("Jxz", (0, 2)),
        ("Jyz", (1, 2)),
    ):
        size = abs(true[i, j])
        curves = tuple(
            Curve(windows.start, np.maximum(100.0 * values / size, FLOOR), style)
            for values, style in (
                (windows.output_error_std[:, i, j], "measured"),
                (np.abs(windows.thesis[:, i, j] - true[i, j]), "residual"),
                (np.abs(windows.output_error[:, i, j] - true[i, j]), "predicted"),
            )
        )
        panels.append(Panel(curves, HEIGHT, (FLOOR, 1e3), label=f"{name}, error in percent", log=True))
    return chart_svg(
        panels,
        x_limits=(0.0, float(windows.start[-1])),
        x_label="s",
        title="Case 5: error of (a) and (d), and sigma of (d) under sensor noise, by the window's start",
    )


def _force_svg(result: CaseResult) -> str:
    unknown = result.unknown_force
    if unknown is None:
        raise ValueError("this case's force is known")
    panels = [
        Panel(
            (
                Curve(unknown.time, unknown.true_force[:, axis], "measured"),
                Curve(unknown.time, unknown.force[:, axis], "predicted"),
            ),
            HEIGHT,
            padded_limits(unknown.true_force[:, axis], np.array([-10.0, 10.0])),
            label=f"{'xyz'[axis]}, N",
        )
        for axis in range(3)
    ]
    return chart_svg(
        panels,
        x_limits=(0.0, float(unknown.time[-1])),
        x_label="s",
        title=f"Case {result.case.label}: force as applied and as estimated",
    )
