"""Sessions below a folder, and an array job's share of them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rig_identification.errors import InputError
from rig_identification.session.not_a_session import FILE


@dataclass(frozen=True)
class Listed:
    """One session of a batch."""

    name: (
        str  # path below the batch's folder, with slashes; the folder's own name where it is a session itself
    )
    folder: Path


@dataclass(frozen=True)
class Shard:
    """The ``number``-th (from 1) of ``count`` jobs that share a batch."""

    number: int
    count: int

    def of(self, sessions: Sequence[Listed]) -> tuple[Listed, ...]:
        """Every ``count``-th session: long ones that were recorded together go to different jobs."""
        return tuple(sessions[self.number - 1 :: self.count])


def sessions_in(folder: Path) -> tuple[Listed, ...]:
    """Every folder with a session.yaml below ``folder``, by name. Links to folders are followed once.

    Raises
    ------
    InputError
        There is no such folder, or no session in it.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder; name one that holds sessions")
    found: list[Listed] = []
    seen: set[Path] = set()
    for top, folders, files in os.walk(folder, followlinks=True):
        here = Path(top)
        if here.resolve() in seen:
            folders.clear()
            continue
        seen.add(here.resolve())
        folders.sort()
        if FILE in files:
            below = here.relative_to(folder).as_posix()
            found.append(Listed(folder.resolve().name if below == "." else below, here))
    if not found:
        raise InputError(f"{folder}: holds no session; a session is a folder with a {FILE}")
    return tuple(sorted(found, key=lambda session: session.name))
