"""Which files make up a bag, and what each of them is: judged by their first bytes, not by their names."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rig_identification.errors import InputError
from rig_identification.session import mcap_storage, rosbag1_storage, sqlite3_storage
from rig_identification.session.bag_metadata import NAME as METADATA
from rig_identification.session.bag_metadata import BagMetadata, read_bag_metadata
from rig_identification.session.unpacking import ZSTD_MAGIC, unpack_file

#: Kind of storage -> its first bytes.
MAGIC = {
    "mcap": mcap_storage.MAGIC,
    "sqlite3": sqlite3_storage.MAGIC,
    "rosbag1": rosbag1_storage.MAGIC,
    "zstd": ZSTD_MAGIC,
}
#: Endings that a bag's file has.
SUFFIXES = (".mcap", ".db3", ".bag")
_ZSTD = ".zstd"


@dataclass(frozen=True)
class BagFiles:
    """Files of one bag in the order in which they were written."""

    files: tuple[Path, ...]
    metadata: BagMetadata
    notes: tuple[str, ...]


def bag_files(path: Path) -> BagFiles:
    """Files of the bag at ``path``: its folder, or one of its files alone.

    Raises
    ------
    InputError
        Nothing there, or nothing that is a bag's file.
    """
    if path.is_file():
        if not is_bag_file(path):
            raise InputError(
                f"{path}: is no bag: it begins neither as mcap, as sqlite3 nor as a ROS 1 bag; "
                "give the bag's folder or its .mcap, .db3 or .bag file"
            )
        return BagFiles((path,), BagMetadata(None, (), {}, 0), ())
    metadata = read_bag_metadata(path)
    here = [file for file in sorted(path.iterdir(), key=_by_number) if is_bag_file(file)]
    named = [file for name in metadata.files if (file := path / name).is_file()]
    missing = [name for name in metadata.files if not (path / name).is_file()]
    files = named or without_copies(here)
    if not files:
        what = (
            f"{METADATA} names {', '.join(missing)}, which is missing: copy it" if missing else "record anew"
        )
        raise InputError(f"{path}: holds no bag's file (.mcap, .db3 or .bag); {what}")
    notes = [*metadata.notes]
    if missing:
        notes.append(f"{', '.join(missing)} of {METADATA} is missing: {_names(files)} was read without it")
    if len(files) > 1 and not metadata.files:
        notes.append(f"{_names(files)} were read as the parts of one bag")
    if left := [file for file in here if file not in files]:
        notes.append(f"{_names(left)} in the bag's folder was not read: it is no part of the bag, or a copy")
    return BagFiles(tuple(files), metadata, tuple(notes))


def is_bag_file(path: Path) -> bool:
    """Whether a file is a bag's by its first bytes, or empty or cut off with the name of one."""
    if not path.is_file() or path.name.endswith(("-wal", "-journal", "-shm")):
        return False
    kind = kind_of(path)
    named = path.name.removesuffix(_ZSTD).endswith(SUFFIXES)
    return named if kind in ("", "zstd") else True


def kind_of(path: Path) -> str:
    """Key of :data:`MAGIC` by the first bytes of ``path``; "" where it is none, or cut off within them."""
    with path.open("rb") as file:
        beginning = file.read(max(map(len, MAGIC.values())))
    return next((kind for kind, magic in MAGIC.items() if beginning.startswith(magic)), "")


@contextmanager
def opened(path: Path) -> Iterator[tuple[Path, str, list[str]]]:
    """A storage file, unpacked where it is compressed as a whole: its path, its kind, and what to say of it.

    Raises
    ------
    Damaged
        It is compressed and does not unpack.
    """
    if kind_of(path) != "zstd":
        yield path, kind_of(path), []
        return
    with tempfile.TemporaryDirectory() as scratch:
        inner = Path(scratch) / path.name.removesuffix(_ZSTD)
        with path.open("rb") as source:
            whole = unpack_file(source, path.stat().st_size, inner)
        yield inner, kind_of(inner), [] if whole else ["is truncated: it was unpacked as far as it goes"]


def without_copies(files: list[Path]) -> list[Path]:
    """Players unpack a compressed file beside itself: then the unpacked one alone."""
    names = {file.name for file in files}
    return [f for f in files if not (f.name.endswith(_ZSTD) and f.name.removesuffix(_ZSTD) in names)]


def _by_number(path: Path) -> list[tuple[int, str]]:
    """Key that sorts run_10 behind run_9."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)]


def _names(files: list[Path]) -> str:
    return ", ".join(file.name for file in files)
