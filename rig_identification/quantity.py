"""Numbers as a person reads them: as many digits as the interval deserves.

Every ± that a person reads is the half-width of a 95 % interval, on the page as in a sentence. A standard
deviation stands in ``result.json`` alone, under the key ``std``.
"""

from __future__ import annotations

import re

import numpy as np

NOT_DETERMINED = "not determinable"
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
Z_95 = 1.959964  # half-width of a 95 % interval in standard deviations


def decimals(half_width: float) -> int:
    """Decimal places that show two significant digits of an interval's half-width."""
    if not np.isfinite(half_width) or half_width <= 0.0:
        return 3
    return int(np.clip(1 - np.floor(np.log10(half_width)), 0, 9))


def number(value: float, places: int) -> str:
    """Fixed places, thin spaces between thousands, a true minus sign, no negative zero."""
    text = f"{value:,.{places}f}"
    if not any(digit in text for digit in "123456789"):
        text = text.lstrip("-")
    return text.replace(",", "\u202f").replace("-", "−")


def significant(value: float, digits: int = 3) -> str:
    """A number of stated significant digits, powers of ten written out."""
    if not np.isfinite(value):
        return "–"
    if value != 0.0 and not 1e-3 <= abs(value) < 1e5:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return mantissa.replace("-", "−") + power_of_ten(int(exponent))
    places = 0 if value == 0.0 else max(0, digits - 1 - int(np.floor(np.log10(abs(value)))))
    return number(value, places)


def power_of_ten(exponent: int) -> str:
    """The factor ``×10⁶`` of a number."""
    return "×10" + str(exponent).translate(SUPERSCRIPT)


def value_and_half_width(value: float, std: float) -> tuple[str, str]:
    """A value and the half-width of its 95 % interval, to the same places."""
    half = Z_95 * std
    places = decimals(half)
    return number(value, places), number(half, places) if np.isfinite(half) else "–"


def exponent(value: float, std: float) -> int:
    """Power of ten that a value with its interval is written with.

    0 where digits can be counted: from a thousandth up to a hundred thousand.
    """
    largest = max(abs(value), Z_95 * std if np.isfinite(std) else 0.0)
    if largest == 0.0 or not np.isfinite(largest) or 1e-3 <= largest < 1e5:
        return 0
    return int(np.floor(np.log10(largest)))


def amount(value: float, std: float) -> tuple[str, str, str]:
    """A value, the half-width of its 95 % interval, and the power of ten both are times; "" where it is 1."""
    power = exponent(value, std)
    scale = 10.0**power
    return *value_and_half_width(value / scale, std / scale), power_of_ten(power) if power else ""


def with_interval(value: float, std: float, unit: str = "1") -> str:
    """A value with the half-width of its 95 % interval, for a sentence: ``148.0 ± 2.0 N/m``.

    Digits can be pasted into a calculation: no thin spaces, a minus sign of ASCII.
    """
    number_text, half, power = amount(value, std)
    if not np.isfinite(std) or std <= 0.0:
        told = significant(value, 4)
    else:
        told = f"({number_text} ± {half}){power}" if power else f"{number_text} ± {half}"
    return _pasteable(f"{told} {unit_text(unit)}".strip())


def plain_figure(value: float, digits: int = 3) -> str:
    """A number of stated significant digits for a sentence: 38200, not 3.82e+04."""
    return _pasteable(significant(value, digits))


def _pasteable(text: str) -> str:
    return text.replace("\u202f", "").replace("−", "-")


def unit_text(unit: str) -> str:
    """A unit as it is printed: ``m/s^2`` becomes m/s²; the unit of a pure number says nothing."""
    return (
        ""
        if unit == "1"
        else re.sub(r"\^(-?\d+)", lambda m: m[1].translate(SUPERSCRIPT), unit).replace("*", " ")
    )
