"""What runs between the nodes' messages: gates, lines, tracker, wrench and running estimate, without ROS."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.live.body_tracker import BodyTracker
from rig_identification.live.common_time import CommonTime
from rig_identification.live.generalized_wrench import generalized_wrench
from rig_identification.live.number_lines import LineBuffer, LineFormat
from rig_identification.live.plant import Plant, Shaking, odometry_values
from rig_identification.live.plant_blocks import DeviceSampler, PlantBlock
from rig_identification.live.plant_effects import PlantEffects, with_effects
from rig_identification.live.running_inertia import RunningInertia
from rig_identification.live.stamp_gate import RESTART, SECOND, StampGate
from rig_identification.model import layout, sensors
from rig_identification.model.body import tensor
from rig_identification.model.motion import rig_model
from rig_identification.nodes.session_folder import DiskFull, RecordingPlan, SessionFolder
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.session import read_session
from rig_identification.session.messages import serialize
from rig_identification.topics import Topic, expected_topics

START = 1_790_000_000 * SECOND
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
BODY = np.array([990.2, 0.69, 1.08, -1.07, 1108.6, -1.4, 31.7, 338.3, 18.3, 1295.9])


def make_rig() -> Rig:
    hinges = [
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1.69),
        ([3.5, 0.0, 0.0], [1.48, 0.03, 0.01], 2.034),
        ([0.0, 5.0, 0.0], [0.01, 2.51, 0.01], 1.968),
        ([3.5, 5.0, 0.0], [1.51, 2.52, 0.01], 2.246),
    ]
    cables = tuple(
        Cable(f"cable_{i + 1}", np.array(c), np.array(b), length) for i, (c, b, length) in enumerate(hinges)
    )
    return Rig(
        gravity=9.80665,
        cables=cables,
        mass=990.6,
        mass_std=0.5,
        imu=Mount(np.array([0.54, 1.43, -0.43]), np.array([0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])),
        inclinometer=Mount(np.zeros(3), LEVEL),
        exciter=Mount(np.array([0.0, 0.0, -1.5]), Rotation.from_euler("y", 45, degrees=True).as_quat()),
        noise={"specific_force": 0.01, "angular_rate": 0.0003, "inclination": 0.0003, "tension": 2.0},
    )


@pytest.fixture(scope="module")
def flight() -> dict[str, np.ndarray]:
    """20 s of a shaken car: exact rows, poses and twists at 1 kHz."""
    plant = Plant(rig_model(make_rig(), BODY), START)
    plant.shake(Shaking(np.array([150.0, 120.0, 60.0]), np.array([0.42, 0.71, 1.1])))
    rows, truth = [], []
    for _ in range(40):
        block, motion = plant.advance(0.5)
        rows.append(block.rows[:-1])
        truth += [odometry_values(motion, node) for node in range(500)]
    stamps = START + np.arange(20_000) * 1_000_000
    return {"stamp": stamps, "rows": np.concatenate(rows), "truth": np.array(truth)}


def imu_readings(rig: Rig, rows: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    assert rig.imu is not None
    R = Rotation.from_quat(rig.imu.orientation).as_matrix()
    true = sensors.imu(rows, rig.imu.position, R, np.zeros(sensors.IMU_SIZE)).values
    return true + rng.standard_normal(true.shape) * ([0.0003] * 3 + [0.01] * 3)


def energy_left(effects: PlantEffects) -> float:
    """Share of a swing's amplitude that 10 s of free motion leave."""
    plant = Plant(with_effects(rig_model(make_rig(), BODY), effects), START)
    plant.shake(Shaking(np.array([150.0, 120.0, 60.0]), np.array([0.42, 0.71, 1.1])))
    plant.advance(5.0)
    plant.stop_shaking()
    first, _ = plant.advance(5.0)
    plant.advance(10.0)
    last, _ = plant.advance(5.0)
    return float(np.std(last.rows[:, sensors.RATE]) / np.std(first.rows[:, sensors.RATE]))


def test_an_effect_that_is_switched_on_shows_in_the_plants_motion() -> None:
    free = energy_left(PlantEffects())
    assert 0.9 < free < 1.1
    assert energy_left(PlantEffects(hinge_damping=50.0)) < 0.9 * free
    rig = make_rig()
    ideal, tilted = (
        Plant(with_effects(rig_model(rig, BODY), effects), START)
        for effects in (PlantEffects(), PlantEffects(level_error=np.array([0.0, 0.01])))
    )
    down = [plant.advance(0.01)[0].rows[0, sensors.GRAVITY] for plant in (ideal, tilted)]
    assert np.linalg.norm(down[0]) == pytest.approx(np.linalg.norm(down[1]), rel=1e-12)
    assert np.linalg.norm(ideal.state.position - tilted.state.position) > 3e-4


def test_the_gate_counts_every_oddity_by_its_name() -> None:
    gate = StampGate()
    step = SECOND // 100
    stamps = START + step * np.arange(10)
    assert gate.admit(stamps, stamps).all()
    odd = np.array([0, stamps[-1], stamps[3], stamps[-1] + 3600 * SECOND, stamps[-1] + step])
    arrivals = stamps[-1] + step * np.arange(1, 6)
    assert gate.admit(odd, arrivals).tolist() == [False, False, False, False, True]
    assert (gate.zero, gate.duplicated, gate.backward, gate.ahead) == (1, 1, 1, 1)
    assert gate.admitted == 11
    assert gate.rejected == 4
    assert gate.rate == pytest.approx(100.0)


def test_the_gate_counts_what_a_gap_lacks() -> None:
    gate = StampGate()
    stamps = START + SECOND // 100 * np.array([0, 1, 2, 3, 4, 8, 9])
    gate.admit(stamps, stamps)
    assert (gate.gaps, gate.missing) == (1, 3)


def test_the_gate_follows_a_device_that_was_restarted_with_other_clock() -> None:
    gate = StampGate()
    first = START + SECOND // 100 * np.arange(100)
    gate.admit(first, first)
    arrivals = first[-1] + SECOND // 100 * np.arange(1, 201)
    again = arrivals - 500 * SECOND
    admitted = gate.admit(again, arrivals)
    assert gate.restarts == 1
    assert admitted[RESTART:].all()
    assert not admitted[: RESTART - 1].any()


def messages(topic: Topic, count: int, first: int = 0) -> tuple[list[bytes], list[int]]:
    stamps = START + SECOND // 100 * np.arange(first, first + count)
    rows = serialize(topic, stamps, np.random.default_rng(first).standard_normal((count, 1)) + 2400.0)
    return [row.tobytes() for row in rows], stamps.tolist()


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_recording_ends_in_good_order_before_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, storage: str
) -> None:
    rig = make_rig()
    topics = expected_topics(tuple(cable.name for cable in rig.cables))
    topic = topics["/rig/cable_1/wrench"]
    folder = SessionFolder(tmp_path / "session", rig, topics, storage)
    folder.start(RecordingPlan("run_1", "dynamic"))
    folder.add(topic.name, *messages(topic, 500))
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage._replace(free=1_000_000))
    with pytest.raises(DiskFull, match=r"recording run_1 ended: .* MiB are left"):
        folder.add(topic.name, *messages(topic, 500, first=500))
    assert folder.plan is None
    monkeypatch.undo()
    folder.add(topic.name, *messages(topic, 10, first=1000))  # nothing is open: nothing happens
    (run,) = read_session(tmp_path / "session").recordings
    assert len(run.tension["cable_1"].time) == 500
    with pytest.raises(InputError, match=r"run_1: is in .* already"):
        folder.start(RecordingPlan("run_1", "dynamic"))


def test_a_window_without_a_message_leaves_nothing(tmp_path: Path) -> None:
    rig = make_rig()
    folder = SessionFolder(tmp_path / "session", rig, expected_topics(("cable_1",)), "mcap")
    folder.start(RecordingPlan("run_1", "dynamic"))
    assert folder.stop() is None
    assert list((tmp_path / "session").iterdir()) == []


@pytest.mark.parametrize(
    ("name", "kind", "holdout", "words"),
    [
        ("../elsewhere", "dynamic", False, "no folder's name"),
        ("run_1", "dynmic", False, "is unknown; give static or dynamic"),
        ("rest", "static", True, "cannot be held out"),
    ],
)
def test_a_plan_that_makes_no_sense_is_refused(name: str, kind: str, holdout: bool, words: str) -> None:
    with pytest.raises(InputError, match=words):
        RecordingPlan(name, kind, holdout)


def test_half_a_line_is_no_smaller_number() -> None:
    form = LineFormat((0, 2), np.array([2.0, 1.0]), np.array([0.0, -1.0]), ";")
    parsed = form.parse("1.5;9;4.0\r")
    assert parsed is not None
    assert parsed[0] is None
    assert parsed[1].tolist() == [3.0, 3.0]
    assert form.parse("1.5;9") is None
    assert form.parse("1.5;9;4.0e") is None
    buffer = LineBuffer()
    assert buffer.add(b"23;1;1\n1;2;") == []
    assert buffer.add(b"3\n4;5;6\n7") == ["1;2;3", "4;5;6"]


def test_a_device_samples_blocks_as_it_would_sample_the_whole() -> None:
    rows = np.arange(101.0)[:, None] ** 2
    whole = DeviceSampler(333.0)
    times, values = whole.sample(PlantBlock(START, 0.001, rows))
    pieces = DeviceSampler(333.0)
    parts = [
        pieces.sample(PlantBlock(START + a * 1_000_000, 0.001, rows[a : b + 1]))
        for a, b in ((0, 7), (7, 8), (8, 60), (60, 100))
    ]
    assert np.array_equal(np.concatenate([p[0] for p in parts]), times)
    assert np.allclose(np.concatenate([p[1] for p in parts]), values)
    assert len(times) == 34


def test_common_time_waits_for_the_slowest_and_gives_up_gaps() -> None:
    common = CommonTime({"lead": 1, "other": 1})
    ms = 1_000_000
    lead = START + 10 * ms * np.arange(30)
    common.add("lead", lead, np.arange(30.0)[:, None])
    common.add("other", lead[:10] + ms, 10.0 * np.arange(10.0)[:, None] + 1.0)
    stamps, values = common.take("lead")
    # the first instant lies before the other's first sample; the tenth after its last
    assert stamps.tolist() == lead[1:10].tolist()
    assert np.allclose(values["other"][:, 0], 10.0 * np.arange(1, 10))
    common.add("other", lead[20:] + ms, 10.0 * np.arange(20.0, 30.0)[:, None] + 1.0)
    stamps, _ = common.take("lead")
    assert stamps.tolist() == lead[21:30].tolist()  # 10 to 20 lie in a gap of 0.1 s
    assert common.given_up == 12


def test_the_wrench_is_newtons_and_eulers(flight: dict[str, np.ndarray]) -> None:
    """With weight, force is m a of the centre of mass, and the moment J alpha + w x J w."""
    rig, rows = make_rig(), flight["rows"][::100]
    n = len(rig.cables)
    tension = rows[:, layout.OUT_TENSION : layout.OUT_TENSION + n]
    wrench = generalized_wrench(
        rig, flight["truth"][::100, :7], tension, rows[:, -3:], BODY[1:4], BODY[0] * rig.gravity
    )
    w, alpha = rows[:, sensors.RATE], rows[:, sensors.ANGULAR_ACCELERATION]
    datum = rows[:, sensors.SPECIFIC_FORCE] + rows[:, sensors.GRAVITY]
    com = datum + np.cross(alpha, BODY[1:4]) + np.cross(w, np.cross(w, BODY[1:4]))
    J = tensor(BODY[4:])
    euler = alpha @ J + np.cross(w, w @ J)
    assert np.allclose(wrench[:, :3], BODY[0] * com, atol=1e-6 * BODY[0] * rig.gravity)
    assert np.allclose(wrench[:, 3:], euler, atol=1e-6 * BODY[0] * rig.gravity)


@pytest.mark.parametrize("integrate_only", [False, True])
def test_the_tracker_holds_where_integration_drifts(
    flight: dict[str, np.ndarray], integrate_only: bool
) -> None:
    rig, rng = make_rig(), np.random.default_rng(4)
    imu = imu_readings(rig, flight["rows"], rng)[::5]
    imu += np.array([0.0, 0.0, 0.0, 0.01, -0.015, 0.01])  # an accelerometer bias within its tolerance
    stamps, truth = flight["stamp"][::5], flight["truth"][::5]
    up = np.arcsin(-flight["rows"][:, sensors.GRAVITY][:, :2] / rig.gravity)[::20]
    up += 0.0003 * rng.standard_normal(up.shape)
    tension = flight["rows"][:, layout.OUT_TENSION : layout.OUT_TENSION + 4][::5]
    tracker = BodyTracker(rig, integrate_only)
    poses, covariances = [], []
    for k in range(0, len(stamps), 10):
        tracker.add_inclination(flight["stamp"][::20][k // 4 : (k + 10) // 4], up[k // 4 : (k + 10) // 4])
        for i, cable in enumerate(rig.cables):
            tracker.add_tension(cable.name, stamps[k : k + 10], tension[k : k + 10, i : i + 1])
        tracked = tracker.add_imu(stamps[k : k + 10], imu[k : k + 10])
        poses.append(tracked.pose)
        covariances.append(tracked.pose_covariance)
    error = np.concatenate(poses)[2000:] - truth[2000:, :7]
    error *= np.where(np.sum(np.concatenate(poses)[2000:, 3:] * truth[2000:, 3:7], axis=1) < 0, np.nan, 1.0)[
        :, None
    ]
    rms = np.sqrt(np.mean(error[:, :3] ** 2, axis=0))
    if integrate_only:
        assert np.max(rms) > 0.5
    else:
        std = np.sqrt(np.mean(np.concatenate(covariances)[2000:, range(3), range(3)], axis=0))
        assert np.max(rms) < 0.002
        assert np.all(rms < 3.0 * std)
        assert np.max(np.abs(error[:, 3:])) < 0.002


def test_the_running_estimate_nears_the_truth_and_knows_how_far_it_is(flight: dict[str, np.ndarray]) -> None:
    rig, rng = make_rig(), np.random.default_rng(5)
    running = RunningInertia(rig)
    chosen = slice(0, None, 10)
    rows = flight["rows"][chosen]
    tension = rows[:, layout.OUT_TENSION : layout.OUT_TENSION + 4] + 2.0 * rng.standard_normal((len(rows), 4))
    running.add(flight["stamp"][chosen][:300], flight["truth"][chosen][:300], tension[:300], rows[:300, -3:])
    assert running.estimate() is None  # 3 s are too few windows
    running.add(flight["stamp"][chosen][300:], flight["truth"][chosen][300:], tension[300:], rows[300:, -3:])
    estimate = running.estimate()
    assert estimate is not None
    std = np.sqrt(np.diag(estimate.covariance))
    assert np.all(np.abs(estimate.elements - BODY) < 4.0 * std + 1e-9)
    assert np.all(std[[4, 7, 9]] < 0.2 * BODY[[4, 7, 9]])
