"""What follows of the ten numbers for a vehicle, written out: centre of mass, axle loads, gyration."""

from __future__ import annotations

from dataclasses import dataclass

from rig_identification.quantity import amount, unit_text
from rig_identification.report.words import title
from rig_identification.result import Identification, Quantity


@dataclass(frozen=True)
class VehicleRow:
    """One quantity with the half-width of its 95 % interval."""

    name: str
    value: str
    half_width: str
    unit: str


@dataclass(frozen=True)
class VehicleView:
    """The chapter: a heading, of which body it is, and the quantities."""

    heading: str
    body: str
    rows: tuple[VehicleRow, ...]


def vehicle_view(identification: Identification, *, wheels: bool) -> VehicleView | None:
    """The quantities that follow; None where none is determined.

    wheels: whether the description says where the wheels touch the ground. Without, radii of gyration follow.
    """
    if not identification.vehicle:
        return None
    body = "the body without its carrying frame" if identification.without_frame else "the body"
    rows = tuple(_row(quantity) for quantity in identification.vehicle)
    return VehicleView("Vehicle" if wheels else "Radii of gyration", body, rows)


def _row(quantity: Quantity) -> VehicleRow:
    if quantity.unit == "1":
        value, half, power = amount(100.0 * quantity.value, 100.0 * quantity.std)
        return VehicleRow(title(quantity.name), value, half, f"{power} %".strip())
    value, half, power = amount(quantity.value, quantity.std)
    return VehicleRow(title(quantity.name), value, half, f"{power} {unit_text(quantity.unit)}".strip())
