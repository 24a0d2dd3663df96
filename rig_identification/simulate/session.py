"""A whole session from its specification: what the devices recorded, and the truth behind it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.estimate.rest_evidence import with_dummy
from rig_identification.model import layout
from rig_identification.model.equilibrium import find_rest
from rig_identification.model.motion import State
from rig_identification.recording import Dummy, Recording, Series, Session
from rig_identification.simulate.devices import Samples, Watch, watch_exciter, watch_rest, watch_run
from rig_identification.simulate.flight import Flight, fly
from rig_identification.simulate.spec import RunSpec, SessionSpec, StaticSpec
from rig_identification.simulate.start import rest_state, start_state
from rig_identification.simulate.true_rig import TrueRig, draw_true_rig

Array = NDArray[np.float64]

#: s of motion before the devices start to record, and after they stop: no clock offset reaches past it.
LEAD = 0.05
#: s between the starts of two recordings.
BETWEEN = 600


@dataclass(frozen=True)
class Truth:
    """What the estimate should find."""

    elements: Array  # (10,) m, c, J about the centre of mass
    parameters: dict[str, float]  # doubts about the rig: name -> true value
    described: dict[str, float]  # ... -> what the description says
    starts: dict[str, State]  # run -> state at the recording's time 0 (load cells' clock)
    least_tension: dict[str, float]  # run -> N, over all cables; 0: a cable went slack
    effects: dict[str, tuple[float, ...]]  # what was switched on: see SessionSpec


def simulate_session(spec: SessionSpec, rng: np.random.Generator) -> tuple[Session, Truth]:
    """Record a session. The same generator state gives the same session.

    Raises InputError where the body finds no rest, a start does not fit the cables, a motion
    leaves every bound, or noise is asked for that the description does not state.
    """
    true = draw_true_rig(spec, rng)
    rest = rest_state(true.model)
    recordings: list[Recording] = []
    starts, least = {}, {}
    for item in spec.statics:
        recordings.append(_record_rest(spec, true, item, rest, _start_ns(spec, len(recordings)), rng))
    for run in spec.runs:
        if not run.duration > 0.0:
            raise InputError(f"{run.name}: duration {run.duration:g} s must be positive")
        start = start_state(true.model, run.start, rest)
        flight = fly(true, start, run.force, run.duration + 2.0 * LEAD, run.name, LEAD)
        recording, begin = _record_run(spec, true, run, flight, _start_ns(spec, len(recordings)), rng)
        recordings.append(recording)
        starts[run.name] = flight.state_at(true, begin)
        least[run.name] = float(np.min(flight.motion.outputs[:, layout.OUT_TENSION :]))
    session = Session(spec.name, true.described, tuple(recordings))
    described = {p.name: p.nominal for p in true.parameters.free}
    elements, effects = np.array(spec.elements, dtype=float), dict(spec.effects)
    return session, Truth(elements, true.values, described, starts, least, effects)


def _start_ns(spec: SessionSpec, number: int) -> int:
    return spec.start_ns + number * BETWEEN * 1_000_000_000


def _record_rest(
    spec: SessionSpec, true: TrueRig, item: StaticSpec, guess: State, start_ns: int, rng: np.random.Generator
) -> Recording:
    model = with_dummy(true.model, item.dummy)
    near = guess if item.dummy is None else rest_state(model)
    rest = find_rest(model, near)
    if not rest.converged or np.min(rest.tension) < 0.0:
        raise InputError(f"{item.name}: the body does not rest on taut cables; move the dummy or lighten it")
    samples = watch_rest(spec, true, rest, Watch(0.0, item.duration), rng)
    return _recording(spec, item.name, "static", False, start_ns, samples, item.dummy)[0]


def _record_run(
    spec: SessionSpec, true: TrueRig, run: RunSpec, flight: Flight, start_ns: int, rng: np.random.Generator
) -> tuple[Recording, float]:
    watch = Watch(LEAD, LEAD + run.duration)
    samples = watch_run(spec, true, flight, watch, rng)
    if spec.rig.exciter is not None and spec.rates.exciter > 0.0:
        samples["exciter_force"] = watch_exciter(spec, true, flight, watch, rng)
        turned = getattr(run.force, "shaft", None)
        if turned is not None and spec.rates.shaft > 0.0:
            instant = watch.instants(spec.rates.shaft, rng)
            samples["exciter_shaft"] = Samples(instant + true.late("exciter"), turned(instant))
    if spec.rates.ground_truth > 0.0:
        samples["ground_truth"] = _odometry(flight, watch, spec.rates.ground_truth)
    return _recording(spec, run.name, "dynamic", run.holdout, start_ns, samples)


def _odometry(flight: Flight, watch: Watch, rate: float) -> Samples:
    """Pose of body in world and twist in body at nodes, without noise."""
    every = max(1, round(1.0 / (rate * flight.grid.step)))
    first, last = round(watch.begin / flight.grid.step), int(watch.end / flight.grid.step)
    nodes = np.arange(first, last, every)
    turns = Rotation.from_matrix(flight.motion.R_world_body[nodes])
    states = flight.motion.states[nodes]
    values = [states[:, :3], turns.as_quat(), turns.inv().apply(states[:, 6:9]), states[:, 9:12]]
    return Samples(flight.grid.step * nodes.astype(float), np.concatenate(values, axis=1))


def _recording(
    spec: SessionSpec,
    name: str,
    kind: str,
    holdout: bool,
    start_ns: int,
    samples: dict[str, Samples],
    dummy: Dummy | None = None,
) -> tuple[Recording, float]:
    """The recording, and the simulation's time at its time 0. Stamps are whole nanoseconds, as on disk."""
    if not samples:
        raise InputError(f"{name}: no device records; mount one, or give it a rate above 0")
    begin = min(float(s.stamp[0]) for s in samples.values())
    series = {key: Series(np.round(s.stamp - begin, 9), s.values) for key, s in samples.items()}
    end = max(float(s.time[-1]) for s in series.values())
    cables = tuple(cable.name for cable in spec.rig.cables)
    recording = Recording(
        name=name,
        kind=kind,
        holdout=holdout,
        start_ns=start_ns,
        duration=end,
        dummy=dummy,
        tension={cable: series[cable] for cable in cables if cable in series},
        exciter_force=series.get("exciter_force"),
        exciter_shaft=series.get("exciter_shaft"),
        imu=series.get("imu"),
        inclination=series.get("inclinometer"),
        mocap=series.get("mocap"),
        ground_truth=series.get("ground_truth"),
    )
    return recording, begin
