"""Simulated sessions in which something is wrong: devices that lie, effects that no description has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation
from test_simulate_identify import shaken

from rig_identification.estimate.identify import Ideal, fit_session, judged
from rig_identification.recording import Recording, Session
from rig_identification.simulate import SessionSpec, simulate_session

Effects = dict[str, tuple[float, ...]]


def made(
    number: int, seconds: float, seed: int, effects: Effects | None = None, *, doubts: bool = False
) -> Session:
    """A shaken case of the thesis with ``effects``."""
    spec = replace(shaken(number, seconds), effects=effects or {}, doubts=doubts)
    return simulate_session(spec, np.random.default_rng(seed))[0]


def twice(spec: SessionSpec, seconds: float | None = None) -> SessionSpec:
    """The same with its run once more, held out. seconds: the held-out run's length, if another one."""
    (run,) = spec.runs
    other = replace(run, name="run_2", holdout=True, duration=run.duration if seconds is None else seconds)
    return replace(spec, runs=(run, other))


def made_twice(number: int, seconds: float, seed: int, effects: Effects) -> Session:
    """A shaken case of the thesis with ``effects``, and the same run once more, held out."""
    spec = replace(twice(shaken(number, seconds)), effects=effects, doubts=False)
    return simulate_session(spec, np.random.default_rng(seed))[0]


def ideal_of(session: Session) -> Ideal:
    """The ideal model fitted to a session."""
    fitted = fit_session(session)
    return Ideal(fitted, *judged(fitted))


def biased(recording: Recording, bias: float) -> Recording:
    """The recording as a gyroscope with a bias (rad/s) about x would have made it."""
    if recording.imu is None:
        return recording
    values = recording.imu.values.copy()
    values[:, 0] += bias
    return replace(recording, imu=replace(recording.imu, values=values))


def moved(recording: Recording, peak: float, start: float, lasts: float) -> Recording:
    """The recording as if part of its force had come from outside: the exciter's cell did not feel it.

    peak: N along the exciter's z. start, lasts: s of half a sine.
    """
    force = recording.exciter_force
    assert force is not None
    phase = (force.time - start) / lasts
    pulse = np.where((phase > 0.0) & (phase < 1.0), peak * np.sin(np.pi * np.clip(phase, 0.0, 1.0)), 0.0)
    values = force.values.copy()
    values[:, 2] -= pulse
    return replace(recording, exciter_force=replace(force, values=values))


def wrong(recording: Recording, turned: float, too_much: float) -> Recording:
    """The recording with an inclinometer turned about y (rad) and a first cell that reads too much (N)."""
    name, tension = next(iter(recording.tension.items()))
    inclination = recording.inclination
    assert inclination is not None
    tilted = replace(inclination, values=inclination.values + np.array([0.0, turned]))
    loud = {**recording.tension, name: replace(tension, values=tension.values + too_much)}
    return replace(recording, inclination=tilted, tension=loud)


def turned_imu(recording: Recording, angle: float) -> Recording:
    """The recording with an IMU turned about y (rad)."""
    imu = recording.imu
    assert imu is not None
    turn = Rotation.from_rotvec([0.0, angle, 0.0]).inv()
    values = np.concatenate([turn.apply(imu.values[:, :3]), turn.apply(imu.values[:, 3:])], axis=1)
    return replace(recording, imu=replace(imu, values=values))


def lagging(recording: Recording, lag: float) -> Recording:
    """The recording with its first cell behind a low-pass of time constant ``lag`` (s)."""
    name, tension = next(iter(recording.tension.items()))
    step = float(np.median(np.diff(tension.time)))
    decay = np.exp(-step / lag)
    values = tension.values.astype(float)
    start = [decay * values[0]]
    late = lfilter([1.0 - decay], [1.0, -decay], values, axis=0, zi=start)[0]
    return replace(recording, tension={**recording.tension, name: replace(tension, values=late)})


def late_cell(recording: Recording, late: float) -> Recording:
    """The recording with a first load cell whose clock is off by ``late`` (s)."""
    name, cell = next(iter(recording.tension.items()))
    return replace(recording, tension={**recording.tension, name: replace(cell, time=cell.time + late)})


def imu_drawn_lower(session: Session, lower: float) -> Session:
    """The session with an IMU that its rig's description has lower (m) than it is."""
    imu = session.rig.imu
    assert imu is not None
    drawn = replace(imu, position=imu.position - np.array([0.0, 0.0, lower]))
    return replace(session, rig=replace(session.rig, imu=drawn))


def hinge_drawn_aside(session: Session, off: float) -> Session:
    """The session with the second upper hinge drawn ``off`` (m) along y of its place."""
    cables = list(session.rig.cables)
    point = cables[1].ceiling_point + np.array([0.0, off, 0.0])
    cables[1] = replace(cables[1], ceiling_point=point)
    return replace(session, rig=replace(session.rig, cables=tuple(cables)))
