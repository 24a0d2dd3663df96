"""What spins on the body, and air against one side of it: energy, a limit case, derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from test_model_conservation import kinetic_and_potential
from test_model_derivatives import check_physics, drive_of
from test_model_gyroscopic import falling, spinning
from test_model_rigs import moving, random_sample, thesis_case_14

from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import Input, RigModel, simulate

Array = NDArray[np.float64]
H = np.array([30.0, -80.0, 50.0])


def having(model: RigModel, **numbers: Array | float) -> RigModel:
    """The model with numbers of its effects' block, by their place's name."""
    physics = model.physics.copy()
    for name, values in numbers.items():
        first = place.effects_block(model.cables) + getattr(place, name)
        own = np.atleast_1d(np.asarray(values, dtype=np.float64))
        physics[first : first + own.size] = own
    return model.with_physics(physics)


def test_a_falling_body_with_a_rotor_keeps_its_angular_momentum() -> None:
    """About its centre of mass, in the world: R (J w + H), H being the rotor's."""
    sample = thesis_case_14()
    motion = simulate(having(falling(sample), SPIN=H), spinning(sample), Input.none(101, 0.01))
    xx, xy, xz, yy, yz, zz = sample.elements[4:]
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    kept = np.einsum("nij,nj->ni", motion.R_world_body, motion.states[:, 9:12] @ J + H)
    np.testing.assert_allclose(kept, np.tile(kept[0], (101, 1)), atol=1e-7 * np.linalg.norm(kept[0]))


def test_a_rotor_neither_drives_nor_brakes_a_body_on_its_cables() -> None:
    sample = random_sample(3, 3)
    plain = sample.model()
    state = moving(sample, plain, 3)
    motion = simulate(having(plain, SPIN=H), state, Input.none(201, 0.01))
    kinetic, potential = kinetic_and_potential(plain, motion)
    assert np.ptp(kinetic) > 0.1 * np.max(kinetic)
    assert np.ptp(kinetic + potential) < 1e-6 * np.max(kinetic)


def test_a_plate_takes_out_what_air_against_it_does() -> None:
    """Its power is -1/2 rho A sqrt(u^2 + s^2 w^2) u^2 at its place, u along its normal, x here, w across."""
    sample, at = random_sample(3, 3), np.array([0.4, 0.9, -0.3])
    plain = sample.model()
    state = moving(sample, plain, 3)
    along = 0.6
    air = {"AIR_PLATE": 8.0, "AIR_PLATE_NORMAL": np.zeros(2), "AIR_PLATE_POINT": at, "AIR_PLATE_ALONG": along}
    motion = simulate(having(plain, **air), state, Input.none(401, 0.0025))
    velocity = np.einsum("nji,nj->ni", motion.R_world_body, motion.states[:, 6:9])
    u, *across = (velocity + np.cross(motion.states[:, 9:12], at)).T
    power = 0.5 * 1.2 * 8.0 * np.sqrt(u**2 + along**2 * (across[0] ** 2 + across[1] ** 2)) * u**2
    kinetic, potential = kinetic_and_potential(plain, motion)
    lost = (kinetic + potential)[0] - (kinetic + potential)[-1]
    assert lost == pytest.approx(np.trapezoid(power, dx=0.0025), rel=1e-3)


def test_carried_air_keeps_its_energy() -> None:
    """With u^T D u / 2 of the air beside the body's own nothing is lost, whichever way either turns."""
    sample, at, D = random_sample(3, 3), np.array([0.4, 0.9, -0.3]), np.array([150.0, 60.0, 400.0])
    plain = sample.model()
    state = moving(sample, plain, 3)
    motion = simulate(having(plain, AIR_CARRIED=D, AIR_CARRIED_POINT=at), state, Input.none(801, 0.0025))
    velocity = np.einsum("nji,nj->ni", motion.R_world_body, motion.states[:, 6:9])
    u = velocity + np.cross(motion.states[:, 9:12], at)
    kinetic, potential = kinetic_and_potential(plain, motion)
    air = 0.5 * np.sum(D * u**2, axis=1)
    assert np.ptp(air) > 0.05 * np.max(kinetic)
    assert np.ptp(kinetic + potential + air) < 1e-6 * np.max(kinetic)


def test_air_carried_all_ways_is_a_mass_without_weight() -> None:
    """At the centre of mass, as much along each axis: as ``air_added_mass`` has it."""
    sample = random_sample(3, 3)
    plain = sample.model()
    state = moving(sample, plain, 3)
    inertial = plain.physics[layout.INERTIAL : layout.INERTIAL + 4]
    both = having(plain, AIR_CARRIED=np.full(3, 30.0), AIR_CARRIED_POINT=inertial[1:] / inertial[0])
    moved = [simulate(m, state, Input.none(201, 0.01)).states for m in (both, having(plain, ADDED_MASS=30.0))]
    np.testing.assert_allclose(*moved, atol=1e-8)


@pytest.mark.parametrize("seed", [3, 7])
def test_every_number_of_carried_air(seed: int) -> None:
    sample = random_sample(seed, 3)
    air = {"AIR_CARRIED": np.array([3.0, 12.0, 5.0]), "AIR_CARRIED_POINT": np.array([0.2, -0.3, 0.4])}
    model = having(sample.model(rods=True), **air)
    block = layout.effects_offset(model.cables)
    entries = [block + getattr(place, name) + i for name in air for i in range(3)]
    entries += [layout.INERTIAL + 4, layout.CABLES + layout.LENGTH]
    check_physics(model, moving(sample, model, seed), drive_of(61, 0.01, seed), entries, 2e-5)


@pytest.mark.parametrize("seed", [3, 7])
def test_every_number_of_both(seed: int) -> None:
    sample = random_sample(seed, 3)
    air = {"AIR_PLATE": 3.0, "AIR_PLATE_NORMAL": np.array([0.4, 0.3]), "AIR_PLATE_POINT": np.full(3, 0.2)}
    air["AIR_PLATE_ALONG"] = np.array([0.6])
    model = having(sample.model(rods=True), SPIN=0.1 * H, **air)
    block = layout.effects_offset(model.cables)
    entries = [block + place.SPIN + i for i in range(3)]
    entries += [block + place.AIR_PLATE, *(block + place.AIR_PLATE_NORMAL + i for i in range(2))]
    entries += [block + place.AIR_PLATE_ALONG, *(block + place.AIR_PLATE_POINT + i for i in range(3))]
    entries += [layout.INERTIAL + 4, layout.CABLES + layout.LENGTH]
    check_physics(model, moving(sample, model, seed), drive_of(61, 0.01, seed), entries, 5e-6)


@pytest.mark.parametrize("seed", [3, 7])
def test_hinges_of_one_cable(seed: int) -> None:
    sample = random_sample(seed, 3)
    model = sample.model(rods=True)
    block, one = layout.effects_offset(model.cables), layout.cable_offset(1)
    physics = model.physics.copy()
    physics[block + place.DAMPING], physics[block + place.CREEP] = 0.3, 0.1
    physics[one + layout.HINGE_DAMPING], physics[one + layout.HINGE_FRICTION] = 2.0, 1.0
    entries = [one + layout.HINGE_DAMPING, one + layout.HINGE_FRICTION, one + layout.BODY_POINT]
    entries += [layout.cable_offset(0) + layout.HINGE_DAMPING, block + place.CREEP, layout.INERTIAL + 4]
    own = model.with_physics(physics)
    check_physics(own, moving(sample, own, seed), drive_of(61, 0.01, seed), entries, 5e-6)


@pytest.mark.parametrize("kind", ["DAMPING", "FRICTION"])
def test_as_much_in_each_cable_as_in_all(kind: str) -> None:
    sample = random_sample(3, 4)
    plain = sample.model(rods=True)
    state = moving(sample, plain, 3)
    all_alike = having(plain, **{kind: 1.5, "CREEP": 0.05})
    each = having(plain, CREEP=0.05)
    for i in range(4):
        each.physics[layout.cable_offset(i) + getattr(layout, f"HINGE_{kind}")] = 1.5
    still = Input.none(101, 0.01)
    one, other = simulate(all_alike, state, still), simulate(each, state, still)
    assert np.ptp(simulate(plain, state, still).states - one.states) > 1e-3
    np.testing.assert_allclose(one.states, other.states, atol=1e-9)
