"""Which files an answer comes from: a digest of each one that a session names."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from rig_identification.errors import InputError
from rig_identification.session.session_description import read_session_description

#: Bytes read at a time.
PIECE = 1 << 20


def file_digests(path: Path, progress: Callable[[str], None] | None = None) -> dict[str, str]:
    """SHA-256, in hexadecimal, of ``session.yaml``, the rig description and every file of every bag.

    Parameters
    ----------
    path : Path
        A session's folder or its session.yaml.
    progress : callable, optional
        Called with one sentence before each file.

    Returns
    -------
    dict
        By path relative to the session's folder, in the order of the session description.

    Raises
    ------
    InputError
        A file cannot be read.
    """
    description = read_session_description(path)
    root = description.file.parent
    found = {}
    for file in files_at(description.file, description.rig_file, *(e.folder for e in description.entries)):
        name = file.relative_to(root).as_posix() if file.is_relative_to(root) else str(file)
        if progress is not None:
            progress(f"digest of {name}")
        try:
            found[name] = sha256_of(file)
        except OSError as error:
            raise InputError(f"{file}: cannot be read: {error.strerror or error}") from error
    return found


def session_digest(digests: Mapping[str, str]) -> str:
    """SHA-256, in hexadecimal, of a whole session: of the lines that ``sha256sum`` prints for its files.

    digests: of :func:`file_digests`. Sessions with the same hash hold the same recordings, rig and session
    descriptions under the same names.
    """
    lines = "".join(f"{digest}  {name}\n" for name, digest in digests.items())
    return hashlib.sha256(lines.encode()).hexdigest()


def files_at(*paths: Path) -> Iterator[Path]:
    """Each path itself, or of a folder every file in it by name."""
    for path in paths:
        if path.is_dir():
            yield from sorted(file for file in path.rglob("*") if file.is_file())
        else:
            yield path


def sha256_of(file: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal. Raises OSError where it cannot be read."""
    digest = hashlib.sha256()
    with file.open("rb") as stream:
        while piece := stream.read(PIECE):
            digest.update(piece)
    return digest.hexdigest()
