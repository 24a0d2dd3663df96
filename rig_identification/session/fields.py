"""Mappings read from YAML: each value is checked where it is taken, and a fault names file, key and limit."""

from __future__ import annotations

import math
import re
import reprlib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml.error import YAMLError

from rig_identification.errors import FieldError, InputError, did_you_mean
from rig_identification.session.yaml_text import TooMuch, load_yaml, read_text

#: A quaternion further than this from norm 1 is a typing error, not rounding.
QUATERNION_NORM_TOLERANCE = 1e-3
_SIGN, _POWER = "[+-]?", r"(?:[eE][+-]?\d+)?"


def one_line(text: object) -> str:
    """``text`` on one line, for messages that quote another library."""
    return " ".join(str(text).split())


def shown(value: object) -> str:
    """A value as a message quotes it: of a long one its two ends, of a deep one its outside."""
    return _QUOTED.repr(value)


_QUOTED = reprlib.Repr()
_QUOTED.maxlevel, _QUOTED.maxlist, _QUOTED.maxdict = 3, 8, 4
_QUOTED.maxstring = _QUOTED.maxlong = _QUOTED.maxother = 80


@dataclass(frozen=True)
class Fields:
    """One mapping of a YAML file with the key path that leads to it."""

    file: Path
    path: str
    values: Mapping[str, object]

    def fault(self, key: str, problem: str) -> InputError:
        """The error for ``key``: file, key path, then ``problem``."""
        path = self.key_path(key)
        return FieldError(one_line(f"{self.file}: {path}: {problem}"), path, one_line(problem))

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
            hint = f"; write it in brackets: [{value}]" if isinstance(value, str) else ""
            raise self.fault(key, f"{shown(value)} is not a list; give {size} numbers in {unit}{hint}")
        if len(value) != size:
            # 1,25 in a list is two whole numbers.
            whole = sum(isinstance(item, int) for item in value)
            hint = "; is a comma a decimal point? write 1.25" if len(value) > size and whole > 1 else ""
            raise self.fault(key, f"has {len(value)} numbers; give {size} in {unit}{hint}")
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
            near = did_you_mean(str(value), words)
            raise self.fault(key, f"{shown(value)} is unknown; give {' or '.join(words)}{near}")
        return str(value)

    def text(self, key: str, what: str, kind: str = "text") -> str:
        """Text at ``key``; ``kind``: what a value that is none is said not to be."""
        value = self.require(key, what)
        if not isinstance(value, str):
            raise self.fault(key, f"{shown(value)} is not a {kind}; give {what}")
        return value

    def names(self, key: str, what: str, *, at_least: int, few: str) -> list[str]:
        """Names at ``key``, each once; ``few``: what is wrong with fewer than ``at_least``."""
        names = self.require(key, what)
        if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
            raise self.fault(key, f"{shown(names)} is not a list of names")
        if len(names) < at_least:
            raise self.fault(key, f"{len(names)} {few}")
        for name, count in Counter(names).items():
            if count > 1:
                raise self.fault(key, f"{name} is listed twice; list each once")
        return names

    def entries(self, key: str, what: str, form: str) -> list[Fields]:
        """Mappings in the list at ``key``, one or more; ``form``: what one looks like."""
        listed = self.require(key, what)
        if not isinstance(listed, list) or not listed:
            raise self.fault(key, f"is not {what.removeprefix('the ')}; give at least one {form}")
        found = []
        for index, item in enumerate(listed):
            if not isinstance(item, dict):
                raise self.fault(f"{key}[{index}]", f"{shown(item)} is not a mapping; give {form}")
            found.append(self.below(self.key_path(f"{key}[{index}]"), item))
        return found

    def flag(self, key: str) -> bool:
        """True or false at ``key``; false where it is missing."""
        value = self.values.get(key, False)
        if not isinstance(value, bool):
            raise self.fault(key, f"{shown(value)} is unknown; give true or false")
        return value

    def section(self, key: str, what: str) -> Fields:
        """Mapping at ``key``."""
        value = self.require(key, what)
        if not isinstance(value, dict):
            raise self.fault(key, f"{shown(value)} is not a mapping; give {what}")
        return self.below(self.key_path(key), value)

    def below(self, path: str, values: Mapping[str, object]) -> Fields:
        """A mapping inside this one, at a key path from the top of the file."""
        return Fields(self.file, path, values)

    def has(self, key: str) -> bool:
        """True where ``key`` carries a value."""
        return self.values.get(key) is not None

    def refuse_unknown(self, known: Iterable[str]) -> None:
        """InputError for the first key that is not in ``known``."""
        names = tuple(known)
        for key in self.values:
            if key not in names:
                self._refuse_half_a_number(key)
                near = did_you_mean(str(key), names)
                raise self.fault(str(key), f"unknown key; known are {', '.join(names)}{near}")

    def refuse_misspelt(self, known: Iterable[str]) -> None:
        """InputError for a key that looks like one of ``known`` misspelt; others belong to other tools."""
        names = tuple(known)
        for key in self.values:
            self._refuse_half_a_number(key)
            close = get_close_matches(str(key).lower(), names, n=1, cutoff=0.8)
            if key not in names and close and close[0] not in self.values:
                raise self.fault(str(key), f"unknown key; did you mean {close[0]}?")

    def _refuse_half_a_number(self, key: object) -> None:
        """InputError for what YAML makes of ``{mass: 50,25}``: a key 25 without a value."""
        if isinstance(key, (int, float)) and self.values[key] is None:  # type: ignore[index]
            raise self.fault(
                "", f"{key} stands alone; is a comma before it a decimal point? write 1.25 for 1,25"
            )

    def _finite(self, key: str, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.fault(key, f"{shown(value)} is not a number{number_hint(value)}")
        try:
            number = float(value)
        except OverflowError:  # a whole number of more than 308 digits
            number = math.inf
        if not math.isfinite(number):
            raise self.fault(key, f"{shown(value)} is not finite")
        return number


def number_hint(value: object) -> str:
    """Ending of a message that says which number a text may mean, or nothing."""
    if not isinstance(value, str):
        return ""
    text = value.strip().replace("\N{MINUS SIGN}", "-")
    if re.fullmatch(rf"{_SIGN}\d+,\d+{_POWER}", text):
        return f"; did you mean {text.replace(',', '.')}? a decimal point is a point"
    if re.fullmatch(rf"{_SIGN}\d{{1,3}}([, ']\d{{3}})+(\.\d*)?", text):
        joined = re.sub("[, ']", "", text)
        return f"; did you mean {joined}? write thousands without a sign between"
    if found := re.match(rf"({_SIGN}(\d+\.?\d*|\.\d+){_POWER})\s*\S*$", text):
        return f"; did you mean {found[1]}? give the number alone"
    return ""


def load_fields(file: Path, what: str) -> Fields:
    """Top mapping of the YAML 1.2 file ``file``; ``what`` names the file's role in messages."""
    try:
        text = read_text(file)
    except FileNotFoundError as err:
        beside = [other.name for other in file.parent.iterdir()] if file.parent.is_dir() else []
        near = did_you_mean(file.name, beside)
        raise InputError(f"{file}: {what} does not exist{near}") from err
    except UnicodeDecodeError as err:
        raise InputError(f"{file}: {what} is no text in UTF-8; save it as UTF-8") from err
    except OSError as err:
        raise InputError(one_line(f"{file}: {what} cannot be read: {err}")) from err
    except TooMuch as err:
        raise InputError(f"{file}: {what} cannot be used: {err}") from err
    try:
        values = load_yaml(text)
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
    hint = "; indent with spaces" if "'\\t'" in problem else ""
    return f"line {mark.line + 1}: {problem}{hint}"
