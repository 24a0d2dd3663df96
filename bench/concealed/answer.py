"""What a tool answered, read from ``result.json`` in the recording contract's terms and nothing else."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.concealed.scene import Array
from bench.concealed.wording import TIE

ELEMENTS = ("m", "cx", "cy", "cz", "Jxx", "Jxy", "Jxz", "Jyy", "Jyz", "Jzz")
_UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True)
class Ten:
    """Ten inertial numbers in the order of :data:`ELEMENTS`; NaN: not determined."""

    values: Array  # (10,) kg, m, kg m^2
    std: Array  # (10,)

    @classmethod
    def read(cls, document: Mapping[str, Any]) -> Ten:
        """From a document with ``mass``, ``center_of_mass`` and ``inertia`` of value and std."""
        return cls(*(_ten({k: v[part] for k, v in _blocks(document).items()}) for part in ("value", "std")))


@dataclass(frozen=True)
class Answer:
    """One session's answer."""

    verdict: str
    findings: tuple[Mapping[str, Any], ...]
    alternatives: tuple[Mapping[str, Any], ...]  # by their gap, the closest first
    ten: Ten
    ideal: Ten | None  # the ideal model's own; None where effects were found and it is not told

    @property
    def first(self) -> str:
        """The effect in first place; without findings "none", or "unknown" where something is left."""
        if self.findings:
            return str(self.findings[0]["effect"])
        return "none" if self.verdict == "none" else "unknown"

    @property
    def ranking(self) -> list[str]:
        """Effects in the order of belief, each once: the findings, then the alternatives."""
        return list(dict.fromkeys(str(f["effect"]) for f in (*self.findings, *self.alternatives)))

    @property
    def ties(self) -> list[str]:
        """Alternatives that the data cannot tell from the first finding."""
        return [str(a["effect"]) for a in self.alternatives if _gap(a) <= TIE]

    def finding(self, effect: str) -> Mapping[str, Any] | None:
        """The first finding of that effect."""
        return next((f for f in self.findings if f["effect"] == effect), None)

    @property
    def holdout_before(self) -> float | None:
        """Held-out error before the first finding."""
        return self._evidence(0, "holdout_error_before")

    @property
    def holdout_after(self) -> float | None:
        """Held-out error with all findings in the model."""
        return self._evidence(-1, "holdout_error_after")

    def _evidence(self, place: int, name: str) -> float | None:
        value = self.findings[place].get("evidence", {}).get(name) if self.findings else None
        return None if value is None else float(value)

    @property
    def told(self) -> str:
        """The answer in a line."""
        names = " + ".join(str(f["effect"]) for f in self.findings) or "nothing named"
        text = f"{names} ({self.verdict})"
        rest = [a for a in self.ranking if self.finding(a) is None][:2]
        return f"{text}; then {', '.join(rest)}" if rest else text


def read_answer(path: Path) -> Answer:
    """Read a ``result.json``."""
    document = json.loads(path.read_text(encoding="utf-8"))
    mismatch = document["mismatch"]
    findings = tuple(mismatch["findings"])
    ten = Ten.read(document)
    told = mismatch.get("ideal_model")
    ideal = Ten.read(told) if told else (None if findings else ten)
    alternatives = tuple(sorted(mismatch["alternatives"], key=_gap))
    return Answer(mismatch["verdict"], findings, alternatives, ten, ideal)


def true_ten(truth: Mapping[str, Any]) -> Array:
    """(10,) of a ``truth.json``."""
    return _ten(_blocks(truth))


def _blocks(document: Mapping[str, Any]) -> dict[str, Any]:
    return {key: document[key] for key in ("mass", "center_of_mass", "inertia")}


def _ten(blocks: Mapping[str, Any]) -> Array:
    tensor = blocks["inertia"]
    numbers = [blocks["mass"], *blocks["center_of_mass"], *(tensor[i][j] for i, j in _UPPER)]
    return np.array([np.nan if n is None else n for n in numbers], dtype=float)


def _gap(alternative: Mapping[str, Any]) -> float:
    gap = alternative.get("log_likelihood_gap")
    return float("inf") if gap is None else float(gap)
