"""A rig as described: its schema, a description checked as it is typed, and the file."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rig_identification.rig import Rig

#: What faults of a description that has no file yet begin with.
NOWHERE = Path("rig.yaml")


def rig_schema() -> Mapping[str, Any]:
    """JSON Schema of a rig description's parameters under ``rig``, of a cable's under ``cable``."""
    from rig_identification.session.schema import rig_schema as schema

    found: Mapping[str, Any] = schema()["definitions"]
    return found


def read_rig(path: str | Path) -> Rig:
    """The rig of a description. Raises InputError: the first fault, as one line."""
    from rig_identification.session import read_rig as read

    return read(Path(path))


def rig_of(parameters: Mapping[str, Any]) -> Rig:
    """The rig of a description's parameters, as they stand under ``ros__parameters``.

    Raises
    ------
    FieldError
        The first fault; its ``key`` names the value.
    """
    from rig_identification.session.fields import Fields
    from rig_identification.session.rig_description import rig_from_fields

    return rig_from_fields(Fields(NOWHERE, "", parameters))


def rig_parameters(rig: Rig) -> Mapping[str, Any]:
    """A rig as the parameters of its description: numbers, lists and words."""
    from rig_identification.rig_document import rig_document

    document: Any = rig_document(rig)
    parameters: Mapping[str, Any] = document["/**"]["ros__parameters"]
    return parameters


def rig_text(rig: Rig) -> str:
    """A rig as the text of its description."""
    from rig_identification.rig_document import rig_document
    from rig_identification.session.write import dump

    stream = io.StringIO()
    dump(rig_document(rig), stream)
    return stream.getvalue()
