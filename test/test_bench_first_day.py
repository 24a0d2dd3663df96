"""The bench of set-up faults: what its faults do to a session, and how answers are marked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("mujoco", reason="the bench's engine is not installed: pip install '.[dev]'")

from bench.concealed.draw import draw_scene
from bench.concealed.inertia import add_point
from bench.first_day.faults import all_cases
from bench.first_day.faults.axes import label, signed_permutations
from bench.first_day.faults.base import Case
from bench.first_day.judge import marked, remains
from bench.first_day.run import false_alarms
from bench.first_day.sessions import received
from bench.first_day.small import resized
from bench.first_day.tracker import watched
from rig_identification.examination import Examination, SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.recording import Dummy, Recording, Series, Session
from rig_identification.rig import Cable, Mount, Rig

START = 1_793_000_000_000_000_000
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
TENSIONS = {"cable_1": 300.0, "cable_2": 250.0, "cable_3": 450.0}  # N, at rest


def rig() -> Rig:
    points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 3.0, 0.0]])
    cables = tuple(
        Cable(f"cable_{i + 1}", p + np.array([0.0, 0.0, 2.5]), p, 2.5) for i, p in enumerate(points)
    )
    turned = Rotation.from_euler("z", 90.0, degrees=True).as_quat()
    return Rig(
        9.80665,
        cables,
        mass=1000.0 / 9.80665,
        mass_std=0.1,
        imu=Mount(np.array([0.5, 0.8, -0.3]), LEVEL),
        inclinometer=Mount(np.zeros(3), turned),
        exciter=Mount(np.array([0.0, 0.0, -1.0]), turned),
        mocap=Mount(np.array([0.1, 0.2, 0.3]), LEVEL),
    )


def channel(device: str, kind: str, interval: float, begin: int, values: np.ndarray) -> RawChannel:
    stamps = begin + np.round(np.arange(len(values)) * interval * 1e9).astype(np.int64)
    cable = device if kind == "tension" else None
    return RawChannel(f"/rig/{device}", kind, "", stamps, stamps + 2_000_000, values, cable)


def recording(name: str, kind: str, begin: int, dummy: Dummy | None = None) -> RawRecording:
    rng = np.random.default_rng(begin // 1_000_000_000)
    moves = 0.0 if kind == "static" else 1.0
    n = 1000  # 2 s of tensions
    swing = moves * np.sin(2.0 * np.pi * 1.3 * np.arange(n) * 0.002)[:, None]
    more = 0.0 if dummy is None else dummy.mass * 9.80665 / 3.0
    channels = [
        channel(c, "tension", 0.002, begin, rest + more + 40.0 * swing + rng.normal(0.0, 1.0, (n, 1)))
        for c, rest in TENSIONS.items()
    ]
    slow = swing[::5]
    imu = np.array([0.05, -0.2, 0.1, 0.3, 0.5, 0.0]) * slow + [0.0, 0.0, 0.0, 0.0, 0.0, 9.8]
    channels.append(channel("imu", "imu", 0.01, begin + 3_000_000, imu + rng.normal(0.0, 1e-3, imu.shape)))
    inclination = np.array([0.02, -0.01]) * slow[::5] + rng.normal(0.0, 3e-4, (len(slow[::5]), 2))
    channels.append(channel("inclinometer", "inclination", 0.05, begin + 7_000_000, inclination))
    attitude = Rotation.from_rotvec(np.array([0.02, 0.01, 0.03]) * slow).as_quat()
    place = np.array([0.2, 0.1, 1.5]) + 0.02 * slow
    channels.append(channel("mocap", "mocap", 0.01, begin, np.concatenate([place, attitude], axis=1)))
    force = np.array([20.0, 10.0, 0.0]) * swing + rng.normal(0.0, 0.1, (n, 3))
    channels.append(channel("exciter", "exciter_force", 0.002, begin, force))
    truth = np.concatenate([place, attitude, np.zeros((len(place), 6))], axis=1)
    channels.append(channel("ground_truth", "ground_truth", 0.01, begin, truth))
    return RawRecording(name, kind, name == "run_2", name, tuple(channels), dummy=dummy)


@pytest.fixture(scope="module")
def raw() -> RawSession:
    dummy = Dummy(8.0, np.array([0.4, 1.2, -0.2]))
    second = 1_000_000_000
    return RawSession(
        "small_bench",
        rig(),
        (
            recording("static_bare", "static", START),
            recording("static_dummy", "static", START + 300 * second, dummy),
            recording("run_1", "dynamic", START + 600 * second),
            recording("run_2", "dynamic", START + 900 * second),
        ),
    )


@pytest.fixture(scope="module")
def cases(raw: RawSession) -> dict[str, Case]:
    return {case.name: case for case in all_cases(raw)}


def of(session: RawSession, device: str, name: str = "run_1") -> RawChannel:
    found = next(r for r in session.recordings if r.name == name).channel(device)
    assert found is not None
    return found


def same(one: RawSession, other: RawSession) -> bool:
    """Equal in what is recorded and in what is described."""
    pairs = zip(one.recordings, other.recordings, strict=True)
    return repr(one.rig) == repr(other.rig) and all(
        len(a.channels) == len(b.channels)
        and repr(a.dummy) == repr(b.dummy)
        and all(
            x.topic == y.topic
            and np.array_equal(x.stamp_ns, y.stamp_ns)
            and np.array_equal(x.received_ns, y.received_ns)
            and np.array_equal(x.values, y.values)
            for x, y in zip(a.channels, b.channels, strict=True)
        )
        for a, b in pairs
    )


def test_every_fault_changes_the_session_and_the_same_seed_changes_it_alike(
    raw: RawSession, cases: dict[str, Case]
) -> None:
    assert len(cases) == len(all_cases(raw)) > 250
    for case in cases.values():
        faulty = case.session(raw, 3)
        assert not same(faulty, raw), case.name
        assert same(faulty, case.session(raw, 3)), case.name


def test_a_fault_of_one_device_leaves_the_others_alone(raw: RawSession, cases: dict[str, Case]) -> None:
    for case in cases.values():
        if len(case.channels) != 1 or case.session(raw, 0).rig is not raw.rig:
            continue
        for before, after in zip(raw.recordings, case.session(raw, 0).recordings, strict=True):
            for a, b in zip(before.channels, after.channels, strict=True):
                if a.device not in case.channels:
                    assert a is b, f"{case.name}: {a.device}"


@pytest.mark.parametrize(
    ("name", "device", "columns", "factor"),
    [
        ("unit/all_cells/kgf", "cable_2", slice(0, 1), 1.0 / 9.80665),
        ("unit/all_cells/gf", "cable_1", slice(0, 1), 101.97162),
        ("unit/all_cells/lbf", "cable_3", slice(0, 1), 0.22480894),
        ("unit/mocap/inch", "mocap", slice(0, 3), 39.370079),
        ("unit/imu/degrees_per_second", "imu", slice(0, 3), 57.295780),
        ("unit/imu/milli_g", "imu", slice(3, 6), 101.97162),
        ("unit/inclinometer/degrees", "inclinometer", slice(0, 2), 57.295780),
    ],
)
def test_units_are_those_of_the_books(
    raw: RawSession, cases: dict[str, Case], name: str, device: str, columns: slice, factor: float
) -> None:
    faulty = cases[name].session(raw, 0)
    before, after = of(raw, device).values, of(faulty, device).values
    assert after[:, columns] == pytest.approx(factor * before[:, columns], rel=1e-7)
    others = np.delete(np.arange(before.shape[1]), columns)
    assert np.array_equal(after[:, others], before[:, others])


def test_swapping_twice_undoes(raw: RawSession, cases: dict[str, Case]) -> None:
    twice = ("wiring/swapped/cable_1_cable_3", "wiring/negative/all_cells", "wiring/files/runs_swapped")
    involutions = [c for c in cases.values() if c.name in twice or "mirrored" in c.name]
    assert len(involutions) == 9
    for case in involutions:
        back = case.session(case.session(raw, 0), 0)
        left = remains(back, raw)
        assert left.values < 1e-3, case.name
        assert left.stamps == 0.0, case.name


def test_signed_permutations_are_all_of_them() -> None:
    three = signed_permutations(3)
    assert len({label(m) for m in three}) == len(three) == 47
    assert sum(np.linalg.det(m) > 0.0 for m in three) == 23
    assert len(signed_permutations(2)) == 7
    # -y+x+z: the first axis carries minus y
    matrix = next(m for m in three if label(m) == "-y+x+z")
    assert (matrix @ np.array([1.0, 2.0, 3.0])).tolist() == [-2.0, 1.0, 3.0]


def test_a_mirrored_tracker_mirrors_rates_as_a_mirror_does(raw: RawSession, cases: dict[str, Case]) -> None:
    def rates(session: RawSession) -> np.ndarray:
        turns = Rotation.from_quat(of(session, "mocap").values[:, 3:7])
        return (turns[1:] * turns[:-1].inv()).as_rotvec()

    mirror = np.diag([1.0, -1.0, 1.0])
    shown = rates(cases["axes/mocap/mirrored_y"].session(raw, 0))
    # An axial vector: its component along the mirror's normal stays, the others turn round
    assert shown == pytest.approx(-rates(raw) @ mirror, abs=1e-12)


def test_linear_acceleration_is_what_gravity_leaves(raw: RawSession, cases: dict[str, Case]) -> None:
    still = of(cases["axes/imu/gravity_removed/by_rest"].session(raw, 0), "imu", "static_bare")
    assert np.mean(still.values[:, 3:], axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    moving = of(cases["axes/imu/gravity_removed/by_attitude"].session(raw, 0), "imu", "static_bare")
    assert np.mean(moving.values[:, 3:], axis=0) == pytest.approx([0.0, 0.0, 9.8 - 9.80665], abs=1e-3)


def test_counts_wrap_where_their_range_ends(raw: RawSession, cases: dict[str, Case]) -> None:
    name = next(n for n in cases if n.startswith("cells/wrapped_16_bits/all_cells/20"))
    before, after = of(raw, "cable_1").values, of(cases[name].session(raw, 0), "cable_1").values
    wrapped = after < 0.0
    assert np.mean(wrapped) == pytest.approx(0.2, abs=0.03)
    turns = (before - after)[wrapped]
    step = np.min(np.diff(np.unique(after)))
    assert turns == pytest.approx(np.full(turns.shape, 65536 * step), rel=1e-3)
    assert after[~wrapped] == pytest.approx(before[~wrapped], abs=0.51 * step)


def test_a_mean_of_a_window_is_late_by_half_of_it(raw: RawSession, cases: dict[str, Case]) -> None:
    name = next(n for n in cases if n.startswith("cells/averaged/all_cells/200"))
    before, after = of(raw, "cable_1").values[:, 0], of(cases[name].session(raw, 0), "cable_1").values[:, 0]
    late = [np.sum((after[200:] - before[200 - k : len(before) - k]) ** 2) for k in range(100)]
    assert abs(int(np.argmin(late)) - 50) <= 2  # 0.1 s of 0.002 s


@pytest.mark.parametrize(
    ("variant", "expected"),
    [
        ("nanoseconds_overflow/imu/all_in_nanosec", lambda s, ns: s * 10**9 + (s * 10**9 + ns) % 2**32),
        ("nanoseconds_overflow/imu/cut_to_32_bits", lambda s, ns: (s * 10**9 + ns) % 2**32),
        ("nanoseconds_unpadded/imu/nanoseconds", lambda s, ns: s * 10**9 + int(f"{ns}".ljust(9, "0"))),
        (
            "nanoseconds_unpadded/imu/milliseconds",
            lambda s, ns: s * 10**9 + int(f"{ns // 10**6}".ljust(9, "0")),
        ),
    ],
)
def test_stamps_are_written_as_a_careless_driver_does(raw, cases, variant, expected) -> None:  # type: ignore[no-untyped-def]
    before = of(raw, "imu").stamp_ns.tolist()
    after = of(cases[f"stamps/{variant}"].session(raw, 0), "imu").stamp_ns.tolist()
    assert after == [expected(*divmod(t, 10**9)) for t in before]


def test_clocks_are_off_by_what_they_say(raw: RawSession, cases: dict[str, Case]) -> None:
    def late(name: str, device: str = "imu") -> np.ndarray:
        changed = of(cases[f"stamps/{name}"].session(raw, 0), device).stamp_ns
        return np.asarray((changed - of(raw, device).stamp_ns) / 1e9)

    assert late("leap_seconds/imu/+37_s") == pytest.approx(37.0)
    assert np.unique(late("clock_step/imu/-0.5_s")).tolist() == [-0.5, 0.0]
    seconds = (of(raw, "imu").stamp_ns - of(raw, "imu").stamp_ns[0]) / 1e9
    assert late("clock_drift/imu/+300_ppm") == pytest.approx(3e-4 * seconds, abs=1e-9)
    # The host's clock steps once, for all that it stamps
    steps = [
        np.argmax(late("clock_step/all/+30_s", d) > 1.0) * t for d, t in (("imu", 0.01), ("cable_1", 0.002))
    ]
    assert steps[0] == pytest.approx(steps[1], abs=0.015)


def test_bursts_hold_back_and_never_hand_over_early(raw: RawSession, cases: dict[str, Case]) -> None:
    for name in ("usb_bursts/imu/64_ms", "arrival_time/imu/6_ms"):
        faulty = of(cases[f"stamps/{name}"].session(raw, 0), "imu")
        late = (faulty.stamp_ns - of(raw, "imu").stamp_ns) / 1e9
        assert np.min(late) >= 0.0
        assert np.all(np.diff(faulty.stamp_ns) >= 0)
        assert np.all(faulty.received_ns > faulty.stamp_ns)
    assert (
        np.median(np.diff(of(cases["stamps/usb_bursts/imu/64_ms"].session(raw, 0), "imu").stamp_ns)) == 70_000
    )


def test_a_recorder_receives_in_order_and_late(raw: RawSession) -> None:
    for recording in received(raw, 1).recordings:
        for one in recording.channels:
            assert np.all(one.received_ns > one.stamp_ns)
            assert np.all(np.diff(one.received_ns) >= 0)


def test_a_small_rig_is_the_big_one_by_the_laws_of_a_pendulum() -> None:
    big = draw_scene(2, 12.0)
    small = resized(big, 0.2, 0.005)
    assert small.body.mass == pytest.approx(0.005 * big.body.mass)
    about_hinge = [add_point(s.body, s.body.mass, np.zeros(3)).inertia for s in (small, big)]
    assert about_hinge[0] == pytest.approx(0.005 * 0.04 * about_hinge[1])
    forces = [s.plans[2].motor.unbalance * s.plans[2].motor.frequency ** 2 for s in (small, big)]  # type: ignore[union-attr]
    assert forces[0] == pytest.approx(0.005 * forces[1])
    # Described to the same share of its size
    errors = [s.rig.cables[0].length - s.geometry.length[0] for s in (small, big)]
    assert errors[0] == pytest.approx(0.2 * errors[1], abs=2e-7)


def test_a_tracker_sees_the_marker_turn_with_the_body(raw: RawSession) -> None:
    truth = of(raw, "ground_truth")
    series = Series((truth.stamp_ns - truth.stamp_ns[0]) / 1e9, truth.values)
    one = Recording("run_1", "dynamic", False, START, 2.0, ground_truth=series)
    seen = watched(Session("s", rig(), (one,)), 5, 1.0, described=True, inclinometer=False)
    assert seen.rig.inclinometer is None
    poses = seen.recordings[0].mocap
    assert poses is not None
    bodies = Rotation.from_quat(truth.values[::2, 3:7])[-len(poses.time) :]
    markers = Rotation.from_quat(poses.values[:, 3:7])
    turned = (markers[0].inv() * markers).magnitude()
    assert turned == pytest.approx((bodies[0].inv() * bodies).magnitude(), abs=0.01)


def fault(effect: str, where: dict[str, object], **more: object) -> SetupFault:
    parameters = {k: {"value": v, "std": 0.0, "unit": "1"} for k, v in more.pop("parameters", {}).items()}  # type: ignore[attr-defined]
    return SetupFault(effect, where, parameters, "It is so.", "Mend it.", "", True, 9.0, **more)  # type: ignore[arg-type]


def outcome(case: Case, *faults: SetupFault) -> str:
    return marked(Examination("s", (), (), faults), case).outcome


def test_answers_are_marked_by_effect_channel_and_kind(raw: RawSession, cases: dict[str, Case]) -> None:
    everywhere, one = cases["unit/all_cells/kgf"], cases["unit/imu/g"]
    drift = cases["stamps/clock_drift/imu/+300_ppm"]
    assert outcome(one, fault("unit", {"channel": "imu"})) == "named"
    assert outcome(one, fault("unit", {"channel": "cable_1"})) == "wrong"
    assert outcome(one, fault("axes", {"channel": "imu"}), fault("unit", {"channel": "imu"})) == "later"
    assert outcome(one) == "silent"
    assert outcome(everywhere, fault("unit", {"channel": None})) == "named"
    assert outcome(everywhere, fault("unit", {"channel": "cable_1, cable_2 and cable_3"})) == "named"
    assert outcome(drift, fault("stamp_error", {"channel": "imu", "kind": "clock_drift"})) == "named"
    assert outcome(drift, fault("stamp_error", {"channel": "imu", "kind": "clock_step"})) == "other kind"
    rival = {"effect": "unit", "where": {"channel": "imu"}, "log_likelihood_gap": 1.0}
    assert outcome(one, fault("axes", {"channel": "imu"}, alternatives=(rival,))) == "tie"


def test_a_factor_counts_either_way_round_and_to_a_percent(cases: dict[str, Case]) -> None:
    case = cases["unit/imu/g"]
    for value, right in ((9.80665, True), (1.0 / 9.80665, True), (9.6, False)):
        told = fault("unit", {"channel": "imu"}, parameters={"factor": value})
        assert marked(Examination("s", (), (), (told,)), case).amount_right is right


def test_an_ordinary_effect_is_no_false_alarm_in_its_own_place_alone() -> None:
    truth = {"effects": [{"effect": "load_cell_gain", "where": {"channel": "cable_2"}}]}
    for channel_name, alarms in (("cable_2", 0), ("cable_1", 1)):
        examination = Examination("s", (), (), (fault("load_cell_gain", {"channel": channel_name}),))
        assert len(false_alarms(examination, truth)) == alarms
    told = Examination("s", (), (), (fault("unit", {"channel": "cable_2"}),))
    assert len(false_alarms(told, truth)) == 1


def test_what_remains_is_measured_in_noise_and_lost_channels(raw: RawSession, cases: dict[str, Case]) -> None:
    assert remains(raw, raw).values == 0.0
    assert remains(cases["unit/imu/g"].session(raw, 0), raw).values > 100.0
    without = tuple(
        replace(r, channels=tuple(c for c in r.channels if c.device != "imu")) for r in raw.recordings
    )
    assert remains(replace(raw, recordings=without), raw).left_out == ("imu",)
