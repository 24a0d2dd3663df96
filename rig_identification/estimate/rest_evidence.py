"""A static recording as the estimator sees it: one mean a channel, with its honest uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Index, columns_of
from rig_identification.estimate.force_noise import Discrepancy
from rig_identification.estimate.noise import noise_std
from rig_identification.estimate.prediction import Bench, read_device
from rig_identification.model import layout, work
from rig_identification.model.body import point_inertia, six_elements
from rig_identification.model.equilibrium import Rest, find_rest, wrench_response
from rig_identification.model.motion import RigModel, State
from rig_identification.recording import Dummy, Recording, Series
from rig_identification.rig import Rig

Array = NDArray[np.float64]


#: Blocks of a static recording whose means show what is not white in it.
BLOCKS = 8
#: Instants that stand for a static recording's time.
SPREAD = 33


@dataclass(frozen=True)
class RestChannel:
    """Mean reading of one device quantity at rest."""

    device: str
    quantity: str
    unit: str
    components: tuple[int, ...]  # of the device's reading
    mean: Array  # (w,)
    variance: Array  # (w,) of the mean
    noise: Array  # (w,) of one sample
    time: Array  # (m,) s after the recording's start, spread over the samples' span
    scattered: bool = False  # whether the scatter of block means, beyond the samples' noise, tells a variance

    @property
    def columns(self) -> slice | Index:
        """Where its components stand in the device's reading."""
        return columns_of(self.components)


@dataclass(frozen=True)
class RestEvidence:
    """One static recording."""

    recording: Recording
    dummy: Dummy | None
    channels: tuple[RestChannel, ...]


def mean_variance(values: Array, noise: Array) -> Array:
    """(w,) variance of the mean of samples (n, w): white noise, or more where block means scatter more.

    Residual swing and drift are not white; the scatter of eight block means shows what they
    leave in the mean (batch means, Law, "Simulation Modeling and Analysis", section 9.5).
    """
    white = noise**2 / values.shape[0]
    blocks = np.array_split(values, BLOCKS)
    if min(block.shape[0] for block in blocks) < 4:
        return np.asarray(white)
    means = np.array([np.mean(block, axis=0) for block in blocks])
    return np.asarray(np.maximum(white, np.var(means, axis=0, ddof=1) / BLOCKS))


def prepare_rest(rig: Rig, recording: Recording) -> RestEvidence:
    """Means of everything that a static recording holds."""
    channels: list[RestChannel] = []

    def add(device: str, quantity: str, unit: str, measured: Series, columns: slice) -> None:
        for part in measured.parts(columns):
            series = part.series
            std, _ = noise_std(rig, quantity, series.time, series.values)
            mean, variance = np.mean(series.values, axis=0), mean_variance(series.values, std)
            time = np.linspace(series.time[0], series.time[-1], SPREAD)
            loud = bool(np.any(variance > std**2 / series.values.shape[0]))
            channels.append(
                RestChannel(device, quantity, unit, part.components, mean, variance, std, time, loud)
            )

    for cable, series in recording.tension.items():
        add(cable, "tension", "N", series, slice(0, 1))
    if recording.imu is not None and rig.imu is not None:
        add("imu", "angular_rate", "rad/s", recording.imu, slice(0, 3))
        add("imu", "specific_force", "m/s^2", recording.imu, slice(3, 6))
    if recording.inclination is not None and rig.inclinometer is not None:
        add("inclinometer", "inclination", "rad", recording.inclination, slice(0, 2))
    return RestEvidence(recording, recording.dummy, tuple(channels))


#: What an equilibrium and its readings take (model/work.py): measured, 3 to 4 thousand.
TAKEN = 3500
#: What a first guess believes of a rig: cells to 0.3 %, angles to 1 mrad, accelerometers to 0.03 m/s^2.
COARSE = {"tension": 0.003, "inclination": 1e-3, "specific_force": 0.03, "angular_rate": 1e-3}


def coarsened(evidence: RestEvidence) -> RestEvidence:
    """The same means with the variance of a rig that is only roughly as described: for a first guess."""
    channels = []
    for c in evidence.channels:
        spread = COARSE[c.quantity] * (np.abs(c.mean) if c.quantity == "tension" else 1.0)
        channels.append(replace(c, variance=c.variance + spread**2))
    return replace(evidence, channels=tuple(channels))


def with_dummy(model: RigModel, dummy: Dummy | None) -> RigModel:
    """The body with a known mass fixed to it: inertial parameters about the datum add."""
    if dummy is None:
        return model
    physics = model.physics.copy()
    extra = np.concatenate(
        [[dummy.mass], dummy.mass * dummy.position, six_elements(point_inertia(dummy.mass, dummy.position))]
    )
    physics[layout.INERTIAL : layout.INERTIAL + 10] += extra
    return model.with_physics(physics)


@dataclass(frozen=True)
class RestLinearised:
    """Whitened means less predicted at rest, and their derivatives."""

    residual: Array  # (m,)
    jacobian: Array  # (m, parameters)
    log_spread: float
    rest: Rest
    predicted: tuple[Array, ...]  # one (w,) a channel
    felt: Array  # (m, 6) whitened response to a constant wrench, of a model with a discrepancy; else no row

    @property
    def cost(self) -> float:
        """Negative log likelihood less a constant."""
        return 0.5 * float(self.residual @ self.residual) + self.log_spread


def linearise_rest(
    bench: Bench,
    evidence: RestEvidence,
    theta: Array,
    guess: State,
    discrepancy: Discrepancy | None = None,
) -> RestLinearised | None:
    """Residual and Jacobian of one static recording; None where no rest pose is found near ``guess``.

    discrepancy: a wrench that the model lacks, of which the body feels one draw at rest.
    """
    work.add(TAKEN)
    bench = bench.at(evidence.recording.name, 0.0)
    parameters = bench.parameters
    model = with_dummy(parameters.model.with_physics(parameters.physics(theta)), evidence.dummy)
    rest = find_rest(model, guess, directions=parameters.directions())
    if not rest.converged:
        return None
    own = parameters.device(theta)
    in_physics = parameters.physics_jacobian(theta)
    device_columns, entries, scale = parameters.device_columns()
    R = rest.state.R_world_body[None]
    residuals, jacobians, predictions, in_raw = [], [], [], []
    log_spread = 0.0
    for channel in evidence.channels:
        reading = read_device(bench, channel.device, rest.outputs, R, own, channel.time)
        predicted = reading.values[0, channel.columns]
        jacobian = reading.in_raw[0, channel.columns] @ rest.J[0] @ in_physics
        first = parameters.places.first(channel.device)
        for column, entry, s in zip(device_columns, entries, scale, strict=True):
            if first <= entry < first + reading.in_device.shape[2]:
                jacobian[:, column] += s * reading.in_device[0, channel.columns, entry - first]
        deviation = np.sqrt(channel.variance)
        in_raw.append(reading.in_raw[0, channel.columns] / deviation[:, None])
        residuals.append((channel.mean - predicted) / deviation)
        jacobians.append(jacobian / deviation[:, None])
        predictions.append(predicted)
        log_spread += float(np.sum(np.log(deviation)))
    if not residuals:
        return None
    residual, jacobian = np.concatenate(residuals), np.concatenate(jacobians)
    felt = np.zeros((0, 6))
    if discrepancy is not None:
        felt = np.concatenate(in_raw) @ wrench_response(model, rest)
        factor = np.linalg.cholesky(np.eye(residual.size) + felt @ discrepancy.covariance @ felt.T)
        residual = np.asarray(np.linalg.solve(factor, residual), dtype=np.float64)
        jacobian = np.asarray(np.linalg.solve(factor, jacobian), dtype=np.float64)
        felt = np.asarray(np.linalg.solve(factor, felt), dtype=np.float64)
        log_spread += float(np.sum(np.log(np.diag(factor))))
    return RestLinearised(residual, jacobian, log_spread, rest, tuple(predictions), felt)
