"""A recording under way: what is told of it before it is over."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.errors import InputError
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.recording import Recording, Series, Session
from rig_identification.session.exciter_commands import HEAD, read_commands
from rig_identification.simulate import simulate_session
from rig_identification.simulate.exciter import ForceProgram, Multisine, UnbalancedMass
from rig_identification.topics import FIXED_TOPICS, WRENCH
from rig_identification.watch.forecast import Forecast, forecast
from rig_identification.watch.look import look
from rig_identification.watch.part import going_on, repeats, so_far, until
from rig_identification.watch.planned import begun
from rig_identification.watching import Expected, Watching

#: Of every load cell of the second cable: it reads 1.5 % high.
GAIN = 0.015
SECONDS = 20.0


def recorded(gain: float = 0.0, seed: int = 1) -> Session:
    """A shaken case of the thesis; the gain is on top of what the rig's tolerances draw."""
    effects = {"cable_2.load_cell_gain": (gain,)} if gain else {}
    return simulate_session(replace(shaken(10, SECONDS), effects=effects), np.random.default_rng(seed))[0]


def raw_of(session: Session) -> RawSession:
    """The session as its bags would hold it."""
    return RawSession(session.name, session.rig, tuple(map(_raw, session.recordings)))


def _raw(recording: Recording) -> RawRecording:
    kinds = {channel: (name, kind) for name, (channel, kind) in FIXED_TOPICS.items()}

    def channel(of: str, topic: str, kind: str, series: Series, cable: str | None = None) -> RawChannel:
        stamps = recording.start_ns + np.round(1e9 * series.time).astype(np.int64)
        return RawChannel(f"/rig/{topic}", of, kind, stamps, stamps + 1_000_000, series.values, cable)

    found = [channel("tension", f"{c}/wrench", WRENCH, series, c) for c, series in recording.tension.items()]
    for of in ("exciter_force", "exciter_shaft", "imu", "inclination"):
        series = getattr(recording, of)
        if series is not None:
            found.append(channel(of, *kinds[of], series))
    listed = {one.topic: one.message_type for one in found}
    counts = {one.topic: one.stamp_ns.size for one in found}
    return RawRecording(
        recording.name, recording.kind, False, recording.name, tuple(found), listed, counts, recording.dummy
    )


def test_a_cell_that_reads_high_is_told_before_the_run_is_over() -> None:
    """From 5 s of motion on, and no later than 20 s after it began, on one core with other work on it."""
    session = recorded(GAIN)
    begun = time.process_time()
    found = look(so_far(session, 5.0))
    took = time.process_time() - begun
    assert (found.verdict, found.cause) == ("explained", "load_cell_gain cable_2")
    assert found.finding is not None
    value, std = (float(str(found.finding.parameters["gain"][key])) for key in ("value", "std"))
    assert abs(value - GAIN) < 4.0 * std < 0.5 * GAIN
    assert "cable_2" in found.text
    # The body is told with the gain in the model: without it, it bends to it
    assert found.estimate is not None
    true = shaken(10, SECONDS).elements
    off = (found.estimate.values - true) / np.sqrt(np.diag(found.estimate.covariance))
    assert np.max(np.abs(off)) < 4.0
    assert 5.0 + took < SECONDS  # s of this process: another one's work is no part of it


def test_nothing_is_told_of_a_rig_without_fault_and_the_end_is_foreseen() -> None:
    session = so_far(recorded(), 10.0)
    early = look(so_far(session, 4.5))
    assert early.verdict == "none"
    assert early.finding is None
    assert early.error == pytest.approx(1.0, abs=0.05)
    foreseen = forecast(early.fitted, "run_1", 10.0)
    assert foreseen is not None
    assert early.estimate is not None
    now = np.sqrt(np.diag(early.estimate.covariance))
    assert foreseen.std[0] == pytest.approx(now, rel=0.02)  # but for the force that is smoothed anew
    whole = fit_session(session)
    final = np.sqrt(np.diag(inertial_estimate(whole.problem, whole.evaluation).covariance))
    assert foreseen.std[-1] == pytest.approx(final, rel=0.2)
    assert np.all(np.diff(foreseen.std, axis=0) <= 1e-6 * now)  # more never tells less
    assert np.max(now / final) > 1.3  # or there was nothing to foresee


def negative(recording: Recording) -> Recording:
    """The recording with a third cell that is wired the wrong way round."""
    cell = recording.tension["cable_3"]
    turned = {"cable_3": replace(cell, values=-cell.values)}
    return replace(recording, tension={**recording.tension, **turned})


def test_a_fault_of_the_set_up_is_told_while_it_is_recorded() -> None:
    session = so_far(recorded(), 3.0)
    told = Watching().look(raw_of(replace(session, recordings=tuple(map(negative, session.recordings)))))
    assert any("cable_3" in fault for fault in told.faults)


@pytest.mark.long  # each look is a fit
def test_a_run_is_watched_from_its_beginning_on() -> None:
    session = recorded()
    watching = Watching(Expected(seconds=SECONDS, aim=0.5))
    assert "2 s are there" in watching.look(raw_of(so_far(session, 2.0))).text
    told = watching.look(raw_of(so_far(session, 4.5)))
    assert told.verdict == "none"
    assert told.forecast is not None
    assert told.forecast["enough"] == pytest.approx(4.5, abs=0.1)  # an aim as wide as that is there already
    assert told.forecast["force"] == "repeated"
    later = watching.look(raw_of(so_far(session, 8.0)), whole=False)
    assert later.verdict == "none"
    assert later.forecast == told.forecast
    # The same look by whom the plan is known: the exciter was told to begin 1.2 s before the window was open
    motor = shaken(10, SECONDS).runs[0].force
    assert motor is not None
    at = np.arange(0.0, SECONDS, 0.02)
    plans = {"shake": Series(at, motor(at - 1.2))}
    knowing = Watching(Expected(seconds=SECONDS, aim=0.5, forces=plans))
    planned = knowing.look(raw_of(so_far(session, 4.5))).forecast
    assert planned is not None
    assert planned["force"] == "planned"


def test_a_length_that_is_enough_lies_between_those_looked_at() -> None:
    seconds, share = np.array([5.0, 10.0, 20.0]), np.array([0.04, 0.02, 0.01])
    foreseen = Forecast("run_1", seconds, np.zeros((3, 10)), share)
    assert foreseen.enough(0.05) == 5.0
    assert foreseen.enough(0.02 * 2.0**0.5) == pytest.approx(5.0 * 2.0**0.5)
    assert foreseen.enough(0.005) is None


@pytest.mark.parametrize("period", [0.4, 1.4])
def test_a_force_goes_on_as_it_was_last(period: float) -> None:
    time_s = np.arange(1500) / 300.0
    force = np.sin(2.0 * np.pi * time_s / period)[:, None] * np.array([[3.0, 1.0, 0.0]])
    noise = 0.01 * np.random.default_rng(0).standard_normal(force.shape)
    series = Series(time_s, np.minimum(1.0, time_s / 2.0)[:, None] * force + noise)
    lag = repeats(series) / 300.0 / period
    assert lag == pytest.approx(round(lag), abs=0.03)
    assert round(lag) >= 1
    run = Recording("run_1", "dynamic", False, 0, 5.0, exciter_force=series)
    after = going_on(run, 12.0).exciter_force
    assert after is not None
    new = after.time > series.time[-1]
    assert after.time[-1] == pytest.approx(12.0, abs=0.01)
    expected = np.sin(2.0 * np.pi * after.time[new] / period)
    assert np.corrcoef(after.values[new, 0], expected)[0, 1] > 0.95
    assert until(going_on(run, 12.0), 5.0).exciter_force is not None
    planned = going_on(run, 12.0, lambda t: np.full((t.size, 3), 7.0)).exciter_force
    assert planned is not None
    assert np.all(planned.values[new] == 7.0)
    assert np.array_equal(planned.values[~new], series.values)


#: Two plans; the second one is another force.
PLANS: tuple[ForceProgram, ForceProgram] = (
    Multisine(40.0, (0.4, 0.77, 1.31), ramp=2.0), UnbalancedMass(1.2, 0.9, "xz", ramp=3.0)
)  # fmt: skip


def planned(program: ForceProgram, seconds: float = 30.0) -> Series:
    """Fifty commands a second."""
    at = np.arange(0.0, seconds, 0.02)
    return Series(at, program(at))


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("start", [-2.5, 0.0, 1.7])
def test_a_planned_force_is_found_in_the_measured_one(which: int, start: float) -> None:
    """Begun before the window or in it, 8 % weaker than commanded, among noise."""
    plans = {name: planned(program) for name, program in zip(("swept", "turned"), PLANS, strict=True)}
    at = np.arange(0.0, 6.0, 1.0 / 300.0)
    noise = 0.5 * np.random.default_rng(3).standard_normal((at.size, 3))
    true = 0.92 * PLANS[which](at - start)
    found = begun(Series(at, true + noise), plans, "run_1")
    assert found is not None
    assert found.recording == ("swept", "turned")[which]
    assert found.factor == pytest.approx(0.92, abs=0.02)
    later = np.arange(6.0, 25.0, 0.01)
    expected = 0.92 * PLANS[which](later - start)
    off = found(later) - expected
    assert np.sqrt(np.mean(off**2)) < 0.1 * np.sqrt(np.mean(expected**2))
    assert not np.any(found(np.array([start + 30.1, 40.0])))  # the plan is over


def test_a_force_that_is_not_planned_is_none_of_the_plans() -> None:
    at = np.arange(0.0, 6.0, 1.0 / 300.0)
    plans = {"swept": planned(PLANS[0])}
    assert begun(Series(at, PLANS[1](at)), plans, "run_1") is None
    noise = np.random.default_rng(4).standard_normal((at.size, 3))
    assert begun(Series(at, noise), plans, "run_1") is None  # the exciter stands still
    assert begun(Series(at, np.zeros((at.size, 3))), plans, "run_1") is None
    assert begun(Series(at, PLANS[0](at)), {"swept": Series(np.arange(9.0), np.zeros((9, 3)))}, "") is None
    # Where a plan bears the window's name, that one is meant
    both = {"swept": planned(PLANS[0]), "run_1": planned(PLANS[1])}
    assert begun(Series(at, PLANS[0](at)), both, "run_1") is None
    assert begun(Series(at, PLANS[0](at)), both, "run_2") is not None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("recording,time_s,force_x_N,force_y_N\n", "line 1: column force_z_N is missing"),
        ("", "line 1: column recording is missing"),
        ("{head}\n", "holds no command"),
        ("{head}\nrun_1,0,,,1,2,3\n", "'run_1': one command is no run"),
        ("{head}\nrun_1,0,,,1,2,3\nrun_1,0.02,,,1,much,3\n", "line 3: force_y_N: 'much' is not a finite"),
        ("{head}\nrun_1,0,,,1,2,3\nrun_1,0.02,,,1,nan,3\n", "line 3: force_y_N: 'nan' is not a finite"),
        ("{head}\nrun_1,0,,,1,2,3\nrun_1,0.02\n", "line 3: force_x_N: missing; the line has 2"),
        ("{head}\nrun_1,1,,,1,2,3\nrun_1,0.5,,,1,2,3\n", "'run_1': time_s does not run forwards at 0.5 s"),
        ("{head}\n\xff\n", "is no text"),
        ("{head}\n" + "x" * 200_000 + "\n", "field larger than"),
    ],
)
def test_a_file_that_holds_no_commands_is_one_line(text: str, told: str, tmp_path: Path) -> None:
    file = tmp_path / "exciter.csv"
    file.write_bytes(text.replace("{head}", ",".join(HEAD)).encode("latin-1"))
    with pytest.raises(InputError, match=told) as refused:
        read_commands(file)
    assert str(refused.value).startswith(str(file))
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 500
