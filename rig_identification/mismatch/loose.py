"""Something loose on the body, found along the motion that was measured.

What slides between stops knocks, and where a blow falls follows from where the part was before: its force
over time is told by the body's motion, sharply, and by next to nothing else. So the motion has to be the
measured one (measured.py), and a massless part that slides along it tells the wrench that a kilogram of it
exerts. Its travel, damping, stops and place are those with which that wrench looks most like the random
wrench that the model needs, which costs some microseconds a try.
    q'' = -d . f_a - c q' + what the stops push,   f_a: specific force at the place, weight and all
    F = -m d q'',   M = m a x (-d q'') - m (d q) x f
(effects/internal.py, for small q and slow turning.) It begins at the stop to which the floor slopes.

A blow lasts some milliseconds and rings in whatever it hits: no fit of whole runs leaves noise there. So a
loose part is told where all else is not: it takes more of the random wrench away than anything of the
catalogue, and in runs that were held out it does so again, with the same travel, damping, stops and place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import differential_evolution, minimize

from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.opened import free_without
from rig_identification.mismatch.response import instant_information, whitened_response
from rig_identification.mismatch.rider_places import REACH
from rig_identification.model import layout
from rig_identification.model.motion import Motion

Array = NDArray[np.float64]

RATE, FORCE, ALPHA = layout.OUT_RATE, layout.OUT_SPECIFIC_FORCE, layout.OUT_ANGULAR_ACCELERATION
#: Integration steps between two nodes.
FINE = 16
#: Ends of what is looked at: m either side, damping 1/s, frequency (Hz) of the stops and their damping ratio.
TRAVELS, RATES, STOPS, RATIOS = (0.002, 0.1), (0.05, 8.0), (10.0, 160.0), (0.05, 0.9)
BOUNDS = [(np.log(a), np.log(b)) for a, b in (TRAVELS, RATES, STOPS, RATIOS)] + [(-REACH, REACH)] * 3
#: Differential evolution (Storn & Price, J. Global Optimization 11, 1997): members for each number that is
#: looked for, generations, and how often anew. Of each scan's last members so many are heard for what they
#: really gain; and from the best few of all, which differ by this much, steps of a simplex on what they look
#: like, and on what they gain from where the best of these comes to.
PEOPLE, GENERATIONS, SEEDS, HEARD = 12, 60, (1, 2), 8
STARTS, POLISHED = 6, (250, 250)
ALIKE = np.array([0.25, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
#: First steps of the simplex: in the logarithms, and in the place.
NUDGES = (0.03, 0.2, 0.3, 0.3, 0.15, 0.15, 0.15)
#: Nats below which the scan's best is not followed any further.
FAINT = 7.5
#: Share of its travel to which a part has come that left its stop.
LEFT = 0.99
#: Prior std of its mass, in parts of the body's, and the number of them past which it is no part of the body.
LIKELY, FARTHEST = 0.05, 3.0


@njit(cache=True, nogil=True)
def slide(force, step, first, stop, rate, frequency, ratio, q, acceleration):  # type: ignore[no-untyped-def]
    """Travel and acceleration (N, S) of S massless parts under a specific force (N, S) along their line.

    first: sign of the stop that they begin at. stop, rate, frequency, ratio: (S,) as :class:`Loose` has them.
    Many at once take little longer than one, whose every step waits for the one before.
    """
    nodes, count = force.shape
    h = step / FINE
    stiffness, knock = (2.0 * np.pi * frequency) ** 2, 4.0 * np.pi * frequency * ratio
    place, speed, total = first * stop, np.zeros(count), np.empty(count)
    for k in range(nodes):
        ahead = min(k + 1, nodes - 1)
        for j in range(count):
            q[k, j] = place[j]
            total[j] = 0.0
        for s in range(FINE):
            share = (s + 0.5) / FINE
            for j in range(count):
                p = place[j]
                beyond = p - stop[j] if p > stop[j] else (p + stop[j] if p < -stop[j] else 0.0)
                slowed = rate[j] + (knock[j] if beyond != 0.0 else 0.0)
                felt = force[k, j] + share * (force[ahead, j] - force[k, j])
                pull = -felt - slowed * speed[j] - stiffness[j] * beyond
                speed[j] += h * pull
                place[j] = p + h * speed[j]
                total[j] += pull
        for j in range(count):
            acceleration[k, j] = total[j] / FINE


@njit(cache=True, nogil=True)
def _along(raw, axis, at, step, stop, rate, frequency, ratio, q, acceleration):  # type: ignore[no-untyped-def]
    """Travel and acceleration (N, S) of S parts at ``at`` (S, 3) along the raw outputs of a motion."""
    nodes, count = raw.shape[0], at.shape[0]
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    felt = np.empty((nodes, count))
    for n in range(nodes):
        wi, wj, wk = raw[n, RATE + i], raw[n, RATE + j], raw[n, RATE + k]
        square = wi * wi + wj * wj + wk * wk
        for m in range(count):
            along = wi * at[m, i] + wj * at[m, j] + wk * at[m, k]
            turning = raw[n, ALPHA + j] * at[m, k] - raw[n, ALPHA + k] * at[m, j]
            felt[n, m] = raw[n, FORCE + i] + turning + wi * along - square * at[m, i]
    first = np.sign(raw[0, layout.OUT_GRAVITY + i])
    slide(felt, step, first, stop, rate, frequency, ratio, q, acceleration)


@njit(cache=True, nogil=True)
def _alike(raw, axis, at, q, acceleration, pull, information):  # type: ignore[no-untyped-def]
    """(S,) w . pull and (S,) w . information w of the wrenches of S parts, each less its mean.

    pull (N, 6): what the recordings ask for, in inverse units of a wrench. information (6, 6): of one
    interval's wrench.
    """
    nodes, count = q.shape
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    chosen = np.array([i, 3 + j, 3 + k])
    total, shared = np.zeros((3, count)), np.zeros(count)
    square, asked = np.zeros((6, count)), np.zeros(3)
    for n in range(nodes):
        fj, fk = raw[n, FORCE + j], raw[n, FORCE + k]
        p0, p1, p2 = pull[n, chosen[0]], pull[n, chosen[1]], pull[n, chosen[2]]
        asked[0] += p0
        asked[1] += p1
        asked[2] += p2
        for m in range(count):
            w0 = -acceleration[n, m]
            w1 = at[m, k] * w0 + q[n, m] * fk
            w2 = -at[m, j] * w0 - q[n, m] * fj
            total[0, m] += w0
            total[1, m] += w1
            total[2, m] += w2
            shared[m] += w0 * p0 + w1 * p1 + w2 * p2
            square[0, m] += w0 * w0
            square[1, m] += w1 * w1
            square[2, m] += w2 * w2
            square[3, m] += w0 * w1
            square[4, m] += w0 * w2
            square[5, m] += w1 * w2
    own = np.zeros(count)
    place = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])
    for a in range(3):
        for m in range(count):
            shared[m] -= total[a, m] * asked[a] / nodes
        for b in range(3):
            inside = information[chosen[a], chosen[b]]
            for m in range(count):
                own[m] += inside * (square[place[a, b], m] - total[a, m] * total[b, m] / nodes)
    return shared, own


@dataclass(frozen=True)
class Loose:
    """A part that slides between stops."""

    axis: str
    travel: float  # m either side
    rate: float  # 1/s: what slows it
    stop: float  # Hz at which it would swing on a stop
    ratio: float  # damping ratio of its stops
    at: Array  # (3,) m, body: middle between the stops

    def wrench(self, motion: Motion) -> Array:
        """(N, 6) wrench about the datum, body axes, of a kilogram of it along a motion that began at rest.

        Each row is the mean over the interval that it begins.
        """
        q, acceleration = (a[:, 0] for a in _moved([self], motion))
        i = AXES.index(self.axis)
        j, k = (i + 1) % 3, (i + 2) % 3
        out = np.zeros((q.size, 6))
        out[:, i] = -acceleration
        out[:, 3 + j] = -self.at[k] * acceleration + q * motion.outputs[:, FORCE + k]
        out[:, 3 + k] = self.at[j] * acceleration - q * motion.outputs[:, FORCE + j]
        return out

    def leaves_its_stop(self, motion: Motion) -> bool:
        """Whether it ever does: what gravity holds down for good knocks at nothing; it rings on its stop."""
        return bool(np.min(np.abs(_moved([self], motion)[0])) < LEFT * self.travel)

    def to_either_side(self, motion: Motion) -> bool:
        """Whether it leaves the one stop for the other: else nothing tells how far apart they are."""
        q = _moved([self], motion)[0]
        return bool(np.min(q) < -0.5 * self.travel and np.max(q) > 0.5 * self.travel)


def _moved(parts: Sequence[Loose], motion: Motion) -> tuple[Array, Array]:
    """Travel (m) and acceleration (m/s^2), (N, S), of parts along one axis in a motion."""
    out = np.empty((2, motion.outputs.shape[0], len(parts)))
    at = np.array([p.at for p in parts])
    numbers = np.array([(p.travel, p.rate, p.stop, p.ratio) for p in parts]).T
    _along(motion.outputs, AXES.index(parts[0].axis), at, motion.step, *np.ascontiguousarray(numbers), *out)
    return out[0], out[1]


@dataclass(frozen=True)
class Gain:
    """What a part takes away, to first order in its mass."""

    nats: float
    mass: float  # kg
    std: float  # kg


def beyond_of(noisy: Problem, evaluation: Evaluation, *, fixed: bool = False) -> Beyond:
    """What is free beside a part. fixed: the body and the rig are as they are, and only starts are free."""
    size = noisy.bench.parameters.size
    free = free_without(noisy, evaluation.point, evaluation, set(), 0)
    return Beyond(evaluation, free[free >= size] if fixed else free, size)


class Along:
    """A problem about its measured motion, to try loose parts on.

    noisy, evaluation: see measured.py; its runs begin at rest. mass: kg, of the body. fixed: the body and the
    rig are as they are, and only starts are free beside the part.
    """

    def __init__(self, noisy: Problem, evaluation: Evaluation, mass: float, *, fixed: bool = False) -> None:
        if noisy.extra_noise is None:
            raise ValueError("there is no random wrench that a loose part could look like")
        self.evaluation, self._mass = evaluation, mass
        self.most = FARTHEST * LIKELY * mass
        weight = 1.0 / np.diag(noisy.extra_noise)
        self._pairs = [
            (run.motion, latent * weight, instant_information(run))
            for run, latent in zip(evaluation.runs, evaluation.point.latents, strict=True)
            if latent is not None
        ]
        self._beyond = beyond_of(noisy, evaluation, fixed=fixed)

    def likeness(self, parts: Sequence[Loose]) -> Array:
        """(S,) about how much (nats) of the random wrench parts along one axis make needless, each alone.

        None does that has a negative mass, or one past which it is no part of the body.
        """
        shared, own = np.zeros(len(parts)), np.zeros(len(parts))
        axis, at = AXES.index(parts[0].axis), np.array([p.at for p in parts])
        for motion, pull, information in self._pairs:
            both = _alike(motion.outputs, axis, at, *_moved(parts, motion), pull, information)
            shared, own = shared + both[0], own + both[1]
        mass = shared / np.maximum(own, 1e-300)
        return np.where((mass > 0.0) & (mass < self.most), 0.5 * mass * shared, 0.0)

    def gain(self, part: Loose) -> Gain:
        """What a part really takes away."""
        rows = [whitened_response(run, part.wrench(run.motion)[:, :, None]) for run in self.evaluation.runs]
        found = self._beyond.of(rows)
        information = float(found.information(rows)[0, 0]) + 1.0 / (LIKELY * self._mass) ** 2
        mass = float(found.right[0]) / information
        if not 0.0 < mass < self.most:
            return Gain(0.0, min(max(mass, 0.0), self.most), float(information**-0.5))
        return Gain(0.5 * mass * float(found.right[0]), mass, float(information**-0.5))


def likeliest(along: Along, middle: Array, spread: float) -> tuple[Loose, Gain]:
    """The part that takes most away. middle (3,) m, spread m: about where it is looked for.

    What a part looks like is asked of ever so many, what it takes away of the likeliest of them; and from the
    best of these that are not one and the same a simplex goes on.
    """

    def part(axis: str, x: Array) -> Loose:
        travel, rate, stop, ratio = np.exp(np.clip(x[:4], *np.array(BOUNDS[:4]).T))
        return Loose(axis, float(travel), float(rate), float(stop), float(ratio), middle + spread * x[4:])

    def away(x: Array) -> float:
        return 0.5 * float(x[4:] @ x[4:])

    def left(axis: str, x: Array) -> float:
        return away(x) - along.gain(part(axis, x)).nats

    def unlike(axis: str, columns: Array) -> Array:
        many = [part(axis, x) for x in columns.T]
        return np.array([away(x) for x in columns.T]) - along.likeness(many)

    def scanned(where: tuple[str, int]) -> list[_Guess]:
        axis, seed = where
        found = differential_evolution(
            lambda columns: unlike(axis, columns),
            BOUNDS,
            vectorized=True,
            updating="deferred",
            popsize=PEOPLE,
            maxiter=GENERATIONS,
            seed=seed,
            polish=False,
        )
        best = found.population[np.argsort(found.population_energies)[:HEARD]]
        return [_Guess(left(axis, x), axis, x) for x in best]

    def polished(guess: _Guess, steps: int, what: Callable[[Array], float]) -> _Guess:
        corners = guess.x + np.vstack([np.zeros(len(NUDGES)), np.diag(NUDGES)])
        options = {"maxfev": steps, "initial_simplex": corners}
        found = minimize(what, guess.x, method="Nelder-Mead", options=options)
        return _Guess(left(guess.axis, found.x), guess.axis, np.asarray(found.x))

    def alike(guess: _Guess) -> _Guess:
        return polished(guess, POLISHED[0], lambda x: float(unlike(guess.axis, x[:, None])[0]))

    every: list[_Guess] = []
    for seed in SEEDS:
        every += [g for found in side_by_side(scanned, [(axis, seed) for axis in AXES]) for g in found]
        best = min(every, key=lambda g: g.left)
        if -best.left < FAINT:
            # Nothing looks like it at all: no simplex makes so much of that
            chosen = part(best.axis, best.x)
            return chosen, along.gain(chosen)
    guesses: list[_Guess] = []
    for guess in sorted(every, key=lambda g: g.left):
        if len(guesses) < STARTS and not any(guess.like(known) for known in guesses):
            guesses.append(guess)
    best = min((*guesses, *side_by_side(alike, guesses)), key=lambda g: g.left)
    best = polished(best, POLISHED[1], lambda x: left(best.axis, x))
    chosen = part(best.axis, best.x)
    return chosen, along.gain(chosen)


@dataclass(frozen=True)
class _Guess:
    """A part as the scan writes it: logarithms of its four numbers, and its place in spreads."""

    left: float  # nats less than nothing
    axis: str
    x: Array  # (7,)

    def like(self, other: _Guess) -> bool:
        """Whether a simplex from either would look at much the same."""
        return self.axis == other.axis and bool(np.all(np.abs(self.x - other.x) < ALIKE))
