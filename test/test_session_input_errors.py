"""Every way to get a session wrong has its one clear line."""

from __future__ import annotations

import dataclasses
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from session_samples import CABLES, edit_yaml, make_recording, make_rig, make_session, write_single

from rig_identification.errors import InputError
from rig_identification.recording import Series
from rig_identification.rig import DEFAULT_TOLERANCE
from rig_identification.session import read_rig, read_session, write_session
from rig_identification.session.messages import TYPESTORE

Edit = Callable[[dict[str, Any]], object]


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_session(make_session(), tmp_path_factory.mktemp("sample") / "session")


@pytest.fixture
def folder(sample: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(sample, tmp_path / "session"))


def refusal(call: Callable[[], object]) -> str:
    """Message of the InputError that ``call`` raises; it must be one line."""
    with pytest.raises(InputError) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message
    assert message.strip() == message
    return message


def put(*path: str | int, value: object) -> Edit:
    """An edit that sets the value at ``path`` of the rig's parameters."""

    def edit(document: dict[str, Any]) -> None:
        place: Any = document["/**"]["ros__parameters"]
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value

    return edit


def drop(*path: str) -> Edit:
    def edit(document: dict[str, Any]) -> None:
        place = document["/**"]["ros__parameters"]
        for key in path[:-1]:
            place = place[key]
        del place[path[-1]]

    return edit


NAN, INF = float("nan"), float("inf")
COPY = {"ceiling_point": [0.0, 0.0, 0.0], "body_point": [0.0, 0.0, 0.0], "length": 2.5}
RIG_FAULTS = [
    (drop("gravity"), "gravity: missing"),
    (put("gravity", value=-9.81), r"gravity: -9.81 m/s\^2 must be above 0"),
    (put("gravity", value=9806.65), r"gravity: 9806.65 m/s\^2 is above 30"),
    (put("gravity", value="9.81"), "gravity: '9.81' is not a number"),
    (put("gravity", value=True), "gravity: True is not a number"),
    (put("mass", value=0.0), "mass: 0 kg must be above 0"),
    (put("mass", value=NAN), "mass: nan is not finite"),
    (put("mass", value=10**400), r"mass: 10+\.\.\.0+ is not finite"),
    (put("mass_std", value=0.0), "mass_std: 0 kg must be above 0"),
    (drop("cables"), "cables: missing"),
    (put("cables", value="cable_1"), "cables: 'cable_1' is not a list"),
    (put("cables", value=["cable_1"]), "cables: 1 cable"),
    (put("cables", value=[*CABLES, "cable_1"]), "cables: cable_1 is listed twice"),
    (put("cables", value=[*CABLES, "cable_9"]), "cables: cable_9 is listed but not described"),
    (put("cables", value=["cable_1", "cable_2"]), "cable_3: described but not listed"),
    (put("cables", value=[*CABLES, "imu"]), "cables: imu is the name of another part"),
    (put("cables", value=[*CABLES, "ground_truth"]), "cables: ground_truth is the name of another part"),
    (put("cable_1", value=[1, 2]), r"cable_1: \[1, 2\] is not a mapping"),
    (put("cable_1", "length", value=0.0), "cable_1.length: 0 m must be above 0"),
    (put("cable_1", "length", value=-2.5), "cable_1.length: -2.5 m must be above 0"),
    (put("cable_1", "length", value=2500.0), "cable_1.length: 2500 m is above 100 m; is it in mm"),
    (put("cable_1", "length", value=INF), "cable_1.length: inf is not finite"),
    (drop("cable_1", "length"), "cable_1.length: missing"),
    (drop("cable_2", "body_point"), "cable_2.body_point: missing"),
    (put("cable_2", "body_point", value=[1.0, 2.0]), "cable_2.body_point: has 2 numbers; give 3"),
    (put("cable_2", "body_point", value=1.0), "cable_2.body_point: 1.0 is not a list"),
    (put("cable_2", "body_point", 1, value=NAN), r"cable_2.body_point\[1\]: nan is not finite"),
    (put("cable_2", "body_point", 0, value="two"), r"cable_2.body_point\[0\]: 'two' is not a number"),
    (put("cable_2", "ceiling_point", 0, value=2400.0), r"cable_2.ceiling_point\[0\]: 2400 m .*in mm"),
    (put("cable_2", "ceiling_point", 0, value=24.0), "cable_2: no pose holds it and cable_1: hinges 24"),
    (put("cable_2", "load_cell", value="roof"), "cable_2.load_cell: 'roof' is unknown; give ceiling or body"),
    (put("cable_2", value=COPY), "cable_2: has the same hinge points as cable_1"),
    (drop("imu", "position"), "imu.position: missing"),
    (put("imu", "position", value=[1000.0, 0.0, 0.0]), r"imu.position\[0\]: 1000 m is beyond 100 m; .*mm"),
    (put("imu", "orientation", value=[0.0] * 4), "imu.orientation: norm 0 is not 1"),
    (put("imu", "orientation", value=[0.0, 0.0, 0.0, 1.01]), "imu.orientation: norm 1.01 is not 1"),
    (put("exciter", "orientation", value=[0.0] * 3), "exciter.orientation: has 3 numbers; give 4"),
    (drop("inclinometer", "orientation"), "inclinometer.orientation: missing"),
    (put("mocap", "position", value=[NAN, 0.0, 0.0]), r"mocap.position\[0\]: nan is not finite"),
    (put("frame", "mass", value=-1.0), "frame.mass: -1 kg must be above 0"),
    (put("frame", "mass", value=1300.0), "frame.mass: 1300 kg is not below 1240 kg"),
    (drop("frame", "center_of_mass"), "frame.center_of_mass: missing"),
    (put("frame", "inertia", 0, value=-90.0), "frame.inertia: principal moments -90, 210, 260"),
    (put("frame", "inertia", 5, value=600.0), "frame.inertia: .* the largest exceeds the sum"),
    (put("frame", "inertia", value=[9e7, 0.0, 0.0, 2e8, 0.0, 2.6e8]), r"frame.inertia: .*kg mm\^2"),
    (put("frame", "inertia", value=[90.0, 210.0, 260.0]), "frame.inertia: has 3 numbers; give 6"),
    (put("noise", "tensoin", value=2.0), "noise.tensoin: unknown key; known are tension, exciter_force"),
    (put("noise", "tension", value=0.0), "noise.tension: 0 SI must be above 0 .*estimated"),
    (put("tolerance", "cable_lenght", value=0.1), "tolerance.cable_lenght: unknown key; known are cable_l"),
    (put("tolerance", "clock", value=-0.1), "tolerance.clock: -0.1 SI must be at least 0"),
    (put("tolerance", value=3), "tolerance: 3 is not a mapping"),
    (put("gravity", value="9,81"), "gravity: '9,81' is not a number; did you mean 9.81?"),
    (put("gravity", value="\u22129.81"), "is not a number; did you mean -9.81?"),
    (put("mass", value="1,240.5"), "mass: '1,240.5' is not a number; did you mean 1240.5?"),
    (put("mass", value="1240 kg"), "'1240 kg' is not a number; did you mean 1240. give the number alone"),
    (put("cable_1", "length", value="2,5e0"), "cable_1.length: '2,5e0' is not a number; did you mean 2.5e0?"),
    (put("cable_2", "body_point", value=[1, 25, 0.5, 0.5]), "has 4 numbers; .*is a comma a decimal point"),
    (put("cable_2", "body_point", value="1.0, 2.0, 0.5"), r"write it in brackets: \[1.0, 2.0, 0.5\]"),
    (put("cable_2", "load_cell", value="cieling"), "give ceiling or body; did you mean ceiling?"),
    (put("cables", value=["cable_1", "cabel_2", "cable_3"]), "cabel_2 is listed but.*did you mean cable_2?"),
    (put("noise", "tensoin", value=2.0), "noise.tensoin: unknown key; .*; did you mean tension?"),
]  # fmt: skip


@pytest.mark.parametrize(("edit", "said"), RIG_FAULTS)
def test_faults_of_the_rig_description(folder: Path, edit: Edit, said: str) -> None:
    edit_yaml(folder / "rig.yaml", edit)
    message = refusal(lambda: read_session(folder))
    assert message.startswith(f"{folder / 'rig.yaml'}: ")
    assert re.search(said, message)


def test_a_misspelt_key_in_place_of_the_right_one(folder: Path) -> None:
    def rename(document: dict[str, Any]) -> None:
        parameters = document["/**"]["ros__parameters"]
        parameters["inclinometre"] = parameters.pop("inclinometer")

    edit_yaml(folder / "rig.yaml", rename)
    message = refusal(lambda: read_rig(folder / "rig.yaml"))
    assert message.endswith("inclinometre: unknown key; did you mean inclinometer?")


def test_a_key_in_capitals(folder: Path) -> None:
    """Otherwise the IMU would not be mounted, without a word."""

    def rename(document: dict[str, Any]) -> None:
        parameters = document["/**"]["ros__parameters"]
        parameters["IMU"] = parameters.pop("imu")

    edit_yaml(folder / "rig.yaml", rename)
    message = refusal(lambda: read_rig(folder / "rig.yaml"))
    assert message.endswith("IMU: unknown key; did you mean imu?")


@pytest.mark.parametrize("written", ["1,25", "+1,25", "-0,5e-3"])
def test_a_decimal_comma_as_people_write_it(folder: Path, written: str) -> None:
    file = folder / "rig.yaml"
    file.write_text(file.read_text().replace("gravity: 9.80665", f"gravity: {written}"))
    point = written.replace(",", ".")
    assert f"'{written}' is not a number; did you mean {point}?" in refusal(lambda: read_rig(file))


def first(**changes: object) -> Edit:
    """An edit of the first recording, a static one, in session.yaml; None removes a key."""

    def edit(document: dict[str, Any]) -> None:
        for key, value in changes.items():
            document["recordings"][0][key] = value
            if value is None:
                del document["recordings"][0][key]

    return edit


SESSION_FAULTS = [
    (lambda document: document.pop("rig"), "rig: missing"),
    (lambda document: document.update(rig="rigg.yaml"), "rigg.yaml: rig description does not exist"),
    (lambda document: document.update(rig=3), "rig: 3 is not a path"),
    (lambda document: document.pop("recordings"), "recordings: missing"),
    (lambda document: document.update(recordings=[]), "recordings: is not a list of bags"),
    (lambda document: document.update(recordings=["run_1"]), r"recordings\[0\]: 'run_1' is not a mapping"),
    (first(bag=None), r"recordings\[0\].bag: missing"),
    (first(bag=7), r"recordings\[0\].bag: 7 is not a path"),
    (first(bag="nowhere"), "nowhere: bag does not exist"),
    (first(bag="rig.yaml"), "rig.yaml: is no bag: it begins neither as mcap, as sqlite3 nor as a ROS 1 bag"),
    (first(bag="static_l"), r"static_l: bag does not exist; .*; did you mean static_1\?"),
    (first(bag="./dynamic_2"), r"recordings\[1\].bag: dynamic_2 is listed twice"),
    (first(kind=None), r"recordings\[0\].kind: missing"),
    (first(kind="still"), r"recordings\[0\].kind: 'still' is unknown; give static or dynamic"),
    (first(kind=["static"]), r"recordings\[0\].kind: \['static'\] is unknown"),
    (first(holdout=True), r"recordings\[0\].holdout: a static recording cannot be held out"),
    (first(holdout="yes"), r"recordings\[0\].holdout: 'yes' is unknown; give true or false"),
    (first(kind="dynamic"), r"recordings\[0\].dummy: belongs to a static recording"),
    (first(dumy={}), r"recordings\[0\].dumy: unknown key; known are bag, kind, holdout, dummy"),
    (first(dummy={"mass": 0.0, "position": [0.0] * 3}), r"recordings\[0\].dummy.mass: 0 kg must be above 0"),
    (first(dummy={"mass": 50.0}), r"recordings\[0\].dummy.position: missing"),
    (first(dummy={"mass": 5.0, "position": [300.0, 0.0, 0.0]}), r"dummy.position\[0\]: 300 m is beyond"),
    (first(dummy=50.0), r"recordings\[0\].dummy: 50.0 is not a mapping"),
    (first(kind="Static"), "give static or dynamic; did you mean static?"),
    (first(dummy={"mass": 50, 25: None, "position": [0.0] * 3}), "dummy: 25 stands alone; is a comma before"),
    (first(dumy={}), "unknown key; .*did you mean dummy?"),
    (lambda document: document.update(rig="rigg.yaml"), "does not exist; did you mean rig.yaml?"),
    (lambda document: document["recordings"].__delitem__(slice(0, 2)), "every recording is held out"),
]


@pytest.mark.parametrize(("edit", "said"), SESSION_FAULTS)
def test_faults_of_the_session_description(folder: Path, edit: Edit, said: str) -> None:
    edit_yaml(folder / "session.yaml", edit)
    message = refusal(lambda: read_session(folder))
    assert message.startswith(str(folder))
    assert re.search(said, message)


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("session.yaml", "rig: [1, 2", "session.yaml: session description is not valid YAML: line 1"),
        ("session.yaml", "rig: a\nrig: b\n", "not valid YAML: line 2: found duplicate key"),
        ("session.yaml", "", "session description is not a YAML mapping"),
        ("rig.yaml", "gravity: 9.8", "rig.yaml: ros__parameters: missing"),
        ("rig.yaml", "/a: {ros__parameters: {}}\n/b: {ros__parameters: {}}", "given for /a, /b; keep one"),
        ("rig.yaml", "\x00\x01", "rig description is not valid YAML"),
        ("rig.yaml", "/**:\n\tros__parameters: {}", "line 2: found character '\\t'"),
        ("rig.yaml", "/**:\n\tros__parameters: {}", "indent with spaces"),
        ("rig.yaml", "/**: {ros_parameters: {}}", "missing; .*ros_parameters has another spelling"),
    ],
)
def test_files_that_are_no_description(folder: Path, file: str, text: str, said: str) -> None:
    (folder / file).write_text(text)
    assert re.search(re.escape(said).replace(r"\.\*", ".*"), refusal(lambda: read_session(folder)))


def test_a_description_of_another_encoding(folder: Path) -> None:
    (folder / "rig.yaml").write_bytes("# für den Prüfstand".encode("latin-1"))
    assert "rig description is no text in UTF-8; save it as UTF-8" in refusal(lambda: read_session(folder))


def test_a_session_that_is_not_there(tmp_path: Path) -> None:
    assert "session does not exist" in refusal(lambda: read_session(tmp_path / "gone"))
    assert "holds neither a session.yaml nor a bag" in refusal(lambda: read_session(tmp_path))


def test_a_room_surveyed_from_afar_is_read(folder: Path) -> None:
    def afar(document: Any) -> None:
        for cable in CABLES:
            point = document["/**"]["ros__parameters"][cable]["ceiling_point"]
            point[0] += 2500.0

    edit_yaml(folder / "rig.yaml", afar)
    assert read_session(folder).rig.cables[0].ceiling_point[0] > 2400.0


def test_ceiling_points_in_millimetres(folder: Path) -> None:
    def in_mm(document: Any) -> None:
        for cable in CABLES:
            part = document["/**"]["ros__parameters"][cable]
            part["ceiling_point"] = [1000.0 * x for x in part["ceiling_point"]]

    edit_yaml(folder / "rig.yaml", in_mm)
    with pytest.raises(
        InputError,
        match=r"ceiling_point\[0\]: 2400 m is 2400 m from that of cable_1, beyond 100 m; is it in mm",
    ):
        read_session(folder)


def test_half_a_mount_of_motion_capture_is_estimated(folder: Path) -> None:
    edit_yaml(
        folder / "rig.yaml", lambda document: document["/**"]["ros__parameters"]["mocap"].pop("position")
    )
    assert read_session(folder).rig.mocap is None


def test_another_node_name_and_small_numbers_are_read(folder: Path) -> None:
    file = folder / "rig.yaml"
    text = file.read_text().replace("/**:", "/rig/identification:").replace("clock: 0.0005", "clock: 5e-4")
    file.write_text(text)
    assert "5e-4" in text
    assert read_rig(file).tolerance["clock"] == 5e-4


def test_what_the_description_leaves_out_has_its_default(folder: Path) -> None:
    def edit(document: dict[str, Any]) -> None:
        parameters = document["/**"]["ros__parameters"]
        for name in ("mass", "mass_std", "frame", "imu", "mocap", "noise"):
            del parameters[name]
        parameters["tolerance"] = {"clock": 0.01}
        parameters["exciter"]["orientation"] = [0.0, 0.0, 0.0, 1.0005]

    edit_yaml(folder / "rig.yaml", edit)
    rig = read_rig(folder / "rig.yaml")
    assert (rig.mass, rig.mass_std, rig.frame, rig.imu, rig.mocap, rig.noise) == (None,) * 5 + ({},)
    assert rig.tolerance == {**DEFAULT_TOLERANCE, "clock": 0.01}
    assert rig.exciter is not None
    np.testing.assert_array_equal(rig.exciter.orientation, [0.0, 0.0, 0.0, 1.0])


def damage(folder: Path, name: str) -> tuple[Path, bytes]:
    file = next(path for path in (folder / name).iterdir() if path.name != "metadata.yaml")
    return file, file.read_bytes()


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3])
@pytest.mark.parametrize(
    ("storage", "compression"),
    [("mcap", "none"), ("mcap", "storage"), ("mcap", "file"), ("sqlite3", "none"), ("sqlite3", "file")],
)
def test_a_bag_cut_off_before_its_first_second_ends(
    tmp_path: Path, storage: str, compression: str, share: float
) -> None:
    """Nothing is left, or too little of a run: either way the line says that the bag is cut off."""
    recording = make_recording(seconds=1.5)
    folder = write_single(recording, tmp_path / "out", storage=storage, compression=compression)
    file, content = damage(folder, recording.name)
    file.write_bytes(content[: int(share * len(content))])
    message = refusal(lambda: read_session(folder))
    assert message.startswith(str(folder / recording.name))
    assert "truncated" in message


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("compression", ["file", "message"])
def test_compressed_data_that_is_corrupt(tmp_path: Path, storage: str, compression: str) -> None:
    recording = make_recording(seconds=1.5)
    folder = write_single(recording, tmp_path / "out", storage=storage, compression=compression)
    file, content = damage(folder, recording.name)
    middle = len(content) // 2
    noise = np.random.default_rng(0).bytes(2000)
    file.write_bytes(content[:middle] + noise + content[middle + len(noise) :])
    assert "damaged or truncated" in refusal(lambda: read_session(folder))


def test_a_damaged_length_that_asks_for_all_memory(folder: Path) -> None:
    file, content = damage(folder, "dynamic_2")
    at = 8 + 9 + int.from_bytes(content[9:17], "little")  # behind magic and header: the first chunk's record
    assert content[at] == 0x06
    file.write_bytes(content[: at + 1] + (1 << 50).to_bytes(8, "little") + content[at + 9 :])
    assert "bag is damaged" in refusal(lambda: read_session(folder))


def test_a_bag_without_its_files(folder: Path) -> None:
    (folder / "dynamic_2" / "dynamic_2.mcap").unlink()
    said = refusal(lambda: read_session(folder))
    assert "dynamic_2: holds no bag's file (.mcap, .db3 or .bag)" in said
    assert "names dynamic_2.mcap, which is missing: copy it" in said
    (folder / "dynamic_2" / "metadata.yaml").unlink()
    assert "dynamic_2: holds no bag's file" in refusal(lambda: read_session(folder))


def make_bag(folder: Path, topics: dict[str, tuple[str, int]]) -> None:
    """A bag with messages of any type: topic -> (type, count), stamped at 100 Hz."""
    vector = TYPESTORE.types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    header, stamp = TYPESTORE.types["std_msgs/msg/Header"], TYPESTORE.types["builtin_interfaces/msg/Time"]
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, (kind, count) in topics.items():
            connection = writer.add_connection(topic, kind, typestore=TYPESTORE)
            for index in range(count):
                time = header(stamp=stamp(sec=1000 + index // 100, nanosec=index % 100 * 10**7), frame_id="")
                message = TYPESTORE.types[kind](header=time, vector=vector)
                data = TYPESTORE.serialize_cdr(message, kind)
                writer.write(connection, 10**12 + index * 10**7, data)


VECTOR, WRENCH = "geometry_msgs/msg/Vector3Stamped", "geometry_msgs/msg/WrenchStamped"


@pytest.mark.parametrize(
    ("topics", "said"),
    [
        ({"/rig/imu/data_raw": (VECTOR, 200)}, f"imu/data_raw: type is {VECTOR}, not sensor_msgs/msg/Imu"),
        ({"/rig/cable_1/wrench": (WRENCH, 0)}, "no topic of the contract in the bag; it has /rig/cable_1"),
        ({"/rig/cable_1/wrench": (WRENCH, 0)}, "/rig/cable_1/wrench has no message: taken as not recorded"),
        ({"/lab/inclinometer/angles": (VECTOR, 200)}, "did you mean --namespace /lab?"),
        ({"/other": (VECTOR, 5)}, "no topic of the contract in the bag; it has /other"),
        ({}, "no topic of the contract in the bag; it has none"),
        ({"/rig/inclinometer/angles": (VECTOR, 50)}, "lasts 0.49 s, less than 1 s"),
    ],
)  # fmt: skip
def test_bags_without_what_is_needed(folder: Path, topics: dict[str, tuple[str, int]], said: str) -> None:
    shutil.rmtree(folder / "dynamic_2")
    make_bag(folder / "dynamic_2", topics)
    message = refusal(lambda: read_session(folder))
    assert message.startswith(f"{folder / 'dynamic_2'}: ")
    assert said in message


def test_messages_too_short_for_their_type(folder: Path) -> None:
    shutil.rmtree(folder / "dynamic_2")
    kind = "sensor_msgs/msg/Imu"
    with Writer(folder / "dynamic_2", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/rig/imu/data_raw", kind, typestore=TYPESTORE)
        writer.write(connection, 1, b"\x00\x01\x00\x00" + bytes(60))
    message = refusal(lambda: read_session(folder))
    assert f"/rig/imu/data_raw: message 0 (64 bytes) is no {kind}" in message


def test_a_force_without_an_exciter_in_the_description(folder: Path) -> None:
    edit_yaml(folder / "rig.yaml", drop("exciter"))
    assert "the rig description has no exciter" in refusal(lambda: read_session(folder))


@pytest.mark.parametrize(
    ("topics", "said"),
    [
        ({"imu": "/imu"}, "topic mapping: imu is no topic of this rig; known are cable_1/wrench"),
        ({"imu/data_raw": "/a", "mocap/pose": "a"}, "two topics of the rig are mapped to one"),
    ],
)
def test_topic_mappings_that_cannot_be(sample: Path, topics: dict[str, str], said: str) -> None:
    assert said in refusal(lambda: read_session(sample, topics=topics))


CHANNEL_LINES = [
    ("imu", "imu angular rate "),
    ("inclination", "inclination "),
    ("mocap", "mocap position "),
    ("tension", "cable_1 tension varies by "),
]


@pytest.mark.parametrize(("channel", "said"), CHANNEL_LINES)
def test_a_static_recording_that_moves_in_any_channel(tmp_path: Path, channel: str, said: str) -> None:
    moving = make_recording("dynamic", seconds=8.0, amplitude=0.02)
    still = make_recording("static", seconds=8.0)
    recording = dataclasses.replace(still, **{channel: getattr(moving, channel)})
    folder = write_single(recording, tmp_path / "out")
    message = refusal(lambda: read_session(folder))
    assert f"static recording moves: {said}" in message
    assert "limit" in message
    assert "record again" in message


def test_a_static_recording_that_turns_under_mocap(tmp_path: Path) -> None:
    still = make_recording("static", seconds=8.0)
    assert still.mocap is not None
    values = np.array(still.mocap.values)
    half = 0.01 * np.sin(2.0 * np.pi * 0.3 * still.mocap.time)
    values[:, 3:] = np.column_stack((0 * half, 0 * half, np.sin(half), np.cos(half)))
    values[::3, 3:] *= -1.0  # the same orientation
    recording = dataclasses.replace(still, mocap=Series(still.mocap.time, values))
    folder = write_single(recording, tmp_path / "out")
    assert "mocap orientation z varies by 0.01" in refusal(lambda: read_session(folder))


def test_a_residual_swing_and_hum_are_rest(tmp_path: Path) -> None:
    recording = make_recording("static", seconds=8.0, amplitude=1e-3)
    assert recording.imu is not None
    hum = 0.05 * np.sin(2.0 * np.pi * 48.0 * recording.imu.time)[:, None]
    recording = dataclasses.replace(recording, imu=Series(recording.imu.time, recording.imu.values + hum))
    assert read_session(write_single(recording, tmp_path / "out")).statics


def test_the_sample_itself_is_accepted(sample: Path) -> None:
    assert repr(read_session(sample).rig) == repr(make_rig())
