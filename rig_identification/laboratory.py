"""Who certifies what, for whom: what a digital calibration certificate says besides its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date


@dataclass(frozen=True)
class Contact:
    """A laboratory or a customer."""

    name: str
    email: str
    city: str
    country: str  # two capital letters of ISO 3166-1


@dataclass(frozen=True)
class Item:
    """The body that was measured."""

    name: str
    manufacturer: str
    serial: str


@dataclass(frozen=True)
class Laboratory:
    """What the laboratory has to say; no recording holds it."""

    contact: Contact
    person: str  # who answers for the certificate
    customer: Contact
    item: Item
    identifier: str | None = None  # the certificate's own number; None: made of the session's digest
    measured: date | None = None  # None: the day that the recordings' stamps tell
