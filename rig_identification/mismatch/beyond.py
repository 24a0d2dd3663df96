"""What columns that stand in no model say beyond all that is free anyway: the Schur complement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from rig_identification.estimate.solve import Evaluation
from rig_identification.model.definite import definite

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Columns:
    """Columns of a whitened Jacobian with all that is free anyway eliminated."""

    seen: Array  # (b, c): scaled base against columns
    solved: Array  # (b, c): what of them the base takes
    right: Array  # (c,): gradient that is left

    def part(self, chosen: slice) -> Columns:
        """Some of the columns."""
        return Columns(self.seen[:, chosen], self.solved[:, chosen], self.right[chosen])

    @classmethod
    def mixed(cls, several: Sequence[Columns], shares: Sequence[float]) -> Columns:
        """The sum of ``several`` sets of as many columns, each by its share."""
        pairs = list(zip(shares, several, strict=True))
        return cls(
            np.sum([w * c.seen for w, c in pairs], axis=0),
            np.sum([w * c.solved for w, c in pairs], axis=0),
            np.sum([w * c.right for w, c in pairs], axis=0),
        )

    def information(self, rows: Sequence[Array]) -> Array:
        """(c, c) information that is left of these columns, which are ``rows`` (m, c) wherever they show."""
        return np.asarray(sum(own.T @ own for own in rows) - self.seen.T @ self.solved)


class Beyond:
    """A linearised problem of which the unknowns ``base`` are free.

    full: Evaluation whose unknowns are ``size`` parameters and then each run's start. base (b,): indices.
    """

    def __init__(self, full: Evaluation, base: NDArray[np.int64], size: int) -> None:
        self.full, self.base, self.size = full, base, size
        self._scale = 1.0 / np.sqrt(np.maximum(np.diag(full.information)[base], 1e-300))
        inside = full.information[np.ix_(base, base)] * np.outer(self._scale, self._scale)
        self._factor = cho_factor(definite(inside + 1e-12 * np.eye(base.size)))

    def of(self, runs: Sequence[Array | None], rests: Sequence[Array] = ()) -> Columns:
        """Columns (m, c) of every run, None where they do not show, and of every rest pose where they do."""
        count, place = next(columns.shape[1] for columns in runs if columns is not None), self.size
        cross, gradient = np.zeros((self.full.information.shape[0], count)), np.zeros(count)
        for run, columns in zip(self.full.runs, runs, strict=True):
            starts = run.jacobian.shape[1] - self.size
            if columns is not None:
                rows = np.concatenate([np.arange(self.size), np.arange(place, place + starts)])
                cross[rows] += run.jacobian.T @ columns
                gradient += columns.T @ run.residual
            place += starts
        for rest, columns in zip(self.full.rests, rests, strict=False):
            cross[: self.size] += rest.jacobian.T @ columns
            gradient += columns.T @ rest.residual
        return self.of_sums(cross, gradient)

    def of_sums(self, cross: Array, gradient: Array) -> Columns:
        """Columns of which sums over the rows in which they show are known.

        cross (unknowns, c): of all unknowns' columns with these. gradient (c,).
        """
        seen = self._scale[:, None] * cross[self.base]
        solved = cho_solve(self._factor, seen)
        own = self._scale * self.full.gradient[self.base]
        return Columns(seen, solved, gradient - solved.T @ own)

    def bent_by(self, columns: Columns) -> Array:
        """(b, c) by how much the base's unknowns give way to each of ``columns``, in their own units."""
        return np.asarray(-self._scale[:, None] * columns.solved)

    def within(self, own: NDArray[np.int64]) -> Array:
        """(c, c) information left of the problem's unknowns ``own`` (c,), none of them in the base."""
        seen = self._scale[:, None] * self.full.information[np.ix_(self.base, own)]
        return np.asarray(self.full.information[np.ix_(own, own)] - seen.T @ cho_solve(self._factor, seen))

    def left_of(self, own: NDArray[np.int64]) -> Array:
        """(c, c) information left of the base's unknowns ``own`` (c,), all others of it eliminated."""
        at = np.searchsorted(self.base, own)
        chosen = np.zeros((self.base.size, own.size))
        chosen[at, np.arange(own.size)] = self._scale[at]
        return np.asarray(np.linalg.inv(chosen.T @ cho_solve(self._factor, chosen)))

    def residuals(self, columns: Columns, amounts: Array, runs: Sequence[Array]) -> list[Array]:
        """Residuals (m,) of every run after the best step with ``amounts`` (c,) of the columns ``runs``."""
        rest = self._scale * self.full.gradient[self.base] - columns.seen @ amounts
        step = np.zeros(self.full.information.shape[0])
        step[self.base] = self._scale * cho_solve(self._factor, rest)
        out, place = [], self.size
        for run, own in zip(self.full.runs, runs, strict=True):
            end = place + run.jacobian.shape[1] - self.size
            change = np.concatenate([step[: self.size], step[place:end]])
            out.append(run.residual - run.jacobian @ change - own @ amounts)
            place = end
        return out
