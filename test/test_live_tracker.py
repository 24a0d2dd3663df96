"""The tracker's covariance is honest: samples missing, samples late, a late start, a body that jumps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from rig_identification.live.body_tracker import BodyTracker
from rig_identification.live.imu_history import ImuHistory
from rig_identification.live.plant import Plant, Shaking, odometry_values
from rig_identification.live.tracked import Tracked
from rig_identification.model import layout, sensors
from rig_identification.model.motion import rig_model
from rig_identification.recording import Dummy
from rig_identification.rig import Cable, Mount, Rig

Array = np.ndarray
Streams = dict[str, tuple[Array, Array]]

START = 1_790_000_000 * 10**9
MS = 1_000_000
BODY = np.array([990.2, 0.69, 1.08, -1.07, 1108.6, -1.4, 31.7, 338.3, 18.3, 1295.9])
SHAKING = Shaking(np.array([150.0, 120.0, 60.0]), np.array([0.42, 0.71, 1.1]))
DUMMY = Dummy(50.0, np.array([0.16, 0.2, -0.2]))
SILENT = (np.zeros(0, np.int64), np.zeros((0, 3)))


def described() -> Rig:
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
        inclinometer=Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])),
        exciter=Mount(np.array([0.0, 0.0, -1.5]), Rotation.from_euler("y", 45, degrees=True).as_quat()),
        noise={"specific_force": 0.01, "angular_rate": 0.0003, "inclination": 0.0003, "tension": 2.0},
    )


def as_built(rig: Rig, rng: np.random.Generator) -> Rig:
    """A rig as the description's tolerances allow it to be."""
    t = rig.tolerance

    def off(cable: Cable) -> Cable:
        return replace(
            cable,
            ceiling_point=cable.ceiling_point + t["hinge_position"] * rng.standard_normal(3),
            body_point=cable.body_point + t["hinge_position"] * rng.standard_normal(3),
            length=cable.length + t["cable_length"] * rng.standard_normal(),
        )

    return replace(rig, cables=tuple(off(cable) for cable in rig.cables))


@dataclass(frozen=True)
class Flight:
    """What a body did: stamps ns, the plant's rows and the true poses, each ms."""

    stamp: Array
    rows: Array
    truth: Array


def fly(rig: Rig, *acts: tuple[str, float]) -> Flight:
    """Acts (``rest``, ``dummy``: the body jumps there; ``shake``, ``go on``), each so many s long."""
    plant = Plant(rig_model(rig, BODY), START)
    rows, truth = [], []
    for act, seconds in acts:
        if act == "shake":
            plant.shake(SHAKING)
        elif act in ("rest", "dummy"):
            plant.come_to_rest(DUMMY if act == "dummy" else None)
        for _ in range(round(2.0 * seconds)):
            block, motion = plant.advance(0.5)
            rows.append(block.rows[:-1])
            truth += [odometry_values(motion, node)[:7] for node in range(500)]
    return Flight(START + np.arange(len(truth)) * MS, np.concatenate(rows), np.array(truth))


def measured(rig: Rig, flight: Flight, rng: np.random.Generator) -> Streams:
    """Device name to stamps and samples, with noise and biases as described."""
    assert rig.imu is not None
    n, t = len(rig.cables), rig.tolerance
    turn = Rotation.from_quat(rig.imu.orientation).as_matrix()
    imu = sensors.imu(flight.rows, rig.imu.position, turn, np.zeros(sensors.IMU_SIZE)).values
    imu = imu + rng.standard_normal(imu.shape) * ([0.0003] * 3 + [0.01] * 3)
    imu += rng.standard_normal(6) * ([t["gyroscope_bias"]] * 3 + [t["accelerometer_bias"]] * 3)
    up = np.arcsin(-flight.rows[:, sensors.GRAVITY][:, :2] / rig.gravity)
    up = up + 0.0003 * rng.standard_normal(up.shape)
    tension = flight.rows[:, layout.OUT_TENSION : layout.OUT_TENSION + n]
    tension = tension + 2.0 * rng.standard_normal(tension.shape)
    force = flight.rows[:, -3:] + 0.5 * rng.standard_normal((len(flight.rows), 3))
    every = {"imu": (imu, 5), "up": (up, 20), "tension": (tension, 5), "exciter": (force, 5)}
    return {name: (flight.stamp[::k], values[::k]) for name, (values, k) in every.items()}


def track(rig: Rig, streams: Streams, looks: Iterable[int], late: dict[str, float] | None = None) -> Tracked:
    """The tracker fed as its node feeds it: what has arrived by each look; streams ``late`` by so many s."""
    return tracker_and_track(rig, streams, looks, late)[1]


def tracker_and_track(
    rig: Rig, streams: Streams, looks: Iterable[int], late: dict[str, float] | None = None
) -> tuple[BodyTracker, Tracked]:
    tracker, taken, out = BodyTracker(rig), dict.fromkeys(streams, 0), []
    for now in looks:
        news = {}
        for name, (stamp, values) in streams.items():
            arrived = int(
                np.searchsorted(stamp + round(1e9 * (late or {}).get(name, 0.0)), now, side="right")
            )
            news[name] = (stamp[taken[name] : arrived], values[taken[name] : arrived])
            taken[name] = arrived
        tracker.add_inclination(*news["up"])
        for i, cable in enumerate(rig.cables):
            tracker.add_tension(cable.name, news["tension"][0], news["tension"][1][:, i : i + 1])
        tracker.add_exciter(*news["exciter"])
        if len(news["imu"][0]):
            out.append(tracker.add_imu(*news["imu"]))
    return tracker, Tracked(*(np.concatenate([getattr(t, f) for t in out]) for f in Tracked.__annotations__))


@dataclass(frozen=True)
class Judged:
    """Errors of a track against the truth."""

    time: Array  # (k,) s of the flight
    nees: Array  # (k,) e^T P^-1 e / 6
    within: Array  # (k, 6) whether an error lies within 3 deviations
    error: Array  # (k, 6) m, rad

    def fair(self, begin: float, end: float = np.inf) -> None:
        """The covariance tells what the errors are: consistent on the average, and no outliers.

        How a rig differs from its description is one draw of six numbers that time does not average out.
        """
        here = (self.time >= begin) & (self.time < end)
        assert np.count_nonzero(here) > 10
        assert np.mean(self.nees[here]) < chi2.isf(1e-3, 6) / 6.0
        assert np.mean(self.within[here]) > 0.99


def judged(flight: Flight, tracked: Tracked) -> Judged:
    node = (tracked.stamp_ns - START) // MS
    true = flight.truth[node]
    turn = Rotation.from_quat(tracked.pose[:, 3:]) * Rotation.from_quat(true[:, 3:]).inv()
    error = np.concatenate([tracked.pose[:, :3] - true[:, :3], turn.as_rotvec()], axis=1)
    P = tracked.pose_covariance
    nees = np.einsum("ni,nij,nj->n", error, np.linalg.inv(P), error) / 6.0
    within = np.abs(error) < 3.0 * np.sqrt(P[:, range(6), range(6)])
    return Judged(1e-3 * node, nees, within, error)


def looks(flight: Flight, period: float = 0.02) -> Array:
    return np.arange(START, int(flight.stamp[-1]), round(1e9 * period))


@pytest.fixture(scope="module", params=[1, 2])
def built(request: pytest.FixtureRequest) -> tuple[Rig, np.random.Generator]:
    rng = np.random.default_rng(request.param)
    return as_built(described(), rng), rng


@pytest.fixture(scope="module")
def shaken(built: tuple[Rig, np.random.Generator]) -> tuple[Flight, Streams]:
    """1 s at rest, 11 s shaken: the flight and what the devices say of it."""
    rig, rng = built
    flight = fly(rig, ("rest", 1.0), ("shake", 11.0))
    return flight, measured(described(), flight, rng)


def test_a_steady_swing_surprises_nobody(shaken: tuple[Flight, Streams]) -> None:
    flight, streams = shaken
    tracker, tracked = tracker_and_track(described(), streams, looks(flight))
    judged(flight, tracked).fair(0.0)
    assert (tracker.surprises, tracker.restarts) == (0, 0)


def test_a_late_start_in_mid_swing_is_honest_from_its_first_sample_on(
    shaken: tuple[Flight, Streams],
) -> None:
    flight, streams = shaken
    begin = START + 7_300 * MS
    late = {
        name: (stamp[stamp >= begin], values[stamp >= begin]) for name, (stamp, values) in streams.items()
    }
    result = judged(flight, track(described(), late, looks(flight)))
    result.fair(7.3)
    result.fair(7.3, 8.3)  # while it settles
    assert np.max(np.abs(result.error[result.time > 8.8, :3])) < 0.003


def test_dropped_samples_widen_the_covariance_by_what_they_hide(shaken: tuple[Flight, Streams]) -> None:
    flight, streams = shaken
    rng = np.random.default_rng(3)

    def thinned(stamp: Array, values: Array) -> tuple[Array, Array]:
        kept = rng.random(len(stamp)) < 0.5
        return stamp[kept], values[kept]

    half = {name: thinned(*series) for name, series in streams.items()}
    judged(flight, track(described(), half, looks(flight))).fair(0.0)
    for hole in (0.05, 0.2, 0.45):
        stamp, values = streams["imu"]
        seconds = (stamp - START) / 1e9
        there = (seconds < 3.0) | (seconds % 1.7 > hole)
        tracker, tracked = tracker_and_track(
            described(), {**streams, "imu": (stamp[there], values[there])}, looks(flight)
        )
        judged(flight, tracked).fair(0.0)
        assert (tracker.surprises, tracker.restarts) == (0, 0), hole  # the motion goes on as it did


def test_a_stalling_machine_and_late_samples_change_little(shaken: tuple[Flight, Streams]) -> None:
    flight, streams = shaken
    rng = np.random.default_rng(4)
    stalls = START + np.cumsum(rng.exponential(0.3e9, 100)).astype(np.int64)
    judged(flight, track(described(), streams, stalls)).fair(0.0)
    late = judged(flight, track(described(), streams, looks(flight), {"up": 0.2}))
    late.fair(0.0)
    assert np.max(np.abs(late.error[late.time > 2.0, :3])) < 0.003


def test_a_stray_reading_moves_nothing(shaken: tuple[Flight, Streams]) -> None:
    flight, streams = shaken
    stamp, values = streams["up"]
    values = values.copy()
    values[400::50] += 0.1
    tracker, tracked = tracker_and_track(described(), {**streams, "up": (stamp, values)}, looks(flight))
    result = judged(flight, tracked)
    result.fair(0.0)
    assert np.max(np.abs(result.error[result.time > 2.0, :3])) < 0.003
    assert tracker.surprises == 0


@pytest.mark.parametrize("late", [0.0, 0.1])
def test_a_body_that_jumps_is_found_again(built: tuple[Rig, np.random.Generator], late: float) -> None:
    """Onto a dummy's rest, off it into a swing, and in mid-swing to rest: as a simulated plant does."""
    rig, rng = built
    flight = fly(rig, ("rest", 2.0), ("dummy", 2.0), ("rest", 0.5), ("shake", 5.5), ("rest", 2.0))
    streams = measured(described(), flight, rng)
    tracker, tracked = tracker_and_track(described(), streams, looks(flight), {"up": late})
    result = judged(flight, tracked)
    noticed = 0.15 + late  # s from a jump until it is known
    result.fair(0.0, 2.0)
    for jump, end in ((2.0, 4.0), (4.0, 10.0), (10.0, 12.0)):
        result.fair(jump + noticed, end)
        assert np.max(np.abs(result.error[(result.time > jump + 1.0) & (result.time < end), :3])) < 0.003
    assert 3 <= tracker.surprises <= 6  # what was wrong may show more than once


def test_without_an_inclinometer_cables_and_imu_hold_the_body(
    shaken: tuple[Flight, Streams], built: tuple[Rig, np.random.Generator]
) -> None:
    flight, streams = shaken
    rig = replace(described(), inclinometer=None)
    judged(flight, track(rig, {**streams, "up": SILENT}, looks(flight))).fair(0.0)


def test_forces_that_fell_silent_or_stalled_pull_nowhere(
    shaken: tuple[Flight, Streams], built: tuple[Rig, np.random.Generator]
) -> None:
    """Without an inclinometer the cables' pull counts: an exciter's last word is not its force."""
    flight, streams = shaken
    rig = replace(described(), inclinometer=None)
    stamp, force = streams["exciter"]
    spoke = stamp < START + 5_000 * MS
    silent = {**streams, "up": SILENT, "exciter": (stamp[spoke], force[spoke])}
    judged(flight, track(rig, silent, looks(flight))).fair(0.0)
    stalls = START + np.cumsum(np.random.default_rng(5).exponential(0.4e9, 100)).astype(np.int64)
    judged(flight, track(rig, {**streams, "up": SILENT}, stalls)).fair(0.0)


def test_the_history_tells_how_the_body_turned_and_what_a_hole_hides() -> None:
    history = ImuHistory()
    stamps = START + 5 * MS * np.arange(400)
    time = (stamps - START) / 1e9
    omega = 2.0 * np.pi * 0.5
    rate = np.stack([0.1 * np.cos(omega * time), 0.0 * time, 0.02 + 0.0 * time], axis=1)
    for stamp, w in zip(stamps, rate, strict=True):
        history.add(int(stamp), w, np.array([np.sin(omega * stamp / 1e9), 0.0, 9.81]))
    assert history.interval == pytest.approx(0.005)
    since = START + 1_803 * MS  # between two samples
    exact = 0.1 / omega * (np.sin(omega * time[-1]) - np.sin(omega * 1.803))
    turn = history.turned_since(since, np.array([0.0, 0.0, 0.02]))
    assert turn == pytest.approx([exact, 0.0, 0.0], abs=1e-6)
    assert history.turned_since(int(stamps[-1]), np.zeros(3)) == pytest.approx(np.zeros(3))
    hidden = history.hidden_in(0.4)
    assert hidden is not None
    # Mean of a sine over T less that of its ends: (sinc(wT/2) - cos(wT/2)) of the middle's value
    half = 0.5 * omega * 0.4
    share = np.sin(half) / half - np.cos(half)
    assert hidden[3] == pytest.approx(share / np.sqrt(2.0), rel=0.15)
    assert hidden[0] == pytest.approx(0.1 * share / np.sqrt(2.0), rel=0.15)
    assert hidden[2] == pytest.approx(0.0, abs=1e-12)
    assert history.hidden_in(1.5) is None
