"""The report's first chapter: mass, centre of mass, inertia, and what a body with them looks like."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig_identification.quantity import Z_95, number, significant, value_and_half_width
from rig_identification.report.principal import PrincipalInertia, principal_inertia
from rig_identification.report.result_json import INERTIA_INDEX
from rig_identification.result import ELEMENTS, Identification, InertialEstimate

UNITS = ("kg", "m", "m", "m", *("kg m²",) * 6)


@dataclass(frozen=True)
class Element:
    """One of the ten numbers, written out."""

    symbol: str  # "m", "c"
    index: str  # "", "x", "xy"
    value: str
    half_width: str  # of the 95 % interval
    unit: str
    observable: bool


@dataclass(frozen=True)
class PrincipalRow:
    """One principal moment with its axis."""

    moment: str
    half_width: str
    axis: tuple[str, str, str]
    near: str  # "0.8° ± 0.1° from x"


@dataclass(frozen=True)
class Block:
    """The ten numbers of one body."""

    heading: str
    mass: Element
    center: tuple[Element, ...]
    inertia: tuple[tuple[Element, ...], ...]
    principal: tuple[PrincipalRow, ...]
    consistency: str  # one sentence
    consistent: bool | None  # None: not decidable


def blocks(identification: Identification) -> list[Block]:
    """Body with its carrying frame, then without it where the frame is described."""
    if identification.without_frame is None:
        return [_block("Body", identification.total)]
    return [
        _block("Body with its carrying frame", identification.total),
        _block("Body without its carrying frame", identification.without_frame),
    ]


def elements(estimate: InertialEstimate) -> list[Element]:
    """The ten numbers in the order of ``ELEMENTS``."""
    std = np.sqrt(np.clip(np.nan_to_num(np.diag(estimate.covariance), nan=0.0), 0.0, None))
    written = []
    for name, value, sigma, unit in zip(ELEMENTS, estimate.values, std, UNITS, strict=True):
        observable = name not in estimate.unobservable and bool(np.isfinite(value))
        text, half = value_and_half_width(value, sigma) if observable else ("", "")
        written.append(Element(name[0], name[1:], text, half, unit, observable))
    return written


def _block(heading: str, estimate: InertialEstimate) -> Block:
    ten = elements(estimate)
    principal = principal_inertia(estimate)
    sentence, consistent = _consistency(principal)
    return Block(
        heading=heading,
        mass=ten[0],
        center=tuple(ten[1:4]),
        inertia=tuple(tuple(ten[i] for i in row) for row in INERTIA_INDEX),
        principal=_principal_rows(principal),
        consistency=sentence,
        consistent=consistent,
    )


def _principal_rows(principal: PrincipalInertia | None) -> tuple[PrincipalRow, ...]:
    if principal is None:
        return ()
    rows = []
    for i in range(3):
        moment, half = value_and_half_width(principal.moments[i], principal.moments_std[i])
        axis = principal.axes[:, i]
        nearest = int(np.argmax(np.abs(axis)))
        angle = np.degrees(np.arccos(min(abs(axis[nearest]), 1.0)))
        doubt = significant(Z_95 * np.degrees(principal.axes_std[i]), 2)
        near = f"{significant(angle, 2)}° from {'xyz'[nearest]}, ± {doubt}°"
        rows.append(PrincipalRow(moment, half, tuple(number(a, 4) for a in axis), near))  # type: ignore[arg-type]
    return tuple(rows)


def _consistency(principal: PrincipalInertia | None) -> tuple[str, bool | None]:
    """A body's largest principal moment is at most the sum of the other two."""
    if principal is None:
        return "Physical consistency needs all six elements of the tensor; not all are determinable.", None
    if principal.moments[0] <= 0.0 or principal.margin < 0.0:
        return (
            "No body can have this tensor: its largest principal moment exceeds the sum of the other two.",
            False,
        )
    margin, half = value_and_half_width(principal.margin, principal.margin_std)
    return (
        "Physically consistent: all principal moments are positive and the two smaller exceed the largest by "
        f"{margin} ± {half} kg m².",
        True,
    )
