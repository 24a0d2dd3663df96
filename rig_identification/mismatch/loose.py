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

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import differential_evolution, minimize

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Point, Problem
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.findings import written
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.measured import measured
from rig_identification.mismatch.response import whitened_response
from rig_identification.mismatch.rider_places import REACH, spread_of
from rig_identification.mismatch.riders import middle_of
from rig_identification.mismatch.screen import free_without, screen, with_reference
from rig_identification.mismatch.trial import mass_of
from rig_identification.model import layout
from rig_identification.model.motion import Motion
from rig_identification.result import Finding

Array = NDArray[np.float64]

RATE, FORCE, ALPHA = layout.OUT_RATE, layout.OUT_SPECIFIC_FORCE, layout.OUT_ANGULAR_ACCELERATION
#: Integration steps between two nodes.
FINE = 16
#: Ends of what is looked at: m either side, damping 1/s, frequency (Hz) of the stops and their damping ratio.
TRAVELS, RATES, STOPS, RATIOS = (0.002, 0.1), (0.05, 8.0), (10.0, 160.0), (0.05, 0.9)
BOUNDS = [(np.log(a), np.log(b)) for a, b in (TRAVELS, RATES, STOPS, RATIOS)] + [(-REACH, REACH)] * 3
#: Differential evolution (Storn & Price, J. Global Optimization 11, 1997): members for each number that is
#: looked for, generations, and how often anew. Of each scan's last members so many are heard for what they
#: really gain; and from the best few of all, which differ by this much, steps of a simplex on that, and more
#: of them from where the best of these comes to.
PEOPLE, GENERATIONS, SEEDS, HEARD = 12, 60, (1, 2), 8
STARTS, POLISHED = 3, (150, 300)
ALIKE = np.array([0.25, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
#: First steps of the simplex: in the logarithms, and in the place.
NUDGES = (0.03, 0.2, 0.3, 0.3, 0.15, 0.15, 0.15)
#: Std of a travel that blows were timed by, and of a mass that they tell, as a share of each: blows that come
#: some milliseconds early or late in the scan make a part look lighter, and its way longer or shorter.
TIMED, WEIGHED = 0.5, 1.0
#: Nats by which a loose part has to be likelier than all else, and by which held-out runs have to confirm it.
AHEAD, CONFIRMED = 30.0, 10.0
#: Share of that below which the scan's best is not followed any further.
FAINT = 0.25
#: Prior std of its mass, in parts of the body's, and the number of them past which it is no part of the body.
LIKELY, FARTHEST = 0.05, 3.0


@njit(cache=True, nogil=True)
def slide(force, step, first, stop, rate, frequency, ratio, q, acceleration):  # type: ignore[no-untyped-def]
    """Travel and acceleration (N,) of a massless part under specific force ``force`` (N,) along its line.

    first: sign of the stop that it begins at.
    """
    omega = 2.0 * np.pi * frequency
    h = step / FINE
    speed, place = 0.0, first * stop
    for k in range(force.shape[0]):
        q[k] = place
        total = 0.0
        ahead = force[min(k + 1, force.shape[0] - 1)]
        for s in range(FINE):
            pull = -(force[k] + (s + 0.5) / FINE * (ahead - force[k])) - rate * speed
            if abs(place) > stop:
                beyond = place - stop if place > 0.0 else place + stop
                pull -= omega * omega * beyond + 2.0 * ratio * omega * speed
            speed += h * pull
            place += h * speed
            total += pull / FINE
        acceleration[k] = total


@njit(cache=True, nogil=True)
def _passenger(raw, axis, at, step, stop, rate, frequency, ratio):  # type: ignore[no-untyped-def]
    """(N, 6) wrench that a kilogram loose at ``at`` exerts along the raw outputs of a motion, (N,) travel."""
    nodes = raw.shape[0]
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    felt = np.empty(nodes)
    for n in range(nodes):
        wi, wj, wk = raw[n, RATE + i], raw[n, RATE + j], raw[n, RATE + k]
        along = wi * at[i] + wj * at[j] + wk * at[k]
        turning = raw[n, ALPHA + j] * at[k] - raw[n, ALPHA + k] * at[j]
        felt[n] = raw[n, FORCE + i] + turning + wi * along - (wi * wi + wj * wj + wk * wk) * at[i]
    q, acceleration = np.empty(nodes), np.empty(nodes)
    first = np.sign(raw[0, layout.OUT_GRAVITY + i])
    slide(felt, step, first, stop, rate, frequency, ratio, q, acceleration)
    out = np.zeros((nodes, 6))
    for n in range(nodes):
        push = -acceleration[n]
        out[n, i] = push
        out[n, 3 + j] = at[k] * push + q[n] * raw[n, FORCE + k]
        out[n, 3 + k] = -at[j] * push - q[n] * raw[n, FORCE + j]
    return out, q


@njit(cache=True, nogil=True)
def _alike(wrench, wanted, weight):  # type: ignore[no-untyped-def]
    """(w . wanted, w . w) of a wrench held between nodes, less its mean. weight (6,): of each component."""
    nodes = wrench.shape[0]
    with_wanted, own = 0.0, 0.0
    for c in range(6):
        total, square, cross, other = 0.0, 0.0, 0.0, 0.0
        for n in range(nodes):
            w = 0.5 * (wrench[n, c] + wrench[min(n + 1, nodes - 1), c])
            total += w
            square += w * w
            cross += w * wanted[n, c]
            other += wanted[n, c]
        own += weight[c] * (square - total * total / nodes)
        with_wanted += weight[c] * (cross - total * other / nodes)
    return with_wanted, own


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
        """(N, 6) wrench about the datum, body axes, of a kilogram of it along a motion that began at rest."""
        return self._along(motion)[0]

    def to_either_side(self, motion: Motion) -> bool:
        """Whether it leaves the one stop for the other: else nothing tells how far apart they are."""
        q = self._along(motion)[1]
        return bool(np.min(q) < -0.5 * self.travel and np.max(q) > 0.5 * self.travel)

    def _along(self, motion: Motion) -> tuple[Array, Array]:
        wrench, q = _passenger(
            motion.outputs,
            AXES.index(self.axis),
            self.at,
            motion.step,
            self.travel,
            self.rate,
            self.stop,
            self.ratio,
        )
        return np.asarray(wrench), np.asarray(q)


@dataclass(frozen=True)
class Gain:
    """What a part takes away, to first order in its mass."""

    nats: float
    mass: float  # kg
    std: float  # kg


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
        self._weight = 1.0 / np.diag(noisy.extra_noise)
        self._pairs = [
            (run.motion, latent)
            for run, latent in zip(evaluation.runs, evaluation.point.latents, strict=True)
            if latent is not None
        ]
        size = noisy.bench.parameters.size
        free = free_without(noisy, evaluation.point, evaluation, set(), 0)
        self._beyond = Beyond(evaluation, free[free >= size] if fixed else free, size)

    def likeness(self, part: Loose) -> float:
        """About how much (nats) of the random wrench a part makes needless; none of negative mass does."""
        shared, own = 0.0, 0.0
        for motion, latent in self._pairs:
            both = _alike(part.wrench(motion), latent, self._weight)
            shared, own = shared + both[0], own + both[1]
        own = max(own, 1e-300)
        mass = float(np.clip(shared / own, 0.0, self.most))
        return mass * (shared - 0.5 * mass * own)

    def gain(self, part: Loose) -> Gain:
        """What a part really takes away."""
        rows = [
            whitened_response(run, part.wrench(run.motion)[:, :, None], smooth=True)
            for run in self.evaluation.runs
        ]
        found = self._beyond.of(rows)
        information = float(found.information(rows)[0, 0]) + 1.0 / (LIKELY * self._mass) ** 2
        right = float(found.right[0])
        mass = float(np.clip(right / information, 0.0, self.most))
        return Gain(mass * (right - 0.5 * mass * information), mass, float(information**-0.5))


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

    def scanned(where: tuple[str, int]) -> list[_Guess]:
        axis, seed = where
        found = differential_evolution(
            lambda x: away(x) - along.likeness(part(axis, x)),
            BOUNDS,
            popsize=PEOPLE,
            maxiter=GENERATIONS,
            seed=seed,
            polish=False,
        )
        best = found.population[np.argsort(found.population_energies)[:HEARD]]
        return [_Guess(left(axis, x), axis, x) for x in best]

    def polished(guess: _Guess, steps: int) -> _Guess:
        corners = guess.x + np.vstack([np.zeros(len(NUDGES)), np.diag(NUDGES)])
        found = minimize(
            lambda x: left(guess.axis, x),
            guess.x,
            method="Nelder-Mead",
            options={"maxfev": steps, "initial_simplex": corners},
        )
        return _Guess(float(found.fun), guess.axis, np.asarray(found.x))

    # What takes the time holds no lock, and no thread tells another what it found: the same every time
    with ThreadPoolExecutor(max_workers=2) as pool:
        every: list[_Guess] = []
        for seed in SEEDS:
            every += [g for found in pool.map(scanned, [(axis, seed) for axis in AXES]) for g in found]
            best = min(every, key=lambda g: g.left)
            if -best.left < FAINT * AHEAD:
                # Nothing looks like it at all: no simplex makes so much of that
                chosen = part(best.axis, best.x)
                return chosen, along.gain(chosen)
        guesses: list[_Guess] = []
        for guess in sorted(every, key=lambda g: g.left):
            if len(guesses) < STARTS and not any(guess.like(known) for known in guesses):
                guesses.append(guess)
        best = min(pool.map(lambda g: polished(g, POLISHED[0]), guesses), key=lambda g: g.left)
    best = polished(best, POLISHED[1])
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


def loose_finding(fitted: Fitted, before: float | None) -> Finding | None:
    """What is told of a loose part beside a fit that leaves something; None: there is none that convinces.

    fitted: whole runs, each from rest. before: held-out error of the ideal model.
    """
    problem, point = with_reference(fitted.problem, fitted.rest), fitted.evaluation.point
    mass = mass_of(problem, fitted.evaluation)
    seen = measured(problem, point, mass)
    if seen is None:
        return None
    along = Along(*seen, mass)
    part, gain = likeliest(along, middle_of(problem.bench.rig), spread_of(problem))
    likely = gain.nats > AHEAD and gain.mass < along.most
    held = _held_out(fitted, problem, mass) if likely else None
    again = None if held is None else held.gain(part)
    if again is None or again.nats < CONFIRMED:
        return None
    rivals = screen(*seen, catalogue(problem), mass)
    if rivals and gain.nats < rivals[0].gain + AHEAD:
        return None
    between = any(part.to_either_side(run.motion) for run in seen[1].runs)
    return _told(part, between, gain, again, before)


def _held_out(fitted: Fitted, problem: Problem, mass: float) -> Along | None:
    """Held-out runs about their measured motion; None where there is none that can be followed."""
    if not fitted.holdouts:
        return None
    point = fitted.evaluation.point
    held = replace(problem, runs=fitted.holdout_runs, rests=())
    starts = tuple(run.motion.state(0) for run in fitted.holdouts)
    seen = measured(held, Point(point.theta, starts, ()), mass)
    return None if seen is None else Along(*seen, mass, fixed=True)


def _told(part: Loose, between: bool, gain: Gain, again: Gain, before: float | None) -> Finding:
    """The finding in words and numbers.

    between: it hits both stops. again: the gain in held-out runs, which tell the mass once more.
    """
    std = max(float(np.hypot(gain.std, gain.mass - again.mass)), WEIGHED * gain.mass)
    quantities = {"mass": (gain.mass, std, "kg")}
    stops = "a stop"
    if between:
        quantities["travel"] = part.travel, TIMED * part.travel, "m"
        stops = f"its stops {1e3 * part.travel:.0f} mm to either side"
    told = f"{gain.mass:.2g} kg of it or more (± {std:.2g} kg; blows timed a little off make it look lighter)"
    text = (
        f"Something slides along {part.axis} and hits {stops}: "
        f"about {told}. Nothing else of the catalogue takes as much of the missing wrench away, and where "
        f"nothing was fitted it does so too ({gain.nats:.0f} and {again.nats:.0f} nats). The blows "
        "themselves are not followed to the noise. Find it by ear, and fix it or take it out."
    )
    where: dict[str, object] = {"channel": None, "axis": part.axis, "position": [float(v) for v in part.at]}
    evidence: dict[str, float | None] = {
        "log_likelihood_gain": gain.nats,
        "holdout_error_before": before,
        "holdout_error_after": None,
    }
    return Finding("loose_mass", where, written(quantities), evidence, text)
