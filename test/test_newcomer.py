"""The path of docs/how-to/import.md, word for word: from a logger's CSV of a bifilar pendulum to its Jzz."""

from __future__ import annotations

import io
import json
import re
import shlex
import time
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rig_identification as ri
from rig_identification.cli.main import main
from rig_identification.rig import Cable, Mount, Rig

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "import.md"
HEADS = "time (s),x (mm),y (mm),z (mm),roll (deg),pitch (deg),yaw (deg)"
BODY = [12.0, 0.4, 0.0, -0.05, 0.09, 0.0, 0.0, 1.1, 0.0, 1.15]
SECONDS = 60.0
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


def bar(duration: float, seed: int) -> ri.Simulated:
    """The bar of the page on its two strings, not quite as described, under motion capture alone."""
    ends = {"left": np.zeros(3), "right": np.array([0.8, 0.0, 0.0])}
    rig = Rig(
        gravity=9.80665,
        cables=tuple(Cable(name, end + np.array([0.0, 0.0, 1.5]), end, 1.5) for name, end in ends.items()),
        mass=12.0,
        mass_std=0.005,
        mocap=Mount(np.array([0.4, 0.0, 0.0]), LEVEL),
        noise={"mocap_position": 0.0003, "mocap_orientation": 0.001},
    )
    return ri.simulate(
        rig, body=BODY, duration=duration, rest=0.0, mocap=60.0, without=["tension"], seed=seed
    )


def export_of_a_phone(made: ri.Simulated, folder: Path) -> list[str]:
    """phyphox' export of each recording: gyroscope and accelerometer sampled each at its own times."""
    names = []
    for recording in made.session.recordings:
        assert recording.imu is not None
        time, rate, force = recording.imu.time, recording.imu.values[:, :3], recording.imu.values[:, 3:]
        later = time[:-1] + 0.46 * np.diff(time)
        felt = np.column_stack([np.interp(later, time, column) for column in force.T])
        names.append(str(folder / f"{recording.name}.zip"))
        with zipfile.ZipFile(names[-1], "w") as archive:
            for name, unit, at, values in (
                ("Gyroscope", "rad/s", time, rate),
                ("Accelerometer", "m/s^2", later, felt),
            ):
                text = io.StringIO()
                word = "Gyroscope" if name == "Gyroscope" else "Acceleration"
                heads = ",".join(f'"{h}"' for h in ("Time (s)", *(f"{word} {a} ({unit})" for a in "xyz")))
                table = np.column_stack([at, values])
                np.savetxt(text, table, "%.9E", ",", header=heads, comments="")
                archive.writestr(f"{name}.csv", text.getvalue())
    return names


def write_csv(made: ri.Simulated, folder: Path) -> None:
    """What a camera's program would export: mm and degrees."""
    for recording in made.session.recordings:
        assert recording.mocap is not None
        pose = recording.mocap.values
        turns = Rotation.from_quat(pose[:, 3:]).as_euler("ZYX", degrees=True)[:, ::-1]
        table = np.column_stack([recording.mocap.time, 1e3 * pose[:, :3], turns])
        np.savetxt(folder / f"{recording.name}.csv", table, "%.6f", ",", header=HEADS, comments="")


def test_from_csv_to_the_moment_of_inertia(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert HEADS in page
    (block,) = re.findall(r"^```console\n(.*?--out answer)\n```$", page, re.DOTALL | re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    made = bar(10.0, seed=3)
    write_csv(made, tmp_path)
    ri.identify(bar(2.0, seed=1), work=1.0)  # compiled before the time is taken
    began = time.process_time()
    for line in block.splitlines():
        program, *arguments = shlex.split(line.removeprefix("$ "))
        assert program == "rig-identification"
        assert main(arguments) == 0, line
    assert time.process_time() - began < SECONDS
    result = json.loads((tmp_path / "answer" / "result.json").read_text())
    assert result["mismatch"]["verdict"] == "none"
    value, std = (result["inertia"][key][2][2] for key in ("value", "std"))
    assert abs(value - made.values[9]) < 3.0 * std
    assert std < 0.1 * made.values[9]  # it says something
    assert (tmp_path / "answer" / "report.html").stat().st_size > 0


def test_a_phone_on_the_bar_is_a_sound_session(tmp_path: Path) -> None:
    """Samples of an IMU that hold one half each are read, used, and found without fault."""
    rig = replace(bar(2.0, 1).spec.rig, imu=Mount(np.array([0.4, 0.0, 0.0]), LEVEL), mocap=None)
    rig = replace(rig, noise={"angular_rate": 0.001, "specific_force": 0.02})
    made = ri.simulate(rig, body=BODY, duration=6.0, rest=4.0, without=["tension"], seed=2)
    files = export_of_a_phone(made, tmp_path)
    out = tmp_path / "session"
    assert main(["import", *files, "--yes", "--out", str(out)]) == 0
    cables = [
        "--cable",
        "left",
        *["0", "0", "1.5", "0", "0", "0", "1.5"],
        "--cable",
        "right",
        *["0.8", "0", "1.5", "0.8", "0", "0", "1.5"],
    ]
    assert main(["init", str(out), "--yes", "--mass", "12", "--at", "imu", "0.4", "0", "0", *cables]) == 0
    found = ri.check(out)
    assert found.sound, found.examination.faults
    assert all(topic.used for topic in found.examination.topics)
    kinds = {r.name: r.kind for r in found.recorded.raw.recordings}
    assert kinds == {r.name: r.kind for r in made.session.recordings}
