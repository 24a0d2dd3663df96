"""Left-out physics on the command line: ``--effect NAME=VALUE``."""

from __future__ import annotations

from collections.abc import Iterable

from rig_identification.api.effects import effect_of, effects_document
from rig_identification.errors import InputError

__all__ = ["effect_of", "effects_document", "effects_given"]


def effects_given(texts: Iterable[str]) -> dict[str, tuple[float, ...]]:
    """Switch -> its numbers, of ``NAME=VALUE[,VALUE...]``. Raises InputError where a text is not that."""
    out: dict[str, tuple[float, ...]] = {}
    for text in texts:
        name, _, values = text.partition("=")
        try:
            out[name.strip()] = tuple(float(value) for value in values.split(","))
        except ValueError as error:
            raise InputError(f"--effect {text}: give NAME=VALUE, or NAME=X,Y,Z") from error
    return out
