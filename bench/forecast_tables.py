"""Tables and figure of the forecasts (forecast.py)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

#: How near a forecast is to come.
NEAR = 0.2
HOW = ("planned", "commanded", "repeated")
COLOURS = ("#1f5fa8", "#2a8a4a", "#d08020")


def report(runs: Sequence[dict[str, Any]]) -> str:
    """The tables."""
    lines = [
        "# Forecasts of a run under way",
        "",
        f"Made by `python -m bench.forecast`: {len(runs)} runs, each forecast after a quarter. A ratio is",
        "the forecast std over the std that the fit to the whole run states.",
        "",
        "![Forecast over final standard deviation, run by run](forecast.svg)",
        "",
        "| the exciter's force from then on | numbers within 20 % | runs with all ten within 20 % "
        "| ratio, 5 to 95 % | no forecast |",
        "| --- | --- | --- | --- | --- |",
    ]
    for how in HOW:
        there = [np.array(r["ratio"][how]) for r in runs if r["ratio"][how] is not None]
        all_of = np.concatenate(there)
        near = np.abs(all_of - 1.0) <= NEAR
        whole = sum(bool(np.all(np.abs(r - 1.0) <= NEAR)) for r in there)
        low, high = np.percentile(all_of, [5, 95])
        lines.append(
            f"| {how} | {near.sum()} of {near.size} ({100 * near.mean():.1f} %) | {whole} of {len(runs)} "
            f"| {low:.2f} to {high:.2f} | {len(runs) - len(there)} |"
        )
    missed = sum(not r["found"] for r in runs)
    shrunk = np.concatenate([np.array(r["std_early"]) / np.array(r["std_final"]) for r in runs])
    low, middle, high = np.percentile(shrunk, [5, 50, 95])
    lines += [
        "",
        "*Planned*: the true force. *Commanded*: what the live graph makes of a plan's `exciter.csv`, whose "
        "beginning it finds in the measured force. "
        f"Not found in {missed} runs, which are forecast as repeated.",
        "",
        f"What was to be foreseen: after a quarter the std is {middle:.2f} times the final one in the "
        f"median, {low:.2f} to {high:.2f} from 5 to 95 %.",
        f"A forecast takes {np.median([r['seconds'] for r in runs]):.1f} s in the median.",
        "",
        f"| rig | runs | {' | '.join(f'{how}: worst ratio' for how in HOW)} |",
        f"| --- | --- |{' --- |' * len(HOW)}",
    ]
    for rig in sorted({r["rig"] for r in runs}):
        mine = [r for r in runs if r["rig"] == rig]
        worst = [_worst(np.concatenate([r["ratio"][how] for r in mine if r["ratio"][how]])) for how in HOW]
        lines.append(f"| {rig} | {len(mine)} | {' | '.join(f'{w:.2f}' for w in worst)} |")
    return "\n".join([*lines, "", f"Fingerprint of the code: {runs[0]['code']}", ""])


def _worst(ratios: np.ndarray) -> float:
    return float(ratios[np.argmax(np.abs(np.log(ratios)))])


def figure(runs: Sequence[dict[str, Any]]) -> str:
    """Each run's ten ratios as a column of points; the band is 20 %."""
    width, height, left, top = 46 + 30 * len(runs), 300, 46, 16
    low, high = np.log(0.5), np.log(2.0)

    def y(ratio: float) -> float:
        return top + (height - top - 40) * (high - np.log(np.clip(ratio, 0.5, 2.0))) / (high - low)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width + 10} {height}" '
        'font-family="sans-serif" font-size="11">',
        f'<rect width="{width + 10}" height="{height}" fill="#fff"/>',
        f'<rect x="{left}" y="{y(1 + NEAR):.1f}" width="{width - left}" '
        f'height="{y(1 - NEAR) - y(1 + NEAR):.1f}" fill="#e4eef8"/>',
    ]
    for tick in (0.5, 0.8, 1.0, 1.2, 2.0):
        parts.append(
            f'<text x="{left - 6}" y="{y(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>'
            f'<line x1="{left}" x2="{width}" y1="{y(tick):.1f}" y2="{y(tick):.1f}" stroke="#ccc"/>'
        )
    for k, run in enumerate(runs):
        for how, shift, fill in zip(HOW, (7, 15, 23), COLOURS, strict=True):
            for ratio in run["ratio"][how] or ():
                x = left + 30 * k + shift
                parts.append(
                    f'<circle cx="{x}" cy="{y(ratio):.1f}" r="2.6" fill="{fill}" fill-opacity=".7"/>'
                )
    parts.append(
        f'<text x="{left}" y="{height - 10}">forecast / final std of the ten numbers, run by run: '
        + ", ".join(f'<tspan fill="{c}">force {how}</tspan>' for how, c in zip(HOW, COLOURS, strict=True))
        + "; band: 20 %</text></svg>"
    )
    return "\n".join(parts) + "\n"
