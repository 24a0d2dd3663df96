"""``plan.html``: what to record, what it would tell, and what would bend it, on one self-contained page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from markupsafe import Markup

from rig_identification import __version__
from rig_identification.plan.choose import Step
from rig_identification.plan.planning import Plan
from rig_identification.plan_report.programme import instruction
from rig_identification.quantity import NOT_DETERMINED, significant, unit_text
from rig_identification.report.line_chart import Curve, Panel, chart_svg
from rig_identification.report.page import page_environment
from rig_identification.report.ten_numbers import UNITS
from rig_identification.report.words import words
from rig_identification.result import ELEMENTS

#: px of a small chart; biases that are listed at most.
WIDTH, HEIGHT, LISTED = 330, 110, 12


def render_plan(plan: Plan) -> str:
    """HTML that loads nothing from anywhere."""
    environment, style = page_environment()
    return environment.get_template("plan.html.j2").render(
        style=style,
        version=__version__,
        plan=plan,
        summary=summary(plan),
        recordings=_recordings(plan),
        heads=expected_heads(plan),
        expected=expected_rows(plan),
        charts=[_chart(plan, i) for i in range(len(ELEMENTS))],
        biases=_biases(plan),
        undecided=() if plan.doubts is None else plan.doubts.undecided,
        ties=tie_rows(plan),
        others=[(o.text, _percent(o.worst), ", ".join(o.determined)) for o in plan.others],
    )


def write_plan_page(plan: Plan, path: Path) -> None:
    """Write :func:`render_plan` to a file."""
    path.write_text(render_plan(plan), encoding="utf-8")


def summary(plan: Plan) -> str:
    """One sentence: how well the inertia would be known, and what the usual session would tell."""
    text = (
        f"The least known element of the inertia would have a standard deviation of {_percent(plan.worst)}."
    )
    if plan.usual_worst is not None:
        text += f" A release shaken at one speed for as long would leave {_percent(plan.usual_worst)}."
    if plan.before is not None:
        text += " It holds for both sessions together."
    return text


def tie_rows(plan: Plan) -> list[tuple[str, ...]]:
    """Tie, what decides it, how far apart so far, expected σ apart after the plan, chance; as text."""
    rows: list[tuple[str, ...]] = []
    for d in plan.decisions:
        tie = f"{words(d.told)} or {words(d.rival)}" if d.told else f"whether there is {words(d.rival)}"
        so_far = f"{significant(np.sqrt(2.0 * d.gap), 2)} σ"
        if d.nats is None or d.chance is None:
            rows.append((tie, d.experiment, so_far, "not known", ""))
            continue
        by = d.best if d.decided else f"not by these runs: {d.experiment}" if d.experiment else "not by these"
        expected = significant(np.sqrt(2.0 * d.nats), 2)
        rows.append((tie, by, so_far, f"{expected} σ", f"{100.0 * d.chance:.0f} %"))
    return rows


def _percent(share: float) -> str:
    return f"{significant(100.0 * share, 2)} %"


def expected_rows(plan: Plan) -> list[tuple[str, ...]]:
    """Element, guessed value, expected std, the same if nothing is left out, unit, share; as text.

    After an earlier session its std stands before the expected one.
    """
    rows: list[tuple[str, ...]] = []
    for i, (name, unit) in enumerate(zip(ELEMENTS, UNITS, strict=True)):
        value = significant(plan.expected.values[i], 4)
        if name in plan.expected.unobservable:
            rows.append((name, value, *_so_far(plan, i), NOT_DETERMINED, "", unit, ""))
            continue
        std, alone = np.sqrt([plan.expected.covariance[i, i], plan.alone[i, i]])
        told = (significant(std, 2), significant(alone, 2), unit, _percent(plan.relative[i]))
        rows.append((name, value, *_so_far(plan, i), *told))
    return rows


def expected_heads(plan: Plan) -> tuple[str, ...]:
    """Heads of :func:`expected_rows`."""
    begin = ("element", "guessed") if plan.before is None else ("element", "so far", "σ so far")
    return (*begin, "σ", "σ if nothing is left out", "unit", "share")


def _so_far(plan: Plan, i: int) -> tuple[str, ...]:
    if plan.before is None:
        return ()
    return (significant(plan.before[i], 2) if np.isfinite(plan.before[i]) else NOT_DETERMINED,)


def _recordings(plan: Plan) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for planned in plan.recordings:
        item, margins = planned.item, planned.margins
        limits = ("", "") if item.run is None else (
            f"{significant(1e3 * margins.travel, 2)} mm",
            f"{100.0 * margins.tension:.0f} %",
        )  # fmt: skip
        rows.append((item.name, planned.role, f"{item.seconds:g} s", instruction(plan, item.name), *limits))
    return rows


def _chart(plan: Plan, element: int) -> tuple[str, Markup]:
    """Expected std of one element against recorded minutes, as a share of its natural size."""
    steps: tuple[Step, ...] = plan.chosen.steps
    minutes = np.array([s.seconds for s in steps]) / 60.0
    share = 100.0 * np.array([s.relative[element] for s in steps])
    limits = (max(0.5 * float(np.min(share)), 1e-6), min(2.0 * float(np.max(share)), 1e4))
    panel = Panel((Curve(minutes, np.clip(share, *limits), "predicted"),), HEIGHT, limits, log=True)
    svg = chart_svg(
        [panel],
        x_limits=(0.0, max(float(minutes[-1]), 0.1)),
        x_label="min",
        title=f"{ELEMENTS[element]}: expected standard deviation in per cent against minutes",
        width=WIDTH,
    )
    return f"{ELEMENTS[element]}, %", Markup(svg)


def _biases(plan: Plan) -> list[tuple[str, ...]]:
    if plan.doubts is None:
        return []
    return [
        (
            bias.told,
            f"{bias.name} {significant(bias.amount, 2)} {unit_text(bias.unit)}".strip(),
            f"{significant(bias.bias, 2)} kg m² of {bias.element}",
            f"{significant(bias.in_sigma, 2)} σ",
            "what is plausible" if bias.limited else "half of what would be found",
        )
        for bias in plan.doubts.biases[:LISTED]
    ]
