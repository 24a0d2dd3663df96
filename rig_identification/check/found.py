"""What one examiner of a session hands on: a fault, and the session with the fault undone."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Protocol

from rig_identification.examination import SetupFault
from rig_identification.raw import RawSession


@dataclass(frozen=True)
class Found:
    """One fault and the session without it."""

    fault: SetupFault
    session: (
        RawSession  # corrected; where the fault cannot be undone its channel is left out or it is as it was
    )


class Examiner(Protocol):
    """A module of ``check/stamps`` or ``check/readings``: one kind of fault, found without a model."""

    ORDER: int  # examiners run by rising order, each on the session that those before it corrected

    def find(self, session: RawSession) -> tuple[Found, ...]:
        """Faults of this kind, in the order in which they were corrected; the last one's session has all."""
        ...


def modules_with(package: ModuleType, name: str) -> list[Any]:
    """Modules of a package that define ``name``, by their file's name: a file in the folder is registered."""
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    modules = [importlib.import_module(f"{package.__name__}.{one}") for one in names]
    return [module for module in modules if hasattr(module, name)]


def examiners(package: ModuleType) -> Iterator[Examiner]:
    """Every module of a package that has ``find``, by its ``ORDER``."""
    return iter(sorted(modules_with(package, "find"), key=lambda module: module.ORDER))
