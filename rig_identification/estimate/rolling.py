"""How a body on a line of hinges rolls about it: every frequency at which it may, tried in turn.

A body on two threads swings across their plane in two ways, nearly as a whole, and rolling about its hinges
while its centre of mass stays. The second is fast and small and dies out early: a fit that begins with it out
of step finds nothing that pulls it there, and what it then makes of the body's depth and of its moments about
the line is worth nothing. With L the cables' length, d the depth of the centre of mass below the line and k
the radius of gyration about the line's direction, both ways have
    (L k^2) w^4 - g (d^2 + k^2 + L d) w^2 + g^2 d = 0
(a double pendulum's). So a body of ordinary k rolls at w with one d, and a scan over w is one over d.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.hung_by_eye import TURNS
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.parameters import INERTIAL, ParameterSet
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.start_state import Doubts, fit_start
from rig_identification.model.motion import State
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Lowest and highest frequency of rolling, as multiples of the pendulum's own. Nearer to it than the lowest
#: the two ways of swinging are one.
LOWEST, HIGHEST = 1.1, 6.0
#: Steps of a fit of start states, and what they may take of rig and devices, in tolerances.
STEPS, DOUBTED = 4, 1.0
#: Ways of rolling that are worth a fit.
TRIED = 3
#: s of the first pieces that are looked at, whole pieces: rolling dies early.
EARLY = 15.0


def line_of_hinges(rig: Rig) -> Array | None:
    """(3,) direction of the line that all body hinges lie on; None where they span a plane."""
    points = np.array([c.body_point for c in rig.cables])
    _, sizes, axes = np.linalg.svd(points - np.mean(points, axis=0))
    return None if sizes[0] <= 0.0 or sizes[1] > 1e-2 * sizes[0] else np.asarray(axes[0])


def depth_of(frequency: float, length: float, gyration: float, gravity: float) -> float:
    """Depth (m) of the centre of mass below its hinges with which a body rolls at ``frequency`` (Hz)."""
    square = (2.0 * np.pi * frequency) ** 2
    a, b = gravity * square, gravity * square * length - gravity**2
    c = -square * gyration**2 * (square * length - gravity)
    return float((-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a))


def _bodies(problem: Problem, theta: Array, line: Array, span: float) -> list[Array]:
    """Bodies on the rig as described, one for each frequency that ``span`` seconds tell from the next."""
    rig, parameters = problem.bench.rig, problem.bench.parameters
    length = float(np.mean([c.length for c in rig.cables]))
    hinges = np.mean([c.body_point for c in rig.cables], axis=0)
    own = np.sqrt(rig.gravity / length) / (2.0 * np.pi)
    rough = np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)])
    believed = parameters.elements(rough)
    mass, vertical = parameters.elements(theta)[[0, 9]]
    # Without products of inertia, as large about the vertical as fitted
    J = np.diag(believed[[4, 7, 9]]) * vertical / believed[9]
    gyration = float(np.sqrt(line @ J @ line / mass))
    out = []
    for frequency in np.arange(LOWEST * own, HIGHEST * own, 0.5 / span):
        center = hinges - [0.0, 0.0, depth_of(float(frequency), length, gyration, rig.gravity)]
        elements = np.concatenate([[mass], center, J[np.triu_indices(3)]])
        out.append(with_body(parameters, theta, parameters.start(elements)))
    return out


def with_body(parameters: ParameterSet, theta: Array, body: Array) -> Array:
    """The vector ``theta`` with another ``body``, the rig as described: its errors were bent to the first."""
    kept = np.array([0.0 if p.bounded else 1.0 for p in parameters.free]) * theta[INERTIAL:]
    return np.concatenate([body[:INERTIAL], kept])


def ways_of_rolling(problem: Problem, pieces: tuple[Run, ...], theta: Array, rest: State) -> list[Array]:
    """Vectors of bodies that roll as the ``pieces`` may show, each better than its neighbours, best first.

    theta: of a fit, from which mass and size are taken. Start states alone are fitted, with rig and devices
    doubted. Each piece is weighed by its own residual: where the noise of each is not known the likelihood is
    the product of their mean squares.
    """
    line = line_of_hinges(problem.bench.rig)
    if line is None or not any(_tell(piece) for piece in pieces):
        return []
    pieces = _early(pieces)
    span = float(np.mean([piece.grid.duration for piece in pieces]))
    bodies = _bodies(problem, theta, line, span)
    left = np.array(side_by_side(lambda body: _left(problem, pieces, body, rest), bodies))
    around = np.concatenate([[np.inf], left, [np.inf]])
    lowest = np.flatnonzero((left < around[:-2]) & (left <= around[2:]))
    return [bodies[k] for k in lowest[np.argsort(left[lowest])][:TRIED]]


def _early(pieces: tuple[Run, ...]) -> tuple[Run, ...]:
    """The first pieces, of EARLY seconds in all, one at least."""
    ends = np.cumsum([piece.grid.duration for piece in pieces])
    return pieces[: max(1, int(np.searchsorted(ends, EARLY, side="right")))]


def _tell(piece: Run) -> bool:
    """Whether a piece measures more than a turn about one's own z, which feels no rolling."""
    return any(c.quantity not in TURNS or c.axes != (2,) for c in piece.channels)


def _left(problem: Problem, pieces: tuple[Run, ...], theta: Array, rest: State) -> float:
    """The pieces' log likelihood, reversed; infinite where one cannot be followed."""
    total, doubts = 0.0, Doubts(problem.bench.parameters.size, DOUBTED)
    for piece in pieces:
        start = launch_state(problem.bench, piece, theta, rest)
        try:
            found = fit_start(
                problem.bench, piece, theta, start, iterations=STEPS, tolerance=1.0, doubted=DOUBTED
            )
        except np.linalg.LinAlgError:
            # Motions that part from each other: some combinations are known to more digits than there are
            return np.inf
        if found is None:
            return np.inf
        run = found[0]
        # Within the noise one way of rolling is as good as another
        left = max(doubts.cost(run) - run.log_spread, 0.5 * run.residual.size)
        total += 0.5 * run.residual.size * float(np.log(2.0 * left / run.residual.size))
    return total
