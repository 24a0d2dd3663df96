"""How fast a bag is read, beside rosbags' own deserialization of the same bag.

Makes a bag of 7 topics at 1 kHz in a temporary folder, reads it both ways in processes of their own, and
prints seconds, messages per second, peak memory and the ratio:

    python bench/read_bag.py [--seconds 250] [--storage mcap sqlite3] [--compression none]
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from rig_identification.recording import Recording, Series, Session
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.session import read_session, write_session

RATE = 1000.0  # Hz
TOPICS = 7  # four cables, exciter, imu, inclinometer
CORNERS = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [2.0, 3.0, 0.0]])


def make_session(seconds: float, rng: np.random.Generator) -> Session:
    """Noise in every channel: the numbers do not matter, their amount does."""
    time_s = np.arange(round(seconds * RATE)) / RATE

    def series(width: int) -> Series:
        return Series(time_s, rng.normal(size=(len(time_s), width)))

    cables = tuple(Cable(f"cable_{i + 1}", 1.5 * point, point, 2.5) for i, point in enumerate(CORNERS))
    mount = Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    rig = Rig(gravity=9.80665, cables=cables, imu=mount, inclinometer=mount, exciter=mount)
    recording = Recording(
        name="run",
        kind="dynamic",
        holdout=False,
        start_ns=1_700_000_000_000_000_000,
        duration=float(time_s[-1]),
        tension={cable.name: series(1) for cable in cables},
        exciter_force=series(3),
        imu=series(6),
        inclination=series(2),
    )
    return Session(name="bench", rig=rig, recordings=(recording,))


def read_ours(folder: Path) -> int:
    """The whole way: bag to checked series."""
    session = read_session(folder)
    return sum(account.count for account in session.recordings[0].quality)


def read_rosbags(folder: Path) -> int:
    """rosbags alone: every message deserialized, nothing done with it."""
    from rosbags.highlevel import AnyReader

    count = 0
    with AnyReader([folder / "run"]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            count += 1
    return count


READERS = {"ours": read_ours, "rosbags": read_rosbags}


def child(*arguments: str) -> str:
    """Run this file in a process of its own, so that peak memory is its own; its output."""
    command = [sys.executable, __file__, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def report_one(reader: str, folder: Path) -> None:
    """What the child that reads prints."""
    wall, cpu = time.perf_counter(), time.process_time()
    count = READERS[reader](folder)
    figures = {
        "count": count,
        "wall": time.perf_counter() - wall,
        "cpu": time.process_time() - cpu,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    }
    print(json.dumps(figures))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=250.0)
    parser.add_argument("--storage", nargs="+", default=["sqlite3", "mcap"])
    parser.add_argument("--compression", default="none")
    parser.add_argument("--child", choices=["write", *READERS], help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child == "write":
        session = make_session(options.seconds, np.random.default_rng(1))
        write_session(session, options.folder, storage=options.storage[0], compression=options.compression)
        return
    if options.child:
        report_one(options.child, options.folder)
        return
    print(f"{options.seconds:g} s, {TOPICS} topics at {RATE:g} Hz, compression {options.compression}")
    print(f"{'storage':<9}{'reader':<9}{'messages':>9}{'wall s':>8}{'cpu s':>8}{'k/s cpu':>9}{'peak MB':>9}")
    for storage in options.storage:
        with tempfile.TemporaryDirectory() as scratch:
            place = ("--folder", str(Path(scratch) / "session"))
            bag = (
                "--seconds",
                str(options.seconds),
                "--storage",
                storage,
                "--compression",
                options.compression,
            )
            child("--child", "write", *place, *bag)
            figures = {reader: json.loads(child("--child", reader, *place)) for reader in READERS}
        for reader, figure in figures.items():
            speed = figure["count"] / figure["cpu"] / 1e3
            print(
                f"{storage:<9}{reader:<9}{figure['count']:>9}{figure['wall']:>8.2f}{figure['cpu']:>8.2f}"
                f"{speed:>9.0f}{figure['peak_mb']:>9.0f}"
            )
        print(f"{storage:<9}ratio    {figures['rosbags']['cpu'] / figures['ours']['cpu']:>9.1f}")


if __name__ == "__main__":
    main()
