"""What every device of the rig sends: its reading at its own instants, with its noise, on its own clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.estimate.sampling import Grid, interpolation
from rig_identification.model.equilibrium import Rest
from rig_identification.simulate.flight import Flight
from rig_identification.simulate.readings import Mounts, mounts_near
from rig_identification.simulate.spec import SessionSpec
from rig_identification.simulate.true_rig import TrueRig, channels_of

Array = NDArray[np.float64]

#: Noise of each column of a device's reading, by the names of the rig description.
NOISE_OF = {
    "tension": ("tension",),
    "imu": ("angular_rate",) * 3 + ("specific_force",) * 3,
    "inclinometer": ("inclination",) * 2,
    "mocap": ("mocap_position",) * 3 + ("mocap_orientation",) * 3,
    "exciter": ("exciter_force",) * 3,
}


@dataclass(frozen=True)
class Samples:
    """What one device sent."""

    stamp: Array  # (n,) s on its clock; the simulation's time 0 is 0
    values: Array  # (n, w)


@dataclass(frozen=True)
class Watch:
    """From when to when the devices record, s of the simulation's time."""

    begin: float
    end: float

    def instants(self, rate: float, rng: np.random.Generator) -> Array:
        """Sampling instants of one device: no two devices sample together."""
        first = self.begin + float(rng.uniform(0.0, 1.0 / rate))
        return np.asarray(np.arange(first, self.end, 1.0 / rate), dtype=float)


def noise_std(spec: SessionSpec, device: str) -> Array:
    """(w,) noise of one sample. Raises InputError where the description does not say it."""
    names = NOISE_OF.get(device, NOISE_OF["tension"])
    if not spec.noise:
        return np.zeros(len(names))
    for name in names:
        if name not in spec.rig.noise:
            raise InputError(f"rig: noise.{name}: missing; give it, or simulate without noise")
    return np.array([spec.rig.noise[name] for name in names])


def watch_run(
    spec: SessionSpec, true: TrueRig, flight: Flight, watch: Watch, rng: np.random.Generator
) -> dict[str, Samples]:
    """Samples of every device but the exciter's; cables under their names."""
    motion = flight.motion

    def sampled(device: str, mounts: Mounts, instant: Array) -> Array:
        nodes = true.shown(
            device, flight.grid.step, mounts.read(device, motion.outputs, motion.R_world_body, true.device)
        )
        return true.drifted(device, instant - watch.begin, at_instants(flight.grid, instant, nodes))

    return _watch(spec, true, motion.R_world_body[0], sampled, watch, rng)


def watch_rest(
    spec: SessionSpec, true: TrueRig, rest: Rest, watch: Watch, rng: np.random.Generator
) -> dict[str, Samples]:
    """The same devices while the body hangs still."""
    R = rest.state.R_world_body

    def sampled(device: str, mounts: Mounts, instant: Array) -> Array:
        still = mounts.read(device, rest.outputs, R[None], true.device)
        return true.drifted(device, instant - watch.begin, np.repeat(still, instant.size, axis=0))

    return _watch(spec, true, R, sampled, watch, rng)


def _watch(
    spec: SessionSpec,
    true: TrueRig,
    R_world_body: Array,
    sampled: Callable[[str, Mounts, Array], Array],
    watch: Watch,
    rng: np.random.Generator,
) -> dict[str, Samples]:
    mounts = mounts_near(spec.rig, true.parameters.places, spec.world_in_tracker, R_world_body)
    out = {}
    for device in sorted(channels_of(spec)):
        instant = watch.instants(spec.rates.of(device), rng)
        values = sampled(device, mounts, instant)
        values = values + noise_std(spec, device) * rng.standard_normal(values.shape)
        stamp = instant + true.late(device)
        out[device] = Samples(stamp, mounts.poses(values) if device == "mocap" else values)
    return out


def watch_exciter(
    spec: SessionSpec, true: TrueRig, flight: Flight, watch: Watch, rng: np.random.Generator
) -> Samples:
    """The exciter's force cells; the force is linear between nodes."""
    instant = watch.instants(spec.rates.exciter, rng)
    nodes = flight.grid.step * np.arange(flight.grid.nodes)
    force = true.shown("exciter", flight.grid.step, flight.drive.force)
    values = np.stack([np.interp(instant, nodes, column) for column in force.T], axis=1)
    values = values + noise_std(spec, "exciter") * rng.standard_normal(values.shape)
    return Samples(instant + true.late("exciter"), values)


def at_instants(grid: Grid, instant: Array, nodes: Array) -> Array:
    """(n, w) cubic interpolation of node values (N, w)."""
    value, _ = interpolation(grid, instant, np.arange(instant.size), instant.size)
    return np.asarray(value @ nodes)
