"""A contract session that grows: one bag a recording, session.yaml renewed whenever one is complete.

What was recorded stays readable whatever happens to the disk: space is reserved beforehand for all
that is needed to close a bag, and recording ends in good order before it is touched.
"""

from __future__ import annotations

import os
import re
import shutil
import sqlite3
from dataclasses import dataclass, field
from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from ruamel.yaml import YAML

from rig_identification.errors import InputError
from rig_identification.recording import Dummy
from rig_identification.rig import Rig
from rig_identification.session.messages import TYPESTORE
from rig_identification.session.rig_document import rig_document
from rig_identification.topics import Topic

PLUGINS = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
#: Bytes kept free to close a bag: the writer's open chunk of 1 MiB, its index and session.yaml.
RESERVE = 3 * 2**20
#: Bytes of index that each message adds to what closing a bag needs.
_INDEX = 20
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")


@dataclass(frozen=True)
class RecordingPlan:
    """What the next recording is."""

    name: str
    kind: str  # "static" or "dynamic"
    holdout: bool = False
    dummy: Dummy | None = None

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise InputError(f"recording {self.name!r}: is no folder's name; use letters, digits, _, - and .")
        if self.kind not in ("static", "dynamic"):
            raise InputError(f"recording {self.name}: kind {self.kind!r} is unknown; give static or dynamic")
        if self.kind == "static" and self.holdout:
            raise InputError(f"recording {self.name}: a static recording cannot be held out")
        if self.kind == "dynamic" and self.dummy is not None:
            raise InputError(
                f"recording {self.name}: a dummy belongs to a static recording; set its mass to 0"
            )

    def entry(self) -> dict[str, object]:
        """Its line in session.yaml."""
        entry: dict[str, object] = {"bag": self.name, "kind": self.kind}
        if self.holdout:
            entry["holdout"] = True
        if self.dummy is not None:
            entry["dummy"] = {"mass": self.dummy.mass, "position": self.dummy.position.tolist()}
        return entry


class DiskFull(InputError):
    """Recording ended because the disk is full; what was recorded is whole."""


@dataclass
class SessionFolder:
    """Writes bags into ``folder``; makes it, or goes on with a session that is there."""

    folder: Path
    rig: Rig
    topics: dict[str, Topic]
    storage: str = "mcap"
    plan: RecordingPlan | None = None  # of the open bag
    counts: dict[str, int] = field(default_factory=dict)  # messages of the open bag, by topic
    done: list[RecordingPlan] = field(default_factory=list)
    _writer: Writer | None = None
    _connections: dict[str, Connection] = field(default_factory=dict)

    def start(self, plan: RecordingPlan) -> None:
        """Open a bag. Raises InputError: one is open, the name is taken, the disk cannot be written."""
        if self.plan is not None:
            raise InputError(f"recording {self.plan.name} is running; stop it first")
        if plan.name in [done.name for done in self.done] or (self.folder / plan.name).exists():
            raise InputError(f"recording {plan.name}: is in {self.folder} already; give another name")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._check_space(0, 0)
            writer = Writer(self.folder / plan.name, version=9, storage_plugin=PLUGINS[self.storage])
            writer.open()
        except OSError as error:
            raise InputError(
                f"{self.folder}: {error.strerror or error}; free it or name another folder"
            ) from error
        self._writer, self.plan, self.counts, self._connections = writer, plan, {}, {}

    def add(self, name: str, messages: list[bytes], received_ns: list[int]) -> None:
        """Write messages of a topic, as received.

        Raises
        ------
        DiskFull
            The bag was closed before they were written; it is whole.
        """
        if self._writer is None or not messages:
            return
        try:
            self._check_space(sum(map(len, messages)) + 64 * len(messages), sum(self.counts.values()))
            if name not in self._connections:
                kind = self.topics[name].message_type
                self._connections[name] = self._writer.add_connection(name, kind, typestore=TYPESTORE)
                self.counts[name] = 0
            connection = self._connections[name]
            for message, received in zip(messages, received_ns, strict=True):
                self._writer.write(connection, received, message)
        except (OSError, sqlite3.OperationalError) as error:
            plan = self.stop()
            told = (
                f"recording {plan.name if plan else ''} ended: {' '.join(str(error).split())}; free the disk"
            )
            raise DiskFull(told) from error
        self.counts[name] += len(messages)

    def _check_space(self, coming: int, messages: int) -> None:
        free = shutil.disk_usage(self.folder).free
        if free < coming + RESERVE + _INDEX * messages:
            raise OSError(28, f"{free / 2**20:.1f} MiB are left on the disk of {self.folder}")

    def stop(self) -> RecordingPlan | None:
        """Close the open bag and enter it in session.yaml; None: nothing was open, or nothing came."""
        writer, plan = self._writer, self.plan
        self._writer, self.plan = None, None
        if writer is None or plan is None:
            return None
        if not sum(self.counts.values()):
            writer.abort()
            shutil.rmtree(self.folder / plan.name, ignore_errors=True)
            return None
        try:
            writer.close()
            self.done.append(plan)
            self._describe()
        except (OSError, sqlite3.OperationalError) as error:
            raise DiskFull(f"recording {plan.name}: cannot be completed: {error}; free the disk") from error
        return plan

    def _describe(self) -> None:
        self.write_yaml("rig.yaml", rig_document(self.rig))
        self.write_yaml(
            "session.yaml", {"rig": "rig.yaml", "recordings": [plan.entry() for plan in self.done]}
        )

    def write_yaml(self, name: str, document: dict[str, object]) -> Path:
        """A YAML file of the folder, replaced at once or not at all."""
        yaml = YAML(typ="safe", pure=True)
        yaml.default_flow_style = None
        yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
        aside = self.folder / f".{name}.part"
        with aside.open("w", encoding="utf-8") as stream:
            yaml.dump(document, stream)
        os.replace(aside, self.folder / name)
        return self.folder / name
