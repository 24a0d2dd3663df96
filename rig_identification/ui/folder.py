"""The one folder that the page reads and writes: nothing outside of it has a name here."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from rig_identification.errors import InputError

SESSION, RIG, RESULT = "session.yaml", "rig.yaml", "result.json"
#: Where the page puts its answers, one folder a session.
ANSWERS = "answers"
#: Levels below the folder that are looked through, and entries of all of them: a folder of ten thousand
#: sessions has some hundred thousand files; a home directory would be walked for minutes.
DEEPEST, MOST_ENTRIES = 6, 200_000


class Outside(InputError):
    """A name that lies outside of the folder."""


@dataclass(frozen=True)
class Folder:
    """What lies below ``root``, by names with slashes."""

    root: Path  # resolved

    def below(self, name: str) -> Path:
        """The path of ``name``, links followed.

        Raises
        ------
        Outside
            It is no plain path, or leads out of the folder, by itself or by a link.
        """
        parts = PurePosixPath(name).parts
        odd = "\0" in name or "\\" in name or ":" in name or len(name) > 1000
        if odd or not parts or parts[0] == "/" or ".." in parts:
            raise Outside(f"{name[:80]!r}: is no path below the page's folder")
        try:
            path = (self.root / name).resolve()
        except (OSError, RuntimeError) as error:  # a link to itself
            raise Outside(f"{name!r}: leads nowhere") from error
        if not path.is_relative_to(self.root):
            raise Outside(f"{name!r}: leads out of the page's folder; copy what it names into it")
        return path

    def name_of(self, path: Path) -> str:
        """Name of a path below the folder; ``.`` for the folder itself."""
        return path.relative_to(self.root).as_posix()

    def check_inside(self, *paths: Path) -> None:
        """Raise Outside for a path that leads out of the folder, links followed."""
        for path in paths:
            if not path.resolve().is_relative_to(self.root):
                raise Outside(f"{path}: lies outside of the page's folder; copy it into it")

    def sessions(self) -> list[str]:
        """Folders with a session.yaml, by name."""
        return sorted(self.name_of(f.parent) for f in self._files() if f.name == SESSION)

    def rigs(self) -> list[str]:
        """Rig descriptions by name: every ``rig.yaml``, and other YAML files that name cables."""
        yaml = [f for f in self._files() if f.suffix in (".yaml", ".yml") and f.name != SESSION]
        return sorted(self.name_of(f) for f in yaml if f.name == RIG or _names_cables(f))

    def results(self) -> list[str]:
        """Files named result.json, by name."""
        return sorted(self.name_of(f) for f in self._files() if f.name == RESULT)

    def _files(self) -> Iterator[Path]:
        """Files below the folder, without hidden ones. Links to folders are not followed."""
        seen = 0
        for top, folders, files in os.walk(self.root):
            here = Path(top)
            seen += len(folders) + len(files)
            if seen > MOST_ENTRIES:
                return
            deep = len(here.relative_to(self.root).parts) >= DEEPEST
            folders[:] = [] if deep else sorted(name for name in folders if not name.startswith("."))
            found = (here / name for name in files if not name.startswith("."))
            yield from (file for file in found if self._holds(file))

    def _holds(self, file: Path) -> bool:
        """Whether it is a file, no pipe that never ends, and lies in the folder by its links too."""
        try:
            if stat.S_ISREG(file.lstat().st_mode):
                return True
            return file.is_symlink() and file.is_file() and file.resolve().is_relative_to(self.root)
        except (OSError, RuntimeError):  # a link to itself
            return False


def _names_cables(file: Path) -> bool:
    """Whether the beginning of a file reads like a rig description."""
    try:
        with file.open("rb") as stream:
            text = stream.read(1 << 16)
    except OSError:
        return False
    return b"ros__parameters:" in text and b"cables:" in text
