"""Mappings read from YAML: each value is checked where it is taken, and a fault names file, key and limit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from rig_identification.errors import InputError

#: Share of letters alike, as difflib counts them, from which a word is taken for another one misspelt: two
#: letters swapped or one wrong in a word of five.
CLOSE = 0.75

#: A quaternion further than this from norm 1 is a typing error, not rounding.
QUATERNION_NORM_TOLERANCE = 1e-3


def one_line(text: object) -> str:
    """``text`` on one line, for messages that quote another library."""
    return " ".join(str(text).split())


def close_match(word: str, known: Iterable[str]) -> str:
    """Ending of a message that names the word of ``known`` that ``word`` may be misspelt from, or nothing."""
    by_lower = {name.lower(): name for name in known}
    close = get_close_matches(word.lower(), by_lower, n=1, cutoff=CLOSE)
    return f"; did you mean {by_lower[close[0]]}?" if close else ""


@dataclass(frozen=True)
class Fields:
    """One mapping of a YAML file with the key path that leads to it."""

    file: Path
    path: str
    values: Mapping[str, object]

    def fault(self, key: str, problem: str) -> InputError:
        """The error for ``key``: file, key path, then ``problem``."""
        return InputError(one_line(f"{self.file}: {self.key_path(key)}: {problem}"))

    def key_path(self, key: str) -> str:
        """Path of ``key`` from the top of the file, joined by dots."""
        return f"{self.path}.{key}" if self.path and key else self.path or key

    def require(self, key: str, what: str) -> object:
        """Value of ``key``; InputError where it is missing or empty."""
        value = self.values.get(key)
        if value is None:
            raise self.fault(key, f"missing; give {what}")
        return value

    def number(
        self,
        key: str,
        unit: str,
        *,
        above: float = -math.inf,
        at_least: float = -math.inf,
        at_most: float = math.inf,
        hint: str = "",
    ) -> float:
        """Finite number at ``key`` within its limits."""
        value = self._finite(key, self.require(key, f"a number in {unit}"))
        ending = f"; {hint}" if hint else ""
        if value <= above:
            raise self.fault(key, f"{value:g} {unit} must be above {above:g} {unit}{ending}")
        if value < at_least:
            raise self.fault(key, f"{value:g} {unit} must be at least {at_least:g} {unit}{ending}")
        if value > at_most:
            raise self.fault(key, f"{value:g} {unit} is above {at_most:g} {unit}{ending}")
        return value

    def vector(
        self, key: str, size: int, unit: str, *, limit: float = math.inf, hint: str = ""
    ) -> NDArray[np.float64]:
        """(size,) finite numbers at ``key``, each at most ``limit`` in magnitude."""
        value = self.require(key, f"{size} numbers in {unit}")
        if not isinstance(value, list):
            raise self.fault(key, f"{value!r} is not a list; give {size} numbers in {unit}")
        if len(value) != size:
            raise self.fault(key, f"has {len(value)} numbers; give {size} in {unit}")
        vector = np.array([self._finite(f"{key}[{i}]", item) for i, item in enumerate(value)])
        worst = int(np.argmax(np.abs(vector)))
        if abs(vector[worst]) > limit:
            ending = f"; {hint}" if hint else ""
            raise self.fault(
                f"{key}[{worst}]", f"{vector[worst]:g} {unit} is beyond {limit:g} {unit}{ending}"
            )
        return vector

    def quaternion(self, key: str) -> NDArray[np.float64]:
        """(4,) unit quaternion xyzw at ``key``; rounding of its norm is mended, more is a fault."""
        vector = self.vector(key, 4, "1 (quaternion x y z w)")
        norm = float(np.linalg.norm(vector))
        if abs(norm - 1.0) > QUATERNION_NORM_TOLERANCE:
            limit = f"{QUATERNION_NORM_TOLERANCE:g}"
            raise self.fault(key, f"norm {norm:g} is not 1 within {limit}; give a unit quaternion x y z w")
        return vector / norm

    def choice(self, key: str, allowed: Iterable[str], default: str | None = None) -> str:
        """One of the words ``allowed`` at ``key``."""
        words = tuple(allowed)
        value = self.values.get(key, default)
        if value not in words:
            raise self.fault(key, f"{value!r} is unknown; give {' or '.join(words)}")
        return str(value)

    def section(self, key: str, what: str) -> Fields:
        """Mapping at ``key``."""
        value = self.require(key, what)
        if not isinstance(value, dict):
            raise self.fault(key, f"{value!r} is not a mapping; give {what}")
        return Fields(self.file, self.key_path(key), value)

    def has(self, key: str) -> bool:
        """True where ``key`` carries a value."""
        return self.values.get(key) is not None

    def refuse_unknown(self, known: Iterable[str]) -> None:
        """InputError for the first key that is not in ``known``."""
        names = tuple(known)
        for key in self.values:
            if key not in names:
                raise self.fault(str(key), f"unknown key; known are {', '.join(names)}")

    def refuse_misspelt(self, known: Iterable[str]) -> None:
        """InputError for a key that looks like one of ``known`` misspelt; others belong to other tools."""
        names = tuple(known)
        for key in self.values:
            close = get_close_matches(str(key), names, n=1, cutoff=0.8)
            if key not in names and close and close[0] not in self.values:
                raise self.fault(str(key), f"unknown key; did you mean {close[0]}?")

    def _finite(self, key: str, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.fault(key, f"{value!r} is not a number")
        if not math.isfinite(value):
            raise self.fault(key, f"{value} is not finite")
        return float(value)


def load_fields(file: Path, what: str) -> Fields:
    """Top mapping of the YAML 1.2 file ``file``; ``what`` names the file's role in messages."""
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError as err:
        raise InputError(f"{file}: {what} does not exist") from err
    except (OSError, UnicodeDecodeError) as err:
        raise InputError(one_line(f"{file}: {what} cannot be read: {err}")) from err
    try:
        # The pure loader is YAML 1.2: 1e-3 is a number, and a key given twice is a fault.
        values = YAML(typ="safe", pure=True).load(text)
    except (YAMLError, ValueError) as err:
        raise InputError(one_line(f"{file}: {what} is not valid YAML: {_first_fault(err)}")) from err
    if not isinstance(values, dict):
        raise InputError(f"{file}: {what} is not a YAML mapping")
    return Fields(file, "", values)


def _first_fault(err: Exception) -> str:
    """Problem and line of a YAML error, without the library's advice."""
    mark, problem = getattr(err, "problem_mark", None), getattr(err, "problem", None)
    if mark is None or problem is None:
        return str(err)
    return f"line {mark.line + 1}: {problem}"
