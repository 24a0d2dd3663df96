"""Packages that only some uses need: asked for where they are used, with the command that installs them."""

from __future__ import annotations

import importlib
from typing import Any

from rig_identification.errors import InputError


def needed(module: str, purpose: str, extra: str) -> Any:
    """The module, imported.

    Parameters
    ----------
    module : str
        Its name for an import.
    purpose : str
        What needs it, as the subject of a sentence: ``tables``.
    extra : str
        The extra of this package that installs it.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != module.partition(".")[0]:
            raise  # the package is there; what it needs itself is not
        raise InputError(
            f"{purpose}: the package {module.partition('.')[0]} is not installed; "
            f"pip install 'rig_identification[{extra}]'"
        ) from error
