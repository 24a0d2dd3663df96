"""What a session's answer depends on, as one hash: descriptions, bags, version and options.

A file of which size and time of change are those of the last time is not read again: ten thousand sessions
that are done are told from new ones without reading their bags.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rig_identification import __version__
from rig_identification.errors import InputError
from rig_identification.session.not_a_session import FILE
from rig_identification.session.provenance import files_at, sha256_of
from rig_identification.session.session_description import read_session_description


@dataclass(frozen=True)
class Seen:
    """A file as it was when its content was hashed."""

    size: int
    changed_ns: int
    digest: str  # SHA-256, hexadecimal


def files_of(folder: Path) -> tuple[Path, ...]:
    """Files that the session in ``folder`` is made of; of an unreadable description the description alone."""
    description = folder / FILE
    try:
        read = read_session_description(folder)
    except (InputError, OSError):
        return (description,)
    bags = files_at(*(entry.folder for entry in read.entries))
    return tuple(dict.fromkeys((description, read.rig_file, *bags)))


def seen_files(files: tuple[Path, ...], before: Mapping[str, Seen]) -> dict[str, Seen]:
    """Each file that can be read, hashed unless it is as it was ``before``. Keys are paths as given."""
    out = {}
    for file in files:
        try:
            found = file.stat()
            last = before.get(str(file))
            if last is None or (last.size, last.changed_ns) != (found.st_size, found.st_mtime_ns):
                last = Seen(found.st_size, found.st_mtime_ns, sha256_of(file))
        except OSError:
            continue  # what is missing is told by whoever reads the session
        out[str(file)] = last
    return out


def fingerprint(folder: Path, seen: Mapping[str, Seen], options: Mapping[str, object]) -> str:
    """64 hexadecimal digits. Where the session lies does not matter, nor when its files were changed."""
    content = sorted((_below(Path(path), folder), file.digest) for path, file in seen.items())
    told = json.dumps([__version__, dict(options), content], sort_keys=True)
    return hashlib.sha256(told.encode()).hexdigest()


def _below(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name
