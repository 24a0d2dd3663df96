"""Numbers that change at an instant: found with the instant, fitted before and after it, told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from test_simulate_identify import at_the_true_body, shaken

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.marginal import marginal
from rig_identification.estimate.parameters import Parameter, Stretch
from rig_identification.estimate.solve import evaluate
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.change import Change, Group
from rig_identification.mismatch.changes import likeliest_changes
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.trial import mass_of
from rig_identification.model.body import (
    elements_from_linear,
    linear_from_elements,
    point_inertia,
    six_elements,
)
from rig_identification.recording import Recording, Series, Session
from rig_identification.search.identify import identify
from rig_identification.simulate import SessionSpec, Truth, simulate_session

Array = NDArray[np.float64]


def two_runs(seconds: float = 6.0) -> SessionSpec:
    """A case of the thesis in two runs alike but for their noise."""
    spec = shaken(14, seconds)
    return replace(spec, runs=(spec.runs[0], replace(spec.runs[0], name="run_2")))


def from_then(series: Series, start: float, change: Callable[[Array], Array]) -> Series:
    """Samples changed from ``start`` s on."""
    later = series.time >= start
    values = series.values.copy()
    values[later] = change(values[later])
    return Series(series.time, values)


def altered(session: Session, name: str, edit: Callable[[Recording], Recording]) -> Session:
    """A session with one of its recordings edited."""
    found = tuple(edit(r) if r.name == name else r for r in session.recordings)
    return replace(session, recordings=found)


def turned(recording: Recording, start: float, degrees: float) -> Recording:
    """The IMU turned about its z axis from an instant on."""
    turn = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    assert recording.imu is not None
    both = from_then(recording.imu, start, lambda v: np.hstack([v[:, :3] @ turn, v[:, 3:] @ turn]))
    return replace(recording, imu=both)


def zeroed(recording: Recording, cable: str, start: float, newtons: float) -> Recording:
    """A load cell whose zero jumps at an instant."""
    later = from_then(recording.tension[cable], start, lambda v: v + newtons)
    return replace(recording, tension={**recording.tension, cable: later})


def change_in(session: Session, truth: Truth) -> Change | None:
    problem, evaluation = at_the_true_body(session, truth)
    mass = mass_of(problem, evaluation)
    return next(iter(likeliest_changes(problem, evaluation, mass, catalogue(problem))[0]), None)


@pytest.fixture(scope="module")
def clean() -> tuple[Session, Truth]:
    return simulate_session(two_runs(), np.random.default_rng(3))


def test_a_zero_that_jumps_within_a_run_is_found_with_its_instant(clean: tuple[Session, Truth]) -> None:
    session = altered(clean[0], "run_1", lambda r: zeroed(r, "cable_2", 3.2, 6.0))
    change = change_in(session, clean[1])
    assert change is not None
    assert change.candidate.effect == "load_cell_offset"
    assert change.candidate.where["channel"] == "cable_2"
    assert len(change.within) == 1
    assert [s.recording for s in change.stretches] == ["run_1"]
    assert change.within[0].start == pytest.approx(3.2, abs=0.1)


def test_a_zero_that_jumps_twice_is_found_with_both_instants(clean: tuple[Session, Truth]) -> None:
    session = altered(
        clean[0], "run_1", lambda r: zeroed(zeroed(r, "cable_2", 2.0, 6.0), "cable_2", 4.2, -9.0)
    )
    change = change_in(session, clean[1])
    assert change is not None
    assert change.candidate.effect == "load_cell_offset"
    assert [s.start for s in change.within] == pytest.approx([2.0, 4.2], abs=0.1)
    names = [p.name for p in change.candidate.parameters]
    found = change.candidate.told(
        Estimates(dict(zip(names, (6.0, -9.0), strict=True)), np.diag([0.04, 0.12]))
    )
    assert found["offset"] == (pytest.approx(-3.0), pytest.approx(0.4), "N")
    assert found["offset_step_2"][0] == pytest.approx(-9.0)


def test_steps_that_nothing_parts_are_told_together(clean: tuple[Session, Truth]) -> None:
    session = altered(
        clean[0], "run_1", lambda r: zeroed(zeroed(r, "cable_2", 3.0, 6.0), "cable_2", 3.7, 6.0)
    )
    change = change_in(session, clean[1])
    assert change is not None
    assert len(change.within) >= 2
    assert len(change.candidate.parameters) == 1


def test_an_imu_that_was_bumped_between_two_runs_is_found(clean: tuple[Session, Truth]) -> None:
    session = altered(clean[0], "run_2", lambda r: turned(r, 0.0, 1.0))
    change = change_in(session, clean[1])
    assert change is not None
    assert change.candidate.effect == "imu_misalignment"
    assert change.stretches == (Stretch("run_2"),)


def test_columns_come_back_from_what_was_integrated_out() -> None:
    random = np.random.default_rng(1)
    responses, columns = 3.0 * random.normal(size=(40, 3)), random.normal(size=(40, 5))
    off, _ = marginal(responses)
    np.testing.assert_allclose(off.without(off.back(columns)), columns, atol=1e-10)
    seen = off.without(columns)
    together = responses.T @ columns
    np.testing.assert_allclose(
        seen.T @ seen, columns.T @ columns - together.T @ off.taken @ together, atol=1e-9
    )


def test_nothing_changes_in_a_clean_session(clean: tuple[Session, Truth]) -> None:
    change = change_in(*clean)
    assert change is None or change.net < 3.0


def test_a_number_counts_in_its_stretches_alone(clean: tuple[Session, Truth]) -> None:
    """Exactly: as if the reading were moved there, and nowhere else; its column has rows there alone."""
    problem, evaluation = at_the_true_body(*clean)
    parameters = problem.bench.parameters
    entry = parameters.places.load_cell("cable_2") + 1
    during = (Stretch("run_2"),)
    jump = Parameter("jump", "N", 5.0, 2.0, "device", -1, shifts=((entry, 1.0),), during=during)
    wide = replace(problem, bench=replace(problem.bench, parameters=parameters.having((jump,))))
    point = replace(evaluation.point, theta=np.append(evaluation.point.theta, 0.0))
    found = evaluate(wide, point)
    assert found is not None
    column = [run.jacobian[:, parameters.size] for run in found.runs]
    assert not np.any(column[0])
    assert np.any(column[1])
    np.testing.assert_allclose(found.runs[0].residual, evaluation.runs[0].residual, atol=1e-9)
    np.testing.assert_allclose(
        found.runs[1].residual, evaluation.runs[1].residual - 2.5 * column[1], atol=1e-9
    )


@pytest.mark.parametrize(
    ("steps", "can_be"), [((2e-3,), True), ((-1e-3,), False), ((2e-3, -1e-3), True), ((1e-3, -2e-3), False)]
)
def test_what_cannot_be_negative_is_not_after_a_change(steps: tuple[float, ...], can_be: bool) -> None:
    """A cell may follow sooner than before, and never before it is pulled."""
    lag = Parameter("cable_1.lag", "s", 0.0, 0.02, "device", 3, bounded=False)
    late = Candidate("sensor_lag", (lag,), "{value}", "", positive=1)
    since = tuple((Stretch("run_1", 4.0 * (k + 1)), Stretch("run_2")) for k in range(len(steps)))
    every = {"run_1": 12.0, "run_2": 12.0}
    change = Change(Group((lag,), np.zeros((0, 1)), late), since, (50.0,) * len(steps), every)
    names = [p.name for p in change.candidate.parameters]
    found = Estimates(dict(zip(names, steps, strict=True)), np.diag(np.full(len(steps), 1e-5**2)))
    assert change.possible(found) is can_be
    assert replace(change, group=replace(change.group, of=None)).possible(found)


def without_a_load(spec: SessionSpec, mass: float, at: Array) -> SessionSpec:
    """The same session of a body off which a point mass was taken."""
    load = np.concatenate([[mass], mass * at, six_elements(point_inertia(mass, at))])
    return replace(spec, elements=elements_from_linear(linear_from_elements(spec.elements) - load))


@pytest.mark.long
@pytest.mark.parametrize("kind", ["zero", "twice", "turn", "load", "held"])
def test_a_session_in_which_something_changed_is_explained(kind: str) -> None:
    spec = two_runs(20.0)
    spec = replace(spec, runs=(spec.runs[0], replace(spec.runs[1], holdout=True)))
    session, truth = simulate_session(spec, np.random.default_rng(3))
    if kind == "zero":
        session = altered(session, "run_1", lambda r: zeroed(r, "cable_2", 8.0, 25.0))
        session = altered(session, "run_2", lambda r: zeroed(r, "cable_2", 0.0, 25.0))
        effect, name, value = "load_cell_offset", "offset", 25.0
    elif kind == "twice":
        session = altered(session, "run_1", lambda r: zeroed(r, "cable_2", 8.0, 25.0))
        session = altered(session, "run_1", lambda r: zeroed(r, "cable_2", 14.0, -40.0))
        session = altered(session, "run_2", lambda r: zeroed(r, "cable_2", 0.0, -15.0))
        effect, name, value = "load_cell_offset", "offset", -15.0
    elif kind == "turn":
        session = altered(session, "run_1", lambda r: turned(r, 9.0, 2.0))
        effect, name, value = "imu_misalignment", "angle", np.radians(2.0)
    elif kind == "held":
        session = altered(session, "run_2", lambda r: turned(r, 0.0, 2.0))
        effect, name, value = "imu_misalignment", "angle", np.radians(2.0)
    else:
        other = without_a_load(spec, 8.0, np.array([1.0, 0.5, 0.4]))
        later = {r.name: r for r in simulate_session(other, np.random.default_rng(3))[0].recordings}
        session = altered(session, "run_1", lambda r: later["run_1"])
        session = altered(session, "run_2", lambda r: later["run_2"])
        effect, name, value = "unknown", "mass", -8.0
    found = identify(session)
    assert found.mismatch.verdict == "explained"
    told = found.mismatch.findings[0]
    assert told.effect == effect
    number = told.parameters[name]
    assert abs(float(str(number["value"])) - value) < 3.0 * float(str(number["std"]))
    after = told.evidence["holdout_error_after"]
    assert after is not None
    assert after < 1.1
    off = found.total.values - truth.elements
    assert np.max(np.abs(off / np.sqrt(np.diag(found.total.covariance)))) < 3.5
