"""One session's answer against its truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.answer import ELEMENTS, Answer, Ten, true_ten
from bench.concealed.scene import Array
from bench.concealed.wording import CLEAR, INSEPARABLE, PARAMETERS

WITHIN_95 = 1.959964  # sigma
INERTIA = slice(4, 10)


@dataclass(frozen=True)
class TenMarks:
    """The ten numbers against the truth."""

    inside_95: Mapping[str, bool]  # by element that was determined
    inertia_percent: float | None  # norm of the six elements' errors over that of the six, determined ones
    inertia_sigma: float | None  # largest error of the six in units of the std claimed

    @property
    def all_inside(self) -> bool:
        """Whether every determined element of the inertia lies within its interval."""
        return all(inside for name, inside in self.inside_95.items() if name.startswith("J"))


@dataclass(frozen=True)
class ParameterMark:
    """One parameter of a finding against the truth; nothing but the truth where it was not told."""

    effect: str
    name: str
    truth: float
    value: float | None
    std: float | None
    sigma: float | None  # (value - truth) / std
    percent: float | None  # of the truth, with its sign


@dataclass(frozen=True)
class SessionMarks:
    """Everything that is scored of one session."""

    session: str
    kind: str  # "clean", "single", "pair" or "outside"
    truth: tuple[str, ...]
    size: float | None  # as drawn, 0 to 1
    over_noise: float  # largest rms of a channel's change over its noise, held-out run left out
    clear: bool
    answered: bool
    said: str
    verdict: str | None = None
    first: str | None = None
    named: tuple[str, ...] = ()
    first_right: bool = False
    three_right: bool = False
    all_named: bool = False
    near: bool = False
    places: Mapping[str, bool] | None = None  # "channel", "axis", "end", "times": right, where it applies
    position_error: float | None = None  # m
    parameters: tuple[ParameterMark, ...] = ()
    before: TenMarks | None = None
    after: TenMarks | None = None
    holdout_before: float | None = None
    holdout_after: float | None = None
    seconds: float | None = None
    reason: str | None = None
    fainter: float | None = None  # of a pair: what the fainter one changes by itself, over noise

    @property
    def miss(self) -> bool:
        """Whether the first place is wrong, or there is none."""
        return not self.first_right

    @property
    def response(self) -> str:
        """To an effect from outside: "abstained", "hedged", "named", "unseen" or "no result"."""
        if not self.answered:
            return "no result"
        if any(name != "unknown" for name in self.named):
            return "hedged" if self.verdict == "unexplained" else "named"
        return "unseen" if self.verdict == "none" else "abstained"


def mark(
    name: str,
    truth: Mapping[str, Any],
    answer: Answer | None,
    size: float | None = None,
    seconds: float | None = None,
    reason: str | None = None,
) -> SessionMarks:
    """Score a session; ``answer`` is None where the tool gave none."""
    effects = truth["effects"]
    loudest = over_noise(truth)
    common: dict[str, Any] = {
        "session": name,
        "kind": kind_of(truth),
        "truth": tuple(e["effect"] for e in effects),
        "size": size,
        "over_noise": loudest,
        "fainter": least_over_noise(truth),
        "seconds": seconds,
        "reason": reason,
    }
    if answer is None:
        return SessionMarks(**common, clear=loudest >= CLEAR, answered=False, said="no result")
    true = true_ten(truth)
    before = None if answer.ideal is None else mark_ten(answer.ideal, true)
    bias = 0.0 if before is None or before.inertia_sigma is None else before.inertia_sigma
    places, distance = _places(effects, answer)
    return SessionMarks(
        **common,
        clear=bool(effects) and max(loudest, bias) >= CLEAR,
        answered=True,
        said=answer.told,
        verdict=answer.verdict,
        first=answer.first,
        named=tuple(str(f["effect"]) for f in answer.findings),
        first_right=_first_right(truth, answer),
        three_right=_three_right(truth, answer),
        all_named=all(answer.finding(e["effect"]) is not None for e in effects),
        near=any(answer.first in e.get("near", ()) for e in effects),
        places=places,
        position_error=distance,
        parameters=_parameters(effects, answer),
        before=before,
        after=mark_ten(answer.ten, true),
        holdout_before=answer.holdout_before,
        holdout_after=answer.holdout_after,
    )


def kind_of(truth: Mapping[str, Any]) -> str:
    """ "clean", "single", "pair" or "outside"."""
    if not truth["effects"]:
        return "clean"
    if truth.get("outside"):
        return "outside"
    return "single" if len(truth["effects"]) == 1 else "pair"


def over_noise(truth: Mapping[str, Any]) -> float:
    """Largest rms over noise among the channels of all recordings that a fit may use."""
    return _largest(truth.get("effect_over_noise", {}))


def least_over_noise(truth: Mapping[str, Any]) -> float | None:
    """The same of the fainter of a pair, each by itself; None where it is not known."""
    each = truth.get("alone_over_noise") or [None]
    return None if None in each else min(map(_largest, each))


def _largest(by_recording: Mapping[str, Mapping[str, float]]) -> float:
    # run_2 is held out: what shows there alone, no fit can find.
    used = (channels for name, channels in by_recording.items() if name != "run_2")
    return max((float(v) for channels in used for v in channels.values()), default=0.0)


def mark_ten(ten: Ten, true: Array) -> TenMarks:
    """Ten numbers against the true ones (10,)."""
    error = ten.values - true
    determined = np.isfinite(error) & np.isfinite(ten.std) & (ten.std > 0.0)
    sigma = np.abs(error[determined]) / ten.std[determined]
    names = np.array(ELEMENTS)[determined]
    six = determined.copy()
    six[: INERTIA.start] = False
    if not six.any():
        return TenMarks(_inside(names, sigma), None, None)
    percent = 100.0 * np.linalg.norm(error[six]) / np.linalg.norm(true[six])
    return TenMarks(_inside(names, sigma), float(percent), float(np.max(np.abs(error[six]) / ten.std[six])))


def _inside(names: Array, sigma: Array) -> dict[str, bool]:
    return {str(n): bool(s <= WITHIN_95) for n, s in zip(names, sigma, strict=True)}


def _first_right(truth: Mapping[str, Any], answer: Answer) -> bool:
    accepted = set(truth["accept_first"])
    if accepted == {"none"}:
        return answer.first == "none"
    # Motion does not tell these from inertia: to state them as undecidable is the right answer.
    return answer.first in accepted or bool(accepted & INSEPARABLE & set(answer.ties))


def _three_right(truth: Mapping[str, Any], answer: Answer) -> bool:
    accepted = set(truth["accept_first"])
    believed = {*answer.ranking[:3], *answer.ties}
    return _first_right(truth, answer) or bool(accepted & believed)


def _places(effects: list[Mapping[str, Any]], answer: Answer) -> tuple[dict[str, bool] | None, float | None]:
    """Where the effects that were named are said to be; None where none of them was."""
    right: dict[str, bool] = {}
    distance = None
    found = [(e["where"], answer.finding(e["effect"])) for e in effects]
    for true, finding in found:
        if finding is None:
            continue
        where = finding.get("where") or {}
        for key in ("channel", "axis", "end"):
            if true.get(key) is not None:
                right[key] = right.get(key, True) and where.get(key) == true[key]
        if true.get("times"):
            right["times"] = right.get("times", True) and _overlap(true["times"], where.get("times") or [])
        if true.get("position") is not None and where.get("position") is not None:
            distance = float(np.linalg.norm(np.subtract(where["position"], true["position"])))
    return (right if any(f is not None for _, f in found) else None), distance


def _overlap(true: list[Mapping[str, Any]], said: list[Mapping[str, Any]]) -> bool:
    """Whether every time that was said meets a true one, and at least one was said."""
    return bool(said) and all(
        any(
            s["recording"] == t["recording"] and s["start"] <= t["end"] and t["start"] <= s["end"]
            for t in true
        )
        for s in said
    )


def _parameters(effects: list[Mapping[str, Any]], answer: Answer) -> tuple[ParameterMark, ...]:
    out = []
    for effect in effects:
        finding = answer.finding(effect["effect"])
        if finding is None:
            continue
        for name in PARAMETERS.get(effect["effect"], ()):
            if name in effect["parameters"]:
                told = (finding.get("parameters") or {}).get(name) or {}
                true = float(effect["parameters"][name]["value"])
                out.append(_parameter(effect["effect"], name, true, told.get("value"), told.get("std")))
    return tuple(out)


def _parameter(effect: str, name: str, true: float, value: Any, std: Any) -> ParameterMark:
    if value is None:
        return ParameterMark(effect, name, true, None, None, None, None)
    error = float(value) - true
    sigma = error / float(std) if std else None
    percent = 100.0 * error / abs(true) if true else None
    return ParameterMark(
        effect, name, true, float(value), None if std is None else float(std), sigma, percent
    )
