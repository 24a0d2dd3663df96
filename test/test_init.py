"""``import`` and ``init`` as a newcomer meets them: from a logger's files to descriptions."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from session_samples import make_session

from rig_identification.cli.main import main
from rig_identification.rig import DEFAULT_TOLERANCE
from rig_identification.session import read_rig, write_session
from rig_identification.session.bag import read_bag
from rig_identification.session.channel import raw_channel
from rig_identification.session.session_description import read_session_description
from rig_identification.topics import expected_topics

CABLES = [
    *("--cable", "left", "-250", "0", "2000", "-250", "0", "100", "1900"),
    *("--cable", "right", "250", "0", "2000", "250", "0", "100", "1900"),
]
TIME = np.arange(400) * 0.005


def log(folder: Path, name: str, swing: float) -> Path:
    """A CSV of a gyroscope and an accelerometer; ``swing``: rad/s."""
    folder.mkdir(exist_ok=True)
    rate = np.degrees(swing * np.sin(6.0 * TIME)) + 0.01 * np.cos(40.0 * TIME)
    lines = [f"{t:.3f},{w:.6f},0.001,0.002,0.999" for t, w in zip(TIME, rate, strict=True)]
    (folder / f"{name}.csv").write_text("\n".join(["t,gyro_z (deg/s),ax (g),ay (g),az (g)", *lines]))
    return folder / f"{name}.csv"


def answers(monkeypatch: pytest.MonkeyPatch, *given: str) -> Iterator[str]:
    """A person at a terminal who answers so, in this order."""
    left = iter(given)
    monkeypatch.setattr("builtins.input", lambda _: next(left))
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    return left


def test_from_csv_to_both_descriptions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(log(tmp_path, name, 0.5)) for name in ("run_1", "run_2")]
    folder = tmp_path / "session"
    assert main(["import", *files, "--yes", "--out", str(folder)]) == 0
    assert f"next: rig-identification init {folder}" in capsys.readouterr().out
    options = ["--unit", "mm", "--mass", "1.4", "--at", "imu", "10", "0", "-50"]
    assert main(["init", str(folder), "--yes", *options, *CABLES]) == 0
    told = capsys.readouterr().out
    assert "/rig/imu/data_raw" in told
    assert "note: imu: taken to be level" in told
    rig = read_rig(folder / "rig.yaml")
    assert [cable.name for cable in rig.cables] == ["left", "right"]
    assert rig.cables[0].ceiling_point.tolist() == [-0.25, 0.0, 2.0]
    assert rig.cables[1].length == 1.9
    assert rig.mass == 1.4
    assert rig.imu is not None
    assert rig.imu.position.tolist() == [0.01, 0.0, -0.05]
    assert rig.exciter is None
    assert rig.tolerance == DEFAULT_TOLERANCE
    entries = read_session_description(folder).entries
    assert [(e.name, e.kind, e.holdout) for e in entries] == [
        ("run_1", "dynamic", False),
        ("run_2", "dynamic", True),
    ]


def test_files_bear_the_line_that_editors_read(tmp_path: Path) -> None:
    log(tmp_path / "session", "run_1", 0.5)
    assert main(["init", str(tmp_path / "session"), "--yes", "--unit", "mm", *CABLES]) == 0
    for name in ("rig", "session"):
        first = (tmp_path / "session" / f"{name}.yaml").read_text(encoding="utf-8").splitlines()[0]
        key, _, schema = first.partition("$schema=")
        assert key == "# yaml-language-server: "
        assert json.loads((tmp_path / "session" / schema).read_text())["$schema"].startswith(
            "http://json-schema"
        )


def test_what_is_commented_out_is_right_when_it_is_not(tmp_path: Path) -> None:
    """A person takes the sign away in front of a key: the description is still read."""
    folder = tmp_path / "session"
    log(folder, "run_1", 0.5)
    assert main(["init", str(folder), "--yes", "--unit", "mm", *CABLES]) == 0
    lines = (folder / "rig.yaml").read_text(encoding="utf-8").splitlines()
    whole = "\n".join([*lines[:3], *(line.replace("    # ", "    ", 1) for line in lines[3:])])
    (folder / "rig.yaml").write_text(whole.replace("    #   ", "      "), encoding="utf-8")
    rig = read_rig(folder / "rig.yaml")
    assert rig.mass == 10.0
    assert rig.exciter is not None
    assert rig.mocap is not None
    assert rig.noise == {"angular_rate": 0.0003}
    assert rig.tolerance == DEFAULT_TOLERANCE


def test_a_person_is_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "session"
    log(folder, "run_1", 0.5)
    left = answers(
        monkeypatch, "y", "cm", "mm", "", "1,4", "1.4", "", "2", "-250 0 2000", "-250, 0, 100", "1900",
        "250 0 2", "250 0", "250 0 100", "1900", "",
    )  # fmt: skip
    assert main(["init", str(folder)]) == 0
    assert next(left, None) is None
    rig = read_rig(folder / "rig.yaml")
    assert (rig.gravity, rig.mass, rig.mass_std) == (9.80665, 1.4, None)
    assert [cable.name for cable in rig.cables] == ["cable_1", "cable_2"]
    assert rig.cables[1].ceiling_point.tolist() == [0.25, 0.0, 0.002]
    assert "give three numbers" in capsys.readouterr().out


def test_who_does_not_confirm_a_guess_gets_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = log(tmp_path, "run_1", 0.5)
    answers(monkeypatch, "n")
    assert main(["import", str(file), "--out", str(tmp_path / "session")]) == 2
    assert "is: imu.angular_rate.z" in capsys.readouterr().out
    assert not (tmp_path / "session").exists()


def test_bags_of_every_device_are_described(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "session"
    write_session(make_session(), folder)
    for name in ("rig.yaml", "session.yaml"):
        (folder / name).unlink()
    corners = {"cable_1": (0, 0), "cable_2": (4, 0), "cable_3": (4, 2), "cable_4": (0, 2)}
    cables = [
        part
        for name, (x, y) in corners.items()
        for part in ("--cable", name, *map(str, (x, y, 4, x, y, 1.5, 2.5)))
    ]
    assert main(["init", str(folder), "--yes", *cables]) == 0
    rig = read_rig(folder / "rig.yaml")
    assert rig.imu is not None
    assert rig.inclinometer is not None
    assert rig.exciter is not None
    assert rig.mocap is None  # it is estimated
    assert "/rig/ground_truth/odometry" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ([], "--cable: missing; no bag says where"),
        (["--cable", "left", *["0"] * 6, "many"], "--cable left: 0 0 0 0 0 0 many: give numbers"),
        (["--unit", "m", *CABLES], "beyond 100 m; is it in mm"),
        ([*CABLES[:9]], "cables: 1 cable"),
        (["--unit", "mm", *CABLES, "--at", "clock", "0", "0", "0"], "--at clock: is no device"),
    ],
)
def test_an_answer_that_makes_no_rig_leaves_the_folder_as_it_was(
    arguments: list[str], word: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "session"
    assert main(["import", str(log(tmp_path, "run_1", 0.5)), "--yes", "--out", str(folder)]) == 0
    before = sorted(p.name for p in folder.iterdir())
    assert main(["init", str(folder), "--yes", *arguments]) == 2
    error = capsys.readouterr().err
    assert word in error
    assert error.count("\n") == 1
    assert ".init-" not in error
    assert sorted(p.name for p in folder.iterdir()) == before


def test_nothing_of_a_persons_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "session"
    file = str(log(tmp_path, "run_1", 0.5))
    assert main(["import", file, "--yes", "--out", str(folder)]) == 0
    assert main(["import", file, "--yes", "--out", str(folder)]) == 2
    assert "run_1: exists already" in capsys.readouterr().err
    assert main(["import", file, "--yes", "--overwrite", "--out", str(folder)]) == 0
    (folder / "rig.yaml").write_text("mine")
    assert main(["init", str(folder), "--yes", "--unit", "mm", *CABLES]) == 2
    assert "rig.yaml: exists already" in capsys.readouterr().err
    assert (folder / "rig.yaml").read_text() == "mine"
    assert main(["init", str(folder), "--yes", "--overwrite", "--unit", "mm", *CABLES]) == 0


@pytest.mark.parametrize("make", [lambda p: p / "gone", lambda p: p])
def test_a_folder_without_anything_is_refused(
    make: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", str(make(tmp_path)), "--yes", *CABLES]) == 2  # type: ignore[operator]
    assert capsys.readouterr().err.count("\n") == 1


def test_the_guess_goes_to_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = log(tmp_path, "run_1", 0.5)
    assert main(["import", str(file)]) == 0
    (tmp_path / "columns.yaml").write_text(capsys.readouterr().out.replace("deg/s}", "rad/s}"))
    out = tmp_path / "session"
    assert main(["import", str(file), "--columns", str(tmp_path / "columns.yaml"), "--out", str(out)]) == 0
    bag = read_bag(out / "run_1", ("/rig/imu/data_raw",))
    assert bag.counts == {"/rig/imu/data_raw": 400}
    topic = expected_topics(())["/rig/imu/data_raw"]
    values = raw_channel(bag.topics["/rig/imu/data_raw"], topic, "run_1").values
    assert np.max(values[:, 2]) == pytest.approx(np.degrees(0.5), rel=1e-3)
    assert np.isnan(values[:, :2]).all()
