"""Files that appear together when all are complete, or not at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

from rig_identification.errors import InputError

Writer = Callable[[Path], None]


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
    aside = nearest_existing(folder) / f".{folder.name}.{os.getpid()}.part"
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
        raise InputError(f"{folder}: {reason}; free it or name another folder") from error


def nearest_existing(folder: Path) -> Path:
    """The folder itself or the first of its parents that exists."""
    absolute = folder.absolute()
    return next(path for path in (absolute, *absolute.parents) if path.exists())


def _move(aside: Path, folder: Path, names: tuple[str, ...]) -> None:
    if folder.exists():
        for name in names:
            os.replace(aside / name, folder / name)
    else:
        folder.parent.mkdir(parents=True, exist_ok=True)
        os.rename(aside, folder)
