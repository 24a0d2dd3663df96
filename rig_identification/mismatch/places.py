"""Effects that act at some place of the body: the place at which they explain most, to first order.

A hose's force follows the motion of the point that it pulls at and turns the body about an arm to that point;
a rider feels the acceleration of its place and pushes there. Columns of such amounts are polynomials of
second degree in the place u, given from the body's middle in units of some spread: with ten of them for each
amount every place of the body is tried at the price of a few. About the middle alone a hose at a corner
promises next to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import Motion, RigModel

Array = NDArray[np.float64]

#: Places tried along each axis at first, and about the best of them in each of so many finer rounds.
COARSE, FINE, ROUNDS = 9, 5, 3
#: Monomials of a place up to the second degree.
TERMS = 10


def monomials(u: Array) -> Array:
    """(..., TERMS) of places ``u`` (..., 3)."""
    x, y, z = u[..., 0], u[..., 1], u[..., 2]
    return np.stack([np.ones_like(x), x, y, z, x * x, y * y, z * z, x * y, x * z, y * z], axis=-1)


def multiplied(a: Array, b: Array) -> Array:
    """(N, TERMS) product of numbers (N, 4) or (4,) that are linear in a place: constant, then slopes."""
    out = np.empty((max(a.shape, b.shape, key=len)[0], TERMS))
    a, b = a.T, b.T
    out[:, 0] = a[0] * b[0]
    for i in range(1, 4):
        out[:, i] = a[0] * b[i] + a[i] * b[0]
        out[:, 3 + i] = a[i] * b[i]
    for term, (i, j) in enumerate(combinations(range(1, 4), 2), start=7):
        out[:, term] = a[i] * b[j] + a[j] * b[i]
    return out


def crossed(a: Array, b: Array) -> Array:
    """(N, 3, TERMS) cross product of vectors (N, 3, 4) that are linear in a place: constant, then slopes."""

    def component(i: int, j: int) -> Array:
        return multiplied(a[:, i], b[:, j]) - multiplied(a[:, j], b[:, i])

    return np.stack([component(1, 2), component(2, 0), component(0, 1)], axis=1)


def lines(nodes: int, middle: Array, spread: float) -> Array:
    """(nodes, 3, 4) the place itself: ``middle`` and ``spread`` times u."""
    return np.broadcast_to(np.column_stack([middle, spread * np.eye(3)]), (nodes, 3, 4))


def travel(model: RigModel, motion: Motion, at: Array) -> Array:
    """(N, 3, 4) m: how far a place of the body is from where it hangs at rest, along world axes.

    at: (N, 3, 4), the place as :func:`lines` gives it.
    """
    block = layout.effects_offset(model.cables)
    home = model.physics[block + place.REFERENCE_POSITION :][:3]
    turn = model.physics[block + place.REFERENCE_ROTATION :][:9].reshape(3, 3)
    moved = (motion.R_world_body - turn) @ at
    moved[..., 0] += motion.outputs[:, layout.OUT_POSITION : layout.OUT_POSITION + 3]
    moved[..., 0] -= home
    return np.asarray(moved)


def travel_of(model: RigModel, motion: Motion, at: Array) -> Array:
    """(N, 3) m: the same of one place ``at`` (3,) m."""
    return np.asarray(travel(model, motion, lines(motion.outputs.shape[0], at, 0.0))[..., 0])


def placed_wrench(force: Array, at: Array) -> Array:
    """(N, 6, TERMS) wrench about the datum of a ``force`` (N, 3, 4) at the place ``at`` (N, 3, 4)."""
    out = np.zeros((force.shape[0], 6, TERMS))
    out[:, :3, :4] = force
    out[:, 3:] = crossed(at, force)
    return out


def design() -> Array:
    """(TERMS, 3) places from which all coefficients of the monomials follow."""
    unit = np.eye(3)
    pairs = [unit[i] + unit[j] for i, j in combinations(range(3), 2)]
    return np.array([np.zeros(3), *unit, *(-unit), *pairs])


@dataclass(frozen=True)
class Best:
    """The best place of some amounts."""

    gain: float  # nats
    positive: float  # nats of it that what cannot be negative adds, there, to what has either sign
    place: Array  # (3,) as given to ``monomials``
    amounts: Array  # (a,)

    @property
    def weights(self) -> Array:
        """(a * TERMS,) of the columns."""
        return np.outer(self.amounts, monomials(self.place)).ravel()


def best_place(
    matrix: Array, right: Array, prior: Array, positive: int, spread: float, reach: float
) -> Best | None:
    """The place that explains most; None where nothing positive does.

    matrix (a, TERMS, a, TERMS), right (a, TERMS): information and gradient of the columns with everything
    else eliminated. prior (a,): precisions of the amounts; the first ``positive`` cannot be negative.
    spread: std of a place about the middle. reach: places lie within so much of it along each axis.
    """
    line = np.linspace(-reach, reach, COARSE)
    center, step = np.zeros(3), line[1] - line[0]
    best: Best | None = None
    for _ in range(1 + ROUNDS):
        grid = center + np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
        grid = np.clip(grid, -reach, reach)
        found = _best_of(grid, matrix, right, prior, positive, spread)
        if found is None:
            return best
        best = found if best is None or found.gain > best.gain else best
        center, line = best.place, np.linspace(-step, step, FINE)
        step = line[1] - line[0]
    return best


def _best_of(
    grid: Array, matrix: Array, right: Array, prior: Array, positive: int, spread: float
) -> Best | None:
    count = right.shape[0]
    terms = monomials(grid)
    M = np.einsum("pi,aibj,pj->pab", terms, matrix, terms, optimize=True) + np.diag(prior)
    r = terms @ right.T
    gains, amounts = np.full(grid.shape[0], -np.inf), np.zeros(r.shape)
    rest = list(range(positive, count))
    x = np.linalg.solve(M[:, rest][:, :, rest], r[:, rest, None])[..., 0]
    without = 0.5 * np.sum(x * r[:, rest], axis=1)
    for kept in range(1, positive + 1):
        for some in combinations(range(positive), kept):
            chosen = [*some, *rest]
            x = np.linalg.solve(M[:, chosen][:, :, chosen], r[:, chosen, None])[..., 0]
            gain = 0.5 * np.sum(x * r[:, chosen], axis=1)
            better = np.all(x[:, :kept] > 0.0, axis=1) & (gain > gains)
            gains[better] = gain[better]
            amounts[better] = 0.0
            amounts[np.ix_(better, chosen)] = x[better]
    added = gains - without
    gains -= 0.5 * np.sum(grid**2, axis=1) / spread**2
    at = int(np.argmax(gains))
    if not np.isfinite(gains[at]):
        return None
    return Best(float(gains[at]), float(added[at]), grid[at], amounts[at])
