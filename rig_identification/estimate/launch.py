"""From nothing to a first guess: rest, then the motion tracked, then momentum balanced."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import extent, rest_of, start_from_mocap
from rig_identification.estimate.followable import rest_near
from rig_identification.estimate.momentum import balance, regress
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import Bench, drive, model_at
from rig_identification.estimate.rest_evidence import coarsened
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.solve import HOPELESS, Evaluation, Point, Problem, evaluate, solve
from rig_identification.estimate.start_state import fit_start
from rig_identification.estimate.track import Track, start_covariance, track, wrench_noise
from rig_identification.model import layout, sensors
from rig_identification.model.equilibrium import find_rest, settle
from rig_identification.model.motion import Input, State, on_cables, redundant, simulate

Array = NDArray[np.float64]

#: Motion that the regression looks at, s: more adds precision that the fit brings anyway.
REGRESSED = 12.0
#: Random wrench of the tracker, as a share of the body's weight.
SHARE = 0.02


@dataclass(frozen=True)
class Launch:
    """A guess on its way to being good enough."""

    problem: Problem
    theta: Array
    rest: State | None = None
    starts: tuple[State, ...] = ()

    def from_rest(self) -> Launch:
        """Centre of mass from the static recordings, where there are any, and the pose at rest."""
        problem, theta = self.problem, self.theta
        rest = rest_of(model_at(problem.bench.parameters, theta))
        if problem.rests:
            # Rest says little of the height where cables hang straight: hold it near the guess
            weak = problem.weak.copy()
            weak[9] *= 0.15
            roughly = replace(problem, runs=(), rests=tuple(coarsened(r) for r in problem.rests), weak=weak)
            hung = tuple(rest_near(problem, evidence, theta, rest) or rest for evidence in problem.rests)
            evaluation, _ = solve(roughly, Point(theta, (), hung), tolerance=1e-2)
            # Only the body is taken over; doubts about the rig start as described
            theta = theta.copy()
            theta[:INERTIAL] = evaluation.point.theta[:INERTIAL]
            rest = rest_of(model_at(problem.bench.parameters, theta))
            if _square(evaluation) < HOPELESS and _hopeless(roughly, theta, rest):
                # Cables almost without play: half a millimetre moves such a rest by centimetres
                theta = evaluation.point.theta
                rest = settle(model_at(problem.bench.parameters, theta), evaluation.rests[0].rest.state)
        return replace(self, theta=theta, rest=rest, starts=(rest,) * len(problem.runs))

    def from_momentum(self) -> Launch:
        """Start states from the tracked motion; inertia from its momentum where all tensions are measured."""
        if self.rest is None:
            raise ValueError("from_rest comes first")
        sure, unsure = self._by_momentum(self.rest, 0.0), self._by_momentum(self.rest, DOUBTED)
        # A rig as described is tracked best where it is believed, and led astray where it is not as described
        return min((sure, unsure), key=lambda found: found[1])[0]

    def _by_momentum(self, rest: State, doubted: float) -> tuple[Launch, float]:
        """The launch with rig and devices ``doubted`` (tolerances), and how badly momentum balances then."""
        problem, parameters = self.problem, self.problem.bench.parameters
        starts, balances = [], []
        for run in problem.runs:
            found = tracked(problem.bench, run.until(REGRESSED), self.theta, rest, doubted)
            starts.append(rest if found is None else found.state(0))
            both = None if found is None else balance(found, run.until(REGRESSED), parameters, self.theta)
            if both is not None:
                balances.append(both)
        theta, left = self.theta.copy(), np.inf
        if balances:
            theta[:INERTIAL], left = regress(balances, theta[:INERTIAL], problem.weak)
        return replace(self, theta=theta, starts=tuple(starts)), left

    def point(self) -> Point:
        """Where the fit starts."""
        if self.rest is None:
            raise ValueError("from_rest comes first")
        return Point(self.theta, self.starts, (self.rest,) * len(self.problem.rests))


def _hopeless(rests: Problem, theta: Array, rest: State) -> bool:
    """Whether the static recordings are nowhere near a body that hangs at ``rest``."""
    there = evaluate(rests, Point(theta, (), (rest,) * len(rests.rests)), residuals_only=True)
    return there is None or _square(there) > HOPELESS


def _square(evaluation: Evaluation) -> float:
    """Mean square of what the static recordings leave."""
    residuals = np.concatenate([np.zeros(0), *(rest.residual for rest in evaluation.rests)])
    return float(np.mean(residuals**2)) if residuals.size else 0.0


def tracked(bench: Bench, run: Run, theta: Array, rest: State, doubted: float = 0.0) -> Track | None:
    """A run tracked from a start that may be anywhere near rest. doubted: see :func:`launch_state`."""
    physics = bench.of(run).parameters.physics(theta)
    size = float(np.max(extent(bench.rig)))
    noise = wrench_noise(physics[layout.INERTIAL], bench.rig.gravity, size, run.grid.step, SHARE)
    start = launch_state(bench, run, theta, rest, noise, doubted)
    return track(bench, run, theta, start, start_covariance(0.02, 0.05), noise, doubted)


#: Horizons (s) over which a start state is found, a random wrench standing for what is not known; and those
#: that go before them where the body was let go so far from rest that the first leads astray.
LAUNCHES, CLOSER = (0.2, 0.5, 1.0), (0.05, 0.1)
#: How far rig and devices may be off while nothing is known, in tolerances: what is still ordinary.
DOUBTED = 3.0


def launch_state(
    bench: Bench,
    run: Run,
    theta: Array,
    rest: State,
    noise: Array | None = None,
    doubted: float = 0.0,
) -> State:
    """Start state of a run: within a fifth of the cables' length of rest, by its first second.

    noise (6, 6): random wrench, given where the body is not known yet. doubted: how far rig and devices may
    be off, in tolerances (fit_start). Cables that stretch begin stretched as far as rigid ones pull: from
    elsewhere the body bounces, and a millimetre is a tonne.
    """
    bench = bench.of(run)
    soft = bench.parameters.model.modes != layout.RIGID
    if np.any(soft) and redundant(bench.rig):
        # Of rigid cables no motion keeps them all: from where those that stretch let the body hang
        hung = find_rest(model_at(bench.parameters, theta), rest)
        rest = hung.state if hung.converged else rest
    elif np.any(bench.parameters.model.modes == layout.ELASTIC):
        rigid = _rigid(bench)
        near = launch_state(
            rigid, run, theta, on_cables(model_at(rigid.parameters, theta), rest), noise, doubted
        )
        start = _stretched(bench, rigid, run, theta, near)
        return _launched(bench, run, theta, start, noise, doubted, LAUNCHES)[0]
    start = rest
    if bench.mocap is not None:
        first = bench.parameters.places.mocap
        errors = bench.parameters.device(theta)[first : first + sensors.MOCAP_SIZE]
        seen = start_from_mocap(model_at(bench.parameters, theta), run, bench.mocap, errors)
        start = rest if seen is None else seen
    state, square = _launched(bench, run, theta, start, noise, doubted, LAUNCHES)
    if square > HOPELESS:
        closer = _launched(bench, run, theta, start, noise, doubted, CLOSER + LAUNCHES)
        state = closer[0] if closer[1] < square else state
    return state


def _rigid(bench: Bench) -> Bench:
    """The bench with cables that do not stretch."""
    model = bench.parameters.model
    modes = np.where(model.modes == layout.ELASTIC, layout.RIGID, model.modes)
    return replace(bench, parameters=replace(bench.parameters, model=replace(model, modes=modes)))


def _stretched(bench: Bench, rigid: Bench, run: Run, theta: Array, state: State) -> State:
    """The ``state`` of ``rigid`` cables moved by the least that stretches them as far as they pull there."""
    driven = drive(run, rigid.parameters, theta)
    first = Input(driven.step, driven.force[:1], driven.force_rate[:1], driven.wrench[:1])
    motion = simulate(model_at(rigid.parameters, theta), state, first)
    if not motion.complete:
        return state
    model = model_at(bench.parameters, theta)
    cables = model.cable_numbers()
    ceiling = cables[:, layout.CEILING_POINT : layout.CEILING_POINT + 3]
    hinge = cables[:, layout.BODY_POINT : layout.BODY_POINT + 3]
    pull = np.maximum(motion.outputs[0, layout.OUT_TENSION :], 0.0)
    soft = model.modes == layout.ELASTIC
    stretch = np.where(soft, pull / np.where(soft, cables[:, layout.AXIAL_STIFFNESS], 1.0), 0.0)
    for _ in range(3):  # Newton's method from a millimetre away
        along = state.position + hinge @ state.R_world_body.T - ceiling
        length = np.linalg.norm(along, axis=1)
        unit = along / length[:, None]
        lines = np.concatenate([unit, np.cross(hinge, unit @ state.R_world_body)], axis=1)
        move = np.linalg.lstsq(lines, cables[:, layout.LENGTH] * (1.0 + stretch) - length, rcond=None)[0]
        state = state.moved(np.concatenate([move, np.zeros(model.states - move.size)]))
    return state


def launch_states(bench: Bench, runs: tuple[Run, ...], theta: Array, rest: State) -> tuple[State, ...]:
    """Start states of several runs."""
    return tuple(side_by_side(lambda run: launch_state(bench, run, theta, rest), runs))


def _launched(
    bench: Bench,
    run: Run,
    theta: Array,
    start: State,
    noise: Array | None,
    doubted: float,
    horizons: tuple[float, ...],
) -> tuple[State, float]:
    """Start state by growing horizons, and the mean square that its last fit leaves (none: infinite)."""
    length = float(np.mean([cable.length for cable in bench.rig.cables]))
    square = np.inf
    for end in horizons:
        found = fit_start(
            bench,
            run.until(end),
            theta,
            start,
            tolerance=1e-2,
            extra_noise=noise,
            spread=0.2 * length,
            doubted=doubted,
        )
        if found is not None:
            square = float(np.mean(found[0].residual ** 2)) if found[0].residual.size else 0.0
            start = found[1]
    return start, square
