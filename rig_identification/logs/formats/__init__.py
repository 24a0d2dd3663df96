"""Readers of formats, one a file, each found by its name.

A reader has ``NAME`` (of the format, for a person), ``holds(path)`` (whether a file or folder is of it, by
its name and first bytes), ``read(path)`` (a :class:`~rig_identification.logs.log.Log`; InputError where it
cannot be read) and ``ORDER``: of two readers that hold a path the one with the lower number reads it.
"""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path
from typing import Protocol

from rig_identification.errors import InputError, did_you_mean
from rig_identification.logs.log import Log


class Reader(Protocol):
    """What every file in this folder defines."""

    NAME: str
    ORDER: int

    def holds(self, path: Path) -> bool:
        """Whether ``path`` is of the format."""
        ...

    def read(self, path: Path) -> Log:
        """What ``path`` holds. Raises InputError."""
        ...


def readers() -> tuple[Reader, ...]:
    """Every reader, in the order in which they are asked."""
    found: list[Reader] = [
        importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)
    ]
    return tuple(sorted(found, key=lambda reader: (reader.ORDER, reader.NAME)))


def reader_of(path: Path) -> Reader | None:
    """The reader of a file or folder; None where no format is known."""
    try:
        return next((reader for reader in readers() if reader.holds(path)), None)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from error


def read_log(path: Path) -> Log:
    """What a file or folder holds.

    Raises
    ------
    InputError
        It is not there, of no known format, damaged, or needs a package that is not installed.
    """
    if not path.exists():
        beside = [other.name for other in path.parent.iterdir()] if path.parent.is_dir() else []
        raise InputError(f"{path}: does not exist{did_you_mean(path.name, beside)}")
    reader = reader_of(path)
    if reader is None:
        names = ", ".join(one.NAME for one in readers())
        raise InputError(f"{path}: is of no known format; known are {names}; export one of these")
    try:
        return reader.read(path)
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{path}: is larger than this machine's memory; split it") from error
    except Exception as error:  # a damaged file fails in as many ways as there are parsers
        told = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: is damaged, or no {reader.NAME} ({told}); export it again") from error


def begins(path: Path, *beginnings: bytes) -> bool:
    """Whether a file begins with one of these bytes."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(max(map(len, beginnings))).startswith(beginnings)
