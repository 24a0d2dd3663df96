"""Rigs and bodies that the tests of model and estimate share, and that they are what they claim to be."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.model import layout
from rig_identification.model.body import can_exist
from rig_identification.model.motion import RigModel, State, on_cables, rig_model
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.thesis.case import load_case

Array = NDArray[np.float64]

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
GRAVITY = 9.80665


@dataclass(frozen=True)
class Sample:
    """A rig, the body on it and a state from which it swings."""

    rig: Rig
    elements: Array  # (10,) as in body.py
    start: State

    def model(self, *, axial_stiffness: float | None = None, rods: bool = False) -> RigModel:
        """Forward model of the sample."""
        return rig_model(self.rig, self.elements, axial_stiffness=axial_stiffness, rods=rods)


def elements_of(mass: float, center: Array, inertia: Array) -> Array:
    """(10,) elements of mass, centre of mass (3,) and inertia about it (3, 3)."""
    return np.array([mass, *center, *inertia[np.triu_indices(3)]])


def thesis_case_14() -> Sample:
    """Case 14 of the thesis: a small car on four splayed cables, let go far from rest."""
    case = load_case(14)
    at = State(case.position, Rotation.from_quat(case.orientation).as_matrix(), np.zeros(3), np.zeros(3))
    elements = elements_of(case.mass, case.center_of_mass, case.inertia)
    return Sample(case.rig, elements, on_cables(rig_model(case.rig, elements), at))


def hung(ceiling: Array, body: Array, elements: Array, position: Array, turn: Array) -> Sample:
    """A rig whose cables are as long as the pose (``position``, rotation vector ``turn``) needs them."""
    R = Rotation.from_rotvec(turn).as_matrix()
    lengths = np.linalg.norm(ceiling - position - body @ R.T, axis=1)
    cables = tuple(
        Cable(f"cable_{i + 1}", ceiling[i], body[i], float(lengths[i])) for i in range(len(ceiling))
    )
    orientation = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_quat()
    rig = Rig(
        gravity=GRAVITY,
        cables=cables,
        mass=float(elements[0]),
        mass_std=0.5,
        imu=Mount(np.array([0.3, -0.2, 0.1]), Rotation.from_rotvec([0.0, 0.0, 0.4]).as_quat()),
        inclinometer=Mount(np.zeros(3), Rotation.from_rotvec([0.01, -0.02, 0.3]).as_quat()),
        exciter=Mount(np.array([0.4, -0.3, 0.2]), orientation),
    )
    return Sample(rig, elements, State(position, R, np.zeros(3), np.zeros(3)))


CAR = np.array([1100.0, 0.06, -0.08, -0.25, 1400.0, 20.0, -30.0, 420.0, 45.0, 1600.0])
DRUM = np.array([300.0, 0.02, -0.03, -0.3, 60.0, 3.0, -2.0, 75.0, 4.0, 90.0])


def circle(radius: Array | float, angles: Array, height: float) -> Array:
    """(n, 3) points at ``angles`` (rad) on a circle about the vertical."""
    return np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(angles.shape, height)], axis=1)


def trifilar(swing: float = 0.5) -> Sample:
    """Three parallel cables of 2 m: let go turned by ``swing`` rad about the vertical and pushed aside."""
    angles = np.array([0.1, 2.2, 4.3])
    corners = circle(0.9, angles, 0.0)
    rest = hung(corners, corners, DRUM, np.array([0.0, 0.0, -2.0]), np.zeros(3))
    sideways = 0.3 * swing * np.array([1.0, 0.5, 0.0])
    at = State(
        np.array([*sideways[:2], -1.9]),
        Rotation.from_rotvec([0.0, 0.0, swing]).as_matrix(),
        np.zeros(3),
        np.zeros(3),
    )
    return replace(rest, start=on_cables(rest.model(rods=True), at))


def four_parallel() -> Sample:
    """Four parallel cables: yaw is free, roll and pitch are not."""
    corners = np.array([[-1.0, -1.5, 0.0], [1.0, -1.5, 0.0], [1.0, 1.5, 0.0], [-1.0, 1.5, 0.0]])
    return hung(corners, corners, CAR, np.array([0.0, 0.0, -2.5]), np.zeros(3))


def bifilar() -> Sample:
    """Two parallel cables."""
    ends = np.array([[-0.6, 0.0, 0.0], [0.6, 0.0, 0.0]])
    return hung(ends, ends, DRUM, np.array([0.0, 0.0, -1.5]), np.zeros(3))


def random_sample(seed: int, cables: int) -> Sample:
    """Splayed cables with no symmetry, a body with every product of inertia, away from rest."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0.0, 2.0 * np.pi, cables, endpoint=False) + rng.uniform(-0.15, 0.15, cables)
    twist = 0.35 * (-1.0) ** np.arange(cables) + rng.uniform(-0.1, 0.1, cables)
    ceiling = circle(rng.uniform(1.6, 2.2, cables), angles + twist, 0.0)
    ceiling[:, 2] += rng.uniform(-0.1, 0.1, cables)
    body = circle(rng.uniform(0.8, 1.2, cables), angles, 0.0)
    body[:, 2] += rng.uniform(-0.1, 0.1, cables)
    mass = rng.uniform(300.0, 1500.0)
    # A cloud of points is a body that can exist
    cloud = rng.normal(size=(12, 3)) * rng.uniform(0.4, 0.9, 3)
    cloud -= cloud.mean(axis=0)
    inertia = mass * (np.mean(np.sum(cloud**2, axis=1)) * np.eye(3) - cloud.T @ cloud / 12.0)
    elements = elements_of(mass, rng.uniform(-0.15, 0.15, 3) - [0.0, 0.0, 0.3], inertia)
    return hung(ceiling, body, elements, np.array([0.0, 0.0, -2.0]), rng.uniform(-0.15, 0.15, 3))


def moving(sample: Sample, model: RigModel, seed: int) -> State:
    """The sample's start pose with a velocity that its cables allow."""
    rng = np.random.default_rng(seed)
    start = sample.start
    state = State(start.position, start.R_world_body, rng.uniform(-0.4, 0.4, 3), rng.uniform(-0.4, 0.4, 3))
    return on_cables(model, state)


def cable_lengths(model: RigModel, position: Array, R: Array) -> Array:
    """(N, n) m of poses (N, 3), (N, 3, 3), by the law of Pythagoras alone."""
    blocks = model.cable_numbers()
    hinges = position[:, None, :] + np.einsum("nij,cj->nci", R, blocks[:, 3:6])
    return np.asarray(np.linalg.norm(hinges - blocks[:, 0:3], axis=2))


def unloaded_lengths(model: RigModel) -> Array:
    """(n,) m."""
    return np.asarray(model.cable_numbers()[:, layout.LENGTH])


@pytest.mark.parametrize("cables", [2, 3, 4, 5, 6])
def test_random_rigs_are_sound(cables: int) -> None:
    for seed in range(5):
        sample = random_sample(seed, cables)
        assert can_exist(sample.elements)
        start, model = sample.start, sample.model()
        lengths = cable_lengths(model, start.position[None], start.R_world_body[None])[0]
        np.testing.assert_allclose(lengths, unloaded_lengths(model), atol=1e-14)
