"""Something loose: the part of the scan against the forward model, and how it is found and confirmed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr
from test_model_derivatives import drive_of
from test_model_rigs import thesis_case_14
from test_simulate_identify import shaken

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import fit_session
from rig_identification.mismatch.loose import Along, Loose
from rig_identification.mismatch.measured import measured
from rig_identification.mismatch.opened import with_reference
from rig_identification.mismatch.something_loose import loose_finding
from rig_identification.mismatch.trial import mass_of
from rig_identification.model import layout
from rig_identification.model.equilibrium import find_rest, settle
from rig_identification.model.motion import RigModel, simulate
from rig_identification.simulate import simulate_session

AT = np.array([0.4, 0.9, -0.7])
STRONG = 10.0  # so that the part leaves its stop
FREQUENCY = 0.01  # Hz: next to nothing leads the part back


def with_part(model: RigModel, part: Loose, mass: float) -> RigModel:
    """The model with ``mass`` kg of a loose part."""
    block = np.zeros((1, layout.INTERNAL_SIZE))
    block[0, layout.AXIS + "xyz".index(part.axis)] = 1.0
    block[0, layout.MASS], block[0, layout.FREQUENCY] = mass, FREQUENCY
    block[0, layout.POINT : layout.POINT + 3] = part.at
    block[0, layout.DAMPING_RATIO] = part.rate / (4.0 * np.pi * FREQUENCY)
    block[0, layout.STOP], block[0, layout.STOP_DAMPING] = part.travel, part.ratio
    return model.with_internal(block)


def test_the_part_of_the_scan_is_that_of_the_forward_model() -> None:
    """What a kilogram between stops does to the body is what its wrench along the motion does."""
    sample = thesis_case_14()
    plain = sample.model(rods=True)
    rest = settle(plain, sample.start)
    plain = plain.referred(rest)
    part = Loose("y", 0.01, 0.8, 20.0, 0.4, AT)
    downhill = np.sign((rest.R_world_body.T @ plain.physics[:3])[1])
    start = replace(rest, internal=np.array([downhill * part.travel, 0.0]))
    gentle, mass = drive_of(801, 0.01, 4), 1.0
    drive = replace(gentle, force=STRONG * gentle.force, force_rate=STRONG * gentle.force_rate)
    loose = simulate(with_part(plain, part, mass), start, drive)
    travel = loose.states[:, layout.BODY_STATE]
    assert np.min(travel) < -part.travel
    assert np.max(travel) > part.travel
    alone = simulate(plain, rest, drive)
    wrench = mass * part.wrench(loose)
    held = 0.5 * (wrench + np.concatenate([wrench[1:], wrench[-1:]]))
    pushed = simulate(plain, rest, replace(drive, wrench=drive.wrench + held))
    pose = slice(0, 3)
    does = loose.outputs[:, pose] - alone.outputs[:, pose]
    says = pushed.outputs[:, pose] - alone.outputs[:, pose]
    assert np.linalg.norm(says - does) < 0.1 * np.linalg.norm(does)


def test_what_is_loose_lies_at_the_stop_to_which_the_floor_slopes() -> None:
    sample = thesis_case_14()
    plain = sample.model(rods=True)
    level = settle(plain, sample.start)
    for axis in "xy":
        part = Loose(axis, 0.004, 0.8, 20.0, 0.4, AT)
        uphill = (level.R_world_body.T @ plain.physics[:3])["xyz".index(axis)]
        rest = find_rest(with_part(plain.referred(level), part, 1.0), level).state
        ease = abs(uphill) / (2.0 * np.pi * FREQUENCY) ** 2
        assert rest.internal[0] == pytest.approx(np.sign(uphill) * min(part.travel, ease), rel=0.05)


def test_what_leaves_every_bound_at_once_has_no_rest_and_says_so_in_no_traceback() -> None:
    sample = thesis_case_14()
    wild = sample.model(rods=True)
    physics = wild.physics.copy()
    physics[layout.INERTIAL] = np.nan
    np.testing.assert_array_equal(
        settle(wild.with_physics(physics), sample.start).position, sample.start.position
    )


def fitted(effects: dict[str, tuple[float, ...]]) -> Fitted:
    """The ideal model fitted to one run of a session, another one held out."""
    spec = shaken(14, 16.0)
    again = replace(spec.runs[0], name="run_2", duration=14.0, holdout=True)
    spec = replace(spec, runs=(*spec.runs, again), effects=effects, doubts=False)
    return fit_session(simulate_session(spec, np.random.default_rng(3))[0])


TRUTH = {
    "loose_mass.mass": (12.0,),
    "loose_mass.travel": (0.02,),
    "loose_mass.frequency": (0.02,),
    "loose_mass.damping_ratio": (2.0,),
    "loose_mass.position": (0.4, 0.9, -0.7),
    "loose_mass.direction": (0.0, 1.0, 0.0),
}


def test_a_loose_part_is_told_with_its_axis_and_mass() -> None:
    """It lies at one stop for the most, and leaves open how far the other one is."""
    found = loose_finding(fitted(TRUTH), 2.0)
    assert found is not None
    assert (found.effect, found.where["axis"]) == ("loose_mass", "y")
    value, std = found.parameters["mass"]["value"], found.parameters["mass"]["std"]
    assert isinstance(value, float)
    assert isinstance(std, float)
    assert abs(value - 12.0) < 3.0 * std


def along_measured(effects: dict[str, tuple[float, ...]]) -> Along:
    fit = fitted(effects)
    problem, point = with_reference(fit.problem, fit.rest), fit.evaluation.point
    mass = mass_of(problem, fit.evaluation)
    seen = measured(problem, point, mass)
    assert seen is not None
    return Along(*seen, mass)


def test_what_a_part_looks_like_is_what_it_takes_away() -> None:
    """The scan asks a thousand times as often as it can afford the answer itself."""
    along = along_measured(TRUTH)
    parts = [Loose("y", 0.02, rate, stop, 0.4, AT) for rate in (0.4, 0.5, 0.6) for stop in (15.0, 20.0, 25.0)]
    gains = np.array([along.gain(part).nats for part in parts])
    alike = along.likeness(parts)
    assert gains.max() > 10.0
    assert spearmanr(alike, gains).statistic > 0.95
    # What is free beside it takes a part of what it looks like
    likely = alike.argmax()
    assert gains[likely] < alike[likely] < 3.0 * gains[likely]


def test_what_gravity_holds_on_its_stop_is_not_loose() -> None:
    """Along z it leaves it where the body falls faster than it does; along y a sloping floor holds it."""
    along = along_measured({})
    motion = along.evaluation.runs[0].motion
    assert not Loose("z", 0.002, 0.5, 50.0, 0.05, AT).leaves_its_stop(motion)
    assert Loose("y", 0.002, 0.5, 50.0, 0.05, AT).leaves_its_stop(motion)


def test_a_loose_part_that_has_to_weigh_too_much_is_none() -> None:
    """A way of two millimetres looks like a hundred kilograms, and a part that light like nothing."""
    along = along_measured({"hinge_damping": (25.0,)})
    along.most = np.inf
    parts = [Loose(axis, 0.002, 0.5, 40.0, 0.4, side * AT) for axis in "xy" for side in (1.0, -1.0)]
    part = max(parts, key=lambda p: along.gain(p).nats)
    free = along.gain(part)
    assert free.mass > 0.0
    assert free.nats > 0.0
    along.most = 0.5 * free.mass
    assert along.gain(part).nats == 0.0
    assert along.gain(part).mass == pytest.approx(along.most)


@pytest.mark.parametrize(
    "effects",
    [{}, {"point_law.spring": (0.0, 0.0, 1.5e7), "point_law.line": (1.2, 0.0)}, {"hinge_damping": (5.0,)}],
    ids=["nothing", "a_spring_that_hardens", "hinges_that_damp"],
)
def test_nothing_loose_is_told_where_nothing_is(effects: dict[str, tuple[float, ...]]) -> None:
    assert loose_finding(fitted(effects), None) is None
