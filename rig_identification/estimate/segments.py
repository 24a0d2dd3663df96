"""A run in short pieces, each with a start state of its own.

What a model leaves out adds up over time: friction that costs a percent of amplitude in one
period costs half of it in a minute. Within a period or two it is nearly gone, and a free
start state every few seconds takes it up. Such a fit gives away precision and is bent less.
It also tells in which pieces a run is free motion at all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Channel, Run
from rig_identification.estimate.launch import launch_state, launch_states
from rig_identification.estimate.noise import FITTED_SAMPLES
from rig_identification.estimate.pose_error import turning_of
from rig_identification.estimate.prediction import Bench, linearise_run
from rig_identification.estimate.sampling import sample_noise_std
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.solve import CannotBeFollowed, Evaluation, Point, Problem, solve
from rig_identification.estimate.start_state import fit_start
from rig_identification.estimate.swing_period import beside_a_swing, long_enough, swing_period
from rig_identification.estimate.unseen_sway import sway_shapes
from rig_identification.model.motion import State
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Steps of a fit of pieces to its end.
PIECE_STEPS = 15
#: Length of a piece, s: one to two periods of the slowest rigid mode of such rigs (0.37 Hz and up).
PIECE = 4.0


def pieces_of(run: Run, length: float = PIECE) -> tuple[Run, ...]:
    """A run cut into equal pieces of about ``length`` seconds."""
    nodes = run.grid.nodes
    count = max(1, round(run.grid.duration / length))
    edges = np.linspace(0, nodes - 1, count + 1).astype(int)
    return tuple(run.between(int(a), int(b)) for a, b in pairwise(edges))


def in_pieces(
    problem: Problem, theta: Array, rest: State, rest_guesses: tuple[State, ...], times: float = 1.0
) -> tuple[Problem, Point]:
    """The same problem with every run in pieces, and a point with a start state for each.

    times: how many times as long as a piece has to be. Where nothing but the motion is measured that is as
    long as some swings take, and PIECE otherwise.
    Pieces that the model cannot follow at ``theta`` are left out. Raises CannotBeFollowed where none is left.
    """
    lengths = [times * long_enough(run, PIECE) for run in problem.runs]
    pieces = (pieces_of(run, length) for run, length in zip(problem.runs, lengths, strict=True))
    cut = tuple(piece for of_run in pieces for piece in of_run if piece.channels)
    starts = launch_states(problem.bench, cut, theta, rest)

    def follows(begun: tuple[Run, State]) -> bool:
        piece, start = begun
        return linearise_run(problem.bench, piece, theta, start, start_only=True) is not None

    followed = side_by_side(follows, zip(cut, starts, strict=True))
    kept = [begun for begun, good in zip(zip(cut, starts, strict=True), followed, strict=True) if good]
    if not kept:
        raise CannotBeFollowed(problem, theta, tuple(dict.fromkeys(run.recording.name for run in cut)))
    parts = replace(problem, runs=tuple(run for run, _ in kept))
    return parts, Point(theta, tuple(start for _, start in kept), rest_guesses)


def solve_in_pieces(
    problem: Problem,
    theta: Array,
    rest: State,
    rest_guesses: tuple[State, ...],
    iterations: int = PIECE_STEPS,
) -> tuple[Problem, Evaluation]:
    """The same problem with every run in pieces, and its evaluation after some steps."""
    parts, point = in_pieces(problem, theta, rest, rest_guesses)
    return parts, solve(parts, point, iterations=iterations)[0]


@dataclass(frozen=True)
class FreePart:
    """The longest stretch of a run in which nothing but the rig acts on the body."""

    run: Run  # cut to that stretch
    start: float  # s after the recording's start
    end: float  # s
    held: tuple[tuple[float, float], ...]  # stretches (s) in which something else acts


#: A piece counts as driven where it fits so many times worse than the calm half of the run, both in units of
#: noise and as a share of how far the body is from the run's middle.
DRIVEN = 3.0
#: Length of the pieces that are told apart, s. Of a body that is only watched each is a whole swing at least:
#: what a model lacks shows otherwise at each phase of a swing, and pieces of three quarters of one, of which
#: every second begins alike, would seem to be driven in turn.
SHORT_PIECE = 2.0


def free_part(problem: Problem, run: Run, theta: Array, rest: State) -> FreePart:
    """Find the free stretch: short pieces are fitted by start states alone, and the bad ones are driven.

    The yardstick is the better half of the pieces. A piece at rest fits always and says nothing; what the
    model lacks, and what a tracker sees of a body far turned, grows with the swing and is no one's hand. Nor
    is what noise leaves of a piece, however well others fit. At either end of the stretch the instant is then
    looked for within the piece (_driven_edge).
    """
    cut = pieces_of(run, long_enough(run, SHORT_PIECE, swings=1.0))
    errors = np.full(len(cut), np.inf)
    swing = _swing(run, cut)
    for i, piece in enumerate(cut):
        fitted = fit_start(problem.bench, piece, theta, launch_state(problem.bench, piece, theta, rest))
        if fitted is not None:
            errors[i] = float(np.sqrt(np.mean(fitted[0].residual ** 2)))
    shares = errors / swing
    calm, calm_share = max(_calm(errors), 1.0), _calm(shares)
    driven = (errors > DRIVEN * calm) & (shares > DRIVEN * calm_share)
    best, begin = (0, 0), 0
    for i in range(len(cut) + 1):
        if i == len(cut) or driven[i]:
            if i - begin > best[1] - best[0]:
                best = (begin, i)
            begin = i + 1
    ordinary = np.maximum(calm, calm_share * swing)
    first, last = cut[best[0]], cut[best[1] - 1]
    bench, usual = problem.bench, ordinary[[best[0], best[1] - 1]]
    early = _driven_edge(bench, first, theta, rest, usual[0], at_end=False)
    final = last.between(early, last.grid.nodes - 1) if last is first else last
    late = _driven_edge(bench, final, theta, rest, usual[1], at_end=True)
    step = run.grid.step
    a = round((first.offset - run.offset) / step) + early
    b = round((last.offset - run.offset) / step) + last.grid.nodes - 1 - late
    start, end = run.offset + a * step, run.offset + b * step
    held = [
        (piece.offset, piece.offset + piece.grid.duration)
        for piece, bad in zip(cut, driven, strict=True)
        if bad
    ]
    held += [(first.offset, start)] if early else []
    held += [(end, end + late * step)] if late else []
    return FreePart(run.between(a, b), start, end, tuple(sorted(held)))


#: Shares of a piece of which the first or the last may be driven while the piece as a whole hardly shows it.
EDGES = (1 / 64, 1 / 48, 1 / 32, 3 / 64, 1 / 16, 3 / 32, 1 / 8, 3 / 16, 1 / 4, 3 / 8, 1 / 2)
#: Numbers of a body's start: so many samples' worth may a fit gain that need not follow the driven ones.
START_NUMBERS = 12.0


def _driven_edge(
    bench: Bench, piece: Run, theta: Array, rest: State, ordinary: float, *, at_end: bool
) -> int:
    """Nodes at the beginning, or the end, of a free stretch's outermost ``piece`` in which it is driven.

    A hand lets go, or takes hold, within a tenth of a second: such a piece is driven for a part of it. The
    fit of its start without that part then leaves less of the others, and of those left out more than DRIVEN
    times what is ``ordinary`` (in units of noise). No sample counts for more than DRIVEN times that again: a
    spike is no hand. 0: nothing is gained.
    """
    allowed = DRIVEN * ordinary
    nodes = piece.grid.nodes - 1

    def left(cut: int) -> tuple[float, int] | None:
        rest_of_it = piece.between(0, nodes - cut) if at_end else piece.between(cut, nodes)
        begun = launch_state(bench, rest_of_it, theta, rest)
        fitted = fit_start(bench, rest_of_it, theta, begun)
        if fitted is None:
            return None
        residual = fitted[0].residual
        return float(np.sum(np.minimum(residual**2, (DRIVEN * allowed) ** 2))), residual.size

    whole = left(0)
    if whole is None:
        return 0
    best, most = 0, START_NUMBERS * allowed**2
    for cut in dict.fromkeys(round(share * nodes) for share in EDGES):
        without = left(cut) if cut else None
        if without is None:
            continue
        gain = whole[0] - without[0] - allowed**2 * (whole[1] - without[1])
        if gain > most:
            best, most = cut, gain
    return best


def _calm(errors: Array) -> float:
    """Median of the better half."""
    return float(np.median(np.sort(errors)[: max(1, (errors.size + 1) // 2)]))


def _swing(run: Run, cut: tuple[Run, ...]) -> Array:
    """(pieces,) root mean square distance of each piece from the run's middle, in units of noise."""
    middle = {c.key: np.median(c.values, axis=0) for c in run.channels}
    out = []
    for piece in cut:
        off = [(c.values - middle[c.key]) / c.noise for c in piece.channels]
        out.append(np.sqrt(np.mean(np.concatenate([o.ravel() for o in off]) ** 2)))
    return np.asarray(np.maximum(np.array(out), 1e-12))


def with_noise_of_swing(rig: Rig, run: Run) -> Run:
    """The run with each noise that was estimated as large as a smooth swing shows it.

    Neighbouring samples show a tracker's white noise alone. What wanders with the pose (markers
    hidden and found again, lens errors) is noise as well: all that a cubic over a quarter of
    the swing's period does not follow; of samples too seldom for that, all that no swing follows, nor what
    one turn's device reads of a swing beside (unseen_sway.py).
    """
    period = swing_period(run)

    def heard(c: Channel) -> Array:
        often = c.time.size / run.grid.duration * 0.25 * period > FITTED_SAMPLES
        if often:
            return sample_noise_std(c.time, c.values, 0.25 * period)
        sway = sway_shapes(rig, run, c)
        if sway is None:
            return beside_a_swing(c.time, c.values, period)
        nodes = run.grid.step * np.arange(run.grid.nodes)
        seen = np.stack([np.interp(c.time, nodes, shape) for shape in sway.T], axis=1)
        return beside_a_swing(c.time, c.values, period, seen)

    channels = tuple(_louder(c, heard(c)) if c.noise_estimated else c for c in run.channels)
    turned = [c for c in channels if c.device == "mocap" and c.quantity == "orientation"]
    turning = turning_of(turned[0].key, turned[0].values) if turned else None
    return replace(run, channels=channels, turning=turning)


def _louder(channel: Channel, heard: Array) -> Channel:
    """The channel as noisy as ``heard`` (w,); what a tracker adds to a moment's noise goes with the pose."""
    noise = np.maximum(channel.noise, heard)
    wander = np.sqrt(noise**2 - channel.noise**2) if channel.device == "mocap" else None
    return replace(channel, noise=noise, wander=wander)
