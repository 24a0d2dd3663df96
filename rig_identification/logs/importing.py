"""Logs to the bags of a session: every recording is complete, or none is there."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rig_identification.errors import InputError
from rig_identification.logs.columns import Columns, check_columns, columns_text, read_columns
from rig_identification.logs.convert import recording_of
from rig_identification.logs.formats import read_log
from rig_identification.logs.guess import guess
from rig_identification.logs.log import Log, of_all
from rig_identification.recording import Recording
from rig_identification.session.write import write_bag
from rig_identification.topics import DEFAULT_NAMESPACE, expected_topics

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Understood:
    """Logs of one make, and what their columns are taken for."""

    names: tuple[str, ...]  # of the recordings
    files: tuple[Path, ...]
    logs: tuple[Log, ...]
    columns: Columns
    text: str  # of the columns.yaml that says the same


def understand(
    files: Sequence[Path],
    columns_file: Path | None = None,
    rate: float | None = None,
    progress: Progress | None = None,
) -> Understood:
    """Read logs and find out what their columns are.

    Parameters
    ----------
    files : sequence of Path
        One a recording. What one of them lacks was not measured in it.
    columns_file : Path, optional
        The ``columns.yaml`` that says what the columns are; without it they are guessed.
    rate : float, optional
        Hz, of tables without a column of time.
    progress : callable, optional
        Called with one sentence before each file is read.

    Raises
    ------
    InputError
        A file or ``columns_file`` cannot be read.
    """
    logs = []
    for file in files:
        if progress is not None:
            progress(f"reading {file.name}")
        logs.append(read_log(file))
    source = ", ".join(file.name for file in files)
    together = of_all(logs)
    if columns_file is not None:
        columns = read_columns(columns_file)
        text = columns_text(columns, together, {}, source)
    else:
        found = guess(together)
        columns = found.columns.with_rate(rate)
        text = columns_text(columns, together, found.remarks, source)
    return Understood(_names(files), tuple(files), tuple(logs), columns, text)


def recordings(understood: Understood) -> tuple[Recording, ...]:
    """The recording of each log. Raises InputError, of a column too that none of the logs holds."""
    check_columns(understood.columns, of_all(understood.logs), ", ".join(map(str, understood.files)))
    together = zip(understood.logs, understood.names, understood.files, strict=True)
    return tuple(
        recording_of(log, understood.columns.held_by(log), name, str(file), number)
        for number, (log, name, file) in enumerate(together)
    )


def write_recordings(
    found: Sequence[Recording],
    folder: Path,
    namespace: str = DEFAULT_NAMESPACE,
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> None:
    """Write a bag a recording into a folder. They are written aside and moved when all are complete.

    Raises
    ------
    InputError
        A bag of the name exists and ``overwrite`` is not given, or the folder cannot be written to.
    """
    for recording in found:
        if (folder / recording.name).exists() and not overwrite:
            raise InputError(
                f"{folder / recording.name}: exists already; name another folder, or overwrite it"
            )
    cables = tuple(dict.fromkeys(cable for recording in found for cable in recording.tension))
    topics = expected_topics(cables, namespace)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        aside = Path(tempfile.mkdtemp(prefix=".import-", dir=folder))
        try:
            for recording in found:
                if progress is not None:
                    progress(f"writing {recording.name}")
                write_bag(recording, aside / recording.name, topics)
            for recording in found:
                if (folder / recording.name).exists():
                    os.replace(folder / recording.name, aside / f"{recording.name}.replaced")
                os.replace(aside / recording.name, folder / recording.name)
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    except OSError as error:
        raise InputError(f"{folder}: {error.strerror or error}; free it or name another folder") from error


def _names(files: Sequence[Path]) -> tuple[str, ...]:
    """Names of the recordings: those of the files, as folders that no shell stumbles over."""
    names = [re.sub(r"[^\w.-]+", "_", file.stem if file.is_file() else file.name) for file in files]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name}: two files would make the recording {name}; rename one of them")
    return tuple(names)
