"""Every effect that the simulated plant can have changes the readings in the way that its physics says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from rig_identification.errors import InputError
from rig_identification.live.plant import Plant, Shaking
from rig_identification.live.plant_effects import with_effects
from rig_identification.live.plant_switches import SWITCHES, effects_of
from rig_identification.live.push import Push
from rig_identification.model import layout, sensors
from rig_identification.model.motion import rig_model
from rig_identification.rig import Cable, Mount, Rig

Array = np.ndarray
START = 1_790_000_000_000_000_000
#: Three plumb cables of 2 m, the centre of mass below their middle: the body swings without turning.
LENGTH, MASS, GRAVITY = 2.0, 300.0, 9.80665
CORNERS = ([0.0, 0.0, 0.0], [1.8, 0.0, 0.0], [0.9, 1.5, 0.0])
CENTER = [0.9, 0.5, -0.3]
BODY = np.array([MASS, *CENTER, 60.0, 0.0, 0.0, 50.0, 0.0, 90.0])
RIG = Rig(
    gravity=GRAVITY,
    cables=tuple(
        Cable(f"cable_{i}", np.array([at[0], at[1], LENGTH]), np.array(at), LENGTH)
        for i, at in enumerate(CORNERS)
    ),
    mass=MASS,
    exciter=Mount(np.array(CENTER), np.array([0.0, 0.0, 0.0, 1.0])),
)
WEIGHT = MASS * GRAVITY
SWING = np.sqrt(GRAVITY / LENGTH) / (2.0 * np.pi)  # Hz
STILL = Shaking(np.zeros(3), np.ones(3))


def sideways(force: float, frequency: float, axis: int = 0) -> Shaking:
    return Shaking(force * np.eye(3)[axis], np.full(3, frequency))


def plant(**switched: float | Sequence[float]) -> Plant:
    """The body with switches thrown; ``__`` stands for a dot."""
    model = rig_model(RIG, BODY)
    effects = effects_of({name.replace("__", "."): value for name, value in switched.items()}, model)
    return Plant(with_effects(model, effects), START, push=effects.push)


def rows_of(made: Plant, seconds: float) -> Array:
    """(n, 18 + 4 + 3) rows of so many seconds, 1 ms apart."""
    return np.concatenate([made.advance(0.05)[0].rows[:-1] for _ in range(round(seconds / 0.05))])


def tension_of(rows: Array) -> Array:
    return rows[..., layout.OUT_TENSION : layout.OUT_TENSION + 3]


def acceleration_of(rows: Array) -> Array:
    """(n, 3) of the datum, body axes."""
    return rows[:, sensors.SPECIFIC_FORCE] + rows[:, sensors.GRAVITY]


def at_rest(**switched: float | Sequence[float]) -> Array:
    return rows_of(plant(**switched), 0.05)[0]


def shaken(made: Plant, seconds: float, shaking: Shaking) -> Array:
    made.shake(shaking)
    return rows_of(made, seconds)


def left_alone(made: Plant, seconds: float) -> Array:
    made.stop_shaking()
    return rows_of(made, seconds)


def tone(signal: Array, low: float, high: float) -> float:
    """Hz of the strongest line between two limits; signal (n,) at 1 kHz."""
    spectrum = np.abs(np.fft.rfft((signal - np.mean(signal)) * np.hanning(signal.size), 16 * signal.size))
    frequency = np.fft.rfftfreq(16 * signal.size, 0.001)
    inside = (frequency > low) & (frequency < high)
    return float(frequency[inside][np.argmax(spectrum[inside])])


def knock(force: float, seconds: float, direction: Sequence[float] = (1.0, 0.0, 0.0)) -> dict[str, object]:
    """Switches of one push on the centre of mass as soon as shaking starts."""
    return {
        "external_force__peak_force": force,
        "external_force__start": [0.0],
        "external_force__duration": seconds,
        "external_force__direction": list(direction),
        "external_force__position": CENTER,
    }


def test_a_plant_without_effects_is_the_described_rig() -> None:
    """And its swing is the pendulum's."""
    ideal, switched = Plant(rig_model(RIG, BODY), START), plant()
    both = [shaken(made, 3.0, sideways(60.0, 0.5)) for made in (ideal, switched)]
    assert both[0] == pytest.approx(both[1], abs=1e-6 * WEIGHT)
    rows = left_alone(switched, 20.0)
    assert tone(acceleration_of(rows)[:, 0], 0.1, 1.0) == pytest.approx(SWING, rel=0.01)


@pytest.mark.parametrize(
    "switched",
    [
        {"hinge_damping": 20.0},
        {"hinge_friction": 2.0},
        {"air_drag": 20.0},
        {"liquid_slosh__mass": 30.0, "liquid_slosh__position": CENTER, "liquid_slosh__damping_ratio": 0.3},
    ],
)
def test_what_dissipates_takes_the_swing_away(switched: dict[str, float]) -> None:
    left = []
    for made in (plant(), plant(**switched)):
        shaken(made, 4.0, sideways(80.0, 0.36))
        left_alone(made, 10.0)
        left.append(np.std(acceleration_of(rows_of(made, 5.0))[:, 0]))
    assert 0.02 < left[1] / left[0] < 0.97


def test_damped_hinges_slow_the_swing_by_their_law() -> None:
    """n cables with two hinges of c each: m L^2 phi'' + 2 n c phi' + m g L phi = 0."""
    damping = 20.0
    made = plant(hinge_damping=damping)
    shaken(made, 4.0, sideways(80.0, 0.36))
    rows = left_alone(made, 20.0)
    swing = np.abs(acceleration_of(rows)[:, 0])
    seconds = 10.0  # between two spells of 5 s
    decay = np.log(np.max(swing[:5000]) / np.max(swing[10_000:15_000])) / seconds
    assert decay == pytest.approx(2.0 * 3.0 * damping / (2.0 * MASS * LENGTH**2), rel=0.15)


def test_entrained_air_is_inertia_without_weight() -> None:
    """The swing slows by the root of the masses' ratio; the cells read the same."""
    assert np.sum(tension_of(at_rest(air_added_mass=60.0))) == pytest.approx(WEIGHT, rel=1e-6)
    made = plant(air_added_mass=60.0)
    shaken(made, 4.0, sideways(60.0, 0.36))
    rows = left_alone(made, 20.0)
    expected = SWING * np.sqrt(MASS / (MASS + 60.0))
    assert tone(acceleration_of(rows)[:, 0], 0.1, 1.0) == pytest.approx(expected, rel=0.01)


def test_heavy_cables_and_an_unweighed_rotor_weigh() -> None:
    """Cells at the ceiling carry each cable whole."""
    heavy = np.sum(tension_of(at_rest(cable_mass=1.0))) - WEIGHT
    assert heavy == pytest.approx(3.0 * LENGTH * 1.0 * GRAVITY, rel=1e-6)
    rotor = np.sum(tension_of(at_rest(exciter_rotor=15.0))) - WEIGHT
    assert rotor == pytest.approx(15.0 * GRAVITY, rel=1e-6)


def test_a_truer_force_than_measured_moves_the_body_more() -> None:
    rows = [shaken(plant(exciter_gain=gain), 1.5, sideways(60.0, 0.7)) for gain in (0.0, 0.1)]
    assert np.array_equal(rows[0][:, -3:], rows[1][:, -3:])  # what the force cells read
    ratio = np.std(acceleration_of(rows[1])[:, 0]) / np.std(acceleration_of(rows[0])[:, 0])
    assert ratio == pytest.approx(1.1, abs=0.002)


def test_longer_cables_and_hinges_elsewhere_let_the_body_hang_elsewhere() -> None:
    """A plumb cable that is 5 mm longer, an upper hinge 5 mm lower and a lower hinge 5 mm higher are one."""
    down = [
        at_rest(**switched)[sensors.GRAVITY] / GRAVITY
        for switched in (
            {"cable_length": [0.0, 0.005, 0.0]},
            {"hinge_position__ceiling": [0.0] * 5 + [-0.005] + [0.0] * 3},
            {"hinge_position__body": [0.0] * 5 + [0.005] + [0.0] * 3},
        )
    ]
    assert down[0][0] == pytest.approx(0.005 / 1.8, rel=0.01)  # the body tilts about its other hinges
    assert down[1] == pytest.approx(down[0], abs=1e-5)
    assert down[2] == pytest.approx(down[0], abs=1e-5)
    assert at_rest(cable_length=0.005)[:3] == pytest.approx([0.0, 0.0, -0.005], abs=1e-9)
    assert at_rest(hinge_position__ceiling=[0.01, 0.0, 0.0])[:3] == pytest.approx([0.01, 0.0, 0.0], abs=1e-9)


def test_a_tilted_ceiling_lets_the_body_hang_beside_its_middle() -> None:
    """Seen from the ceiling the cables hang aslant by the tilt."""
    tilted = at_rest(level_error=[0.01, 0.0])
    assert abs(tilted[1]) == pytest.approx(LENGTH * np.sin(0.01), rel=1e-3)
    assert tilted[0] == pytest.approx(0.0, abs=1e-6)
    assert np.sum(tension_of(tilted)) == pytest.approx(WEIGHT, rel=1e-6)


def test_cables_that_stretch_let_the_body_sink_and_bounce() -> None:
    """By T L / EA, and at (n EA / L / m)^(1/2)."""
    stiffness = 1e6
    made = plant(cable_elasticity=stiffness, cable_damping_ratio=0.01)
    assert made.state.position[2] == pytest.approx(-WEIGHT / 3.0 * LENGTH / stiffness, rel=1e-3)
    shaken(made, 2.0, sideways(300.0, 9.0, axis=2))
    rows = left_alone(made, 4.0)
    bounce = np.sqrt(3.0 * stiffness / LENGTH / MASS) / (2.0 * np.pi)
    assert tone(np.sum(tension_of(rows), axis=1), 5.0, 20.0) == pytest.approx(bounce, rel=0.01)


def test_a_ceiling_that_yields_sinks_under_the_weight_and_lowers_the_swing() -> None:
    """By m g / k upright; sideways, the pendulum is longer by as much."""
    plumb = plant(ceiling_compliance__stiffness=[0.0, 0.0, 2e6], ceiling_compliance__mass=200.0)
    assert plumb.state.position[2] == pytest.approx(-WEIGHT / 2e6, rel=1e-4)
    soft = plant(ceiling_compliance__stiffness=[2e4, 0.0, 0.0], ceiling_compliance__mass=20.0)
    shaken(soft, 4.0, sideways(60.0, 0.36))
    rows = left_alone(soft, 20.0)
    expected = np.sqrt(GRAVITY / (LENGTH + WEIGHT / 2e4)) / (2.0 * np.pi)
    assert tone(acceleration_of(rows)[:, 0], 0.1, 1.0) == pytest.approx(expected, rel=0.01)


def test_a_tether_is_slack_at_rest_and_stiffens_the_swing() -> None:
    """w^2 = g / L + k / m across it."""
    made = plant(tether=[3000.0, 0.0, 0.0], tether_point=CENTER)
    assert rows_of(made, 0.05)[0] == pytest.approx(at_rest(), abs=1e-6)
    shaken(made, 4.0, sideways(60.0, 0.6))
    rows = left_alone(made, 20.0)
    expected = np.sqrt(GRAVITY / LENGTH + 3000.0 / MASS) / (2.0 * np.pi)
    assert tone(acceleration_of(rows)[:, 0], 0.1, 2.0) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(
    ("effect", "more"), [("sprung_mass", {"sprung_mass__direction": [0.0, 2.0, 0.0]}), ("liquid_slosh", {})]
)
def test_a_rider_rings_at_its_frequency_and_weighs_nothing_extra(
    effect: str, more: dict[str, object]
) -> None:
    """Against a body that is free to yield it swings faster by (M / (M - m))^(1/2)."""
    switched = {f"{effect}__mass": 60.0, f"{effect}__frequency": 2.5, f"{effect}__damping_ratio": 0.002}
    switched |= {f"{effect}__position": CENTER} | more
    assert at_rest(**switched) == pytest.approx(at_rest(), abs=1e-6)
    made = plant(**switched)
    shaken(made, 2.0, sideways(10.0, 2.8, axis=1))
    rows = left_alone(made, 10.0)
    expected = 2.5 * np.sqrt(MASS / (MASS - 60.0))
    assert tone(acceleration_of(rows)[:, 1], 1.5, 4.0) == pytest.approx(expected, rel=0.01)


def test_a_loose_mass_stays_between_its_stops_and_knocks() -> None:
    shaking = sideways(150.0, 0.6)
    made = plant(loose_mass__mass=10.0, loose_mass__travel=0.01, loose_mass__position=CENTER)
    made.shake(shaking)
    travel, rows = [], []
    for _ in range(160):
        block, motion = made.advance(0.05)
        travel.append(motion.states[:-1, layout.BODY_STATE])
        rows.append(block.rows[:-1])
    reached = np.concatenate(travel)
    assert 0.01 < np.max(reached) < 0.015
    assert -0.015 < np.min(reached) < -0.01
    knocking = np.max(np.abs(np.diff(acceleration_of(np.concatenate(rows))[:, 0])))
    calm = np.max(np.abs(np.diff(acceleration_of(shaken(plant(), 8.0, shaking))[:, 0])))
    assert knocking > 3.0 * calm


def test_a_push_leaves_its_impulse() -> None:
    """m times the change of speed is the half sine's 2 F T / pi, at its time and at no other."""
    push = Push(500.0, np.array([2.0, 0.0, 0.0]), np.array(CENTER), np.array([0.2, 5.0]), 0.04)
    assert push.wrench(np.array([0.22, 0.2, 0.25]))[:, 0] == pytest.approx([500.0, 0.0, 0.0], abs=1e-9)
    assert push.wrench(np.array([5.02]))[0, 3:] == pytest.approx(np.cross(CENTER, [500.0, 0.0, 0.0]))
    made = plant(**(knock(500.0, 0.04) | {"external_force__start": [0.2]}))
    before = rows_of(made, 0.3)  # its time counts from the start of shaking
    rows = shaken(made, 0.3, STILL)
    assert np.max(np.abs(acceleration_of(np.concatenate([before, rows[:199]])))) < 1e-9
    speed = 0.001 * np.sum(acceleration_of(rows)[195:245, 0])
    assert MASS * speed == pytest.approx(2.0 * 500.0 * 0.04 / np.pi, rel=0.01)
    assert np.max(np.abs(rows[:, -3:])) == 0.0  # no force cell feels it


def test_a_cable_that_goes_slack_stays_so_from_block_to_block() -> None:
    """A knock from below throws the body: it flies free, the same in blocks of 5 ms as in one."""
    whole, blocks = (plant(**knock(9000.0, 0.1, (0.0, 0.0, 1.0))) for _ in range(2))
    for made in (whole, blocks):
        made.shake(STILL)
    at_once = whole.advance(0.4)[0].rows[:-1]
    in_blocks = np.concatenate([blocks.advance(0.005)[0].rows[:-1] for _ in range(80)])
    thrown = (2.0 * 9000.0 * 0.1 / np.pi - WEIGHT * 0.1) / MASS  # m/s, a little less than at its end
    flying = acceleration_of(in_blocks)[110:200, 2]
    assert thrown > 0.5
    assert flying == pytest.approx(np.full(90, -GRAVITY), abs=1e-6)
    assert np.max(np.abs(tension_of(in_blocks)[110:200])) == 0.0
    assert in_blocks == pytest.approx(at_once, abs=1e-6 * WEIGHT)


@pytest.mark.parametrize(
    ("switched", "words"),
    [
        ({"sprung_mas.mass": 3.0}, "effect sprung_mas.mass: is unknown"),
        ({"hinge_damping": -1.0}, "effect hinge_damping: -1 is not within 0 and 1e+06"),
        ({"hinge_damping": float("nan")}, "effect hinge_damping: nan"),
        ({"cable_length": [0.0, 0.0]}, "effect cable_length: has 2 numbers; give 1 or 3"),
        ({"hinge_position.body": [0.0] * 4}, "has 4 numbers; give 1 or 3 or 9"),
        ({"sprung_mass.mass": 310.0, "sprung_mass.position": CENTER}, "sprung_mass.mass: 310 kg at"),
        ({"loose_mass.mass": 60.0, "loose_mass.position": [20.0, 0.0, 0.0]}, "more than the body has there"),
        ({"external_force.direction": [0.0, 0.0, 0.0]}, "external_force.direction: is zero"),
        ({"tether": "much"}, "'much' is no number"),
    ],
)
def test_a_switch_that_makes_no_sense_is_refused_by_name(switched: dict[str, object], words: str) -> None:
    with pytest.raises(InputError) as refused:
        effects_of(switched, rig_model(RIG, BODY), "effect ")  # type: ignore[arg-type]
    assert words in str(refused.value)


def test_every_mechanical_effect_of_the_contract_has_a_switch() -> None:
    """The devices' own errors are the sensor nodes'; a cable goes slack by itself."""
    mechanical = {
        "cable_length", "hinge_position", "level_error", "cable_elasticity", "cable_mass", "hinge_damping",
        "hinge_friction", "air_drag", "air_added_mass", "ceiling_compliance", "exciter_rotor", "liquid_slosh",
        "sprung_mass", "loose_mass", "tether", "external_force", "exciter_gain",
    }  # fmt: skip
    assert mechanical <= {switch.name.partition(".")[0] for switch in SWITCHES}
