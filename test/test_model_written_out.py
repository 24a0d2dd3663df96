"""Columns that are written out (state_columns.py, number_columns.py) against the complex step."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from test_model_internal import AXES, ceiling, pendulum, rider, with_rest
from test_model_rigs import Sample, random_sample

from rig_identification.model import layout
from rig_identification.model.dynamics import assemble, rotation
from rig_identification.model.effects import place
from rig_identification.model.integrate import EXCITER_CLOCK, linearise, solve
from rig_identification.model.motion import RigModel

Array = NDArray[np.float64]


def held_to_the_complex_step(model: RigModel, sample: Sample, modes: Array) -> None:
    """dz of the equations' right-hand side, for every entry of state and physics, to rounding."""
    rng = np.random.default_rng(8)
    x = rng.normal(0.0, 0.3, model.states)
    x[:3] = sample.start.position
    x[layout.ROTATION : layout.ROTATION + 3] = 0.02, 0.01, -0.03
    R_reference = np.array(sample.start.R_world_body, order="C")
    force, rate, wrench = rng.normal(0.0, 100.0, 3), rng.normal(0.0, 900.0, 3), rng.normal(0.0, 10.0, 6)
    size = 6 + model.cables + model.internal
    K, r = np.empty((size, size)), np.empty(size)
    inverse, z, R = np.empty((size, size)), np.empty(size), np.empty((3, 3))
    rotation(R_reference, x, R)
    mount = model.exciter_orientation
    assert solve(model.physics, modes, mount, x, R, force, wrench, K, r, inverse, z)
    entries = np.array([*range(model.physics.size), EXCITER_CLOCK])
    dz = np.empty((size, model.states + 6 + entries.size))
    linearise(model.physics, modes, mount, R_reference, x, force, rate, z, inverse, entries, dz)

    def by_complex_step(entry: int, of_state: bool) -> Array:
        xc, pc, fc = x.astype(complex), model.physics.astype(complex), force.astype(complex)
        if of_state:
            xc[entry] += 1e-30j
        elif entry == EXCITER_CLOCK:
            fc += 1e-30j * rate
        else:
            pc[entry] += 1e-30j
        Kc, rc, Rc = np.empty((size, size), complex), np.empty(size, complex), np.empty((3, 3), complex)
        rotation(R_reference.astype(complex), xc, Rc)
        assemble(pc, modes, mount, xc, Rc, fc, wrench, Kc, rc)
        return np.asarray(inverse @ ((rc - Kc @ z).imag / 1e-30))

    density = layout.effects_offset(model.cables) + place.LINEAR_DENSITY
    rows, not_cables = np.ones(size, dtype=bool), np.ones(size, dtype=bool)
    not_cables[6 : 6 + model.cables] = False
    if model.physics[density] > 0.0:
        # The weight of cables themselves at their cells stands in these rows as well
        rows = not_cables
    for column in range(model.states):
        exact = by_complex_step(column, True)[rows]
        np.testing.assert_allclose(
            dz[rows, column], exact, rtol=1e-9, atol=1e-9 * np.max(np.abs(exact)) + 1e-9
        )
    for k, entry in enumerate(entries):
        kept = not_cables if entry == density else rows
        exact = by_complex_step(int(entry), False)[kept]
        found = dz[kept, model.states + 6 + k]
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-9 * np.max(np.abs(exact)) + 1e-12)


@pytest.mark.parametrize("mode", [layout.RIGID, layout.ELASTIC, layout.ELASTIC_ROD, layout.SLACK])
@pytest.mark.parametrize("yielding", [False, True], ids=["plain", "ceiling"])
def test_what_is_written_out_is_what_the_complex_step_gives(mode: int, yielding: bool) -> None:
    sample = random_sample(3, 4)
    model = sample.model(axial_stiffness=2e6)
    physics = model.physics.copy()
    physics[layout.EXCITER_ROTATION : layout.EXCITER_ROTATION + 3] = 0.02, -0.01, 0.03
    for i in range(model.cables):
        physics[layout.cable_offset(i) + layout.AXIAL_DAMPING] = 1e-3
        # All of them pull
        physics[layout.cable_offset(i) + layout.LENGTH] -= 2e-3
    model = model.with_physics(physics)
    if yielding:
        model = model.with_internal(ceiling(2e-6, np.array([[0.6, 0.0, 0.8]]), 4.0, 0.05))
        model = model.with_internal(ceiling(3e-6, np.array([[0.0, 0.6, 0.8]]), 5.0, 0.1, hinge=1))
    modes = np.full(model.cables, layout.RIGID)
    modes[1] = mode
    held_to_the_complex_step(model, sample, modes)


@pytest.mark.parametrize("entry", range(place.TETHER_POINT))
def test_what_an_effect_does_not_answer_to_is_left_out_rightly(entry: int) -> None:
    """Each amount of the effects' block by itself, with a mass that rides and a liquid beside."""
    sample = random_sample(5, 3)
    model = with_rest(sample.model(rods=True))
    physics = model.physics.copy()
    block = layout.effects_offset(model.cables)
    physics[block + entry] = 7.0
    physics[block + place.CREEP] = 0.05
    physics[block + place.TETHER_POINT : block + place.TETHER_POINT + 3] = 0.3, -0.2, 0.1
    physics[block + place.LAW_POINT : block + place.LAW_POINT + 3] = -0.3, 0.2, 0.4
    physics[block + place.PLATE_REACH] = 1.0
    physics[block + place.ROLL_AXIS : block + place.ROLL_AXIS + 3] = 0.6, 0.8, 0.0
    model = model.with_physics(physics)
    model = model.with_internal(rider(60.0, np.array([0.3, 0.1, -0.5]), AXES[2:], 0.9, 0.05))
    model = model.with_internal(pendulum(30.0, np.array([0.1, 0.2, -0.4]), 1.4, 0.02))
    held_to_the_complex_step(model, sample, np.full(model.cables, layout.RIGID))
