"""The case generator: equilibria are minima of the energy under the cables' bounds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.recording import Dummy
from rig_identification.rig import Cable, Rig
from rig_identification.statics import find_equilibria
from rig_identification.thesis import load_case, load_cases


def spans_of(rig, equilibrium, orientation=None, position=None):
    turned = orientation or Rotation.from_quat(equilibrium.orientation)
    place = equilibrium.position if position is None else position
    body = np.array([c.body_point for c in rig.cables])
    return np.array([c.ceiling_point for c in rig.cables]) - place - turned.apply(body)


@pytest.mark.parametrize("number", [1, 10, 12, 14, 16])
def test_equilibrium_balances_forces_and_moments(number):
    case = load_case(number)
    found = find_equilibria(case.rig, case.mass, case.center_of_mass)
    assert found.status == "one"
    rest = found.equilibria[0]
    turned = Rotation.from_quat(rest.orientation)
    span = spans_of(case.rig, rest)
    length = np.linalg.norm(span, axis=1)
    assert length == pytest.approx([c.length for c in case.rig.cables], abs=1e-9)
    pull = rest.tension[:, None] * span / length[:, None]
    weight = np.array([0.0, 0.0, -case.mass * case.rig.gravity])
    assert pull.sum(0) + weight == pytest.approx(np.zeros(3), abs=1e-6)
    arms = turned.apply(np.array([c.body_point for c in case.rig.cables]))
    moment = np.cross(arms, pull).sum(0) + np.cross(turned.apply(case.center_of_mass), weight)
    assert moment == pytest.approx(np.zeros(3), abs=1e-6)


def test_no_motion_that_the_cables_allow_lowers_the_body():
    """Random poses within every length have their centre of mass no lower."""
    case = load_case(14)
    rest = find_equilibria(case.rig, case.mass, case.center_of_mass).equilibria[0]
    lowest = rest.potential_energy / (case.mass * case.rig.gravity)
    rng = np.random.default_rng(0)
    lengths = np.array([c.length for c in case.rig.cables])
    allowed = 0
    for _ in range(20_000):
        turn = Rotation.from_rotvec(rng.normal(0.0, 0.1, 3)) * Rotation.from_quat(rest.orientation)
        place = rest.position + rng.normal(0.0, 0.1, 3)
        if np.all(np.linalg.norm(spans_of(case.rig, rest, turn, place), axis=1) <= lengths):
            allowed += 1
            assert (place + turn.apply(case.center_of_mass))[2] > lowest - 1e-9
    assert allowed > 300


def test_symmetric_case_hangs_as_printed_and_shares_its_weight():
    case = load_case(1)
    rest = find_equilibria(case.rig, case.mass, case.center_of_mass).equilibria[0]
    assert rest.position == pytest.approx(case.position, abs=1e-9)
    assert rest.tension == pytest.approx(np.full(4, rest.tension[0]), rel=1e-9)


def test_vehicle_cases_do_not_start_in_equilibrium():
    """The remark of tables 4.10 to 4.17: 'no initial displacement' does not hold."""
    for case in load_cases()[9:17]:
        rest = find_equilibria(case.rig, case.mass, case.center_of_mass).equilibria[0]
        assert np.abs(rest.position - case.position).max() > 0.02


def test_a_cable_that_is_too_long_hangs_slack_and_is_named():
    case = load_case(14)
    *others, last = case.rig.cables
    rig = replace(case.rig, cables=(*others, replace(last, length=last.length + 0.5)))
    found = find_equilibria(rig, case.mass, case.center_of_mass)
    assert found.status == "slack"
    rest = found.equilibria[0]
    loose = [i for i, c in enumerate(rig.cables) if c.name in rest.slack]
    assert loose
    assert all(name in found.statement for name in rest.slack)
    lengths = np.array([c.length for c in rig.cables])
    distance = np.linalg.norm(spans_of(rig, rest), axis=1)
    assert np.all(distance[loose] < lengths[loose])
    assert np.all(rest.tension[loose] == 0.0)
    taut = np.setdiff1d(np.arange(4), loose)
    assert distance[taut] == pytest.approx(lengths[taut], abs=1e-8)
    assert np.all(rest.tension[taut] > 0.0)


def test_dummy_hangs_with_the_body():
    case = load_case(14)
    bare = find_equilibria(case.rig, case.mass, case.center_of_mass).equilibria[0]
    loaded = find_equilibria(
        case.rig, case.mass, case.center_of_mass, Dummy(60.0, np.array([0.0, 0.0, -0.5]))
    ).equilibria[0]
    moved = Rotation.from_quat(bare.orientation).inv() * Rotation.from_quat(loaded.orientation)
    assert moved.magnitude() > 1e-3
    assert loaded.tension.sum() > bare.tension.sum()


def test_bifilar_body_hangs_with_its_center_below_its_cables():
    cables = (
        Cable("a", np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0]), 2.0),
        Cable("b", np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), 2.0),
    )
    found = find_equilibria(Rig(9.81, cables), 10.0, np.array([0.4, 0.1, -0.3]))
    assert found.status == "one"
    rest = found.equilibria[0]
    center = rest.position + Rotation.from_quat(rest.orientation).apply([0.4, 0.1, -0.3])
    assert center[1] == pytest.approx(0.0, abs=1e-9)
    assert rest.tension == pytest.approx([10 * 9.81 * 0.6, 10 * 9.81 * 0.4], rel=1e-6)


def test_two_cables_to_one_ceiling_point_have_two_headings():
    """A body on two long cables from one point hangs either way round: both are found."""
    top = np.zeros(3)
    cables = (
        Cable("a", top, np.array([-0.5, 0.0, 0.0]), 2.0),
        Cable("b", top + np.array([0.0, 0.3, 0.0]), np.array([0.5, 0.0, 0.0]), 2.0),
        Cable("c", top + np.array([0.0, -0.3, 0.0]), np.array([0.5, 0.0, 0.0]), 2.0),
    )
    found = find_equilibria(Rig(9.81, cables), 10.0, np.array([0.0, 0.0, -1.0]))
    assert found.status == "several"
    assert len(found.equilibria) >= 2
    energies = [e.potential_energy for e in found.equilibria]
    assert energies == sorted(energies)
