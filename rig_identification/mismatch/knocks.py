"""Something loose that knocks: blows along one line, each of which comes when the last one says.

What slides between stops hits them, and a blow lasts some milliseconds. In the random wrench that stands for
what the model lacks along the measured motion (measured.py) it is a spike of one node or two, which nothing
smooth bends to, be the model wrong in something else as well. Of spikes z_k (6), whitened by what the
recordings tell of one interval's wrench and by their own spread,
    z_k = S a_k (d, p x d) + noise
is one line of action: direction d through p, impulse a_k. What knocks has that line in every run.

From one blow to the next the part slides, massless, along the measured motion. Its way y from the stop that
it hit last, sigma = sign(a_k), begins with what that blow left of its speed:
    y'' = sigma (f + b) - c y' - mu sign(y'),  y(0) = 0,  y'(0) = kappa |a_k|,  y >= 0,  f = d . f_a(p)
f_a: specific force; b: slope of its floor, mu: its dry friction, m/s^2, which holds what is at rest as long
as |f + b| < mu. At the next blow y = 0, or 2 l where the other stop is hit;
and that blow's impulse is what stops it: |a_k+1| = m (1 + e) |y'|, e = kappa m (1 + e). A scan of whole runs
(loose.py) has to have all blows right, each of which follows from the ones before; here every blow begins
anew, and errors of some milliseconds do not grow.

How much likelier (nats) that makes the times and sizes of blows than chance does: the times are Cauchy with
the scale that they show, about the one that is predicted, against blows that come at any time, as many; the
log sizes likewise, against their own spread. Half the log of the number of gaps is charged for each number
that is looked for. Blows of other runs confirm it, each with the scales that they show themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.optimize import differential_evolution
from scipy.stats import chi2

from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.loose import beyond_of
from rig_identification.mismatch.response import instant_information, whitened_response
from rig_identification.model import layout
from rig_identification.model.motion import Motion

Array = NDArray[np.float64]

#: Share that counts as the larger part.
CHIEF = 0.5

RATE, FORCE, ALPHA = layout.OUT_RATE, layout.OUT_SPECIFIC_FORCE, layout.OUT_ANGULAR_ACCELERATION
#: What lasts longer than this (s) is no blow; blows closer than the other are one.
SMOOTH, APART = 0.2, 0.03
#: Chance of a spike in a run that has none, and the number of its spread's std up to which a node has none.
CHANCE, CALM = 1e-3, 3.0
#: Median of a normal error's size, in std.
NORMAL = 0.6745
#: Share of all six variances that is added to each, and least that is: where nothing is asked there is none.
EVEN, TINY = 1e-9, 1e-30
#: Nodes at least whose spread tells that of all.
FEW = 50
#: Least number of blows along one line, and least share of the largest that a blow has.
FEWEST, FAINTEST = 4, 0.05
#: Integration steps between two nodes.
FINE = 8
#: Ends of what is looked at: rate 1/s, speed after a middling blow m/s, dry friction m/s^2: from next to none
#: to that of rubber on steel; slope m/s^2, and its prior's std.
RATES, SPEEDS, FRICTIONS, SLOPES, SLOPING = (0.05, 8.0), (1e-4, 0.1), (2e-3, 4.0), (-0.3, 0.3), 0.05
#: The same of where its line lies, m: a body that is not known yet turns, and bends what all blows are.
ASIDES, ASIDE = (-0.5, 0.5), 0.15
#: Share of a line's direction that has to be level for it to be taken for a level one.
LEVEL = 0.5
#: Differential evolution: members for each number, generations.
PEOPLE, GENERATIONS = 12, 40
#: Nats that a slide may be less likely than the best and still be as likely: two std of a normal error.
TWO_STD = 2.0
#: m/s below which a part does not come, and what such a blow's time (s) and log size are taken to be off by.
STILL, NEVER, NOTHING_LIKE = 1e-4, 1.0, 3.0
#: Least scales of times (s) and log sizes.
SHARPEST, ALIKE = 0.005, 0.05
#: Numbers that are looked for: rate, rebound, friction, slope, line, travel, weight, and scales; and of them
#: scales.
NUMBERS, SCALES = 10, 2


@dataclass(frozen=True)
class Spikes:
    """What stands out of the random wrench of one run."""

    motion: Motion
    nodes: NDArray[np.int64]  # (K,)
    whitened: Array  # (K, 6)
    seen: Array  # (6, 6): from a wrench held for one node interval to what it whitens to


def spikes_of(problem: Problem, evaluation: Evaluation) -> list[Spikes]:
    """Spikes of every run about its measured motion (measured.py).

    Raises:
        ValueError: the problem has no random wrench.
    """
    if problem.extra_noise is None:
        raise ValueError("there is no random wrench that blows could stand out of")
    weight = 1.0 / np.diag(problem.extra_noise)
    out = []
    for run, latent in zip(evaluation.runs, evaluation.point.latents, strict=True):
        if latent is None:
            raise ValueError("there is no random wrench that blows could stand out of")
        step = run.motion.step
        pull = latent * weight
        pull = pull - median_filter(pull, size=(int(SMOOTH / step) | 1, 1), mode="nearest")
        root = _root(instant_information(run))
        alone = np.linalg.solve(root, pull.T).T
        spread = np.median(np.abs(alone), axis=0) / NORMAL
        calm = np.all(np.abs(alone) <= CALM * spread, axis=1)
        own = _root(np.cov(alone[calm].T) if np.sum(calm) > FEW else np.cov(alone.T))
        white = np.linalg.solve(own, alone.T).T
        nodes, sums = _together(white, max(1, round(APART / step)))
        out.append(Spikes(run.motion, nodes, sums, np.linalg.solve(own, root.T)))
    return out


def _root(matrix: Array) -> Array:
    """Lower triangular root of a symmetric matrix of which nothing is to be divided by."""
    return np.asarray(np.linalg.cholesky(matrix + max(EVEN * float(np.trace(matrix)), TINY) * np.eye(6)))


def _together(white: Array, apart: int) -> tuple[NDArray[np.int64], Array]:
    """Nodes at which blows are largest, and their whitened sums (K, 6)."""
    size = np.sum(white**2, axis=1)
    high = np.flatnonzero(size > chi2.isf(CHANCE / size.size, 6))
    groups = np.split(high, np.flatnonzero(np.diff(high) > apart) + 1) if high.size else []
    nodes = [g[np.argmax(size[g])] for g in groups]
    sums = [np.sum(white[max(g[0] - 1, 0) : g[-1] + 2], axis=0) for g in groups]
    return np.array(nodes, dtype=np.int64), np.array(sums).reshape(-1, 6)


@dataclass(frozen=True)
class Line:
    """A line of action in the body, and how blows along it look."""

    along: Array  # (3,) unit
    at: Array  # (3,) m, its point next to the datum
    spike: Array  # (6,) wrench of the spikes that such blows are
    strength: float  # N along it for each of those

    @property
    def axis(self) -> str:
        """The body's axis that it is nearest to."""
        return AXES[int(np.argmax(np.abs(self.along)))]

    @property
    def across(self) -> Array:
        """(2, 3) unit vectors across it."""
        first = np.eye(3)[int(np.argmin(np.abs(self.along)))]
        first = first - (first @ self.along) * self.along
        first /= np.linalg.norm(first)
        return np.array([first, np.cross(self.along, first)])

    def impulses(self, spikes: Spikes) -> Array:
        """(K,) N s along it."""
        return sizes(spikes, self.spike) * self.strength * spikes.motion.step

    def own(self, spikes: Spikes) -> Array:
        """(K,) of each spike's square what such a blow is."""
        row = spikes.seen @ self.spike
        return np.asarray((spikes.whitened @ row) ** 2 / (row @ row))

    def chiefly(self, spikes: Spikes) -> NDArray[np.bool_]:
        """(K,) which spikes are such blows for the larger part."""
        return np.asarray(self.own(spikes) > CHIEF * np.sum(spikes.whitened**2, axis=1))

    def share(self, every: Sequence[Spikes]) -> float:
        """Share of all spikes' squares that such blows are."""
        total = sum(float(np.sum(s.whitened**2)) for s in every)
        return sum(float(np.sum(self.own(s))) for s in every) / max(total, 1e-300)


def spike_of(every: Sequence[Spikes]) -> Array | None:
    """(6,) The wrench that spikes are multiples of, if any is; None where there are too few."""
    if sum(s.nodes.size for s in every) < FEWEST:
        return None
    frame = every[0].seen
    rows = np.vstack([(frame @ np.linalg.solve(s.seen, s.whitened.T)).T for s in every])
    wrench = np.linalg.solve(frame, np.linalg.svd(rows, full_matrices=False)[2][0])
    force = wrench[:3]
    size = float(np.linalg.norm(force)) or float(np.linalg.norm(wrench))
    return np.asarray(wrench / size * (-1.0 if force[np.argmax(np.abs(force))] < 0.0 else 1.0))


def sizes(spikes: Spikes, spike: Array) -> Array:
    """(K,) of how many such wrenches each is the sum."""
    row = spikes.seen @ spike
    return np.asarray(spikes.whitened @ row / (row @ row))


def lines_of(spike: Array, blow: Array, down: Array) -> list[Line]:
    """The lines of action that blows may have: along the body's nearest axis, level, and as it is measured.

    spike, blow: (6,) what such a blow shows of itself in a node or two, and what it is. down: (3,) gravity in
    the body at rest: what slides freely down a floor does not leave its stop again.
    """
    force = float(np.linalg.norm(blow[:3]))
    if force == 0.0:
        return []
    along, moment = blow[:3] / force, blow[3:] / force
    nearest, axis = int(np.argmax(np.abs(along))), np.zeros(3)
    axis[nearest] = np.sign(along[nearest])
    level = along - (along @ down) / (down @ down) * down
    length = float(np.linalg.norm(level))
    directions = [axis, along] if length < LEVEL else [axis, level / length, along]
    return [Line(d, np.cross(d, moment), spike, force) for d in directions]


def _blow_of(told: Sequence[tuple[Sequence[Spikes], Beyond]], spike: Array) -> Array:
    """(6,) What blows are all together, as all recordings tell it, for each ``spike`` of theirs.

    A force that few sensors feel at once shows in what comes after, and its spike has but a part of it: told
    from spikes alone a line would lie too far from the datum. Here every blow has the size of its spike, and
    the six numbers of one wrench are free, with all of its response, beside all that is free anyway.
    """
    right, information = np.zeros(6), np.zeros((6, 6))
    for every, beyond in told:
        rows: list[Array | None] = []
        for spikes, run in zip(every, beyond.full.runs, strict=True):
            size = sizes(spikes, spike)
            wrenches = np.zeros((spikes.motion.outputs.shape[0], 6, 6))
            wrenches[spikes.nodes] = size[:, None, None] * np.eye(6)
            rows.append(whitened_response(run, wrenches))
        found = beyond.of(rows)
        right += found.right
        information += found.information([own for own in rows if own is not None])
    return np.asarray(np.linalg.lstsq(information, right, rcond=None)[0])


@njit(cache=True, nogil=True)
def _flights(force, first, last, side, speed, step, rate, friction, slope, out):  # type: ignore[no-untyped-def]
    """out (G, 2): way (m) from the stop that was left and its rate at the end of each gap.

    A part that has come back already is beyond the stop by what it would have gone since.
    """
    for g in range(first.shape[0]):
        h = step[g] / FINE
        y, v = 0.0, speed[g]
        since, hit = 0.0, 0.0
        for k in range(first[g], last[g]):
            for s in range(FINE):
                f = force[k] + (force[k + 1] - force[k]) * (s + 0.5) / FINE + slope
                away = y > 0.0
                v += h * (side[g] * f - rate * v)
                # Dry friction takes no more than all of the speed in a step (implicit Euler)
                v = max(v - h * friction, 0.0) if v > 0.0 else min(v + h * friction, 0.0)
                y += h * v
                since += h
                if y < 0.0:
                    if away:
                        hit, since = -v, 0.0
                    y, v = 0.0, 0.0
        if y > 0.0:
            out[g, 0], out[g, 1] = y, v
        else:
            out[g, 0], out[g, 1] = -hit * since, -hit


class Gaps:
    """What lies between blows along a line, run after run."""

    def __init__(self, line: Line, every: Sequence[Spikes]) -> None:
        force, first, last, step, before, after = [], [], [], [], [], []
        begun = 0
        for spikes in every:
            impulses = line.impulses(spikes)
            most = np.max(np.abs(impulses), initial=0.0)
            kept = np.flatnonzero(line.chiefly(spikes) & (np.abs(impulses) > FAINTEST * most))
            force.append(_felt(spikes.motion, line))
            first += [begun + int(n) for n in spikes.nodes[kept[:-1]]]
            last += [begun + int(n) for n in spikes.nodes[kept[1:]]]
            before += list(impulses[kept[:-1]])
            after += list(impulses[kept[1:]])
            step += [spikes.motion.step] * max(kept.size - 1, 0)
            begun += force[-1].shape[0]
        self._force = np.concatenate(force) if force else np.zeros((0, 3))
        self._first, self._last = np.array(first, dtype=np.int64), np.array(last, dtype=np.int64)
        self._step = np.array(step, dtype=float)
        self.before, self.after = np.array(before, dtype=float), np.array(after, dtype=float)
        self.same = np.sign(self.before) == np.sign(self.after)

    @property
    def count(self) -> int:
        """Number of gaps."""
        return int(self.after.size)

    @property
    def lengths(self) -> Array:
        """(G,) s."""
        return np.asarray((self._last - self._first) * self._step)

    def weight(self, speed: Array) -> float | None:
        """Impulse of a blow over the speed (G,) at which the part comes, kg; None where it comes to none."""
        coming = speed > STILL
        if not np.any(coming):
            return None
        return float(np.exp(np.median(np.log(np.abs(self.after[coming]) / speed[coming]))))

    def arrivals(self, slide: Slide) -> tuple[Array, Array]:
        """Way (m) from the stop that was left, and speed (m/s) towards the stop that is hit, (G,) each."""
        out = np.empty((self.count, 2))
        speed = slide.left * np.abs(self.before)
        side = np.sign(self.before)
        force = self._force @ np.array([1.0, *slide.aside])
        numbers = slide.rate, slide.friction, slide.slope
        _flights(force, self._first, self._last, side, speed, self._step, *numbers, out)
        return out[:, 0], np.where(self.same, -out[:, 1], out[:, 1])


def _felt(motion: Motion, line: Line) -> Array:
    """(N, 3) specific force along a line of the body, and what it gains for each metre aside of it."""
    turning, gaining = motion.outputs[:, RATE : RATE + 3], motion.outputs[:, ALPHA : ALPHA + 3]

    def turned(at: Array) -> Array:
        return np.asarray(np.cross(gaining, at) + np.cross(turning, np.cross(turning, at)))

    there = [motion.outputs[:, FORCE : FORCE + 3] + turned(line.at), *map(turned, line.across)]
    return np.column_stack([part @ line.along for part in there])


@dataclass(frozen=True)
class Slide:
    """How a part slides and rebounds."""

    rate: float  # 1/s: what slows it
    left: float  # m/s after a blow of one N s
    friction: float  # m/s^2: dry friction per kilogram
    slope: float  # m/s^2, of its floor
    aside: tuple[float, float] = (0.0, 0.0)  # m, by which its line is off, along ``Line.across``


@dataclass(frozen=True)
class Arrival:
    """How well times and sizes of blows follow from the ones before."""

    slide: Slide
    apart: float  # m between the stops; NaN where one alone is hit
    weight: float  # kg: impulse of a blow over speed, m (1 + e)
    late: float  # s, scale of times
    unlike: float  # scale of log sizes
    nats: float  # by which that is likelier than chance, nothing charged

    @property
    def mass(self) -> float:
        """Of the part, kg."""
        return self.weight / (1.0 + self.slide.left * self.weight)


def _arrival(gaps: Gaps, slide: Slide, known: Arrival | None = None) -> Arrival:
    """Times and sizes with a slide. known: with distance and weight of other runs."""
    way, speed = gaps.arrivals(slide)
    across = way[~gaps.same]
    if known is None:
        apart = float(np.median(across)) if across.size else float("nan")
        weight = gaps.weight(speed) or 1.0
    else:
        # Where one stop alone was hit, nothing is known of the other
        seen = np.isfinite(known.apart) or not across.size
        apart, weight = known.apart if seen else float(np.median(across)), known.weight
    short, fast = np.where(gaps.same, way, way - apart), np.maximum(speed, STILL)
    told = (speed > STILL) & np.isfinite(short)
    size = np.log(np.abs(gaps.after))
    times = np.where(told, np.abs(short) / fast, NEVER)
    off = np.where(told, np.abs(size - np.log(weight * fast)), NOTHING_LIKE)
    about = np.abs(size - np.median(size))
    late, unlike, wide = (
        max(float(np.median(a)), b) for a, b in ((times, SHARPEST), (off, ALIKE), (about, ALIKE))
    )
    mean = float(np.mean(gaps.lengths))
    timed = np.log(mean) + gaps.lengths / mean - _cauchy(times, late) - np.log(np.pi)
    sized = _cauchy(about, wide) - _cauchy(off, unlike)
    return Arrival(slide, apart, weight, late, unlike, float(np.sum(timed + sized)))


def _cauchy(error: Array, scale: float) -> Array:
    """Nats that an error costs, but for the log of pi."""
    return np.asarray(np.log1p((error / scale) ** 2) + np.log(scale))


def _likely(gaps: Gaps) -> list[Arrival]:
    """Slides that are as likely as any, the likeliest first.

    Times hold on to combinations of rate, slope and place: along a valley of slides the weight may double.
    """
    middling = float(np.median(np.abs(gaps.before)))
    bounds = [
        (float(np.log(RATES[0])), float(np.log(RATES[1]))),
        (float(np.log(SPEEDS[0] / middling)), float(np.log(SPEEDS[1] / middling))),
        (float(np.log(FRICTIONS[0])), float(np.log(FRICTIONS[1]))),
        SLOPES,
        ASIDES,
        ASIDES,
    ]
    seen: list[tuple[float, Arrival]] = []

    def unlikely(x: Array) -> float:
        rate, left, friction = (float(v) for v in np.exp(x[:3]))
        there = _arrival(gaps, Slide(rate, left, friction, float(x[3]), (float(x[4]), float(x[5]))))
        far = (x[3] / SLOPING) ** 2 + (x[4] / ASIDE) ** 2 + (x[5] / ASIDE) ** 2
        seen.append((0.5 * float(far) - there.nats, there))
        return seen[-1][0]

    differential_evolution(unlikely, bounds, popsize=PEOPLE, maxiter=GENERATIONS, seed=1, polish=False)
    seen.sort(key=lambda s: s[0])
    return [there for cost, there in seen if cost < seen[0][0] + TWO_STD]


def _middle(values: Sequence[float]) -> tuple[float, float]:
    """Middle and std of what is as likely as the best, two std either side."""
    least, most = min(values), max(values)
    return 0.5 * (least + most), 0.25 * (most - least)


@dataclass(frozen=True)
class Knocks:
    """A part that knocks, as its blows tell it."""

    line: Line
    blows: int  # along it, in all runs
    mass: float  # kg
    std: float  # kg
    travel: float | None  # m either side; None where it hits one stop alone
    travel_std: float
    gain: float  # nats that its line takes away in the runs that were fitted
    timed: float  # nats by which its slide tells times and sizes of all blows
    confirmed: float  # ... of those that it was not made for


def knocking(seen: tuple[Problem, Evaluation], held: tuple[Problem, Evaluation]) -> Knocks | None:
    """What knocks along one line in fitted and in held-out runs, the likelier of two; None: nothing does.

    seen, held: about their measured motion. Whether the blows' times convince is in ``timed`` and
    ``confirmed``: a slide is made for those of the runs that have more, and confirmed by the others.
    """
    fitted, others = spikes_of(*seen), spikes_of(*held)
    spike = spike_of([*fitted, *others])
    if spike is None:
        return None
    blow = _blow_of([(fitted, beyond_of(*seen)), (others, beyond_of(*held, fixed=True))], spike)
    down = fitted[0].motion.outputs[0, layout.OUT_GRAVITY : layout.OUT_GRAVITY + 3]
    return likelier(lines_of(spike, blow, down), fitted, others)


def likelier(lines: Sequence[Line], fitted: Sequence[Spikes], held: Sequence[Spikes]) -> Knocks | None:
    """What knocks along one of some lines; None: nothing does in both."""
    found = [_knocks(line, fitted, held) for line in lines]
    return max((k for k in found if k is not None), key=lambda k: k.timed, default=None)


def _knocks(line: Line, fitted: Sequence[Spikes], held: Sequence[Spikes]) -> Knocks | None:
    if min(line.share(fitted), line.share(held)) < CHIEF:
        return None
    gaps, others = sorted((Gaps(line, fitted), Gaps(line, held)), key=lambda g: -g.count)
    if gaps.count < FEWEST or not others.count:
        return None
    likely = _likely(gaps)
    arrival = likely[0]
    confirmed = _arrival(others, arrival.slide, arrival).nats - 0.5 * SCALES * float(np.log(others.count))
    weight = others.weight(others.arrivals(arrival.slide)[1])
    apart = 0.0 if weight is None else float(np.log(weight / arrival.weight))
    mass, doubt = _middle([float(np.log(a.mass)) for a in likely])
    every = [_stops(a, (gaps, others)) for a in likely]
    travel = _middle([middle for middle, _ in every])
    line = replace(line, at=line.at + np.array(arrival.slide.aside) @ line.across)
    return Knocks(
        line,
        sum(int(np.sum(line.chiefly(s))) for s in (*fitted, *held)),
        float(np.exp(mass)),
        float(np.exp(mass) * np.linalg.norm([arrival.unlike / NORMAL, apart, doubt])),
        travel[0] if np.isfinite(travel[0]) else None,
        float(np.hypot(travel[1], every[0][1])),
        0.5 * sum(float(np.sum(line.own(s))) for s in fitted),
        arrival.nats - 0.5 * NUMBERS * float(np.log(gaps.count)) + confirmed,
        confirmed,
    )


def _stops(arrival: Arrival, every: Sequence[Gaps]) -> tuple[float, float]:
    """Half the distance between the stops, m, and by what the ways across differ; NaN where there is none."""
    way = np.concatenate([g.arrivals(arrival.slide)[0][~g.same] for g in every])
    if not way.size:
        return float("nan"), float("nan")
    middle = float(np.median(way))
    return 0.5 * middle, 0.5 * float(np.median(np.abs(way - middle))) / NORMAL
