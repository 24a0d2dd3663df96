"""``lab.yaml``: laboratory, customer and body, as a digital calibration certificate has to name them."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path

from rig_identification.laboratory import Contact, Item, Laboratory
from rig_identification.session.fields import Fields, load_fields, shown

_KEYS = ("laboratory", "person", "customer", "item", "identifier", "measured")


def read_laboratory(path: Path) -> Laboratory:
    """Read ``path``. Raises InputError for the first fault, with file, key and what to do."""
    top = load_fields(path, "description of the laboratory")
    top.refuse_unknown(_KEYS)
    return Laboratory(
        contact=_contact(top, "laboratory"),
        person=_words(top, "person", "the name of who answers for the certificate"),
        customer=_contact(top, "customer"),
        item=_item(top.section("item", "name, manufacturer and serial of the body")),
        identifier=_words(top, "identifier", "the certificate's number") if top.has("identifier") else None,
        measured=_day(top) if top.has("measured") else None,
    )


def _contact(top: Fields, key: str) -> Contact:
    part = top.section(key, "name, email, city and country")
    part.refuse_unknown(("name", "email", "city", "country"))
    country = _words(part, "country", "two capital letters of ISO 3166-1, as DE")
    if not re.fullmatch("[A-Z]{2}", country):
        raise part.fault("country", f"{shown(country)} is no country code; give two capital letters, as DE")
    told = {name: _words(part, name, f"its {name}") for name in ("name", "email", "city")}
    return Contact(country=country, **told)


def _item(part: Fields) -> Item:
    names = ("name", "manufacturer", "serial")
    part.refuse_unknown(names)
    return Item(**{name: _words(part, name, f"its {name}") for name in names})


def _words(part: Fields, key: str, what: str) -> str:
    """Text at ``key``. A number, as a serial one, stands for its digits."""
    value = part.values.get(key)
    if isinstance(value, int) and not isinstance(value, bool):
        return str(value)
    return part.text(key, what)


def _day(top: Fields) -> date:
    """YAML has dates of its own; a quoted one is text."""
    value = top.require("measured", "a date, as 2026-03-01")
    try:
        return date.fromisoformat(str(value))
    except ValueError as error:
        raise top.fault("measured", f"{shown(value)} is no date; give year-month-day") from error
