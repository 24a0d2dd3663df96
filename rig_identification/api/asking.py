"""Values that a form sends, checked one by one: a fault names the value by its key."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rig_identification.session.fields import Fields


def asked(what: str, values: Mapping[str, Any]) -> Fields:
    """The values of a form called ``what``, whose faults are :class:`FieldError`."""
    from rig_identification.session.fields import Fields

    return Fields(Path(what), "", values)
