"""The simulator: what it records is the forward model's, with doubts, noise and clocks as described."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.api.truth import truth_document
from rig_identification.cli.effects import effect_of, effects_document, effects_given
from rig_identification.errors import InputError
from rig_identification.live.plant_effects import with_effects
from rig_identification.live.plant_switches import effects_of
from rig_identification.model.body import tensor
from rig_identification.model.motion import rig_model
from rig_identification.recording import Dummy, Recording, Series, Session
from rig_identification.rig import Mount
from rig_identification.session import read_rig, read_session, write_session
from rig_identification.simulate import (
    AtRest,
    Posed,
    Pulled,
    RunSpec,
    SampleRates,
    SessionSpec,
    StaticSpec,
    UnbalancedMass,
    case_spec,
    simulate_session,
)
from rig_identification.simulate.start import rest_state
from rig_identification.thesis import load_case

RATES = SampleRates(tension=200.0, exciter=200.0, shaft=50.0, imu=100.0, inclinometer=50.0, mocap=60.0)
CONFIG = Path(__file__).parents[1] / "config"
CAR = load_case(14)
WEIGHT = CAR.mass * CAR.rig.gravity
PULL = Pulled(0.06 * WEIGHT * np.array([0.6, 0.8, 0.0]), CAR.center_of_mass + np.array([0.3, 0.2, 0.0]))
MOTOR = UnbalancedMass(0.05 * WEIGHT / (2.0 * np.pi * 0.7) ** 2, 0.7, ramp=1.0)


def car(*runs: RunSpec, **changes: object) -> SessionSpec:
    """The car of case study 14 with ``runs``, exactly as described and without noise."""
    spec = case_spec(CAR, rest=2.0, rates=RATES, noise=False, doubts=False)
    return replace(spec, runs=runs, **changes)


def recorded(spec: SessionSpec, seed: int = 0) -> Recording:
    return simulate_session(spec, np.random.default_rng(seed))[0].recordings[-1]


def truth_at(recording: Recording, time: np.ndarray) -> np.ndarray:
    """Odometry at other instants."""
    odometry = recording.ground_truth
    return np.stack([np.interp(time, odometry.time, column) for column in odometry.values.T], axis=1)


def test_at_rest_vertical_cables_carry_the_weight_and_the_dummy() -> None:
    rig = read_rig(CONFIG / "trifilar.yaml")
    elements = np.array([42.0, 0.3, 0.18, -0.12, 1.9, 0.03, -0.05, 2.4, 0.02, 3.6])
    dummy = Dummy(3.0, np.array([0.1, 0.2, 0.0]))
    statics = (StaticSpec("bare", 1.0), StaticSpec("dummy", 1.0, dummy))
    spec = SessionSpec("plate", rig, elements, statics=statics, noise=False, doubts=False)
    session, _ = simulate_session(spec, np.random.default_rng(0))
    hinges = np.array([cable.body_point for cable in rig.cables])
    for recording, mass, moment in zip(
        session.recordings,
        (42.0, 45.0),
        (42.0 * elements[1:3], 42.0 * elements[1:3] + 3.0 * dummy.position[:2]),
        strict=True,
    ):
        tension = np.array([recording.tension[cable.name].values[:, 0] for cable in rig.cables])
        assert np.ptp(tension, axis=1) == pytest.approx(np.zeros(3), abs=1e-12)
        assert np.sum(tension[:, 0]) == pytest.approx(mass * rig.gravity, rel=1e-9)
        # Level, as the hinges and lengths are, so that moments balance about both axes
        assert tension[:, 0] @ hinges[:, :2] == pytest.approx(moment * rig.gravity, rel=1e-4)


def test_a_run_from_rest_without_force_stays_at_rest() -> None:
    run = recorded(car(RunSpec("still", 2.0, AtRest())))
    assert np.ptp(run.ground_truth.values[:, :7], axis=0) == pytest.approx(np.zeros(7), abs=1e-7)


def test_pulled_and_let_go_the_body_swings_through_rest_with_its_energy_kept() -> None:
    run = recorded(car(RunSpec("swing", 6.0, PULL)))
    pose, twist = run.ground_truth.values[:, :7], run.ground_truth.values[:, 7:]
    center = np.array([CAR.center_of_mass])
    turns = Rotation.from_quat(pose[:, 3:])
    height = (pose[:, :3] + turns.apply(np.repeat(center, len(pose), axis=0)))[:, 2]
    speed = twist[:, :3] + np.cross(twist[:, 3:], center)
    spin = np.einsum("ni,ij,nj->n", twist[:, 3:], CAR.inertia, twist[:, 3:])
    energy = 0.5 * CAR.mass * np.sum(speed**2, axis=1) + 0.5 * spin + WEIGHT * height
    kinetic = energy - WEIGHT * height
    assert kinetic[0] < 0.25 * kinetic.max(), "0.06 s, a fifteenth of a period, after it was let go"
    assert np.ptp(energy) < 1e-5 * kinetic.max()


def test_the_pull_bends_the_start_its_own_way() -> None:
    places = []
    for sign in (-1.0, 1.0):
        run = recorded(car(RunSpec("swing", 1.0, Pulled(sign * PULL.force, PULL.point))))
        pose = run.ground_truth.values[0, :7]
        places.append(pose[:3] + Rotation.from_quat(pose[3:]).apply(PULL.point))
    assert (places[1] - places[0]) @ PULL.force > 0.001 * np.linalg.norm(PULL.force)


def test_a_given_pose_is_kept_and_one_off_the_cables_refused() -> None:
    start = Posed(CAR.position, CAR.orientation)
    run = recorded(car(RunSpec("thesis", 1.0, start), rods=True))
    assert run.ground_truth.values[0, :3] == pytest.approx(CAR.position, abs=0.02)
    lifted = Posed(CAR.position + np.array([0.0, 0.0, 0.4]), CAR.orientation)
    with pytest.raises(InputError, match="away from the given one"):
        recorded(car(RunSpec("lifted", 1.0, lifted)))


def test_the_exciter_pulls_with_m_r_w_squared_in_its_plane() -> None:
    time = np.linspace(0.0, 5.0, 5001)
    force, shaft = MOTOR(time), MOTOR.shaft(time)
    full = time > 1.0
    assert np.linalg.norm(force[full], axis=1) == pytest.approx(0.05 * WEIGHT, rel=1e-12)
    assert np.all(force[:, 2] == 0.0)
    assert np.gradient(shaft[:, 0], time)[1:-1] == pytest.approx(shaft[1:-1, 1], abs=2e-3)
    # The mass itself obeys Newton: the force is the reaction to its acceleration about the shaft
    arm = np.stack([np.cos(shaft[:, 0]), np.sin(shaft[:, 0])], axis=1)
    acceleration = np.gradient(np.gradient(arm, time, axis=0), time, axis=0)
    assert force[3:-3, :2] == pytest.approx(-MOTOR.unbalance * acceleration[3:-3], abs=1e-3 * 0.05 * WEIGHT)
    with pytest.raises(InputError, match="plane 'zz'"):
        UnbalancedMass(1.0, 1.0, "zz")


def test_a_force_along_world_axes_is_measured_in_the_turning_exciter_frame() -> None:
    case = load_case(7)
    spec = replace(case_spec(case, duration=3.0, noise=False, doubts=False, rods=True), rates=RATES)
    run = recorded(replace(spec, runs=spec.runs[:1]))
    turns = Rotation.from_quat(truth_at(run, run.exciter_force.time)[:, 3:7])
    in_world = turns.apply(run.exciter_force.values)
    time = run.exciter_force.time
    # The recording starts 0.05 s after the run and some samples later; steps blur by one node
    begin = 0.05
    given = np.array([case.force(time + begin + shift) for shift in (-0.008, 0.0, 0.008)])
    steady = np.all(np.abs(np.diff(given, axis=0)) < 5.0, axis=(0, 2))
    assert np.count_nonzero(steady) > 100
    assert in_world[steady] == pytest.approx(given[1][steady], abs=6.0)


def test_sensors_see_the_same_motion_at_their_own_instants() -> None:
    run = recorded(car(RunSpec("run", 4.0, PULL, MOTOR)))
    rate = truth_at(run, run.imu.time)[:, 10:13]
    assert run.imu.values[5:-5, :3] == pytest.approx(rate[5:-5], abs=2e-4)
    instants = [run.imu.time[3], run.inclination.time[3], *(s.time[3] for s in run.tension.values())]
    assert len({round(t, 7) for t in instants}) == len(instants), "no two devices sample together"
    z = Rotation.from_quat(truth_at(run, run.inclination.time)[:, 3:7]).as_matrix()[:, 2, :2]
    assert run.inclination.values[2:-2] == pytest.approx(np.arcsin(z)[2:-2], abs=2e-4)


def test_motion_capture_sees_the_marker_frame_from_its_tracker() -> None:
    turned = Rotation.from_euler("xyz", [0.3, -0.2, 1.0])
    marker = Mount(np.array([0.4, -0.1, 0.2]), turned.as_quat())
    spec = car(RunSpec("run", 3.0, PULL))
    run = recorded(replace(spec, rig=replace(spec.rig, mocap=marker)))
    truth = truth_at(run, run.mocap.time)
    body = Rotation.from_quat(truth[:, 3:7] / np.linalg.norm(truth[:, 3:7], axis=1, keepdims=True))
    tracker = Rotation.from_quat(spec.world_in_tracker.orientation)
    place = tracker.apply(truth[:, :3] + body.apply(marker.position)) + spec.world_in_tracker.position
    assert run.mocap.values[2:-2, :3] == pytest.approx(place[2:-2], abs=2e-4)
    off = (tracker * body * turned).inv() * Rotation.from_quat(run.mocap.values[:, 3:])
    assert np.max(off.magnitude()[2:-2]) < 2e-4


def test_noise_has_the_size_that_the_description_states() -> None:
    spec = replace(car(), noise=True, statics=(StaticSpec("long", 60.0),))
    recording = recorded(replace(spec, rig=replace(spec.rig, mocap=Mount(np.zeros(3), CAR.orientation))))
    noise = spec.rig.noise
    for values, name in (
        (recording.tension["cable_2"].values, "tension"),
        (recording.imu.values[:, :3], "angular_rate"),
        (recording.imu.values[:, 3:], "specific_force"),
        (recording.inclination.values, "inclination"),
        (recording.mocap.values[:, :3], "mocap_position"),
    ):
        assert np.std(values, axis=0) == pytest.approx(np.full(values.shape[1], noise[name]), rel=0.06)
    turns = Rotation.from_quat(recording.mocap.values[:, 3:])
    spread = np.std((turns.mean().inv() * turns).as_rotvec(), axis=0)
    assert spread == pytest.approx(np.full(3, noise["mocap_orientation"]), rel=0.06)
    missing = replace(spec, rig=replace(spec.rig, noise={}))
    with pytest.raises(InputError, match=r"noise\.\w+: missing"):
        simulate_session(missing, np.random.default_rng(0))


def test_doubts_are_drawn_by_the_tolerances_and_within_three_of_them() -> None:
    spec = replace(car(), doubts=True, statics=(StaticSpec("short", 1.0),))
    draws = []
    for seed in range(40):
        session, truth = simulate_session(spec, np.random.default_rng(seed))
        off = {n: truth.parameters[n] - truth.described[n] for n in truth.parameters}
        draws.append([off["cable_2.length"], off["imu.gyroscope_bias.y"], off["imu.clock"]])
        mass = session.rig.mass - CAR.mass
        draws[-1].append(mass)
    tolerance = spec.rig.tolerance
    std = np.array(
        [tolerance["cable_length"], tolerance["gyroscope_bias"], tolerance["clock"], spec.rig.mass_std]
    )
    scaled = np.array(draws) / std
    assert np.all(np.abs(scaled[:, :3]) <= 3.0)
    assert np.all(np.std(scaled, axis=0) > 0.65)
    assert np.all(np.std(scaled, axis=0) < 1.35)
    exact, truth = simulate_session(replace(spec, doubts=False), np.random.default_rng(0))
    assert truth.parameters == pytest.approx(truth.described)
    assert exact.rig.mass == CAR.mass


def test_a_late_clock_makes_late_stamps() -> None:
    spec = car(RunSpec("run", 3.0, PULL))
    wide = dict(spec.rig.tolerance) | {"clock": 0.05}
    quiet = {name: 0.0 for name in wide if name != "clock"}
    spec = replace(spec, doubts=True, rig=replace(spec.rig, tolerance=wide | quiet, mass_std=1e-9))
    session, truth = simulate_session(spec, np.random.default_rng(3))
    run = session.recordings[-1]
    late = truth.parameters["imu.clock"]
    assert abs(late) > 0.005
    rate = truth_at(run, run.imu.time - late)[:, 10:13]
    inside = slice(20, -20)
    assert run.imu.values[inside, :3] == pytest.approx(rate[inside], abs=2e-4)


def test_the_same_seed_gives_the_same_session() -> None:
    spec = replace(car(RunSpec("run", 1.0, PULL, MOTOR)), noise=True, doubts=True)
    one, other, third = (recorded(spec, seed) for seed in (5, 5, 6))
    assert np.array_equal(one.imu.values, other.imu.values)
    assert not np.array_equal(one.imu.values[:50], third.imu.values[:50])


def test_devices_can_be_left_out() -> None:
    rates = SampleRates(tension=0.0, exciter=0.0, shaft=0.0, imu=100.0, inclinometer=0.0, ground_truth=0.0)
    run = recorded(replace(car(RunSpec("run", 1.0, PULL, MOTOR)), rates=rates, statics=()))
    assert run.imu is not None
    assert not run.tension
    assert run.exciter_force is None
    assert run.exciter_shaft is None
    assert run.ground_truth is None
    nothing = replace(rates, imu=0.0)
    with pytest.raises(InputError, match="no device records"):
        recorded(replace(car(RunSpec("run", 1.0, PULL)), rates=nothing, statics=()))


@pytest.mark.parametrize(("storage", "compression"), [("mcap", "none"), ("sqlite3", "message")])
def test_a_simulated_session_survives_the_disk(tmp_path: Path, storage: str, compression: str) -> None:
    spec = replace(car(RunSpec("run_1", 2.0, PULL, MOTOR)), noise=True, doubts=True)
    session, _ = simulate_session(spec, np.random.default_rng(1))
    write_session(session, tmp_path / "s", storage=storage, compression=compression)
    again: Session = read_session(tmp_path / "s")
    assert [r.name for r in again.recordings] == ["static_bare", "static_dummy", "run_1"]
    for before, after in zip(session.recordings, again.recordings, strict=True):
        assert (before.start_ns, before.kind) == (after.start_ns, after.kind)
        for name in ("imu", "inclination", "exciter_force", "exciter_shaft", "mocap", "ground_truth"):
            one, other = getattr(before, name), getattr(after, name)
            assert (one is None) == (other is None), name
            if one is not None:
                assert other.time == pytest.approx(one.time, abs=1.1e-9)
                assert other.values == pytest.approx(one.values, abs=1e-12)
        for cable, series in before.tension.items():
            assert after.tension[cable].values == pytest.approx(series.values)
    assert again.rig.mass == pytest.approx(session.rig.mass)


def test_every_case_of_the_thesis_can_be_simulated() -> None:
    """Case 8 and its kind push on their cables: rods."""
    for number in (1, 5, 8, 14, 16):
        spec = case_spec(load_case(number), duration=2.0, rest=0.0, holdout=False, rates=RATES, rods=True)
        session, truth = simulate_session(spec, np.random.default_rng(number))
        assert session.training[0].duration == pytest.approx(2.0, abs=0.06)
        assert np.array_equal(tensor(truth.elements[4:]), load_case(number).inertia)


@pytest.mark.parametrize(
    ("name", "elements"),
    [
        ("car_four_cables", [1145, 0.8, 1.128, -1.137, 1617, 0, 0, 365, 70, 1785]),
        ("trifilar", [42, 0.3, 0.18, -0.12, 1.9, 0.03, -0.05, 2.4, 0.02, 3.6]),
        ("bifilar", [12, 0.4, 0, -0.05, 0.09, 0, 0, 1.1, 0, 1.15]),
    ],
)
def test_the_example_rigs_hang_and_swing(name: str, elements: list[float]) -> None:
    rig = read_rig(CONFIG / f"{name}.yaml")
    body = np.array(elements, dtype=float)
    assert rig.mass == body[0]
    pull = Pulled(
        0.05 * body[0] * rig.gravity * np.array([0.6, 0.8, 0.0]), body[1:4] + np.array([0.1, 0.0, 0.0])
    )
    spec = SessionSpec(name, rig, body, (RunSpec("run", 4.0, pull),), rates=RATES, noise=False)
    session, truth = simulate_session(spec, np.random.default_rng(2))
    assert truth.least_tension["run"] > 0.1 * body[0] * rig.gravity / len(rig.cables)
    assert np.max(np.ptp(session.training[0].ground_truth.values[:, :3], axis=0)) > 0.005


def test_effects_are_those_of_the_simulated_plant() -> None:
    """A push on a body at rest is felt at its time; a part on springs adds no weight but rings afterwards."""
    center = tuple(CAR.center_of_mass)
    push = {
        "external_force.peak_force": (2000.0,),
        "external_force.start": (1.0,),
        "external_force.duration": (0.05,),
        "external_force.position": center,
    }
    part = {
        "sprung_mass.mass": (0.05 * CAR.mass,),
        "sprung_mass.frequency": (8.0,),
        "sprung_mass.damping_ratio": (0.01,),
        "sprung_mass.position": center,
    }
    run = RunSpec("run_1", 4.0, AtRest())
    ringing = []
    for effects in (push, push | part):
        imu = recorded(car(run, effects=effects)).imu
        assert imu is not None
        force = imu.values[:, 3]
        assert np.ptp(force[imu.time < 0.97]) < 1e-6
        assert np.ptp(force[(imu.time > 0.97) & (imu.time < 1.1)]) > 0.3
        after = force[imu.time > 1.2]
        spectrum = np.abs(np.fft.rfft((after - np.mean(after)) * np.hanning(after.size)))
        frequency = np.fft.rfftfreq(after.size, 1.0 / RATES.imu)
        ringing.append(np.max(spectrum[(frequency > 6.0) & (frequency < 11.0)]))
    assert ringing[1] > 3.0 * ringing[0]
    still = [
        simulate_session(car(effects=effects), np.random.default_rng(0))[0].statics[0]
        for effects in ({}, part)
    ]
    for cable in still[0].tension:
        assert still[1].tension[cable].values == pytest.approx(still[0].tension[cable].values, abs=1e-3)


def test_a_devices_error_is_on_top_of_what_it_reads() -> None:
    run = RunSpec("run_1", 2.0, PULL)
    plain = recorded(car(run))
    wrong = recorded(car(run, effects={"imu.gyroscope_bias.x": (0.01,), "cable_2.load_cell_gain": (0.02,)}))
    assert wrong.imu.values[:, 0] == pytest.approx(plain.imu.values[:, 0] + 0.01, abs=1e-9)
    assert wrong.imu.values[:, 1:] == pytest.approx(plain.imu.values[:, 1:], abs=1e-9)
    assert wrong.tension["cable_2"].values == pytest.approx(1.02 * plain.tension["cable_2"].values)
    assert wrong.tension["cable_1"].values == pytest.approx(plain.tension["cable_1"].values)


def test_a_reading_may_follow_a_law_of_its_own() -> None:
    run = RunSpec("run_1", 2.0, PULL)
    laws = {
        "cable_2.feels.cable_1": (0.1,),
        "cable_1.drift": (3.0,),
        "cable_1.drift.settling": (0.5,),
        "imu.gyroscope.x.feels.accelerometer.z": (0.01,),
    }
    plain, wrong = recorded(car(run)), recorded(car(run, effects=laws))
    assert wrong.imu.values[:, 0] == pytest.approx(plain.imu.values[:, 0] + 0.01 * plain.imu.values[:, 5])
    assert wrong.imu.values[:, 1:] == pytest.approx(plain.imu.values[:, 1:], abs=1e-9)
    first, second = plain.tension["cable_1"], plain.tension["cable_2"]
    felt = np.interp(second.time, first.time, first.values[:, 0])
    inside = (second.time > first.time[0]) & (second.time < first.time[-1])
    more = wrong.tension["cable_2"].values[:, 0] - second.values[:, 0]
    assert more[inside] == pytest.approx(0.1 * felt[inside], rel=1e-3)
    moved = wrong.tension["cable_1"].values[:, 0] - first.values[:, 0]
    assert moved == pytest.approx(6.0 * (1.0 - np.exp(-0.5 * first.time)), abs=0.05)


def test_a_lagging_device_is_late_and_a_little_weaker() -> None:
    """Of a swing at angular frequency w it shows 1/(1 + i w tau)."""
    run, tau, hertz = RunSpec("run_1", 8.0, AtRest(), MOTOR), 0.02, 0.7
    plain, slow = (recorded(car(run, effects=e)) for e in ({}, {"imu.lag": (tau,), "exciter.lag": (tau,)}))

    def phasor(series: Series, column: int) -> complex:
        # Five periods once the motor has its speed, from which a straight line is taken off
        time = series.time[series.time > 8.0 - 5.0 / hertz]
        values = series.values[-time.size :, column]
        values = values - np.polyval(np.polyfit(time, values, 1), time)
        return complex(np.sum(values * np.exp(-2j * np.pi * hertz * time)))

    shown = 1.0 / (1.0 + 2j * np.pi * hertz * tau)
    force = phasor(slow.exciter_force, 0) / phasor(plain.exciter_force, 0)
    assert force == pytest.approx(shown, abs=0.01)
    assert slow.tension["cable_1"].values == pytest.approx(plain.tension["cable_1"].values)
    later = np.interp(plain.imu.time + tau, slow.imu.time, slow.imu.values[:, 1])[200:-50]
    off = later - plain.imu.values[200:-50, 1]
    assert np.std(off) < 0.02 * np.std(plain.imu.values[:, 1])
    assert np.std(slow.imu.values[:, 1] - plain.imu.values[:, 1]) > 0.06 * np.std(plain.imu.values[:, 1])


def test_a_soft_mount_enlarges_by_the_square_of_frequency() -> None:
    """Far below resonance u - k d2u/dt2 (estimate/mounting.py): the gyroscope alone has a mount here."""
    run, softness = RunSpec("run_1", 4.0, PULL), 4e-4
    effects = {"imu.mount.angular_rate.softness": (softness,), "imu.mount.angular_rate.damping": (0.3,)}
    plain, soft = (recorded(car(run, effects=e)).imu for e in ({}, effects))
    second = np.gradient(np.gradient(plain.values[:, 0], plain.time), plain.time)
    more = soft.values[:, 0] - plain.values[:, 0]
    late = slice(150, -10)
    assert np.corrcoef(more[late], -softness * second[late])[0, 1] > 0.98
    assert soft.values[:, 3:] == pytest.approx(plain.values[:, 3:])


def test_an_inclinometers_zero_and_an_exciters_place_are_off_as_told() -> None:
    run = RunSpec("run_1", 2.0, AtRest(), MOTOR)
    plain, wrong = (recorded(car(run, effects=e)) for e in ({}, {"inclinometer.zero.y": (0.004,)}))
    assert wrong.inclination.values - plain.inclination.values == pytest.approx(
        np.broadcast_to([0.0, 0.004], plain.inclination.values.shape), abs=1e-5
    )
    moved = recorded(car(run, effects={"exciter.position.z": (0.3,)}))
    assert moved.exciter_force.values == pytest.approx(plain.exciter_force.values, abs=1e-6 * WEIGHT)
    assert np.std(moved.imu.values[:, 0] - plain.imu.values[:, 0]) > 1e-4


def test_plumb_cables_do_not_feel_an_edge_and_inclined_ones_are_shorter() -> None:
    """The longer way around the edge lifts the body; a cable that hangs plumb touches it in one point."""
    plumb, inclined = (read_rig(CONFIG / name) for name in ("trifilar.yaml", "car_four_cables.yaml"))
    for rig, lifted in ((plumb, False), (inclined, True)):
        hinges = np.array([cable.body_point for cable in rig.cables])
        middle = np.array([*np.mean(hinges, axis=0)[:2], np.min(hinges[:, 2]) - 0.2])
        model = rig_model(rig, np.array([500.0, *middle, 90.0, 0.0, 0.0, 90.0, 0.0, 90.0]))
        edged = with_effects(model, effects_of({"cable_edge": (0.05,)}, model))
        rise = rest_state(edged).position[2] - rest_state(model).position[2]
        assert bool(rise > 1e-5) == lifted


def test_a_body_without_its_gyroscopic_moment_turns_otherwise() -> None:
    run = RunSpec("run_1", 3.0, PULL)
    plain, without = (recorded(car(run, effects=e)) for e in ({}, {"gyroscopic_share": (1.0,)}))
    off = np.abs(plain.imu.values[:, :3] - without.imu.values[:, :3])
    assert 0.0 < np.max(off) < 0.1 * np.max(np.abs(plain.imu.values[:, :3]))


def test_a_law_is_told_beside_the_truth() -> None:
    """No description has it: it was a KeyError."""
    run, given = RunSpec("run_1", 1.0, PULL), {"cable_1.drift": (3.0,), "imu.lag": (0.01,)}
    _, truth = simulate_session(car(run, effects=given), np.random.default_rng(0))
    told = truth_document(truth)
    assert told["parameters"]["cable_1.drift"] == {"value": 3.0, "described": 0.0}
    assert {e["effect"] for e in told["effects"]} == {"unknown", "sensor_lag"}


def test_a_law_of_what_is_not_measured_is_refused() -> None:
    with pytest.raises(InputError, match=r"effect cable_9.drift: is unknown"):
        recorded(car(RunSpec("run_1", 2.0), effects={"cable_9.drift": (1.0,)}))


def test_cables_that_stretch_start_where_they_hang() -> None:
    """Let go aside on elastic cables the body swings; it does not bounce by all of its stretch."""
    run = RunSpec("run_1", 2.0, PULL)
    stiff, soft = (recorded(car(run, effects=effects)) for effects in ({}, {"cable_elasticity": (2e6,)}))
    for cable, series in soft.tension.items():
        beside = np.ptp(series.values[:40] - np.mean(stiff.tension[cable].values[:40]))
        assert beside < 0.5 * np.mean(series.values)


def test_an_effect_that_is_unknown_is_refused() -> None:
    with pytest.raises(InputError, match=r"effect hinge_dampin: is unknown; known are .*hinge_damping"):
        recorded(car(RunSpec("run_1", 2.0), effects={"hinge_dampin": (1.0,)}))


def test_effects_of_the_command_line_are_told_in_the_contracts_words() -> None:
    given = effects_given(
        ["tether=100,0,0", "tether_point=0,0,1", "imu.orientation.x=0.01", "imu.clock=1e-3"]
    )
    assert given["tether"] == (100.0, 0.0, 0.0)
    told = {entry["effect"]: entry["switches"] for entry in effects_document(given)}
    assert set(told) == {"tether", "imu_misalignment", "clock_offset"}
    assert told["tether"] == {"tether": [100.0, 0.0, 0.0], "tether_point": [0.0, 0.0, 1.0]}
    assert effect_of("sprung_mass.position") == "sprung_mass"
    assert effect_of("imu.position.y") == "imu_position"
    assert effect_of("exciter.position.y") == "exciter_position"
    assert effect_of("exciter.orientation.y") == "exciter_misalignment"
    assert effect_of("cable_1.lag") == "sensor_lag"
    assert effect_of("imu.mount.specific_force.softness") == "sensor_resonance"
    assert (
        effect_of("inclinometer.zero.x") == effect_of("inclinometer.orientation.x") == "inclinometer_offset"
    )
    assert effect_of("gyroscopic_share") == "gyroscopic_term"
    assert effect_of("imu.gyroscope.x.feels.accelerometer.z") == effect_of("cable_1.drift") == "unknown"
    with pytest.raises(InputError, match="--effect hinge_damping: give NAME=VALUE"):
        effects_given(["hinge_damping"])
