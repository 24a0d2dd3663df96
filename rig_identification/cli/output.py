"""The folder that ``--out`` names: refused before any work, or filled with all files at once."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification import files
from rig_identification.errors import InputError
from rig_identification.files import Writer

if TYPE_CHECKING:
    from rig_identification.api import Check, Result
    from rig_identification.api.planning import Planned


def check_output_folder(folder: Path, names: tuple[str, ...]) -> None:
    """Refuse a folder that files cannot be written to, before any work is done.

    Raises
    ------
    InputError
    """
    try:
        _check(folder, names)
    except (OSError, ValueError) as error:  # a name that no file system takes
        reason = error.strerror if isinstance(error, OSError) else None
        raise InputError(f"--out {folder}: {reason or error}; name another folder") from error


def _check(folder: Path, names: tuple[str, ...]) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {folder}: is a file; name a folder")
    if folder.is_symlink() and not folder.exists():
        raise InputError(f"--out {folder}: is a link to nothing; name another folder, or remove it")
    for name in names:
        if (folder / name).is_dir():
            raise InputError(f"--out {folder}: {name} in it is a folder; name another folder, or remove it")
    parent = files.nearest_existing(folder)
    if not parent.is_dir():
        raise InputError(f"--out {folder}: {parent} is a file; name another folder")
    try:  # Permissions do not tell of a full disk, a quota or a file system that is read-only.
        Path(tempfile.mkdtemp(prefix=".", suffix=".part", dir=parent)).rmdir()
    except OSError as error:
        reason = error.strerror or error
        raise InputError(
            f"--out {folder}: {parent} is not writable ({reason}); name another folder, or free it"
        ) from error


def write_together(folder: Path, writers: Mapping[str, Writer]) -> None:
    """:func:`rig_identification.files.write_together`, whose fault names the option ``--out``."""
    try:
        files.write_together(folder, writers)
    except InputError as error:
        raise InputError(f"--out {error}") from error


def written(answer: Check | Result | Planned, folder: Path) -> None:
    """Write an answer's files into the folder. Raises InputError, which names the option."""
    try:
        answer.write(folder)
    except InputError as error:
        raise InputError(f"--out {error}") from error
