"""Chapter 2's solution: Table 2.1, every number of cables, and standard deviations that hold."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.recording import Dummy
from rig_identification.rig import Cable, CarryingFrame, Rig
from rig_identification.statics import (
    StaticObservation,
    find_equilibria,
    observe_equilibrium,
    solve_center_of_mass,
    without_frame,
)
from rig_identification.thesis import load_case, read_static_table


def table_2_1(z_axis="down"):
    """Rig, centre of mass of all, dummy and frame of Table 2.1, world and body z up."""
    printed = read_static_table()["printed"]
    # The printed axes with z down, turned half round x; with z up they stay.
    flip = np.diag([1.0, -1.0, -1.0] if z_axis == "down" else [1.0, 1.0, 1.0])
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    ceiling = corners * [*printed["ceiling_frame"], 0.0] @ flip
    body = corners * [*printed["carrying_frame"][:2], 0.0] @ flip
    cables = tuple(
        Cable(f"cable_{i + 1}", ceiling[i], body[i], 1e-3 * printed["cable_length"]) for i in range(4)
    )
    masses = printed["body_mass"], printed["carrying_frame_mass"]
    tested = 1e-3 * np.array(printed["body_center_of_gravity"]) @ flip
    middle = 0.5 * np.array(printed["carrying_frame"]) @ flip
    combined = (masses[0] * tested + masses[1] * middle) / sum(masses)
    frame = CarryingFrame(masses[1], middle, np.eye(3))
    rig = Rig(gravity=9.81, cables=cables, mass=sum(masses), frame=frame)
    dummy = Dummy(printed["dummy_mass"], np.array(printed["dummy_center_of_gravity"]) * 1e-3)
    return rig, combined, tested, dummy


def observe_both(rig, truth_rig, mass, center, dummy, tension_std=None, noise=0.0, rng=None):
    seen = []
    for name, load in (("bare", None), ("dummy", dummy)):
        rest = find_equilibria(truth_rig, mass, center, load).equilibria[0]
        seen.append(observe_equilibrium(truth_rig, rest, name, load, noise, tension_std, rng))
    return seen


@pytest.mark.parametrize("z_axis", ["down", "up"])
def test_table_2_1_to_a_hundredth_of_a_millimetre(z_axis):
    rig, combined, tested, dummy = table_2_1(z_axis)
    solution = solve_center_of_mass(rig, *observe_both(rig, rig, rig.mass, combined, dummy))
    assert solution.status == "determined"
    assert solution.center_of_mass == pytest.approx(combined, abs=1e-5)
    mass, body_center, _ = without_frame(solution, rig.frame)
    assert mass == pytest.approx(1072.0)
    assert body_center == pytest.approx(tested, abs=1e-5)


def test_measured_tensions_sharpen_the_center_of_mass():
    """At Table 2.1 with the contract's tolerances: from 12, 6, 57 mm to 1.2, 0.7, 16 mm."""
    rig, combined, _, dummy = table_2_1()
    bare = solve_center_of_mass(rig, *observe_both(rig, rig, rig.mass, combined, dummy, None, 1e-5))
    cells = solve_center_of_mass(rig, *observe_both(rig, rig, rig.mass, combined, dummy, 0.5, 1e-5))
    assert np.all(cells.std[:2] < bare.std[:2] / 5.0)
    assert cells.std[2] < bare.std[2] / 3.0


def test_bare_alone_leaves_the_height_open_and_says_so():
    rig, combined, _, _ = table_2_1()
    rest = find_equilibria(rig, rig.mass, combined).equilibria[0]
    solution = solve_center_of_mass(rig, observe_equilibrium(rig, rest, tension_std=0.1))
    assert solution.status == "undetermined"
    assert solution.undetermined == ("cz",)
    assert np.isnan(solution.center_of_mass[2])
    assert np.isinf(solution.std[2])
    assert np.all(np.abs(solution.center_of_mass - combined)[:2] < 3.0 * solution.std[:2])


@pytest.mark.parametrize("number", [10, 12, 14, 16])
def test_vehicle_rigs_come_back_exactly(number):
    case = load_case(number)
    dummy = Dummy(50.0, np.array([0.1, 0.2, -0.4]))
    seen = observe_both(case.rig, case.rig, case.mass, case.center_of_mass, dummy)
    solution = solve_center_of_mass(case.rig, *seen)
    assert solution.status == "determined"
    assert solution.center_of_mass == pytest.approx(case.center_of_mass, abs=1e-6)
    for pose, observation, load in zip(solution.poses, seen, (None, dummy), strict=True):
        rest = find_equilibria(case.rig, case.mass, case.center_of_mass, load).equilibria[0]
        assert pose.position == pytest.approx(rest.position, abs=1e-6)
        assert pose.tension == pytest.approx(rest.tension, rel=1e-6)
        assert pose.name == observation.name


def few_cables(count):
    """Two to three inclined cables: the balance completes the pose that lengths leave open."""
    angle = np.arange(count) * 2.0 * np.pi / count + 0.2
    ceiling = np.c_[2.0 * np.cos(angle), 1.8 * np.sin(angle), np.zeros(count)]
    body = np.c_[np.cos(angle + 0.1), np.sin(angle - 0.1), np.linspace(0.0, 0.1, count)]
    length = np.linalg.norm(body + np.array([0.0, 0.0, -2.0]) - ceiling, axis=1)
    cables = tuple(Cable(f"c{i}", ceiling[i], body[i], float(length[i])) for i in range(count))
    return Rig(9.81, cables, mass=500.0)


@pytest.mark.parametrize("count", [2, 3])
def test_fewer_than_four_cables_without_load_cells(count):
    rig = few_cables(count)
    center = np.array([0.05, -0.03, -0.5])
    seen = observe_both(rig, rig, rig.mass, center, Dummy(40.0, np.array([0.5, 0.4, 0.0])))
    solution = solve_center_of_mass(rig, *seen)
    assert solution.status == "determined"
    assert solution.center_of_mass == pytest.approx(center, abs=1e-6)


def parallel_rig():
    body = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1.5, 0], [2, 1.5, 0]])
    cables = tuple(Cable(f"c{i}", body[i] + np.array([0.0, 0.0, 2.0]), body[i], 2.0) for i in range(4))
    return Rig(9.81, cables, mass=800.0)


def test_parallel_cables_without_load_cells_determine_nothing():
    rig = parallel_rig()
    center = np.array([0.9, 0.8, -0.4])
    seen = observe_both(rig, rig, rig.mass, center, Dummy(50.0, np.array([1.5, 1.0, 0.0])))
    solution = solve_center_of_mass(rig, *seen)
    assert solution.status == "undetermined"
    assert "cz" in solution.undetermined
    assert set(solution.undetermined) >= {"cx", "cy"}
    assert solution.poses[0].undetermined_tensions == 1
    assert "tensions" in solution.statement


def test_parallel_cables_with_load_cells_determine_all_but_the_height():
    rig = parallel_rig()
    center = np.array([0.9, 0.8, -0.4])
    seen = observe_both(rig, rig, rig.mass, center, Dummy(50.0, np.array([1.5, 1.0, 0.0])), 0.1)
    solution = solve_center_of_mass(rig, *seen)
    assert solution.undetermined == ("cz",)
    assert solution.center_of_mass[:2] == pytest.approx(center[:2], abs=2e-3)
    assert np.all(solution.std[:2] < 5e-3)


def hexagon():
    """Six rigid cables in pairs: they lock the body, and each carries what statics says."""
    angle = np.arange(6) * np.pi / 3.0
    body = np.c_[np.cos(angle), np.sin(angle), np.zeros(6)]
    twist = 0.25 * np.array([1.0, -1.0] * 3)
    ceiling = np.c_[1.5 * np.cos(angle + twist), 1.5 * np.sin(angle + twist), np.full(6, 2.0)]
    length = np.linalg.norm(ceiling - body, axis=1)
    cables = tuple(Cable(f"c{i}", ceiling[i], body[i], float(length[i])) for i in range(6))
    return Rig(9.81, cables, mass=600.0), (ceiling - body) / length[:, None], body


def test_six_cables_lock_the_pose_so_that_only_load_cells_tell_and_never_the_height():
    rig, unit, body = hexagon()
    center = np.array([0.05, 0.08, -0.3])
    wrench = np.hstack([unit, np.cross(body, unit)]).T
    seen = []
    for name, load in (("bare", None), ("dummy", Dummy(40.0, np.array([0.3, -0.2, 0.1])))):
        total = rig.mass + (load.mass if load else 0.0)
        first = rig.mass * center + (load.mass * load.position if load else 0.0)
        weight = np.array([0.0, 0.0, -total * 9.81])
        pull = np.linalg.solve(wrench, -np.concatenate([weight, np.cross(first / total, weight)]))
        assert np.all(pull > 0.0)
        seen.append(StaticObservation(name, np.zeros(2), np.full(2, 1e-5), pull, np.full(6, 0.1), load))
    solution = solve_center_of_mass(rig, *seen)
    assert solution.undetermined == ("cz",)
    assert np.abs(solution.center_of_mass - center)[:2].max() < 3e-3
    assert np.all(solution.std[:2] < 0.02)


def test_load_cells_stand_in_for_a_missing_inclinometer():
    case = load_case(14)
    dummy = Dummy(80.0, np.array([0.1, 0.2, -0.4]))
    seen = observe_both(case.rig, case.rig, case.mass, case.center_of_mass, dummy, 0.1)
    blind = [replace(o, inclination=np.full(2, np.nan), inclination_std=np.full(2, np.nan)) for o in seen]
    solution = solve_center_of_mass(case.rig, *blind)
    assert solution.status == "determined"
    assert solution.center_of_mass == pytest.approx(case.center_of_mass, abs=1e-5)
    assert np.all(solution.std > solve_center_of_mass(case.rig, *seen).std)


def test_unknown_mass_comes_from_the_load_cells():
    case = load_case(14)
    rig = replace(case.rig, mass=None)
    dummy = Dummy(50.0, np.array([0.1, 0.2, -0.4]))
    solution = solve_center_of_mass(
        rig, *observe_both(rig, rig, case.mass, case.center_of_mass, dummy, tension_std=0.1)
    )
    assert solution.mass == pytest.approx(case.mass, abs=1e-3)
    assert 0.1 < solution.mass_std < 2.0  # four zeros of 3 N weigh 0.6 kg


def twisting_rig():
    """Three long cables from a small triangle to a wide body: two headings fit one inclination."""
    rng = np.random.default_rng(6)
    count = int(rng.integers(2, 5))
    angle = np.arange(count) * 2.0 * np.pi / count + rng.uniform(-0.3, 0.3, count)
    ceiling = np.c_[
        rng.uniform(0.05, 0.6) * np.cos(angle),
        rng.uniform(0.05, 0.6) * np.sin(angle),
        rng.uniform(-0.1, 0.1, count),
    ]
    body = np.c_[
        np.cos(angle + rng.uniform(-0.3, 0.3, count)), 0.8 * np.sin(angle), rng.uniform(-0.3, 0.3, count)
    ]
    length = np.linalg.norm(np.array([0.0, 0.0, -2.5]) + body - ceiling, axis=1)
    cables = tuple(Cable(f"c{i}", ceiling[i], body[i], float(length[i])) for i in range(count))
    return Rig(9.81, cables, mass=1000.0), rng.uniform(-0.1, 0.1, 3) + np.array([0.0, 0.0, -0.5])


def test_two_solutions_are_both_named_and_tensions_decide():
    rig, center = twisting_rig()
    rest = find_equilibria(rig, rig.mass, center).equilibria[0]
    solution = solve_center_of_mass(rig, observe_equilibrium(rig, rest, inclination_std=1e-4))
    assert solution.status == "ambiguous"
    every = [solution.center_of_mass, *(other.center_of_mass for other in solution.alternatives)]
    assert min(np.abs(c - center)[:2].max() for c in every) < 0.02
    assert max(np.abs(c - center)[:2].max() for c in every) > 0.03
    cells = observe_equilibrium(rig, rest, inclination_std=1e-4, tension_std=0.1)
    decided = solve_center_of_mass(rig, cells)
    assert decided.status == "undetermined"
    assert decided.undetermined == ("cz",)
    assert np.abs(decided.center_of_mass - center)[:2].max() < 0.02


def test_readings_that_no_pose_has():
    rig, combined, _, dummy = table_2_1()
    seen = observe_both(rig, rig, rig.mass, combined, dummy)
    short = replace(rig, cables=tuple(replace(c, length=0.5) for c in rig.cables))
    solution = solve_center_of_mass(short, *seen)
    assert solution.status == "no_pose"
    assert "bare" in solution.statement


def test_a_wrong_load_cell_is_inconsistent_not_an_answer():
    rig, combined, _, dummy = table_2_1()
    seen = observe_both(rig, rig, rig.mass, combined, dummy, tension_std=0.1)
    wrong = [replace(o, tension=o.tension * np.array([1.03, 1.0, 1.0, 1.0])) for o in seen]
    assert solve_center_of_mass(rig, *wrong).status == "inconsistent"


def test_no_observation_is_an_error_of_the_caller():
    rig, *_ = table_2_1()
    with pytest.raises(InputError, match="no observation"):
        solve_center_of_mass(rig)


def drawn(rig, rng):
    """A rig that deviates from its description by the description's tolerances."""
    t = rig.tolerance
    level = np.append(t["level"] * rng.standard_normal(2), 0.0)
    cables = []
    for cable in rig.cables:
        ceiling = cable.ceiling_point + t["hinge_position"] * rng.standard_normal(3)
        cables.append(
            replace(
                cable,
                ceiling_point=ceiling + np.cross(level, cable.ceiling_point),
                body_point=cable.body_point + t["hinge_position"] * rng.standard_normal(3),
                length=cable.length + t["cable_length"] * rng.standard_normal(),
            )
        )
    turn = Rotation.from_rotvec(t["inclinometer_orientation"] * rng.standard_normal(3))
    mounted = replace(rig.inclinometer, orientation=turn.as_quat())
    return replace(rig, cables=tuple(cables), inclinometer=mounted)


@pytest.mark.parametrize("cells", [pytest.param(False, marks=pytest.mark.long), True])
def test_standard_deviations_hold_over_drawn_rigs(cells):
    """Hinges, lengths, level, inclinometer, scale and cells drawn: (c - truth) / std is N(0, 1)."""
    case = load_case(14)
    rig = replace(case.rig, mass_std=0.5)
    dummy = Dummy(80.0, np.array([0.1, 0.2, -0.4]))
    rng = np.random.default_rng(7)
    noise = 2e-5
    scores, sizes = [], []
    for _ in range(16):
        truth = drawn(rig, rng)
        mass = rig.mass + 0.5 * rng.standard_normal()
        seen = observe_both(rig, truth, mass, case.center_of_mass, dummy, 0.1 if cells else None, noise, rng)
        if cells:
            gain = 1.0 + rig.tolerance["load_cell_gain"] * rng.standard_normal(4)
            zero = rig.tolerance["load_cell_zero"] * rng.standard_normal(4)
            seen = [replace(o, tension=gain * o.tension + zero) for o in seen]
        solution = solve_center_of_mass(rig, *seen)
        assert solution.status == "determined"
        error = solution.center_of_mass - case.center_of_mass
        scores.append(error / solution.std)
        sizes.append(error @ np.linalg.solve(solution.covariance, error))
    rms = np.sqrt(np.mean(np.square(scores), axis=0))
    # 16 draws: the rms of a unit normal lies within 0.5 and 1.55 in 99.9 % of all cases.
    assert np.all(rms > 0.5)
    assert np.all(rms < 1.55)
    assert 1.2 < np.mean(sizes) < 5.3  # chi squared with 3 degrees of freedom
