"""A motion shared between threads is the motion of one, to the last bit; steps resolve what bounces."""

from __future__ import annotations

import numpy as np
import pytest
from test_model_derivatives import drive_of, tangent_basis
from test_model_rigs import moving, random_sample, trifilar
from test_model_threads import having

from rig_identification.model import layout
from rig_identification.model.effects.place import DAMPING, FRICTION, effects_block
from rig_identification.model.equilibrium import settle
from rig_identification.model.integrate import EXCITER_CLOCK
from rig_identification.model.modes import natural_modes
from rig_identification.model.motion import Input, Motion, RigModel, State, _cuts, rig_model, simulate
from rig_identification.model.substeps import FIT_STEP, MOST, RESOLVED, STABLE, stopping_rate, substeps_for
from rig_identification.rig import Cable, Rig

FIELDS = ("states", "R_world_body", "outputs", "A", "B", "H", "D", "J")


def directions_of(model: RigModel) -> np.ndarray:
    lengths = [layout.cable_offset(i) + layout.LENGTH for i in range(model.cables)]
    return np.array([EXCITER_CLOCK, *range(layout.INERTIAL, layout.INERTIAL + 10), *lengths])


def by(threads: int, model: RigModel, start: State, drive: Input) -> Motion:
    basis = tangent_basis(model, start)
    return simulate(model, start, drive, directions=directions_of(model), start_basis=basis, threads=threads)


@pytest.mark.parametrize("threads", [2, 3])
@pytest.mark.parametrize(
    "effects", [{}, {"DAMPING": 4.0, "FRICTION": 2.0, "DRAG_AREA": 0.8}, {"LINEAR_DENSITY": 0.9}]
)
def test_a_shared_motion_is_that_of_one_thread_bit_for_bit(effects: dict[str, float], threads: int) -> None:
    sample = random_sample(5, 4)
    model = having(sample.model(), **effects)
    start, drive = moving(sample, model, 5), drive_of(801, 0.01, 5)
    one, shared = by(1, model, start, drive), by(threads, model, start, drive)
    assert one.complete
    assert shared.complete
    for name in FIELDS:
        assert np.array_equal(getattr(one, name), getattr(shared, name)), name


def test_cables_let_go_alike_in_every_stretch() -> None:
    sample = trifilar()
    model = sample.model()
    nodes = 1201
    drive = Input(0.01, np.zeros((nodes, 3)), np.zeros((nodes, 3)), np.zeros((nodes, 6)))
    weight = -9.80665 * model.physics[layout.INERTIAL]
    drive.wrench[300:700, 2] = -1.4 * weight
    one, shared = by(1, model, sample.start, drive), by(2, model, sample.start, drive)
    cut = _cuts(nodes, 2, 0.2)[1]
    assert 300 < cut < 800
    assert np.any(one.outputs[cut, layout.OUT_TENSION :] == 0.0)
    for name in FIELDS:
        assert np.array_equal(getattr(one, name), getattr(shared, name)), name


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("node", [100, 700])
def test_a_motion_that_leaves_every_bound_ends_where_it_does(node: int, threads: int) -> None:
    sample = random_sample(5, 4)
    model = sample.model()
    drive = drive_of(801, 0.01, 5)
    drive.wrench[node:, :3] = 1e18
    motion = by(threads, model, moving(sample, model, 5), drive)
    assert not motion.complete
    assert node <= motion.nodes <= node + 2


@pytest.mark.parametrize("threads", [2, 4, 8])
@pytest.mark.parametrize("plain", [0.02, 0.3])
def test_stretches_end_together(threads: int, plain: float) -> None:
    cuts = np.array(_cuts(1_000_000, threads, plain))
    assert cuts[0] == 0
    assert cuts[-1] == 1_000_000
    takes = plain * cuts[:-1] + np.diff(cuts)
    assert np.ptp(takes) < 1e-5 * cuts[-1]
    assert takes[0] < 1_000_000 * (plain + (1.0 - plain) / threads)
    assert _cuts(150, threads, plain) == [0, 150]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_substeps_follow_the_fastest_bounce(seed: int) -> None:
    """Which natural_modes finds from the motion's own derivatives; stiffer cables ask for more."""
    sample = random_sample(seed, 4)
    model = sample.model(axial_stiffness=4e6, rods=True)
    rest = settle(model, sample.start)
    fastest = 2.0 * np.pi * natural_modes(model, rest)[-1].frequency
    step = 0.4
    count = substeps_for(model, step, longest=step)
    assert count == pytest.approx(step * fastest / RESOLVED, rel=0.1)  # near the design pose, not at rest


def light_pendulum(friction: float) -> RigModel:
    """1.6 kg on two threads whose hinges rub."""
    points = np.array([[-0.2, 0.0, 0.0], [0.2, 0.0, 0.0]])
    cables = tuple(Cable(f"cable_{i}", p, p, 1.4) for i, p in enumerate(points))
    elements = np.array([1.6, 0.0, 0.0, -0.1, 0.03, 0.0, 0.0, 0.02, 0.0, 0.03])
    model = rig_model(Rig(9.80665, cables, 1.6, 0.001), elements)
    model.physics[effects_block(2) + FRICTION] = friction
    return model


def test_hinges_that_hardly_creep_ask_for_short_steps() -> None:
    """Longer ones chatter where the hinges hold the body, and what a number does to it grows for ever."""
    model = light_pendulum(0.008)
    start = settle(model, State(np.array([0.0, 0.0, -1.4]), np.eye(3), np.zeros(3), np.zeros(3)))
    rolled = State(start.position, start.R_world_body, np.zeros(3), np.array([0.3, 0.0, 0.0]))
    drive = Input.none(201, 0.025)

    def answer(substeps: int | None) -> float:
        motion = simulate(
            model,
            rolled,
            drive,
            directions=directions_of(model)[1:11],
            start_basis=tangent_basis(model, rolled),
            substeps=substeps,
        )
        assert motion.complete
        assert motion.J is not None
        return float(np.max(np.abs(motion.J)))

    assert substeps_for(light_pendulum(0.0), 0.025, FIT_STEP) == 5
    assert 5 < substeps_for(model, 0.025, FIT_STEP) < MOST
    assert substeps_for(light_pendulum(1.0), 0.025, FIT_STEP) == MOST
    assert answer(None) < 1e3
    assert not answer(1) < 1e6


def test_the_stopping_rate_is_that_of_a_body_that_rolls_to_a_halt() -> None:
    """Slow rolling between two hinges on its axis: both rub against J + m d^2 about it."""
    model = light_pendulum(0.008)
    rate = stopping_rate(model)
    about_line = 0.03 + 1.6 * 0.1**2
    np.testing.assert_array_less(2.0 * 0.008 / 1e-3 / about_line, rate)  # no slower than this way of moving
    viscous = light_pendulum(0.0)
    viscous.physics[effects_block(2) + DAMPING] = 8.0
    assert stopping_rate(viscous) == pytest.approx(rate)
    assert substeps_for(viscous, 0.025, 1.0) == int(np.ceil(0.025 * rate / STABLE))
