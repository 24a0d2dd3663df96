"""Figures over all sessions: shares with their Wilson intervals, medians, and one line an effect."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from bench.concealed.answer import ELEMENTS
from bench.concealed.marks import SessionMarks
from bench.concealed.wording import CLEAR

HOLDOUT_LIMIT = 1.1
PARAMETER_LIMIT = 3.0  # sigma
TIME_LIMIT = 180.0  # s


@dataclass(frozen=True)
class Share:
    """So many of so many, and what is wanted of it."""

    label: str
    hits: int
    of: int
    least: float | None = None
    most: float | None = None

    @property
    def share(self) -> float | None:
        """0 to 1."""
        return self.hits / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of the share behind it (Wilson 1927, eq. 1)."""
        if not self.of:
            return None
        found = binomtest(self.hits, self.of).proportion_ci(method="wilson")
        return float(found.low), float(found.high)

    @property
    def reached(self) -> bool | None:
        """Whether the share itself meets what is wanted; None where nothing is, or nothing was counted."""
        if self.share is None or (self.least is None and self.most is None):
            return None
        low = 0.0 if self.least is None else self.least
        return low <= self.share <= (1.0 if self.most is None else self.most)


@dataclass(frozen=True)
class Spread:
    """Median and worst of a number over ``of`` sessions."""

    label: str
    median: float | None
    worst: float | None
    of: int


@dataclass(frozen=True)
class EffectLine:
    """All sessions in which one effect was."""

    effect: str
    sessions: int
    clear: int
    first_right: int
    three_right: int
    within_3_sigma: str  # parameters, "2 of 3"
    median_percent: float | None  # size of the parameters' errors


def shares(marks: Sequence[SessionMarks]) -> list[Share]:
    """Everything that is counted. A session without a result counts against the tool, but for alarms."""
    answered = [m for m in marks if m.answered]
    clean = [m for m in answered if m.kind == "clean"]
    table = [m for m in marks if m.kind in ("single", "pair")]
    clear = [m for m in table if m.clear]
    explained = [m for m in answered if m.verdict == "explained"]
    outside = [m for m in marks if m.kind == "outside"]
    held = [m.holdout_after for m in explained if m.holdout_after is not None]
    told = [p.sigma for m in marks for p in m.parameters if p.sigma is not None]
    timed = [m.seconds for m in marks if m.seconds is not None]
    return [
        _count("sessions without a result", marks, lambda m: not m.answered, most=0.0),
        _count("false alarms on clean sessions", clean, lambda m: m.first != "none", most=0.03),
        _count("first place right, clear size", clear, lambda m: m.first_right, least=0.9),
        _count("first three or stated tie, clear size", clear, lambda m: m.three_right, least=0.98),
        _count("first place right, any size", table, lambda m: m.first_right),
        _count("first three or stated tie, any size", table, lambda m: m.three_right),
        _count("pairs: both named", [m for m in table if m.kind == "pair"], lambda m: m.all_named),
        _count(
            "pairs: both named, each clear by itself",
            [m for m in table if m.kind == "pair" and (m.fainter or 0.0) >= CLEAR],
            lambda m: m.all_named,
        ),
        *(_place(table, key) for key in ("channel", "axis", "end", "times")),
        _count("parameters within 3 sigma", told, lambda s: abs(s) <= PARAMETER_LIMIT),
        *_coverage("all answers", answered),
        *_coverage("explained", explained, 0.9, 0.98),
        *_coverage("clean", clean),
        _count("held-out error after <= 1.1, explained", held, lambda h: h <= HOLDOUT_LIMIT, least=0.95),
        *(
            _count(f"outside: {text}", outside, lambda m, r=responses: m.response in r, most=most)
            for text, responses, most in (
                ("answered with a named effect", ("named", "hedged"), 0.1),
                ("of these, said to leave something over", ("hedged",), None),
                ("honest abstentions", ("abstained",), None),
                ("unseen", ("unseen",), None),
            )
        ),
        _count("outside: named effect that a fair judge may pass", outside, lambda m: m.near),
        _count("within 180 s", timed, lambda s: s <= TIME_LIMIT, least=1.0),
    ]


def by_element(marks: Sequence[SessionMarks]) -> list[Share]:
    """Coverage of the 95 % interval of each of the ten elements."""
    held = [m.after.inside_95 for m in marks if m.after is not None]
    return [
        Share(name, sum(h[name] for h in held if name in h), sum(name in h for h in held))
        for name in ELEMENTS
    ]


def spreads(marks: Sequence[SessionMarks]) -> list[Spread]:
    """Errors before (ideal model) and after, where effects were found; times of all."""
    found = [m for m in marks if m.named and m.before is not None and m.after is not None]
    after = [m.after for m in found if m.after is not None]
    before = [m.before for m in found if m.before is not None]
    table = [p for m in marks for p in m.parameters]
    return [
        _spread("J error before, % (effects found)", (t.inertia_percent for t in before)),
        _spread("J error after, % (effects found)", (t.inertia_percent for t in after)),
        _spread("J error before, worst element in claimed sigma", (t.inertia_sigma for t in before)),
        _spread("J error after, worst element in claimed sigma", (t.inertia_sigma for t in after)),
        _spread("J error, % (clean)", (m.after.inertia_percent for m in marks if _clean(m) and m.after)),
        _spread("parameter error, %", (None if p.percent is None else abs(p.percent) for p in table)),
        _spread("held-out error before", (m.holdout_before for m in marks)),
        _spread("held-out error after", (m.holdout_after for m in marks)),
        _spread("seconds a session", (m.seconds for m in marks)),
    ]


def by_effect(marks: Sequence[SessionMarks]) -> list[EffectLine]:
    """One line for each effect that was in a session, pairs counted under both."""
    names = sorted({name for m in marks for name in m.truth})
    return [_effect_line(name, [m for m in marks if name in m.truth]) for name in names]


def _effect_line(name: str, marks: Sequence[SessionMarks]) -> EffectLine:
    told = [p for m in marks for p in m.parameters if p.effect == name]
    sigmas = [abs(p.sigma) for p in told if p.sigma is not None]
    percents = [abs(p.percent) for p in told if p.percent is not None]
    return EffectLine(
        name,
        len(marks),
        sum(m.clear for m in marks),
        sum(m.first_right for m in marks),
        sum(m.three_right for m in marks),
        f"{sum(s <= PARAMETER_LIMIT for s in sigmas)} of {len(sigmas)}",
        float(np.median(percents)) if percents else None,
    )


def _clean(marks: SessionMarks) -> bool:
    return marks.answered and marks.kind == "clean"


def _count(
    label: str,
    of: Sequence[object],
    hit: Callable[..., bool],
    least: float | None = None,
    most: float | None = None,
) -> Share:
    return Share(label, sum(bool(hit(x)) for x in of), len(of), least, most)


def _place(marks: Sequence[SessionMarks], key: str) -> Share:
    told = [m.places[key] for m in marks if m.places is not None and key in m.places]
    return Share(f"{key} right, effect named and located", sum(told), len(told))


def _coverage(
    of: str, marks: Sequence[SessionMarks], least: float | None = None, most: float | None = None
) -> list[Share]:
    held = [m.after.inside_95 for m in marks if m.after is not None]
    ten = [inside for h in held for inside in h.values()]
    six = [inside for h in held for name, inside in h.items() if name.startswith("J")]
    return [
        Share(f"95 % intervals of the ten elements hold, {of}", sum(ten), len(ten)),
        Share(f"95 % intervals of J hold, {of}", sum(six), len(six), least, most),
    ]


def _spread(label: str, values: Iterable[float | None]) -> Spread:
    known = [v for v in values if v is not None]
    if not known:
        return Spread(label, None, None, 0)
    return Spread(label, float(np.median(known)), float(np.max(known)), len(known))
