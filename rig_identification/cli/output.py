"""Files that appear together when all are complete, or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from rig_identification.errors import InputError

Writer = Callable[[Path], None]


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
    parent = _nearest_existing(folder)
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
    """Write files aside, on the same file system, and move them into the folder once all are complete.

    Parameters
    ----------
    folder : Path
        Made, with its parents, where it does not exist.
    writers : mapping
        File name -> function that writes the file at the path it is given.

    Raises
    ------
    InputError
        The folder cannot be written to, or the disk is full. The folder is as it was.
    """
    aside = _nearest_existing(folder) / f".{folder.name}.{os.getpid()}.part"
    try:
        try:
            aside.mkdir()
            for name, write in writers.items():
                write(aside / name)
            _move(aside, folder, tuple(writers))
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"--out {folder}: {reason}; free it or name another folder") from error


def _move(aside: Path, folder: Path, names: tuple[str, ...]) -> None:
    if folder.exists():
        for name in names:
            os.replace(aside / name, folder / name)
    else:
        folder.parent.mkdir(parents=True, exist_ok=True)
        os.rename(aside, folder)


def _nearest_existing(folder: Path) -> Path:
    """The folder itself or the first of its parents that exists."""
    absolute = folder.absolute()
    return next(path for path in (absolute, *absolute.parents) if path.exists())
