"""Least squares under equality constraints, with what the data leave open named, not guessed.

    minimise |r(z)|^2  subject to  f(z) = 0

The constraints hold exactly (lengths and balance), the residuals are measurements and beliefs
in units of their standard deviation. Each step of the Gauss-Newton iteration solves the linear
problem in the null space N of A = df/dz: with the particular step d0 = -pinv(A) f and G = J N,

    step = d0 + N y,   y = -pinv(G) (r + J d0), lightly damped

At the solution the covariance is N pinv(G'G) N' (Bjorck, Numerical Methods for Least Squares
Problems, section 5.1). Directions that G takes to (nearly) zero are open: parameters come in
units in which twenty are more than is possible (metres, radians, weights, tolerances), so a
singular value below 1/20 says that nothing was learned. Hardly anything moves along them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
State = TypeVar("State")

RANK = 1e-10  # relative size below which a singular value of the constraints counts as zero
OPEN = 0.05  # singular value of G below which a direction is open; a belief alone gives 1
STEPS = 100
SETTLED = 1e-10  # longest step, in the parameters' own scale, that counts as none


@dataclass(frozen=True)
class Adjusted(Generic[State]):
    """The optimum and what is known about it."""

    state: State
    covariance: Array  # (q, q) of the steps at the optimum, open directions left out
    open_directions: Array  # (q, k) orthonormal: combinations of parameters that nothing determines
    chi_squared: float
    degrees_of_freedom: int  # residuals less determined parameters
    constraint_error: float  # largest |f|
    converged: bool


def adjust(
    state: State,
    residuals: Callable[[State], tuple[Array, Array]],
    constraints: Callable[[State], tuple[Array, Array]],
    move: Callable[[State, Array], State],
    longest_step: Array,
) -> Adjusted[State]:
    """Iterate from ``state``; ``move`` applies a step (q,) of the parameters to a state.

    ``residuals`` and ``constraints`` return values and slopes (rows, q) in the step's parameters.
    ``longest_step`` (q,) shortens a step that would leave the range in which slopes mean something.
    """
    converged = False
    for _ in range(STEPS):
        step, _, _ = _step(residuals(state), constraints(state))
        excess = float(np.max(np.abs(step) / longest_step))
        state = move(state, step / max(1.0, excess))
        if float(np.abs(step).max()) < SETTLED:
            converged = True
            break
    values = residuals(state)
    constraint = constraints(state)
    _, null, reduced = _step(values, constraint)
    covariance, open_directions = _covariance(null, reduced)
    return Adjusted(
        state=state,
        covariance=covariance,
        open_directions=open_directions,
        chi_squared=float(values[0] @ values[0]),
        degrees_of_freedom=len(values[0]) - (null.shape[1] - open_directions.shape[1]),
        constraint_error=float(np.abs(constraint[0]).max()),
        converged=converged,
    )


def _step(values: tuple[Array, Array], constraint: tuple[Array, Array]) -> tuple[Array, Array, Array]:
    residual, slope = values
    error, gradient = constraint
    left, sizes, right = np.linalg.svd(gradient)
    rank = int(np.sum(sizes > RANK * sizes[0]))
    particular = -right[:rank].T @ ((left[:, :rank].T @ error) / sizes[:rank])
    null = right[rank:].T
    reduced = slope @ null
    left, sizes, right = np.linalg.svd(reduced, full_matrices=False)
    # Damping at the size that counts as open: full steps where something is known, none where not.
    gain = sizes**3 / (sizes**2 + OPEN**2) ** 2
    along = -right.T @ (gain * (left.T @ (residual + slope @ particular)))
    return particular + null @ along, null, reduced


def _covariance(null: Array, reduced: Array) -> tuple[Array, Array]:
    _, sizes, right = np.linalg.svd(reduced)
    rank = int(np.sum(sizes > OPEN))
    known = null @ right[:rank].T / sizes[:rank]
    return known @ known.T, null @ right[rank:].T
