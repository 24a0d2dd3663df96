"""Mass, centre of mass and inertia tensor of a body on a cable rig, and what the rig's model left out.

For a program or a notebook::

    import rig_identification as ri

    result = ri.identify("session")
    result.mass, result.inertia, result.verdict
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from functools import wraps
from inspect import Parameter, signature
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from rig_identification.api import (
        Check,
        Recorded,
        Result,
        Simulated,
        Stopped,
        check,
        identify,
        read,
        simulate,
    )
    from rig_identification.errors import InputError

__all__ = [
    "Check",
    "InputError",
    "Recorded",
    "Result",
    "Simulated",
    "Stopped",
    "check",
    "identify",
    "read",
    "simulate",
]

#: Functions whose names are those of rooms of this package too.
_ROOMS = ("check", "simulate")


def __getattr__(name: str) -> Any:
    """Load a public name when it is first asked for: importing the package loads nothing."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name in _ROOMS:
        return importlib.import_module(f"{__name__}.{name}")
    home = "errors" if name == "InputError" else "api"
    return getattr(importlib.import_module(f"{__name__}.{home}"), name)


class _Package(ModuleType):
    """This package, whose rooms ``check`` and ``simulate`` can be called like the functions of their names.

    Importing a room binds its name here, in place of the function. Both are wanted by that name.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if name in _ROOMS and type(value) is ModuleType:
            from rig_identification import api

            value.__class__ = _callable(getattr(api, name))
        super().__setattr__(name, value)


def _callable(function: Callable[..., Any]) -> type[ModuleType]:
    """Class of a module that, called, calls ``function``."""

    @wraps(function)
    def call(room: ModuleType, /, *arguments: Any, **options: Any) -> Any:
        return function(*arguments, **options)

    # Of a method, a notebook shows the signature without its first parameter.
    given = signature(function)
    bound = Parameter("room", Parameter.POSITIONAL_ONLY)
    call.__signature__ = given.replace(parameters=[bound, *given.parameters.values()])  # type: ignore[attr-defined]
    return type("Room", (ModuleType,), {"__call__": call, "__doc__": function.__doc__})


sys.modules[__name__].__class__ = _Package
