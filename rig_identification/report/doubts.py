"""The doubts about the rig: fitted parameters beside what the lab believed of them, in its tolerances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from rig_identification.quantity import Z_95, amount, exponent, significant, unit_text
from rig_identification.report.words import device_words, parameter_words
from rig_identification.result import ParameterEstimate

SPAN = 4.0  # tolerances either side of the description that a bar shows
WIDTH, HEIGHT = 240, 18  # px


@dataclass(frozen=True)
class Doubt:
    """One fitted parameter, written out."""

    name: str
    unit: str
    nominal: str
    value: str
    half_width: str
    shift: float | None  # tolerances from the description; None where no tolerance was stated
    learned: int | None  # percent by which the recordings narrowed the tolerance
    notable: bool  # beyond three tolerances
    bar: Markup | None


@dataclass(frozen=True)
class Group:
    """The parameters of one device."""

    device: str
    doubts: tuple[Doubt, ...]
    furthest: float  # tolerances
    notable: bool


def doubt_groups(parameters: tuple[ParameterEstimate, ...]) -> list[Group]:
    """Group parameters by the part of their name before the first dot, keeping their order."""
    devices: dict[str, list[Doubt]] = {}
    for parameter in parameters:
        device, _, rest = parameter.name.partition(".")
        devices.setdefault(device if rest else "rig", []).append(_doubt(parameter, rest or parameter.name))
    return [
        Group(
            device=device_words(device),
            doubts=tuple(doubts),
            furthest=max((abs(d.shift) for d in doubts if d.shift is not None), default=0.0),
            notable=any(d.notable for d in doubts),
        )
        for device, doubts in devices.items()
    ]


def _doubt(parameter: ParameterEstimate, name: str) -> Doubt:
    value, half, power = amount(parameter.value, parameter.std)
    stated = np.isfinite(parameter.prior_std) and parameter.prior_std > 0.0
    shift = (parameter.value - parameter.nominal) / parameter.prior_std if stated else None
    ratio = parameter.std / parameter.prior_std if stated else None
    return Doubt(
        name=parameter_words(name),
        unit=f"{power} {unit_text(parameter.unit)}".strip(),
        nominal=significant(parameter.nominal / 10.0 ** exponent(parameter.value, parameter.std), 5),
        value=value,
        half_width=half,
        shift=shift,
        learned=None if ratio is None else round(100.0 * float(np.clip(1.0 - ratio, 0.0, 1.0))),
        notable=shift is not None and abs(shift) > 3.0,
        bar=None if shift is None or ratio is None else _bar(shift, ratio),
    )


def _bar(shift: float, ratio: float) -> Markup:
    """Shaded one and three tolerances of the description; the estimate with its 95 % interval on it."""

    def at(tolerances: float) -> float:
        return float(WIDTH * (np.clip(tolerances, -SPAN, SPAN) + SPAN) / (2.0 * SPAN))

    middle = HEIGHT / 2
    low, high = at(shift - Z_95 * ratio), at(shift + Z_95 * ratio)
    state = "far" if abs(shift) > 3.0 else "near"
    shades = "".join(
        f'<rect class="{name}" x="{at(-reach):.1f}" y="2" '
        f'width="{at(reach) - at(-reach):.1f}" height="{HEIGHT - 4}"/>'
        for name, reach in (("three", 3.0), ("one", 1.0))
    )
    return Markup(
        f'<svg class="doubt" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">'
        f"<title>{shift:+.2f} tolerances</title>{shades}"
        f'<path class="zero" d="M{WIDTH / 2} 0v{HEIGHT}"/>'
        f'<path class="interval {state}" d="M{low:.1f} {middle}H{max(high, low + 0.5):.1f}"/>'
        f'<circle class="{state}" cx="{at(shift):.1f}" cy="{middle}" r="3.6"/></svg>'
    )
