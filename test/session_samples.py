"""Small sessions that the tests of reading and writing start from."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from ruamel.yaml import YAML

from rig_identification.recording import Dummy, Recording, Series, Session
from rig_identification.rig import Cable, CarryingFrame, Mount, Rig
from rig_identification.session import write_session
from rig_identification.session.messages import TYPESTORE

START_NS = 1_793_243_600_901_000_001
TURNED = np.array([0.0, 0.0, np.sin(0.3), np.cos(0.3)])
CABLES = ("cable_1", "cable_2", "cable_3")


def make_rig() -> Rig:
    """Three cables and every device."""
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.01], [0.0, 3.0, -0.02]])
    return Rig(
        gravity=9.80665,
        cables=tuple(
            Cable(name, 1.2 * corner, corner, 2.5 + 0.01 * i, ("ceiling", "body")[i % 2])
            for i, (name, corner) in enumerate(zip(CABLES, corners, strict=True))
        ),
        mass=1240.0,
        mass_std=0.5,
        frame=CarryingFrame(168.0, np.array([1.9, 1.0, 0.9]), np.diag([90.0, 210.0, 260.0])),
        imu=Mount(np.array([1.0, 1.2, 0.4]), TURNED),
        inclinometer=Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])),
        exciter=Mount(np.array([0.0, 0.0, 0.1]), TURNED),
        mocap=Mount(np.array([0.1, 0.0, 0.0]), TURNED),
        noise={"tension": 2.0, "angular_rate": 1e-05},
    )


def make_recording(
    kind: str = "dynamic",
    *,
    seconds: float = 2.0,
    seed: int = 1,
    amplitude: float | None = None,
    **changes: Any,
) -> Recording:
    """Every channel at a rate of its own: a swing of ``amplitude`` rad, or rest, with noise."""
    rng = np.random.default_rng(seed)
    if amplitude is None:
        amplitude = 0.05 if kind == "dynamic" else 0.0

    def series(rate: float, width: int, mean: float, scale: float, noise: float) -> Series:
        time = np.arange(round(seconds * rate) + 1) / rate
        swing = scale * amplitude * np.sin(2.0 * np.pi * 0.7 * time)
        return Series(time, mean + swing[:, None] + noise * rng.normal(size=(len(time), width)))

    rates = series(200.0, 3, 0.0, 4.4, 3e-4)
    forces = series(200.0, 3, 5.7, 9.8, 1e-2)
    positions = series(100.0, 3, 0.5, 2.5, 3e-4)
    turns = np.array(series(100.0, 4, 0.0, 0.5, 1e-5).values)
    turns[:, 3] = 1.0
    pose = np.hstack((positions.values, turns / np.linalg.norm(turns, axis=1, keepdims=True)))
    recording = Recording(
        name=f"{kind}_{seed}",
        kind=kind,
        holdout=False,
        start_ns=START_NS,
        duration=seconds,
        tension={cable: series(500.0, 1, 4000.0, 12000.0, 2.0) for cable in CABLES},
        exciter_force=series(500.0, 3, 0.0, 1000.0, 0.5),
        exciter_shaft=series(100.0, 2, 1.0, 1.0, 1e-3),
        imu=Series(rates.time, np.hstack((rates.values, forces.values))),
        inclination=series(50.0, 2, 0.01, 1.0, 3e-4),
        mocap=Series(positions.time, pose),
        ground_truth=Series(positions.time, np.hstack((pose, series(100.0, 6, 0.0, 1.0, 1e-3).values))),
    )
    return dataclasses.replace(recording, **changes)


def make_session() -> Session:
    """A static recording with a dummy, a run and a held-out run."""
    dummy = Dummy(50.0, np.array([0.3, 0.2, 0.1]))
    recordings = (
        make_recording("static", seed=1, dummy=dummy),
        make_recording("dynamic", seed=2),
        make_recording("dynamic", seed=3, holdout=True),
    )
    return Session(name="sample", rig=make_rig(), recordings=recordings)


def write_single(recording: Recording, folder: Path, **options: Any) -> Path:
    """A session of one recording, written to ``folder``."""
    return write_session(Session("single", make_rig(), (recording,)), folder, **options)


def edit_yaml(file: Path, edit: Any) -> None:
    """Load ``file``, let ``edit`` change the document in place, and save it."""
    yaml = YAML(typ="safe", pure=True)
    document = yaml.load(file.read_text())
    edit(document)
    with file.open("w") as stream:
        yaml.dump(document, stream)


def rewrite(bag: Path, edit: Callable[[str, int, Any], Any]) -> None:
    """Pass every message of ``bag`` through ``edit(topic, index, message)``; None drops it."""
    original = bag.with_name("original")
    shutil.move(bag, original)
    counts: dict[str, int] = {}
    with AnyReader([original]) as reader, Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        kinds = {item.topic: item.msgtype for item in reader.connections}
        to = {topic: writer.add_connection(topic, kind, typestore=TYPESTORE) for topic, kind in kinds.items()}
        for connection, received, data in reader.messages():
            index = counts[connection.topic] = counts.get(connection.topic, -1) + 1
            message = TYPESTORE.deserialize_cdr(data, connection.msgtype)
            message = edit(connection.topic, index, message)
            if message is not None:
                data = TYPESTORE.serialize_cdr(message, connection.msgtype)
                writer.write(to[connection.topic], received, data)
    shutil.rmtree(original)


def shift_stamp(message: Any, shift_ns: int) -> Any:
    """``message`` with its stamp moved by ``shift_ns``."""
    stamp = message.header.stamp
    seconds, nanoseconds = divmod(stamp.sec * 1_000_000_000 + stamp.nanosec + shift_ns, 1_000_000_000)
    return stamped(message, seconds, nanoseconds)


def stamped(message: Any, seconds: int, nanoseconds: int) -> Any:
    """``message`` with another stamp."""
    stamp = dataclasses.replace(message.header.stamp, sec=seconds, nanosec=nanoseconds)
    return dataclasses.replace(message, header=dataclasses.replace(message.header, stamp=stamp))
