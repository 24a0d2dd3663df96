"""The path of docs/how-to/import.md, word for word: from a logger's CSV of a bifilar pendulum to its Jzz."""

from __future__ import annotations

import json
import re
import shlex
import time
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


def bar(duration: float, seed: int) -> ri.Simulated:
    """The bar of the page on its two strings, not quite as described, under motion capture alone."""
    ends = {"left": np.zeros(3), "right": np.array([0.8, 0.0, 0.0])}
    rig = Rig(
        gravity=9.80665,
        cables=tuple(Cable(name, end + np.array([0.0, 0.0, 1.5]), end, 1.5) for name, end in ends.items()),
        mass=12.0,
        mass_std=0.005,
        mocap=Mount(np.array([0.4, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])),
        noise={"mocap_position": 0.0003, "mocap_orientation": 0.001},
    )
    return ri.simulate(
        rig, body=BODY, duration=duration, rest=0.0, mocap=60.0, without=["tension"], seed=seed
    )


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
