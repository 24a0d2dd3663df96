"""Forces that are not sampled all the time, or seldom."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from session_samples import make_recording, make_rig
from test_estimate_prediction import recorded
from test_model_rigs import thesis_case_14

from rig_identification.estimate.evidence import SHORTEST_PART, prepare
from rig_identification.estimate.force_gaps import bridged
from rig_identification.estimate.identify import fit_session, judged
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.sampling import Grid, node_input
from rig_identification.recording import Recording, Series, Session
from rig_identification.result import ELEMENTS

NOISE = 0.5
GRID = Grid(0.01, 1001)


def turning(rate: float, hz: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """A force of 200 N that turns, sampled at ``rate`` Hz with noise."""
    time = np.arange(0.0, 10.0, 1.0 / rate) + 0.3 / rate
    angle = 2.0 * np.pi * hz * time
    clean = 200.0 * np.stack([np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    return time, clean + NOISE * np.random.default_rng(1).normal(size=clean.shape)


def without(series: Series, start: float, end: float) -> Series:
    keep = (series.time < start) | (series.time > end)
    return Series(series.time[keep], series.values[keep])


def begun_late(recording: Recording, start: float) -> Recording:
    """A recording of which only the exciter's force is known before ``start`` s."""

    def late(series: Series | None) -> Series | None:
        return series and Series(series.time[series.time >= start], series.values[series.time >= start])

    tension = {name: late(series) for name, series in recording.tension.items()}
    return replace(
        recording,
        tension=tension,
        imu=late(recording.imu),
        inclination=late(recording.inclination),
        mocap=late(recording.mocap),
    )


def test_a_force_without_gaps_is_left_alone() -> None:
    time, values = turning(500.0)
    known = bridged(GRID, time, values, NOISE)
    np.testing.assert_array_equal(known.values, values)
    assert not np.any(known.variance)
    assert known.unknown == ()


def test_a_short_gap_is_bridged_and_doubted_by_what_the_bridge_may_be_off() -> None:
    time, values = turning(500.0)
    keep = (time < 4.0) | (time > 4.03)
    known = bridged(GRID, time[keep], values[keep], NOISE)
    assert known.unknown == ()
    doubted = np.flatnonzero(known.variance) * GRID.step
    assert 3.97 <= doubted.min() <= 4.0
    assert 4.0 <= doubted.max() <= 4.04
    filled = (known.time > 4.0) & (known.time < 4.03)
    angle = 2.0 * np.pi * 2.0 * known.time[filled]
    error = known.values[filled][:, 0] - 200.0 * np.sin(angle)
    assert np.max(np.abs(error)) < 4.0 * np.sqrt(np.max(known.variance))


@pytest.mark.parametrize(("start", "end"), [(4.0, 4.5), (-1.0, 2.0), (7.0, 11.0)])
def test_a_long_gap_is_a_stretch_of_unknown_force(start: float, end: float) -> None:
    time, values = turning(500.0)
    keep = (time < start) | (time > end)
    ((first, last),) = bridged(GRID, time[keep], values[keep], NOISE).unknown
    np.testing.assert_allclose([first, last], [max(start, 0.0), min(end, 10.0)], atol=0.01)


@pytest.mark.parametrize("rate", [50.0, 100.0, 500.0])
def test_a_force_sampled_seldom_is_no_polygon(rate: float) -> None:
    time, values = turning(rate)
    known = bridged(GRID, time, values, NOISE)
    nodes = node_input(GRID, known.time, known.values, NOISE)
    angle = 2.0 * np.pi * 2.0 * GRID.step * np.arange(GRID.nodes)
    error = (nodes.values[:, 0] - 200.0 * np.sin(angle))[10:-10]
    assert np.sqrt(np.mean(error**2)) < 1.2 * NOISE


def test_a_run_begins_anew_behind_a_gap() -> None:
    whole = make_recording(seconds=8.0)
    assert whole.exciter_force is not None
    run = prepare(make_rig(), replace(whole, exciter_force=without(whole.exciter_force, 3.0, 3.8)))
    first, second = run.where_driven()
    assert first.offset == 0.0
    np.testing.assert_allclose([first.grid.duration, second.offset], [3.0, 3.8], atol=0.02)
    assert second.force is not None
    assert second.force.values.shape[0] == second.grid.nodes
    scraps = prepare(make_rig(), replace(whole, exciter_force=without(whole.exciter_force, 0.5, 3.0)))
    assert all(part.grid.duration > SHORTEST_PART for part in scraps.where_driven())


def test_a_run_begins_where_something_but_the_force_is_heard() -> None:
    """A logger started 2 s after the exciter's: of the body nothing is known before."""
    whole = make_recording(seconds=8.0)
    silent = begun_late(whole, 2.0)
    (run,) = prepare(make_rig(), silent).where_driven()
    np.testing.assert_allclose([run.offset, run.grid.duration], [2.0, whole.duration - 2.0], atol=0.03)
    assert run.force is not None
    assert run.force.values.shape[0] == run.grid.nodes
    assert min(c.time[0] for c in run.channels) < 0.05
    holed = replace(silent, exciter_force=without(whole.exciter_force, 1.0, 3.0))  # type: ignore[arg-type]
    (run,) = prepare(make_rig(), holed).where_driven()
    assert run.offset == pytest.approx(3.0, abs=0.02)


@pytest.fixture(scope="module")
def driven() -> tuple[Session, np.ndarray]:
    session, truth = recorded(thesis_case_14(), seed=11, duration=8.0)
    return session, truth.elements


def changed(session: Session, start: float, end: float) -> Session:
    def holed(r: Recording) -> Recording:
        force = r.exciter_force
        return (
            r if force is None or r.kind == "static" else replace(r, exciter_force=without(force, start, end))
        )

    return replace(session, recordings=tuple(holed(r) for r in session.recordings))


@pytest.mark.parametrize(("start", "end"), [(3.0, 3.4), (-1.0, 1.5)])
def test_a_gap_in_the_force_leaves_a_session_explained(
    driven: tuple[Session, np.ndarray], start: float, end: float
) -> None:
    session, truth = driven
    fitted = fit_session(changed(session, start, end))
    assert judged(fitted)[1].verdict == "none"
    total = inertial_estimate(fitted.problem, fitted.evaluation)
    z = (total.values - truth) / np.sqrt(np.diag(total.covariance))
    seen = [i for i, name in enumerate(ELEMENTS) if name not in total.unobservable]
    assert np.max(np.abs(z[seen])) < 3.5


def test_a_session_whose_devices_begin_after_the_force_is_explained(
    driven: tuple[Session, np.ndarray],
) -> None:
    """Fits begin with short stretches of a run: one in which nothing is heard made the equations singular."""
    session, truth = driven
    late = [r if r.kind == "static" else begun_late(r, 3.0) for r in session.recordings]
    fitted = fit_session(replace(session, recordings=tuple(late)))
    assert judged(fitted)[1].verdict == "none"
    total = inertial_estimate(fitted.problem, fitted.evaluation)
    z = (total.values - truth) / np.sqrt(np.diag(total.covariance))
    seen = [i for i, name in enumerate(ELEMENTS) if name not in total.unobservable]
    assert np.max(np.abs(z[seen])) < 3.5


def test_a_run_whose_force_was_not_measured_tells_no_inertia(driven: tuple[Session, np.ndarray]) -> None:
    session, _ = driven

    def unmeasured(r: Recording) -> Recording:
        return replace(r, exciter_force=None, exciter_unmeasured=True)

    blind = fit_session(replace(session, recordings=tuple(unmeasured(r) for r in session.recordings)))
    assert judged(blind)[1].verdict == "none"
    assert any("run_1: left aside" in note for note in blind.notes)
    total = inertial_estimate(blind.problem, blind.evaluation)
    assert {"Jxx", "Jyy", "Jzz"} <= set(total.unobservable)
    assert not {"m", "cx", "cy"} & set(total.unobservable)
