"""``simulate`` and ``demo`` as a person at the keyboard meets them."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig_identification.cli.main import main
from rig_identification.session import read_session

CONFIG = Path(__file__).parents[1] / "config"
PLATE = ["42", "0.3", "0.18", "-0.12", "1.9", "0.03", "-0.05", "2.4", "0.02", "3.6"]
NO_BODY = ["1", "0", "0", "0", "1", "0", "0", "1", "0", "9"]
BAR = ["12", "0.4", "0", "-0.05", "0.09", "0", "0", "1.1", "0", "1.15"]


def _farthest(result: dict[str, Any], truth: dict[str, Any]) -> float:
    """Largest error of the ten numbers, in standard deviations."""
    keys = ("mass", "center_of_mass", "inertia")
    off = [np.abs(np.subtract(result[k]["value"], truth[k])) / result[k]["std"] for k in keys]
    return float(max(np.max(part) for part in off))


def simulate(out: Path, *arguments: str) -> int:
    return main(["simulate", "--out", str(out), "--duration", "2", "--rest", "1", *arguments])


def test_demo_makes_a_session_identifies_it_and_names_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "--out", str(out), "--duration", "10"]) == 0
    beside, last = capsys.readouterr().out.strip().splitlines()[-2:]
    assert last == f"report: {out / 'report.html'}"
    assert "<html" in (out / "report.html").read_text(encoding="utf-8")[:500]
    result = json.loads((out / "result.json").read_text())
    truth = json.loads((out / "session" / "truth.json").read_text())
    assert abs(result["mass"]["value"] - truth["mass"]) < 4.0 * result["mass"]["std"]
    off = np.subtract(result["inertia"]["value"], truth["inertia"]) / result["inertia"]["std"]
    assert np.max(np.abs(off)) < 4.0
    told = re.search(r"truth: 10 numbers within ([\d.]+) σ", beside)
    assert told is not None
    assert float(told[1]) == pytest.approx(_farthest(result, truth), abs=0.051)
    session = read_session(out / "session")
    assert [r.holdout for r in session.recordings] == [False, False, False, True]


def test_demo_leaves_a_folder_of_another_kind_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "session").mkdir()
    (tmp_path / "session" / "notes.txt").write_text("mine")
    assert main(["demo", "--out", str(tmp_path)]) == 2
    assert "is no session" in capsys.readouterr().err
    assert [p.name for p in (tmp_path / "session").iterdir()] == ["notes.txt"]


def test_simulate_writes_a_session_with_its_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "car"
    options = ("--start", "pulled", "--shake", "0.05", "0.7", "--storage", "sqlite3", "--compression", "file")
    assert simulate(out, "--case", "14", "--seed", "3", *options) == 0
    *modes, last = capsys.readouterr().out.splitlines()
    assert last == f"session: {out}"
    # A simulator of other make swings at 0.95 and 1.33 Hz
    frequencies = [float(line.removeprefix("swings at ").split(" Hz")[0]) for line in modes]
    assert frequencies == pytest.approx([0.95, 1.33], abs=0.005)
    session = read_session(out)
    assert [r.kind for r in session.recordings] == ["static", "static", "dynamic", "dynamic"]
    assert session.recordings[2].exciter_shaft is not None
    truth = json.loads((out / "truth.json").read_text())
    assert truth["inertia"][1][2] == 70.0
    length = truth["parameters"]["cable_1.length"]
    assert 0.0 < abs(length["value"] - length["described"]) < 0.0015


def test_the_motor_pulls_with_its_mass_radius_and_speed(tmp_path: Path) -> None:
    out = tmp_path / "shaken"
    options = (
        "--start",
        "rest",
        "--motor",
        "12",
        "0.25",
        "0.9",
        "--plane",
        "xz",
        "--no-noise",
        "--no-doubts",
    )
    assert simulate(out, "--case", "1", *options) == 0
    force = read_session(out).training[0].exciter_force
    assert force is not None
    full = force.values[force.time > 3.5]
    np.testing.assert_allclose(np.linalg.norm(full, axis=1), 12 * 0.25 * (2.0 * np.pi * 0.9) ** 2, rtol=1e-3)
    np.testing.assert_allclose(full[:, 1], 0.0, atol=1e-9)


def test_simulate_on_a_described_rig_with_motion_capture_alone(tmp_path: Path) -> None:
    out = tmp_path / "bifilar"
    options = ("--mocap", "60", "--without", "tension", "--no-noise", "--no-doubts")
    assert simulate(out, "--rig", str(CONFIG / "bifilar.yaml"), "--body", *BAR, *options) == 0
    run = read_session(out).training[0]
    assert run.mocap is not None
    assert run.imu is None
    assert not run.tension


def test_a_slack_cable_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Case 14 starts from where its rods push: cables let go."""
    assert simulate(tmp_path / "slack", "--case", "14", "--duration", "8") == 0
    assert "a cable goes slack in run_1" in capsys.readouterr().out
    assert simulate(tmp_path / "rods", "--case", "14", "--duration", "8", "--rods") == 0
    assert "a cable is pushed in run_1" in capsys.readouterr().out


def test_simulate_overwrites_when_told_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert simulate(tmp_path / "s", "--case", "10", "--start", "rest") == 0
    assert simulate(tmp_path / "s", "--case", "10", "--start", "rest") == 2
    assert "exists already" in capsys.readouterr().err
    assert simulate(tmp_path / "s", "--case", "10", "--start", "rest", "--overwrite") == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--case", "19"], "case study 19"),
        (["--case", "14e"], "--case 14e: is no case study"),
        (["--case", "14", "--body", *PLATE], "a case study has its own body"),
        (["--rig", str(CONFIG / "trifilar.yaml")], "--body: missing"),
        (
            ["--rig", str(CONFIG / "trifilar.yaml"), "--body", *NO_BODY],
            "no body has",
        ),
        (["--rig", str(CONFIG / "bifilar.yaml"), "--body", *BAR], "noise.tension: missing"),
        (["--rig", "absent.yaml", "--body", *PLATE], "absent.yaml"),
        (["--case", "14", "--shake", "0", "1"], "--shake 0 1"),
        (["--case", "14", "--motor", "12", "0", "1"], "--motor 12 0 1"),
        (["--case", "14", "--seed", "-1"], "--seed -1"),
        (["--case", "14", "--duration", "0.5"], "--duration 0.5"),
        (["--case", "14", "--mocap", "nan"], "--mocap nan"),
    ],
)
def test_what_cannot_be_simulated_has_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], says: str
) -> None:
    assert simulate(tmp_path / "s", *arguments) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1
    assert not (tmp_path / "s").exists()


def test_modes_of_a_case_and_of_what_was_identified(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["modes", "--case", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(" (")[0] for line in lines] == [
        "swings at 0.369 Hz: pitch with sway along x",
        "swings at 0.402 Hz: sway along y with roll",
    ]
    rig = str(CONFIG / "trifilar.yaml")
    assert main(["modes", "--rig", rig, "--body", *PLATE]) == 0
    plate = capsys.readouterr().out
    assert plate.count("Hz") == 3
    m, cx, cy, cz, xx, xy, xz, yy, yz, zz = map(float, PLATE)
    values = {
        "mass": m,
        "center_of_mass": [cx, cy, cz],
        "inertia": [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
    }
    result = tmp_path / "result.json"
    result.write_text(json.dumps({name: {"value": value} for name, value in values.items()}))
    assert main(["modes", "--rig", rig, "--result", str(result)]) == 0
    assert capsys.readouterr().out == plate
    values["inertia"][2][2] = None
    result.write_text(json.dumps({name: {"value": value} for name, value in values.items()}))
    assert main(["modes", "--rig", rig, "--result", str(result)]) == 2
    assert "Jzz not determined" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--case", "x"], "is no case study"),
        (["--case", "1", "--body", *BAR], "has its own body"),
        (["--rig", "RIG"], "says nothing of the inertia"),
        (["--rig", "RIG", "--body", *NO_BODY], "no body has this mass and inertia"),
        (["--rig", "RIG", "--result", "nowhere.json"], "No such file"),
    ],
)
def test_modes_of_nothing_are_refused_in_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = str(CONFIG / "trifilar.yaml")
    assert main(["modes", *(rig if a == "RIG" else a for a in arguments)]) == 2
    error = capsys.readouterr().err.strip()
    assert message in error
    assert "\n" not in error
