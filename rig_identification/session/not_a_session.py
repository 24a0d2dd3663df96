"""What stands where a session was looked for, in one line that says what to do."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rig_identification.errors import InputError, MissingDescription, did_you_mean
from rig_identification.session.bag_files import is_bag_file, kind_of, without_copies
from rig_identification.session.bag_metadata import NAME as METADATA
from rig_identification.session.fields import Fields
from rig_identification.session.yaml_text import beginning_of

FILE = "session.yaml"
_YAML = (".yaml", ".yml")
_TABLES = (".csv", ".tsv", ".txt", ".dat", ".xlsx", ".xls", ".ods", ".mat", ".npz", ".npy", ".parquet", ".h5")
_KINDS = {"mcap": "mcap", "sqlite3": "sqlite3", "rosbag1": "ROS 1", "zstd": "compressed"}
_WHAT = f"a session is a folder with a {FILE} that lists its bags"
_CONVERT = "make a session of it with rig-identification import"


def description_file(path: Path) -> Path:
    """The session.yaml at ``path``, a session's folder or the file itself.

    Raises
    ------
    MissingDescription
        A folder of bags without it.
    InputError
        Anything else, and what that is.
    """
    try:
        return _description_file(path)
    except OSError as err:
        raise InputError(f"{path}: cannot be read ({err.strerror or err}); correct its permissions") from err


def _description_file(path: Path) -> Path:
    if not path.exists():
        beside = [other.name for other in path.parent.iterdir()] if path.parent.is_dir() else []
        raise InputError(
            f"{path}: session does not exist; give its folder or its {FILE}{did_you_mean(path.name, beside)}"
        )
    if path.is_dir():
        if (path / FILE).exists():
            return path / FILE
        raise _folder(path)
    if path.suffix.lower() in _YAML:
        return path
    raise _file(path)


def check_description(top: Fields) -> None:
    """Refuse a YAML file of another purpose. Raises InputError."""
    if METADATA.removesuffix(".yaml") in top.file.stem and "rosbag2_bagfile_information" in top.values:
        raise InputError(f"{top.file}: is what a bag says of itself; {_WHAT}")
    if any(isinstance(value, dict) and "ros__parameters" in value for value in top.values.values()):
        raise InputError(
            f"{top.file}: is a rig description, not a session; {_WHAT} and names this file as rig"
        )


def bags_in(folder: Path, depth: int = 2) -> list[Path]:
    """Bags at ``folder``: itself, or those in it and in its folders down to ``depth``, by name.

    Files whose names begin with their folder's name are the parts of one bag, as a recorder names them;
    others are bags of their own.
    """
    files = without_copies([file for file in sorted(folder.iterdir()) if is_bag_file(file)])
    if (folder / METADATA).is_file() or (files and all(file.name.startswith(folder.name) for file in files)):
        return [folder]
    return files + [bag for inner in _folders(folder) if depth > 0 for bag in bags_in(inner, depth - 1)]


def _file(path: Path) -> InputError:
    kind = kind_of(path) if is_bag_file(path) else ""
    if kind or path.suffix.lower() in (".mcap", ".db3", ".bag"):
        return InputError(
            f"{path}: is a bag's file ({_KINDS.get(kind, 'empty')}), no session; {_way_up(path)}"
        )
    if path.suffix.lower() in _TABLES:
        return InputError(f"{path}: is a table ({path.suffix[1:]}), no session; {_CONVERT}")
    return InputError(f"{path}: is no {FILE}; {_WHAT}")


def _folder(path: Path) -> InputError:
    others = sorted(file.name for file in path.iterdir() if _lists_recordings(file))
    if others:
        return InputError(
            f"{path}: has no {FILE}; give {path / others[0]}, which lists recordings, or rename it"
        )
    inside = [inner.name for inner in _folders(path) if (inner / FILE).is_file()]
    if inside:
        return InputError(f"{path}: holds sessions and is none; give one of them: {', '.join(inside)}")
    bags = bags_in(path)
    if bags == [path]:
        return InputError(f"{path}: is one bag, no session; {_way_up(path)}")
    if bags:
        return MissingDescription(
            f"{path}: holds {len(bags)} bags but no {FILE}, which says what each of them is"
        )
    tables = sorted(file.name for file in path.iterdir() if file.suffix.lower() in _TABLES)
    if tables:
        return InputError(f"{path}: holds no bag but tables ({', '.join(tables[:3])}); {_CONVERT}")
    return InputError(f"{path}: holds neither a {FILE} nor a bag; {_WHAT}")


def _way_up(path: Path) -> str:
    """What to give in place of one bag."""
    above = path.absolute().parent
    for folder in (above, above.parent):
        if (folder / FILE).is_file():
            return f"give {folder}, whose {FILE} lists bags"
    if path.is_file() and bags_in(above) == [above]:
        above = above.parent
    return f"{_WHAT}: give {above} for a proposal of one"


def _lists_recordings(file: Path) -> bool:
    """Whether a YAML file has the list that makes it a session's description."""
    if file.suffix.lower() not in _YAML:
        return False
    text = beginning_of(file, 1 << 20)
    return any(line.startswith("recordings:") for line in text.splitlines())


def _folders(folder: Path) -> Iterator[Path]:
    return (inner for inner in sorted(folder.iterdir()) if inner.is_dir() and not inner.name.startswith("."))
