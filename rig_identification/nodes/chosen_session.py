"""Which recordings a request is about: a session on disk, or windows of the node."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rig_identification.errors import InputError
from rig_identification.nodes.session_folder import SessionFolder
from rig_identification.session.session_description import read_session_description


def chosen_session(
    windows: SessionFolder, session: str, names: Sequence[str]
) -> tuple[Path, tuple[str, ...]]:
    """Session file of what was chosen, and what an answer to it rests on.

    session: folder or file of a recorded session; empty: the windows. names: those to use; none: all.

    Raises
    ------
    InputError
        There is no such session or window, or none is complete.
    """
    if session:
        return _recorded(Path(session).expanduser(), names)
    if not windows.done:
        raise InputError(f"no window is complete: {_missing(windows)}, or set the parameter session")
    known = [plan.name for plan in windows.done]
    _refuse_unknown(names, known)
    if not names:
        file = windows.folder / "session.yaml"
        return file, (str(file), *known)
    entries = [plan.entry() for plan in windows.done if plan.name in names]
    file = windows.write_yaml("chosen.yaml", {"rig": "rig.yaml", "recordings": entries})
    return file, (str(file), *names)


def _recorded(path: Path, names: Sequence[str]) -> tuple[Path, tuple[str, ...]]:
    description = read_session_description(path)
    known = [entry.name for entry in description.entries]
    _refuse_unknown(names, known)
    if names:
        raise InputError(
            "parameter windows: chooses among windows; a session is taken whole: set windows empty"
        )
    folders = [entry.folder for entry in description.entries if entry.folder.exists()]
    stamps = (str(folder.stat().st_mtime_ns) for folder in folders)
    return description.file, (str(description.file), *known, *stamps)


def _missing(windows: SessionFolder) -> str:
    if windows.plan is not None:
        return f"window {windows.plan.name} is still open; call ~/stop_window and wait for its answer"
    return "call ~/start_window"


def _refuse_unknown(names: Sequence[str], known: Sequence[str]) -> None:
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(f"parameter windows: {', '.join(unknown)} is none of {', '.join(known)}")
