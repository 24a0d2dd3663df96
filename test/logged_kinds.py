"""What loggers write of ten kinds of rigs: the files that the pages of docs/recordings begin with.

Each kind is a simulated session, written as its logger would write it, with its units and its columns.
"""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat
from scipy.spatial.transform import Rotation

import rig_identification as ri
from rig_identification.recording import Recording, Series
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.session import read_rig

Array = NDArray[np.float64]
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
#: A bar of 12 kg on two strings, and a plate of 42 kg on three: m, c, then Jxx Jxy Jxz Jyy Jyz Jzz.
BAR = [12.0, 0.4, 0.0, -0.05, 0.09, 0.0, 0.0, 1.1, 0.0, 1.15]
PLATE = [42.0, 0.3, 0.173, 0.02, 1.9, 0.0, 0.0, 2.4, 0.0, 3.6]
#: The car of 1145 kg.
CAR = [1145.0, 0.8, 1.128, -1.137, 1617.0, 0.0, 0.0, 365.0, 70.0, 1785.0]
ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Kind:
    """One kind of recordings."""

    page: str  # in docs/recordings
    make: Callable[[], ri.Simulated]
    write: Callable[[ri.Simulated, Path], None]
    known: tuple[str, ...]  # elements that the page's commands determine
    heads: str = ""  # first line of its text files


def _hung(points: list[list[float]], length: float, mass: float, **devices: Any) -> Rig:
    """A body on parallel strings that hang from straight above."""
    cables = tuple(
        Cable(f"string_{i + 1}", np.array(p) + np.array([0.0, 0.0, length]), np.array(p), length)
        for i, p in enumerate(points)
    )
    return Rig(gravity=9.80665, cables=cables, mass=mass, mass_std=0.001 * mass, **devices)


def bar(**devices: Any) -> Rig:
    """On two strings of 1.5 m, 0.8 m apart."""
    return _hung([[0.0, 0.0, 0.0], [0.8, 0.0, 0.0]], 1.5, 12.0, **devices)


def plate(**devices: Any) -> Rig:
    """On three strings of 2 m at the corners of a triangle with sides of 0.6 m."""
    return _hung([[0.0, 0.0, 0.0], [0.6, 0.0, 0.0], [0.3, 0.52, 0.0]], 2.0, 42.0, **devices)


def car(mounted: tuple[str, ...]) -> Rig:
    """The car of config/car_four_cables.yaml with the devices that are named, and load cells."""
    rig = read_rig(ROOT / "config" / "car_four_cables.yaml")
    others = dict.fromkeys({"imu", "inclinometer", "exciter"} - {*mounted})
    return replace(rig, **others)


def turned(rig: Rig, body: list[float], seed: int, **more: Any) -> ri.Simulated:
    """Turned about the vertical and let go, twice."""
    asked: dict[str, Any] = {"duration": 12.0, "rest": 0.0, "without": ["tension"]}
    start = [0.0, 0.0, 0.0, 0.0, 0.0, 0.3]
    return ri.simulate(rig, body=body, displaced=start, seed=seed, **{**asked, **more})


def at(x: float, y: float, z: float) -> Mount:
    """A device whose axes are those of the body."""
    return Mount(np.array([x, y, z]), LEVEL)


# --- how it is logged ------------------------------------------------------------------------------------


def _samples(samples: Series | None) -> Series:
    assert samples is not None
    return samples


def _pose(recording: Recording) -> tuple[Array, Array, Array]:
    """Times, positions in mm, roll pitch yaw in deg."""
    told = _samples(recording.mocap)
    turns = Rotation.from_quat(told.values[:, 3:]).as_euler("ZYX", degrees=True)[:, ::-1]
    return told.time, 1e3 * told.values[:, :3], turns


def _csv(path: Path, heads: str, *columns: Array) -> None:
    np.savetxt(path, np.column_stack(columns), "%.6f", ",", header=heads, comments="")


def _each(write: Callable[[Recording, Path], None]) -> Callable[[ri.Simulated, Path], None]:
    def all_of_them(made: ri.Simulated, folder: Path) -> None:
        for recording in made.session.recordings:
            if recording.dummy is None:  # a known mass is no business of a logger
                write(recording, folder)

    return all_of_them


CAMERA = "time (s),x (mm),y (mm),z (mm),roll (deg),pitch (deg),yaw (deg)"
ANGLE = "time (s),yaw (deg)"
MARKER = "time (s),marker x (mm),marker y (mm)"
GYROSCOPE = "time_ms,gyro_x_dps,gyro_y_dps,gyro_z_dps"
CELLS = "time (s),F1 (N),F2 (N),F3 (N),F4 (N)"
ALL = ",".join(
    ["time (s)", *(f"cable_{i} (N)" for i in range(1, 5)), *(f"gyro {a} (rad/s)" for a in "xyz")]
    + [f"acc {a} (m/s^2)" for a in "xyz"]
    + [f"exciter {a} (N)" for a in "xyz"]
)


def _camera(recording: Recording, folder: Path) -> None:
    _csv(folder / f"{recording.name}.csv", CAMERA, *_pose(recording))


def _angle(recording: Recording, folder: Path) -> None:
    time, _, turns = _pose(recording)
    _csv(folder / f"{recording.name}.csv", ANGLE, time, turns[:, 2])


def _marker(recording: Recording, folder: Path) -> None:
    time, place, _ = _pose(recording)
    _csv(folder / f"{recording.name}.csv", MARKER, time, place[:, :2])


def _gyroscope(recording: Recording, folder: Path) -> None:
    told = _samples(recording.imu)
    _csv(folder / f"{recording.name}.csv", GYROSCOPE, 1e3 * told.time, np.degrees(told.values[:, :3]))


def _mat(recording: Recording, folder: Path) -> None:
    told = _samples(recording.mocap)
    names = {"time": told.time, "position": told.values[:, :3], "quaternion": told.values[:, 3:]}
    savemat(folder / f"{recording.name}.mat", names)


def _phone(recording: Recording, folder: Path) -> None:
    """phyphox' export: gyroscope and accelerometer at times of their own, which come by turns."""
    told = _samples(recording.imu)
    parts = (
        ("Gyroscope", "Gyroscope", "rad/s", told.time[::2], told.values[::2, :3]),
        ("Accelerometer", "Acceleration", "m/s^2", told.time[1::2], told.values[1::2, 3:]),
    )
    with zipfile.ZipFile(folder / f"{recording.name}.zip", "w") as archive:
        for name, word, unit, times, values in parts:
            heads = ",".join(f'"{h}"' for h in ("Time (s)", *(f"{word} {a} ({unit})" for a in "xyz")))
            text = io.StringIO()
            table = np.column_stack([times, values])
            np.savetxt(text, table, "%.9E", ",", header=heads, comments="")
            archive.writestr(f"{name}.csv", text.getvalue())


def _ulog(recording: Recording, folder: Path) -> None:
    """The log of an autopilot (PX4), written from its format's description."""
    told = _samples(recording.imu)

    def message(kind: str, content: bytes) -> bytes:
        return struct.pack("<HB", len(content), ord(kind)) + content

    fields = "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;"
    out = io.BytesIO()
    out.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40)))
    topics = {"sensor_gyro": told.values[:, :3], "sensor_accel": told.values[:, 3:]}
    for topic in topics:
        out.write(message("F", f"{topic}:{fields}".encode()))
    for number, (topic, values) in enumerate(topics.items()):
        out.write(message("A", struct.pack("<BH", 0, number) + topic.encode()))
        for time, row in zip(told.time, values, strict=True):
            stamps = (round(1e6 * time) + 300, round(1e6 * time) + 50)
            out.write(message("D", struct.pack("<HQQfff", number, *stamps, *row)))
    (folder / f"{recording.name}.ulg").write_bytes(out.getvalue())


def _lines(path: Path, heads: str, channels: list[Series]) -> None:
    """A line whenever a device has a sample; what the others did not measure then stays empty.

    Nothing is brought to a common rate: that would colour the noise.
    """
    width = sum(channel.values.shape[1] for channel in channels)
    lines: list[tuple[float, list[str]]] = []
    first = 0
    for channel in channels:
        for time, row in zip(channel.time, channel.values, strict=True):
            cells = [""] * width
            cells[first : first + len(row)] = [f"{value:.6f}" for value in row]
            lines.append((float(time), cells))
        first += channel.values.shape[1]
    lines.sort(key=lambda line: line[0])
    told = [heads, *(",".join([f"{time:.6f}", *cells]) for time, cells in lines)]
    path.write_text("\n".join(told) + "\n", encoding="utf-8")


def _tensions(recording: Recording) -> list[Series]:
    return [_samples(recording.tension[f"cable_{i}"]) for i in range(1, 5)]


def _cells(recording: Recording, folder: Path) -> None:
    _lines(folder / f"{recording.name}.csv", CELLS, _tensions(recording))


def _all(recording: Recording, folder: Path) -> None:
    """The exciter's cells are not logged at rest."""
    parts = [*_tensions(recording), _samples(recording.imu)]
    if recording.exciter_force is not None:
        parts.append(recording.exciter_force)
    width = sum(part.values.shape[1] for part in parts)
    _lines(folder / f"{recording.name}.csv", ",".join(ALL.split(",")[: 1 + width]), parts)


def _ros1(made: ri.Simulated, folder: Path) -> None:
    """Bags of ROS 1 with a pose under the name that its driver gave it."""
    store = get_typestore(Stores.ROS1_NOETIC)
    types: Any = store.types
    (folder / "session").mkdir()
    for recording in made.session.recordings:
        told = _samples(recording.mocap)
        with Writer(folder / "session" / f"{recording.name}.bag") as bag:
            kind = "geometry_msgs/msg/PoseStamped"
            topic = bag.add_connection("/vrpn_client_node/bar/pose", kind, typestore=store)
            for i, (time, row) in enumerate(zip(told.time, told.values, strict=True)):
                stamp = recording.start_ns + round(1e9 * time)
                header = types["std_msgs/msg/Header"](
                    i, types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9), "world"
                )
                pose = types["geometry_msgs/msg/Pose"](
                    types["geometry_msgs/msg/Point"](*row[:3]),
                    types["geometry_msgs/msg/Quaternion"](*row[3:]),
                )
                content = store.serialize_ros1(types[kind](header, pose), kind)
                bag.write(topic, stamp, content)


MOCAP = {"mocap_position": 0.0003, "mocap_orientation": 0.001}
INERTIAL = {"angular_rate": 0.001, "specific_force": 0.02}


def _bar_seen(seed: int, rate: float) -> ri.Simulated:
    return turned(bar(mocap=at(0.4, 0.0, 0.0), noise=MOCAP), BAR, seed, mocap=rate)


def _bar_pulled(seed: int) -> ri.Simulated:
    """As in the import's page: pulled aside and let go, which turns it as well."""
    rig = bar(mocap=at(0.4, 0.0, 0.0), noise=MOCAP)
    return ri.simulate(rig, body=BAR, duration=10.0, rest=0.0, mocap=60.0, without=["tension"], seed=seed)


def _bar_felt(seed: int, depth: float) -> ri.Simulated:
    return turned(bar(imu=at(0.4, 0.0, depth), noise=INERTIAL), BAR, seed)


def _plate_seen(place: Mount, seed: int, rate: float) -> ri.Simulated:
    return turned(plate(mocap=place, noise=MOCAP), PLATE, seed, mocap=rate)


def _car(mounted: tuple[str, ...], seed: int, **more: Any) -> ri.Simulated:
    return ri.simulate(car(mounted), body=CAR, duration=12.0, rest=5.0, seed=seed, **more)


JZZ = ("Jzz",)
KINDS = {
    kind.page: kind
    for kind in (
        Kind("camera", lambda: _bar_pulled(3), _each(_camera), JZZ, CAMERA),
        Kind("one-angle", lambda: _bar_seen(4, 60.0), _each(_angle), JZZ, ANGLE),
        Kind("phone", lambda: _bar_felt(5, 0.0), _each(_phone), JZZ),
        Kind("drone", lambda: _bar_felt(6, -0.05), _each(_ulog), JZZ),
        Kind(
            "one-marker", lambda: _plate_seen(at(0.55, 0.17, 0.05), 7, 60.0), _each(_marker), ("m",), MARKER
        ),
        Kind("motion-capture", lambda: _plate_seen(at(0.3, 0.2, 0.05), 8, 120.0), _each(_mat), JZZ),
        Kind(
            "gyroscope",
            lambda: turned(plate(imu=at(0.3, 0.2, 0.05), noise=INERTIAL), PLATE, 9),
            _each(_gyroscope),
            JZZ,
            GYROSCOPE,
        ),
        Kind(
            "load-cells", lambda: _car((), 10, start="pulled", pull=0.12), _each(_cells), ("m", "Jzz"), CELLS
        ),
        Kind(
            "everything",
            lambda: _car(("imu", "exciter"), 11, start="rest", shake=[0.05, 0.7]),
            _each(_all),
            ("m", "Jxx", "Jyy", "Jzz"),
            ALL,
        ),
        Kind("ros-1-bag", lambda: _bar_seen(12, 100.0), _ros1, JZZ),
    )
}
