"""A run's samples against the forward model: residuals and their exact derivatives in all parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import Channel, Run
from rig_identification.estimate.force_noise import Discrepancy, RandomWrench, random_wrench
from rig_identification.estimate.lag import lagged, settling_cost, unsettled
from rig_identification.estimate.marginal import Marginal, marginal
from rig_identification.estimate.mounting import Answer, mounted, mounted_change
from rig_identification.estimate.parameters import MOUNT_SIZE, MOUNTED, DeviceLayout, ParameterSet
from rig_identification.estimate.side_by_side import spare
from rig_identification.estimate.unseen import unseen_of
from rig_identification.estimate.unseen_sway import without_sway
from rig_identification.estimate.wander import FREED, MOVES, wander_of, zero_moves
from rig_identification.estimate.whitening import filter_of, smooth, whiten
from rig_identification.model import layout, sensors, work
from rig_identification.model.constraints import rigid_jacobian
from rig_identification.model.motion import Input, Motion, RigModel, State, simulate
from rig_identification.model.substeps import FIT_STEP, substeps_for
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Unit of a start-state coordinate (m, rad, m/s, rad/s): keeps the vector's entries alike.
START_UNIT = 0.01
#: What a run's residuals alone take, in columns (model/work.py): motion in state and wrench, and the filter.
#: Measured on three recordings: 43 to 48. Of that and of each column six parts in ten go with the number of
#: steps between two nodes.
BARE, STEPPED = 46, 6
#: What a smoothed run takes, in columns: measured, 14.
SMOOTHED = 14
#: No whitened residual or derivative is larger: beyond it the last digit of a parameter, 1e-15 of its prior's
#: std, moves a prediction by the std of its noise, and no fit means anything.
LARGEST = 1e15


@dataclass(frozen=True)
class Bench:
    """What every prediction of one session shares."""

    rig: Rig
    parameters: ParameterSet
    mocap: sensors.MocapMount | None = None
    unseen: bool = False  # nothing that was measured tells how far the body swings (unseen_swing.py)
    calm: float = 1.0  # share of what is believed of that swing's size that a fit leaves it
    freed: str | None = None  # quantity whose zeros move FREED times as far as every device's (wander.py)

    def wander_of(self, quantity: str) -> float:
        """Std of a run's own deviation from a quantity's zero, in its unit; 0 where it has none."""
        return wander_of(self.rig, quantity) * (FREED if quantity == self.freed else 1.0)

    def of(self, run: Run) -> Bench:
        """The bench as it is during a run: a number may count in some stretches alone (Parameter.during)."""
        return self.at(run.recording.name, run.offset + 0.5 * run.grid.duration)

    def at(self, recording: str, time: float) -> Bench:
        """The bench as it is ``time`` s after the start of a recording."""
        parameters = self.parameters.at(recording, time)
        return self if parameters is self.parameters else replace(self, parameters=parameters)


def model_at(parameters: ParameterSet, theta: Array) -> RigModel:
    """The rig with the numbers of ``theta``."""
    return parameters.model.with_physics(parameters.physics(theta))


def drive(run: Run, parameters: ParameterSet, theta: Array) -> Input:
    """The measured exciter force at the nodes, its clock and its low-pass undone.

    Stamps that are late by d, of cells that follow with a time constant tau, tell of the force
        F(t) = (1 + tau d/dt) f(t + d) = f(t + d) + tau f'(t + d)
    To first order both are one; (w tau)^2/2 of the amplitude at angular frequency w tells them apart.
    """
    quiet = Input.none(run.grid.nodes, run.grid.step)
    if run.force is None:
        return quiet
    device, places = parameters.device(theta), parameters.places
    late, tau = device[places.exciter_clock], device[places.lag("exciter")]
    force, middle, rate, bend = run.force.late_by(late)
    # Its rate is what either time changes; of the time constant but for tau f'', which next to f' is small
    return Input(run.grid.step, force + tau * rate, rate + tau * bend, quiet.wrench, middle)


def start_basis(model: RigModel, state: State) -> Array:
    """(12 + 2 s, 2 dof + 2 s): directions in which a start state can differ, cables kept; in START_UNIT."""
    n = model.cables
    G, gap, rate = np.zeros((n, 6)), np.zeros(n), np.zeros(n)
    count = rigid_jacobian(
        model.physics,
        model.modes,
        state.vector(model.states),
        np.array(state.R_world_body, order="C"),
        G,
        gap,
        rate,
    )
    free = null_space(G[:count], rcond=1e-6) if count else np.eye(6)
    dof = free.shape[1]
    inner = model.states - layout.BODY_STATE
    basis = np.zeros((model.states, 2 * dof + inner))
    basis[:6, :dof] = START_UNIT * free
    basis[6:12, dof : 2 * dof] = START_UNIT * free
    basis[12:, 2 * dof :] = START_UNIT * np.eye(inner)
    return basis


def read_device(
    bench: Bench,
    device: str,
    raw: Array,
    R: Array,
    own: Array,
    time: Array,
    R_tracker_mean: Array | None = None,
) -> sensors.Reading:
    """Reading of one device at the nodes.

    own: flat array of DeviceLayout. time (N,): s after the recording's start; of a single row, when it was
    measured. R_tracker_mean: see sensors.mocap.
    """
    rig, places = bench.rig, bench.parameters.places
    numbers = own[places.own(device)]
    if device == "mocap" and bench.mocap is not None and R_tracker_mean is not None:
        return sensors.mocap(raw, R, bench.mocap, R_tracker_mean, numbers)
    if device == "imu" and rig.imu is not None:
        turn = Rotation.from_quat(rig.imu.orientation).as_matrix()
        reading = sensors.imu(raw, rig.imu.position, turn, numbers)
    elif device == "inclinometer" and rig.inclinometer is not None:
        turn = Rotation.from_quat(rig.inclinometer.orientation).as_matrix()
        reading = sensors.inclinometer(raw, turn, numbers)
    else:
        reading = sensors.load_cell(raw, places.cables.index(device), numbers)
    return sensors.drifting(reading, time, own[places.drift(device)])


@dataclass(frozen=True)
class Linearised:
    """A run about the current parameters: normalised innovations and their derivatives."""

    residual: Array  # (m,) whitened, measured less predicted
    jacobian: Array  # (m, parameters + start)
    log_spread: float  # sum of log standard deviations of the innovations
    motion: Motion
    nodes: NDArray[np.int64]  # (m,) node of each row
    channel: NDArray[np.int64]  # (m,) index into run.channels
    axis: NDArray[np.int64]  # (m,) which axis of the channel's quantity
    plain: Array  # (m,) residual before whitening, in the channel's unit
    variance: Array  # (m,) sensor noise of each row
    row_H: Array  # (m, 12 + 2 s) response of each row to the state at its node
    row_D: Array  # (m, 6) ... and to the wrench
    noise: RandomWrench  # what noise drives the model with
    latent: Array  # (N, 6) wrench noise that the nominal motion holds, of a discrepancy where there is one
    readings: dict[str, sensors.Reading]  # each device at the nodes
    wander: Marginal  # what the zeros' own deviations in this run do

    @property
    def cost(self) -> float:
        """Negative log likelihood less a constant."""
        return 0.5 * float(self.residual @ self.residual) + self.log_spread

    @cached_property
    def filter(self) -> tuple[Array, Array]:
        """How wrenches to come are whitened: gains and standard deviations (whitening.filter_of)."""
        noise = self.noise
        if not np.any(noise.Q):
            # Nothing moves the body but what is known: no sample tells anything of the next one
            states, own = self.row_H.shape[1], noise.felt.shape[1]
            return np.zeros((self.nodes.size, states + own)), np.sqrt(self.variance)
        A = self.motion.derivatives[0]
        gains, deviations = filter_of(
            A, noise.through, noise.Q, self.nodes, self.row_H, noise.felt, self.variance, noise.follow
        )
        return np.asarray(gains), np.asarray(deviations)


def _in_use(in_raw: Array) -> NDArray[np.int64]:
    """Raw outputs that a reading (N, w, 18 + n) depends on: a load cell's on one, a gyroscope's on three."""
    return np.flatnonzero(np.any(in_raw, axis=(0, 1)))


def _channel_rows(
    bench: Bench,
    run: Run,
    index: int,
    motion: Motion,
    reading: sensors.Reading,
    own: Array,
    node: NDArray[np.int64],
    in_physics: Array,
    start_only: bool,
) -> tuple[Array, Array, Array]:
    """(columns (g, w, 1 + p + b), H (g, w, X), D (g, w, 6)) of one channel.

    columns: residual, derivatives in the p parameters, of which there are none where ``start_only``, and in
    the b start coordinates. index: of the channel. node (g,): where each sample was taken. in_physics (d, p):
    derivative of the motion's directions in the parameters.
    """
    parameters, channel = bench.parameters, run.channels[index]
    clock, lag = parameters.places.clock(channel.device), parameters.places.lag(channel.device)
    late, tau = own[clock], own[lag]
    step, groups = run.grid.step, channel.node.size
    value, slope = run.samplers[index].at(late)
    reads = channel.columns
    soft, mount = mount_of(channel, own, parameters.places)

    def as_shown(values: Array) -> Array:
        return device_shows(step, channel, own, parameters.places, values)

    values = as_shown(reading.values[:, reads])
    _, _, motion_H, motion_D, motion_J = motion.derivatives
    in_raw = reading.in_raw[:, reads]
    raw = _in_use(in_raw)
    in_raw = in_raw[:, :, raw]
    nodes, width = in_raw.shape[:2]
    known, starts = (0 if start_only else parameters.size), motion_J.shape[2] - in_physics.shape[0]
    total = as_shown((in_raw @ motion_J[:, raw]).reshape(nodes, -1))
    in_motion = (value @ total).reshape(groups * width, -1)
    H = in_raw[node] @ motion_H[node[:, None], raw]
    D = in_raw[node] @ motion_D[node[:, None], raw]
    out = np.empty((groups, width, 1 + known + starts))
    flat = out.reshape(groups * width, -1)
    out[:, :, 0] = channel.grouped - value @ values
    flat[:, 1 + known :] = in_motion[:, :starts]
    if start_only:
        return out, H, D
    np.matmul(in_motion[:, starts:], in_physics, out=flat[:, 1 : 1 + known])
    columns, entries, scale = parameters.device_columns()
    first = parameters.places.first(channel.device)
    # Of a device's numbers most are certain
    free = np.flatnonzero((entries >= first) & (entries < first + reading.in_device.shape[2]))
    in_used = reading.in_device[:, reads][:, :, entries[free] - first]
    own_map = value @ as_shown(in_used.reshape(nodes, -1))
    own_map = own_map.reshape(groups, width, free.size)
    for k, i in enumerate(free):
        out[:, :, 1 + columns[i]] += scale[i] * own_map[:, :, k]
    for i in np.flatnonzero((entries == clock) | (entries == lag)):
        shown = values if entries[i] == clock else lagged(step, tau, values)
        out[:, :, 1 + columns[i]] -= scale[i] * (slope @ shown)
    if soft is not None and np.any(of_mount := (entries >= soft) & (entries < soft + MOUNT_SIZE)):
        changes = mounted_change(step, mount, reading.values[:, reads])
        for i in np.flatnonzero(of_mount):
            out[:, :, 1 + columns[i]] += scale[i] * (value @ lagged(step, tau, changes[entries[i] - soft]))
    return out, H, D


def mount_of(channel: Channel, own: Array, places: DeviceLayout) -> tuple[int | None, Answer]:
    """First entry of the mount that a channel is seen through, and its numbers there; None: it is rigid."""
    if channel.quantity not in MOUNTED:
        return None, Answer()
    first = places.mount(channel.quantity)
    return first, Answer(*own[first : first + MOUNT_SIZE].tolist())


def device_shows(step: float, channel: Channel, own: Array, places: DeviceLayout, values: Array) -> Array:
    """What a device shows of ``values`` (N, c) at nodes ``step`` s apart, through its mount and its lag."""
    _, mount = mount_of(channel, own, places)
    return lagged(step, float(own[places.lag(channel.device)]), mounted(step, mount, values))


def longest_step(run: Run) -> float:
    """Longest integration step (s): that of every fit, or a node's where the run holds nothing fast.

    A Runge-Kutta step h keeps the frequency of a swing at angular frequency w to (w h)^4/120: 4e-7 at
    1.3 Hz with 0.01 s, 3e-5 at 1.5 Hz with the 0.025 s of a run that is only watched.
    """
    return max(FIT_STEP, run.grid.step)


def _shown_at(run: Run, channel: Channel, own: Array, parameters: ParameterSet) -> NDArray[np.int64]:
    """(g,) node of what each sample shows: a late device's was shaken by the force of earlier."""
    late = own[parameters.places.clock(channel.device)] + max(own[parameters.places.lag(channel.device)], 0.0)
    return np.asarray(np.clip(channel.node - round(late / run.grid.step), 0, run.grid.nodes - 1))


def _taken(substeps: int, states: int, columns: int) -> int:
    """Work (model/work.py) of a node of a run with so many steps to the next, states and columns."""
    steps = 10 - STEPPED + STEPPED * substeps
    return steps * (BARE + columns) * states // (10 * layout.BODY_STATE)


def linearise_run(
    bench: Bench,
    run: Run,
    theta: Array,
    start: State,
    *,
    start_only: bool = False,
    extra_noise: Array | None = None,
    latent: Array | None = None,
    discrepancy: Discrepancy | None = None,
) -> Linearised | None:
    """Whitened residual and Jacobian of one run; None where the motion leaves every bound.

    Jacobian columns: the vector of ``bench.parameters``, then the start coordinates of
    :func:`start_basis`. ``start_only`` leaves the parameters' columns at zero and saves their cost.
    ``extra_noise`` (6, 6): covariance of a further random wrench held over each node interval.
    latent (N, 6): wrench noise that the nominal motion is to hold (:func:`smoothed`); the motion
    is then linearised about what really happened instead of about an undisturbed one. discrepancy: a wrench
    that the model lacks; the latent is then of this one.
    """
    bench = bench.of(run)
    parameters = bench.parameters
    model = model_at(parameters, theta)
    basis = start_basis(model, start)
    directions = np.zeros(0, dtype=np.int64) if start_only else parameters.directions()
    starts, known = basis.shape[1], 0 if start_only else parameters.size
    substeps = substeps_for(model, run.grid.step, longest_step(run))
    driven = drive(run, parameters, theta)
    held = np.zeros((run.grid.nodes, 6)) if latent is None else latent
    motion = simulate(
        model,
        start,
        replace(driven, wrench=driven.wrench + held),
        directions=directions,
        start_basis=basis,
        substeps=substeps,
        threads=spare(),
    )
    work.add(motion.nodes * _taken(substeps, motion.states.shape[1], known + starts))
    if not motion.complete:
        return None
    own = parameters.device(theta)
    clock = run.offset + run.grid.step * np.arange(run.grid.nodes, dtype=np.float64)
    in_physics = parameters.physics_jacobian(theta)[: directions.size]
    rows_of = [c.node.size * c.width for c in run.channels]
    size, which = sum(rows_of), np.repeat(np.arange(len(rows_of)), rows_of)
    shown = [_shown_at(run, c, own, parameters) for c in run.channels]
    nodes = [
        np.zeros(0, dtype=np.int64),
        *(np.repeat(n, c.width) for n, c in zip(shown, run.channels, strict=True)),
    ]
    order = np.argsort(np.concatenate(nodes), kind="stable")
    # Where each row goes
    places = np.empty_like(order)
    places[order] = np.arange(size)
    at, which = np.concatenate(nodes)[order], which[order]
    axis, variance = np.empty(size, dtype=np.int64), np.empty(size)
    H, D = np.empty((size, motion.states.shape[1])), np.empty((size, 6))
    wandering = [bench.wander_of(c.quantity) for c in run.channels]
    count = zero = 1 + known + starts
    zeros = MOVES * sum(c.width for c, std in zip(run.channels, wandering, strict=True) if std > 0.0)
    columns = np.empty((size, count + zeros))
    columns[:, count:] = 0.0
    readings: dict[str, sensors.Reading] = {}
    first, settled = 0, 0.0
    for index, channel in enumerate(run.channels):
        if channel.device not in readings:
            readings[channel.device] = read_device(
                bench, channel.device, motion.outputs, motion.R_world_body, own, clock, run.R_tracker_mean
            )
        rows, in_state, in_wrench = _channel_rows(
            bench, run, index, motion, readings[channel.device], own, shown[index], in_physics, start_only
        )
        tau = float(own[parameters.places.lag(channel.device)])
        settling = unsettled(run.grid.step, tau, channel.node, channel.grouped)
        if tau > 0.0:
            settled += settling_cost(channel.grouped_variance, settling)
        spread = channel.grouped_variance + settling
        here = places[first : first + spread.size]
        first += spread.size
        axis[here] = np.tile(channel.axes, channel.node.size)
        variance[here] = spread.ravel()
        H[here], D[here] = in_state.reshape(spread.size, -1), in_wrench.reshape(spread.size, 6)
        columns[here, :count] = rows.reshape(spread.size, -1)
        if wandering[index] > 0.0:
            moved = wandering[index] * zero_moves(run, channel)
            for k in range(channel.width):
                columns[here[k :: channel.width], zero : zero + MOVES] = moved
                zero += MOVES
    plain = columns[:, 0].copy()
    A, B, _, _, _ = motion.derivatives
    acts = extra_noise is not None or latent is not None or discrepancy is not None
    felt = None if acts or not run.channels else np.array([c.felt for c in run.channels])[which]
    noise = random_wrench(run, parameters, theta, B, D, felt, extra_noise, discrepancy)
    if np.any(noise.Q):
        log_spread = float(
            whiten(A, noise.through, noise.Q, held, at, H, noise.felt, variance, columns, noise.follow)
        )
    else:
        deviation = np.sqrt(variance)
        columns /= deviation[:, None]
        log_spread = float(np.sum(np.log(deviation)))
        for off in unseen_of(bench.rig, bench.unseen, run, which, axis, variance):
            beside = columns[off.rows]
            log_spread += without_sway(off.seen, beside)
            columns[off.rows] = beside
    if columns.size and not max(float(np.max(columns)), -float(np.min(columns))) < LARGEST:
        # Derivatives of motions that part from each other may grow beyond every number
        return None
    own_zeros, doubt = marginal(columns[:, count:])
    columns = own_zeros.without(columns[:, :count])
    whitened = columns[:, 1:]
    if start_only:
        whitened = np.zeros((plain.size, parameters.size + starts))
        whitened[:, parameters.size :] = columns[:, 1:]
    return Linearised(
        columns[:, 0],
        whitened,
        log_spread + settled + doubt,
        motion,
        at,
        which,
        axis,
        plain,
        variance,
        H,
        D,
        noise,
        held,
        readings,
        own_zeros,
    )


def smoothed(linearised: Linearised, start: Array | None = None) -> tuple[Array, Array, Array]:
    """Best correction of the nominal motion by the noise that enters as force, given the whole run.

    start (X, X), X = 12 + 2 s: covariance of the start state (none: it is exact). Returns (N, X)
    state and (N, 6) wrench corrections and (N, X, X) covariance of the filtered state.
    """
    motion, noise = linearised.motion, linearised.noise
    work.add(SMOOTHED * motion.nodes)
    states, drawn, spread = smooth(
        motion.A,
        noise.through,
        noise.Q,
        linearised.latent,
        linearised.nodes,
        linearised.row_H,
        noise.felt,
        linearised.variance,
        linearised.plain,
        np.zeros((motion.states.shape[1],) * 2) if start is None else start,
        noise.follow,
    )
    return states, drawn @ noise.wrench.T, spread
