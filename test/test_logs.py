"""Logs of other makes: what is read of each format, what its columns are taken for, and what comes out."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from rig_identification.errors import InputError
from rig_identification.logs.columns import Columns, columns_text, read_columns
from rig_identification.logs.convert import recording_of
from rig_identification.logs.formats import read_log
from rig_identification.logs.formats.csv_text import table_of
from rig_identification.logs.guess import guess, words_of
from rig_identification.logs.importing import recordings, understand
from rig_identification.logs.log import ONLY, Column, Log, Table
from rig_identification.logs.quantities import FIXED, quantity
from rig_identification.logs.units import UNITS, factor, known_unit
from rig_identification.recording import Recording

Array = NDArray[np.float64]
TIME = np.arange(40) * 0.005
G = 9.80665
RATE = np.column_stack([np.sin(TIME + i) for i in range(3)])  # rad/s
FORCE = np.column_stack([np.cos(TIME), np.sin(TIME), G + np.sin(TIME)])  # m/s^2


def imported(path: Path) -> Recording:
    """A file with what its columns are guessed to be."""
    log = read_log(path)
    return recording_of(log, guess(log).columns, "run_1", str(path))


def imu(recording: Recording) -> Array:
    assert recording.imu is not None
    assert recording.imu.time == pytest.approx(TIME, abs=1e-9)
    return recording.imu.values


def text_table(
    heads: list[str], rows: Array, separator: str = ",", *, comma: bool = False, above: str = ""
) -> str:
    lines = [separator.join(f"{v:.9f}" for v in row) for row in rows]
    body = "\n".join(lines)
    return f"{above}{separator.join(heads)}\n{body.replace('.', ',') if comma else body}\n"


IMU_HEADS = ["t", "gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"]
IMU_ROWS = np.column_stack([TIME, RATE, FORCE])


@pytest.mark.parametrize(
    "text",
    [
        text_table(IMU_HEADS, IMU_ROWS),
        text_table(IMU_HEADS, IMU_ROWS, ";", comma=True),
        text_table(IMU_HEADS, IMU_ROWS, "\t", comma=True),
        text_table(IMU_HEADS, IMU_ROWS, " "),
        text_table(IMU_HEADS, IMU_ROWS, above="# logger 3, cell by the door\nserial,17\n"),
        text_table(["# time", *IMU_HEADS[1:]], IMU_ROWS),
        text_table(["s", *["rad/s"] * 3, *["m/s^2"] * 3], IMU_ROWS, above=",".join(IMU_HEADS) + "\n"),
        text_table(IMU_HEADS, IMU_ROWS) + "0.2,1.5,0.",  # cut off while it was written
        text_table(["Time (s)", *(f"Gyroscope {a} [rad/s]" for a in "xyz"),
                    *(f"Acceleration {a} (m/s²)" for a in "xyz")], IMU_ROWS),
        text_table(["t", "Wx", "Wy", "Wz", "Ax", "Ay", "Az"], IMU_ROWS),
        text_table(["time_ms", *(f"gyr{a}_dps" for a in "XYZ"), *(f"acc{a}_g" for a in "XYZ")],
                   np.column_stack([1e3 * TIME, np.degrees(RATE), FORCE / G])),
        text_table(["timestamp", *IMU_HEADS[1:4], "ax", "ay", "az"],
                   np.column_stack([1e3 * TIME, RATE, FORCE / G])),
    ],
    ids=["comma", "semicolon", "tab", "blanks", "lines above", "comment", "row of units", "cut off",
         "brackets",
         "short names", "endings", "nothing stated"],
)  # fmt: skip
def test_a_table_of_an_imu_comes_out_whatever_its_dialect(text: str, tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    file.write_bytes(text.encode("utf-8"))
    assert imu(imported(file)) == pytest.approx(np.hstack([RATE, FORCE]), abs=1e-6)


def test_text_in_other_encodings(tmp_path: Path) -> None:
    text = text_table(["Zeit [s]", "gyro_z [°/s]"], np.column_stack([TIME, np.degrees(RATE[:, 2])]))
    for name, encoding in (("one.csv", "utf-16"), ("two.csv", "latin-1"), ("three.csv", "utf-8-sig")):
        (tmp_path / name).write_bytes(text.encode(encoding))
        assert imu(imported(tmp_path / name))[:, 2] == pytest.approx(RATE[:, 2], abs=1e-8)


def test_times_of_day_and_epochs_are_dates(tmp_path: Path) -> None:
    rows = [f"2026-03-01T12:00:{5e-3 * i:09.6f}Z,{i}.5" for i in range(9)]
    (tmp_path / "a.csv").write_text("time,gyro_x\n" + "\n".join(rows))
    first = imported(tmp_path / "a.csv")
    assert first.start_ns == 1772366400_000_000_000
    assert first.duration == pytest.approx(0.04, abs=1e-6)
    (tmp_path / "b.csv").write_text("time_ns,gyro_x\n" + "\n".join(f"{1772366400 * 10**9 + 5_000_000 * i},1.5"
                                                                for i in range(9)))  # fmt: skip
    assert imported(tmp_path / "b.csv").start_ns == pytest.approx(1772366400_000_000_000, abs=512)


def test_without_a_date_logs_stand_apart_and_say_none() -> None:
    log = Log((Table(ONLY, (Column("t", TIME), Column("gyro_x", RATE[:, 0]))),))
    first, second = (recording_of(log, guess(log).columns, "run", "run.csv", number) for number in (0, 1))
    assert second.start_ns > first.start_ns + first.duration * 1e9
    assert second.start_ns < 946_684_800 * 10**9  # what the report takes for a date


@pytest.mark.parametrize(
    ("name", "unit", "word"),
    [
        ("force_left", "N", "left.tension"),
        ("F1", "N", "cable_1.tension"),
        ("cable_2 tension (kN)", "", "cable_2.tension"),
        ("Load cell rear right", "lbf", "rear_right.tension"),
        ("exciter force x", "N", "exciter.force.x"),
        ("shaft angle", "deg", "exciter.angle"),
        ("inclinometer_y", "mrad", "inclinometer.y"),
        ("marker_pos_z", "mm", "mocap.position.z"),
        ("x", "mm", "mocap.position.x"),
        ("qw", "", "mocap.quaternion.w"),
        ("quaternion.w", "", "mocap.quaternion.w"),
        ("orientation w", "", "mocap.quaternion.w"),
        ("w_z", "rad/s", "imu.angular_rate.z"),
        ("yaw", "deg", "mocap.yaw"),
        ("magnetic rate x", "", None),
        ("gyro_x", "V", "imu.angular_rate.x"),  # an unknown unit states nothing
        ("gyro_x", "N", None),
        ("temperature", "°C", None),
        ("gyro", "deg/s", None),  # no axis
        ("counter", "", None),
    ],
)
def test_what_a_column_is_taken_for(name: str, unit: str, word: str | None) -> None:
    log = Log((Table(ONLY, (Column("t", TIME, "s"), Column(name, RATE[:, 0], unit))),))
    found = guess(log)
    columns = found.columns.tables[ONLY].columns if found.columns.tables else {}
    assert (columns[name].word if name in columns else None) == word
    if word is None:
        assert found.remarks[ONLY, name].startswith("not used")


def test_every_word_is_a_quantity_and_every_unit_is_known() -> None:
    assert all(quantity(word) is FIXED[word] for word in FIXED)
    assert quantity("left.tension").cable == "left"  # type: ignore[union-attr]
    assert quantity("imu.tension") is None
    assert quantity("imu.angular_rate") is None
    for si, units in UNITS.items():
        assert UNITS[si][si] == 1.0
        assert all(known_unit(unit) == unit for unit in units)
    assert factor("deg/s", "rad/s", "") == pytest.approx(np.pi / 180)
    assert (known_unit("mN"), known_unit("MN")) == ("mN", "")
    assert words_of("GyroX_dps 2") == ["gyro", "x", "dps", "2"]


def test_a_guess_read_back_is_the_same(tmp_path: Path) -> None:
    heads = ["Time (s)", "Gyroscope x (rad/s)", "1", "on: {a}", "force left"]
    log = Log((table_of(text_table(heads, np.column_stack([TIME, RATE, TIME])), "", ONLY),))
    found = guess(log)
    file = tmp_path / "columns.yaml"
    file.write_text(columns_text(found.columns, log, found.remarks, "run.csv"), encoding="utf-8")
    assert read_columns(file) == found.columns
    assert "on: {a}" in file.read_text(encoding="utf-8")


COLUMNS = """
tables:
  table:
    time: {column: t, unit: ms}
    columns:
      a: {is: imu.angular_rate.z, unit: deg/s, scale: -1}
"""


def test_columns_in_words_of_ones_own(tmp_path: Path) -> None:
    (tmp_path / "columns.yaml").write_text(COLUMNS)
    (tmp_path / "run.csv").write_text(text_table(["t", "a"], np.column_stack([1e3 * TIME, RATE[:, 0]])))
    log = read_log(tmp_path / "run.csv")
    found = recording_of(log, read_columns(tmp_path / "columns.yaml"), "run", "run.csv")
    assert imu(found)[:, 2] == pytest.approx(-np.radians(RATE[:, 0]), abs=1e-8)
    assert np.isnan(imu(found)[:, [0, 1, 3, 4, 5]]).all()


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        (
            "is: imu.angular_rate.z",
            "is: imu.angular_rat.z",
            r"tables.table.columns.a.is: .*did you mean imu.angular",
        ),
        ("unit: deg/s", "unit: N", "a.unit: N is a unit of another kind; give rad/s or"),
        ("unit: deg/s", "unit: deg/m", "a.unit: unit deg/m is unknown"),
        ("scale: -1", "scale: 0", "a.scale: 0 leaves nothing"),
        ("column: t", "colum: t", r"tables.table.time.colum: unknown key.*did you mean column"),
        ("      a:", "      b:", r"holds no column b; it holds t, a"),
        ("  table:", "  tables:", r"holds no table tables; it holds table; did you mean table"),
        ("column: t, unit: ms", "rate: 0", "time.rate: 0 Hz must be above"),
    ],
)
def test_wrong_columns_have_one_line(old: str, new: str, word: str, tmp_path: Path) -> None:
    file = tmp_path / "columns.yaml"
    file.write_text(COLUMNS.replace(old, new))
    log = Log((Table(ONLY, (Column("t", TIME), Column("a", TIME))),))
    with pytest.raises(InputError, match=word) as caught:
        recording_of(log, read_columns(file), "run", "run.csv")
    assert "\n" not in str(caught.value)


def test_a_table_without_time_needs_a_rate() -> None:
    log = Log((Table(ONLY, (Column("gyro_x", RATE[:, 0]), Column("gyro_y", RATE[:, 1]))),))
    columns = guess(log).columns
    with pytest.raises(InputError, match="no column of time"):
        recording_of(log, columns, "run", "run.csv")
    assert imu(recording_of(log, columns.with_rate(200.0), "run", "run.csv"))[:, 0] == pytest.approx(
        RATE[:, 0]
    )


def test_two_tables_of_one_imu_keep_their_samples() -> None:
    """A phone's gyroscope and accelerometer are sampled each at its own times."""
    gyro = Table("Gyroscope", (Column("t", TIME, "s"), Column("x", RATE[:, 0], "rad/s")))
    force = Table("Accelerometer", (Column("t", TIME[::2], "s"), Column("z", FORCE[::2, 2], "m/s^2")))
    late = Table("Accelerometer", (Column("t", TIME[::2] + 0.001, "s"), Column("z", FORCE[::2, 2], "m/s^2")))
    for other, count in ((force, 40), (late, 60)):
        log = Log((gyro, other))
        found = recording_of(log, guess(log).columns, "run", "phone")
        assert found.imu is not None
        assert len(found.imu.time) == count
        assert (np.diff(found.imu.time) > 0).all()
        rate, felt = found.imu.values[:, 0], found.imu.values[:, 5]
        assert rate[np.isfinite(rate)] == pytest.approx(RATE[:, 0])
        assert felt[np.isfinite(felt)] == pytest.approx(FORCE[::2, 2])


def test_turns_become_a_quaternion() -> None:
    def turned(**angles: float) -> Array:
        columns = [Column(name, np.full(40, value), "deg") for name, value in angles.items()]
        log = Log((Table(ONLY, (Column("t", TIME, "s"), *columns)),))
        mocap = recording_of(log, guess(log).columns, "run", "run.csv").mocap
        assert mocap is not None
        return mocap.values[0, 3:]

    half = np.radians(15.0)
    alone = turned(yaw=30.0)
    assert np.isnan(alone[:2]).all()
    assert alone[2:] == pytest.approx([np.sin(half), np.cos(half)])
    assert turned(roll=0.0, pitch=0.0, yaw=30.0) == pytest.approx([0.0, 0.0, np.sin(half), np.cos(half)])
    assert turned(roll=30.0, pitch=0.0, yaw=0.0) == pytest.approx([np.sin(half), 0.0, 0.0, np.cos(half)])
    with pytest.raises(InputError, match=r"mocap.pitch: missing"):
        turned(roll=1.0, yaw=1.0)


def test_mat_files(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "five.mat", {"log": {"t": TIME, "gyro": RATE, "acc": FORCE}, "mass": 3.0})
    assert imu(imported(tmp_path / "five.mat")) == pytest.approx(np.hstack([RATE, FORCE]))


def test_mat_files_of_version_7_3(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py", reason="pip install '.[mat]'")
    pytest.importorskip("pymatreader", reason="pip install '.[mat]'")
    file = tmp_path / "seven.mat"
    with h5py.File(file, "w", userblock_size=512) as content:
        for name, values in (("t", TIME[None]), ("gyro", RATE.T), ("acc", FORCE.T)):  # MATLAB's order
            content[name] = values
            content[name].attrs["MATLAB_class"] = np.bytes_("double")
    with file.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    assert imu(imported(file)) == pytest.approx(np.hstack([RATE, FORCE]))


def test_ros_1_bags(tmp_path: Path) -> None:
    """An IMU's topic, and a load cell's of another kind of message than the contract's."""
    store = get_typestore(Stores.ROS1_NOETIC)
    types: Any = store.types
    vector, header = types["geometry_msgs/msg/Vector3"], types["std_msgs/msg/Header"]
    level = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    with Writer(tmp_path / "run.bag") as bag:
        kinds = {"/xsens/data": "sensor_msgs/msg/Imu", "/left/force": "std_msgs/msg/Float64"}
        to = {topic: bag.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        for i, time in enumerate(TIME):
            stamp = types["builtin_interfaces/msg/Time"](1_700_000_000, round(time * 1e9))
            message = types["sensor_msgs/msg/Imu"](
                header(i, stamp, "imu"), level, np.zeros(9),
                vector(*RATE[i]), np.zeros(9), vector(*FORCE[i]), np.zeros(9),
            )  # fmt: skip
            received = 1_700_000_000_000_000_000 + round(time * 1e9)
            bag.write(to["/xsens/data"], received, bytes(store.serialize_ros1(message, kinds["/xsens/data"])))
            force = types["std_msgs/msg/Float64"](100.0 + i)
            bag.write(to["/left/force"], received, bytes(store.serialize_ros1(force, kinds["/left/force"])))
    found = imported(tmp_path / "run.bag")
    assert found.start_ns == pytest.approx(1_700_000_000_000_000_000, abs=512)
    assert found.imu is not None
    assert found.imu.values == pytest.approx(np.hstack([RATE, FORCE]))
    assert found.tension["left"].values[:, 0] == pytest.approx(100.0 + np.arange(40))


def zipped(path: Path, files: dict[str, str]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


def test_an_export_of_phyphox(tmp_path: Path) -> None:
    heads = ["Time (s)", *(f"Gyroscope {axis} (rad/s)" for axis in "xyz")]
    felt = ["Time (s)", *(f"Acceleration {axis} (m/s^2)" for axis in "xyz")]
    linear = ["Time (s)", *(f"Linear Acceleration {axis} (m/s^2)" for axis in "xyz")]
    clock = '"event","experiment time","system time","system time text"\n"START",0.0,1772366400.5,"..."\n'
    path = zipped(tmp_path / "pendulum 1.zip", {
        "Gyroscope.csv": text_table(heads, np.column_stack([TIME + 0.25, RATE])),
        "Accelerometer.csv": text_table(felt, np.column_stack([TIME + 0.25, FORCE])),
        "Linear Accelerometer.csv": text_table(linear, np.column_stack([TIME + 0.25, FORCE - [0, 0, G]])),
        "meta/time.csv": clock,
        "meta/device.csv": '"property","value"\n"deviceModel","x"\n',
    })  # fmt: skip
    found = imported(path)
    assert found.start_ns == 1772366400_750_000_000
    assert imu(found) == pytest.approx(np.hstack([RATE, FORCE]), abs=1e-8)


@pytest.mark.parametrize(("platform", "standard", "sign"), [("android", "false", 1.0), ("ios", "false", -1.0),
                                                            ("ios", "true", 1.0)])  # fmt: skip
def test_an_export_of_sensor_logger(platform: str, standard: str, sign: float, tmp_path: Path) -> None:
    """Its acceleration is without gravity; an iPhone's own has the opposite sign."""
    epoch = 1_700_000_000 + TIME
    heads = ["time", "seconds_elapsed", "z", "y", "x"]

    def sensor(values: Array) -> str:
        rows = zip(epoch, TIME, *values.T[::-1], strict=True)
        lines = [f"{round(t * 1e9)},{s:.9f},{z:.9f},{y:.9f},{x:.9f}" for t, s, z, y, x in rows]
        return "\n".join([",".join(heads), *lines])

    gravity = np.array([[0.0, 0.0, G]])
    path = zipped(tmp_path / "log.zip", {
        "Gyroscope.csv": sensor(RATE),
        "Accelerometer.csv": sensor(sign * (FORCE - gravity)),
        "Gravity.csv": sensor(sign * np.repeat(gravity, 40, axis=0)),
        "Annotation.csv": "time,seconds_elapsed,text\n",
        "Metadata.csv": f"version,platform,standardisation\n1,{platform},{standard}\n",
    })  # fmt: skip
    found = imported(path)
    assert found.imu is not None
    assert found.imu.values == pytest.approx(np.hstack([RATE, FORCE]), abs=1e-6)


def test_tdms_files(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="pip install '.[tdms]'")
    wave = {"wf_increment": 0.005, "wf_start_offset": 0.0, "unit_string": "deg/s"}
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment(
            [nptdms.ChannelObject("IMU", f"gyro {a}", np.degrees(RATE[:, i]), wave)
             for i, a in enumerate("xyz")]
        )  # fmt: skip
    assert imu(imported(tmp_path / "run.tdms"))[:, :3] == pytest.approx(RATE)


def test_mdf_files(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf", reason="pip install '.[mdf]'")
    signals = [asammdf.Signal(np.degrees(RATE[:, i]), TIME, name=f"gyro_{a}", unit="deg/s")
               for i, a in enumerate("xyz")]  # fmt: skip
    with asammdf.MDF(version="4.10") as file:
        file.append(signals)
        file.save(tmp_path / "run.mf4")
    assert imu(imported(tmp_path / "run.mf4"))[:, :3] == pytest.approx(RATE)


def test_ulog_files(tmp_path: Path) -> None:
    pytest.importorskip("pyulog", reason="pip install '.[ulog]'")

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    fields = "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;"
    out = io.BytesIO()
    out.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
    out.write(message("B", bytes(40)))
    topics = {"sensor_gyro": RATE, "sensor_accel": FORCE}
    for topic in topics:
        out.write(message("F", f"{topic}:{fields}".encode()))
    for number, (topic, values) in enumerate(topics.items()):
        out.write(message("A", struct.pack("<BH", 0, number) + topic.encode()))
        for time, row in zip(TIME, values, strict=True):
            stamps = (round(1e6 * time) + 300, round(1e6 * time) + 50)
            out.write(message("D", struct.pack("<HQQfff", number, *stamps, *row)))
    (tmp_path / "run.ulg").write_bytes(out.getvalue())
    assert imu(imported(tmp_path / "run.ulg")) == pytest.approx(np.hstack([RATE, FORCE]), abs=1e-6)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda p: p.with_name("gone.csv"), "gone.csv: does not exist"),
        (lambda p: p.with_suffix(".xyz"), "is of no known format"),
        (lambda p: p, "holds no two rows of numbers"),
        (lambda p: p.with_suffix(".mat"), "is damaged, or no MAT"),
        (
            lambda p: p.with_suffix(".tdms"),
            "is damaged, or no TDMS|holds no group|package nptdms is not installed",
        ),
    ],
)
def test_what_cannot_be_read_is_said_in_one_line(
    make: Callable[[Path], Path], word: str, tmp_path: Path
) -> None:
    path = make(tmp_path / "run.csv")
    if path.name != "gone.csv":
        path.write_bytes(b"TDSmnonsense\n" if path.suffix == ".tdms" else b"hello\nworld\n")
    with pytest.raises(InputError, match=word) as caught:
        read_log(path)
    assert "\n" not in str(caught.value)


def test_nothing_used_is_said() -> None:
    log = Log((Table(ONLY, (Column("t", TIME), Column("temperature", TIME))),))
    with pytest.raises(InputError, match=r"no column that is used; say in columns\.yaml"):
        recording_of(log, Columns(), "run", "run.csv")


def test_what_one_file_lacks_is_taken_from_the_others(tmp_path: Path) -> None:
    """The exciter is not logged at rest: the guess holds it all the same, whichever file comes first."""
    heads = [*IMU_HEADS, "exciter x (N)"]
    still, moving = tmp_path / "still.csv", tmp_path / "run.csv"
    still.write_text(text_table(IMU_HEADS, IMU_ROWS), encoding="utf-8")
    moving.write_text(text_table(heads, np.column_stack([IMU_ROWS, TIME])), encoding="utf-8")
    for files in ((still, moving), (moving, still)):
        understood = understand(files)
        assert "exciter x (N): {is: exciter.force.x, unit: N}" in understood.text
        made = {recording.name: recording for recording in recordings(understood)}
        assert made["still"].exciter_force is None
        assert imu(made["still"]) == pytest.approx(np.hstack([RATE, FORCE]), abs=1e-6)
        told = made["run"].exciter_force
        assert told is not None
        assert told.values[:, 0] == pytest.approx(TIME, abs=1e-6)


def test_a_column_that_no_file_holds_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(text_table(IMU_HEADS, IMU_ROWS), encoding="utf-8")
    text = understand([tmp_path / "run.csv"]).text.replace("gyro_x:", "giro_x:")
    (tmp_path / "columns.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"holds no column giro_x; .*did you mean gyro_x"):
        recordings(understand([tmp_path / "run.csv"], tmp_path / "columns.yaml"))
