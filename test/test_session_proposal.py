"""What is no session given as one: a line that says what it is, and a proposal where bags are there."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from session_samples import make_recording, make_rig, make_session, write_single

from rig_identification.cli.main import main
from rig_identification.errors import InputError, MissingDescription
from rig_identification.recording import Session
from rig_identification.session import read_raw, read_session, write_session
from rig_identification.session.messages import TYPESTORE
from rig_identification.session.session_description import read_session_description


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_session(make_session(), tmp_path_factory.mktemp("sample") / "session")


@pytest.fixture
def folder(sample: Path, tmp_path: Path) -> Path:
    """A session without its session.yaml."""
    copy = Path(shutil.copytree(sample, tmp_path / "bags"))
    (copy / "session.yaml").unlink()
    return copy


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_raw(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


def proposal(path: Path, **options: str) -> str:
    with pytest.raises(MissingDescription) as caught:
        read_raw(path, **options)
    return caught.value.proposal


# The proposal


def test_a_proposal_saved_is_a_session_that_reads(folder: Path) -> None:
    """At rest is static, moving is dynamic, and one of two runs is held out."""
    before = sorted(path.relative_to(folder) for path in folder.rglob("*"))
    text = proposal(folder)
    assert sorted(path.relative_to(folder) for path in folder.rglob("*")) == before
    (folder / "session.yaml").write_text(text)
    session = read_session(folder)
    assert {(r.name, r.kind, r.holdout) for r in session.recordings} == {
        ("static_1", "static", False),
        ("dynamic_2", "dynamic", False),
        ("dynamic_3", "dynamic", True),
    }
    assert repr(session.rig) == repr(make_rig())


def test_runs_are_told_apart_by_their_time_not_by_their_name(tmp_path: Path) -> None:
    later = make_recording("dynamic", seed=2, name="a")
    earlier = make_recording("dynamic", seed=3, name="b", start_ns=later.start_ns - 10**12)
    folder = write_session(Session("two", make_rig(), (later, earlier)), tmp_path / "two")
    (folder / "session.yaml").unlink()
    lines = [line for line in proposal(folder).splitlines() if "{bag: " in line]
    assert lines[0].startswith("  - {bag: b, kind: dynamic}")
    assert lines[1].startswith("  - {bag: a, kind: dynamic, holdout: true}")


def test_one_run_alone_is_not_held_out(tmp_path: Path) -> None:
    folder = write_single(make_recording("dynamic"), tmp_path / "one")
    (folder / "session.yaml").unlink()
    (folder / "session.yaml").write_text(proposal(folder))
    assert read_session(folder).training


@pytest.mark.parametrize("rig", ["missing", "broken", "two"])
def test_the_rig_is_found_among_the_files_or_asked_for(folder: Path, rig: str) -> None:
    """Rest is told from motion without a rig description too."""
    file = folder / "rig.yaml"
    if rig == "two":
        shutil.copy(file, folder / "another.yaml")
    elif rig == "broken":
        file.write_text(file.read_text().replace("gravity: 9.80665", "gravity: 9,80665"))
    else:
        file.unlink()
    text = proposal(folder)
    assert {
        "two": "rig: another.yaml  # or rig.yaml",
        "broken": "rig: rig.yaml  # to be mended: ",
        "missing": "rig: rig.yaml  # to be written",
    }[rig] in text
    assert text.count("kind: static}") == 1
    assert text.count("kind: dynamic") == 2


def test_files_and_folders_of_bags_with_any_name(folder: Path) -> None:
    """A bag that is a file, one below a folder, and names that YAML would read as something else."""
    shutil.move(folder / "dynamic_2" / "dynamic_2.mcap", folder / "first, best.mcap")
    shutil.rmtree(folder / "dynamic_2")
    (folder / "later").mkdir()
    shutil.move(folder / "dynamic_3", folder / "later" / "dynamic_3")
    shutil.move(folder / "static_1", folder / "1")
    (folder / "session.yaml").write_text(proposal(folder))
    assert {r.name for r in read_session(folder).recordings} == {"first, best.mcap", "later/dynamic_3", "1"}


def test_a_bag_that_cannot_be_used_is_proposed_as_a_comment(folder: Path) -> None:
    (folder / "dynamic_3" / "dynamic_3.mcap").write_bytes(b"")
    text = proposal(folder)
    (folder / "session.yaml").write_text(text)
    assert "# - {bag: dynamic_3, kind: dynamic}  # cannot be used: " in text
    assert len(read_session(folder).recordings) == 2


def test_topics_of_another_namespace(tmp_path: Path) -> None:
    folder = write_session(make_session(), tmp_path / "out", namespace="/lab")
    (folder / "session.yaml").unlink()
    (folder / "rig.yaml").unlink()
    assert "kind: static}" in proposal(folder, namespace="/lab")
    assert "did you mean --namespace /lab?" in proposal(folder)


@pytest.mark.parametrize("command", ["check", "identify"])
def test_the_proposal_goes_to_standard_output(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    assert main([command, str(folder), "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1
    assert f"{folder}: holds 3 bags but no session.yaml" in printed.err
    assert f"save it as {folder / 'session.yaml'}" in printed.err
    assert printed.out == proposal(folder)
    assert not (tmp_path / "out").exists()


# What else may be given


def test_a_bag_in_place_of_its_session(sample: Path) -> None:
    for path in (sample / "dynamic_2", sample / "dynamic_2" / "dynamic_2.mcap"):
        assert f"no session; give {sample}, whose session.yaml lists bags" in refusal(path)


def test_a_bag_without_a_session(folder: Path) -> None:
    assert "is one bag, no session; a session is a folder" in refusal(folder / "dynamic_2")
    said = refusal(folder / "dynamic_2" / "dynamic_2.mcap")
    assert said.startswith("is a bag's file (mcap), no session")
    assert f"give {folder} for a proposal" in said
    proposal(folder)  # what the line advises


@pytest.mark.parametrize("name", ["cut.mcap", "cut.db3", "cut.bag"])
def test_a_bag_that_is_empty(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"")
    assert refusal(tmp_path / name).startswith("is a bag's file (empty), no session")


@pytest.mark.parametrize("name", ["log.csv", "log.CSV", "log.txt", "log.xlsx", "log.mat", "log.npz"])
def test_a_table(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"time,force\n0.0,1.0\n")
    said = refusal(tmp_path / name)
    assert said.startswith("is a table")
    assert "rig-identification import" in said
    assert f"holds no bag but tables ({name}); make a session of it" in refusal(tmp_path)


def test_a_folder_of_nothing_and_a_file_of_nothing(tmp_path: Path) -> None:
    (tmp_path / "picture.png").write_bytes(b"\x89PNG")
    assert refusal(tmp_path / "picture.png").startswith("is no session.yaml; a session is a folder")
    assert refusal(tmp_path).startswith("holds neither a session.yaml nor a bag; a session is a folder")


def test_a_folder_of_sessions(sample: Path) -> None:
    assert refusal(sample.parent).startswith("holds sessions and is none; give one of them: session")


def test_a_session_of_another_name(folder: Path, sample: Path) -> None:
    shutil.copy(sample / "session.yaml", folder / "session.yml")
    assert f"give {folder / 'session.yml'}" in refusal(folder)
    assert read_session(folder / "session.yml").recordings
    assert "did you mean bags?" in refusal(folder.with_name("bgas"))


def test_the_wrong_file_of_a_session(sample: Path) -> None:
    assert "is a rig description, not a session" in refusal(sample / "rig.yaml")
    assert "is what a bag says of itself" in refusal(sample / "dynamic_2" / "metadata.yaml")


def test_a_description_that_is_asked_for_alone_says_the_same(folder: Path) -> None:
    """Nodes read it without the bags."""
    with pytest.raises(InputError, match=r"holds 3 bags but no session\.yaml"):
        read_session_description(folder)


# Topics asked for and not there


def test_a_topic_asked_for_and_in_no_bag(
    sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["identify", str(sample), "--out", str(tmp_path / "out"), "--topic"]
    assert main([*arguments, "imu/data_raw=/rig/imu/data_rw"]) == 2
    said = capsys.readouterr().err
    assert "--topic imu/data_raw=/rig/imu/data_rw: no bag holds /rig/imu/data_rw" in said
    assert "of type sensor_msgs/msg/Imu they hold /rig/imu/data_raw; did you mean /rig/imu/data_raw?" in said
    assert not (tmp_path / "out").exists()


def test_a_topic_of_a_type_that_no_bag_has(tmp_path: Path) -> None:
    folder = write_single(make_recording(mocap=None), tmp_path / "out")
    with pytest.raises(InputError, match="none holds a geometry_msgs/msg/PoseStamped"):
        read_raw(folder, topics={"mocap/pose": "/vicon/van"})


def test_a_topic_that_one_bag_of_two_holds_is_there(sample: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(sample, tmp_path / "session"))
    shutil.rmtree(folder / "dynamic_3")
    kind = "geometry_msgs/msg/Vector3Stamped"
    types, stamp = TYPESTORE.types, TYPESTORE.types["builtin_interfaces/msg/Time"]
    with Writer(folder / "dynamic_3", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        to = writer.add_connection("/tilt", kind, typestore=TYPESTORE)
        for k in range(200):
            header = types["std_msgs/msg/Header"](
                stamp=stamp(sec=1000, nanosec=k * 10**7 % 10**9), frame_id=""
            )
            header.stamp.sec += k // 100
            vector = types["geometry_msgs/msg/Vector3"](x=0.001 * k, y=0.0, z=0.0)
            data = TYPESTORE.serialize_cdr(types[kind](header=header, vector=vector), kind)
            writer.write(to, 10**12 + k * 10**7, data)
    raw = read_raw(folder, topics={"inclinometer/angles": "tilt"})
    channel = raw.recordings[2].channel("inclinometer")
    assert channel is not None
    np.testing.assert_allclose(channel.values[:, 0], 0.001 * np.arange(200))
    assert raw.recordings[1].channel("inclinometer") is None
