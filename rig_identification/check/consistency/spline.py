"""A cubic spline of the pose over a run's instants, fitted to readings by linear least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from rig_identification.check.consistency.reduced import PER_SPAN

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """Readings of one kind about a trajectory: what is missed, and slopes by pose, velocity, acceleration."""

    name: str
    miss: Array  # (N, w), NaN where not measured
    slopes: tuple[Array | None, Array | None, Array | None]  # (N, w, 6) each
    std: Array  # (w,)
    spread: Array  # (w,) std of the readings themselves
    constant_std: Array  # (w,) what a reading may be off by throughout


class Spline:
    """Cubic B-spline of six numbers over a run's evenly spaced instants, and its least squares.

    Each span between two knots holds ``PER_SPAN`` instants, so that what one span adds to the normal
    equations is one product of matrices.
    """

    def __init__(self, instants: int, step: float, away: Array) -> None:
        self.away = away
        self.spans = instants // PER_SPAN
        self.count = self.spans + 3
        h = PER_SPAN * step
        s = (np.arange(PER_SPAN) + 0.5) / PER_SPAN
        self.basis = (
            np.stack([(1 - s) ** 3, 3 * s**3 - 6 * s**2 + 4, -3 * s**3 + 3 * s**2 + 3 * s + 1, s**3], 1)
            / 6.0,
            np.stack([-((1 - s) ** 2), 3 * s**2 - 4 * s, -3 * s**2 + 2 * s + 1, s**2], 1) / (2.0 * h),
            np.stack([1 - s, 3 * s - 2, -3 * s + 1, s], 1) / h**2,
        )
        # Lower band storage: entry (row, column) of the matrix stands at [row - column, column]
        row = np.arange(24)[:, None] + np.arange(6)
        self._block, self._row = np.minimum(row // 6, 4), row % 6

    def rows(self, block: Block) -> Array:
        """(spans, PER_SPAN w, 24) slopes by the four knots' numbers about each span, over the std."""
        w = block.std.size
        total = np.zeros((self.spans, PER_SPAN, w, 4, 6))
        for slope, basis in zip(block.slopes, self.basis, strict=True):
            if slope is not None:
                parts = slope.reshape(self.spans, PER_SPAN, w, 1, 6)
                total += parts * basis[None, :, None, :, None]
        known = np.isfinite(block.miss).reshape(self.spans, PER_SPAN, w)
        total *= (known / block.std)[..., None, None]
        return total.reshape(self.spans, PER_SPAN * w, 24)

    def solve(self, blocks: list[Block]) -> tuple[tuple[Array, Array, Array], dict[str, Array]]:
        """Changes of pose, velocity and acceleration (N, 6) each, and each block's constants (w,)."""
        widths = [b.std.size for b in blocks]
        starts = np.cumsum([0, *widths])
        rows = np.concatenate([self.rows(b) for b in blocks], axis=1)
        miss = np.concatenate([self._sharp(b) for b in blocks], axis=1)
        ones = np.concatenate([self._ones(b, starts, k) for k, b in enumerate(blocks)], axis=1)
        transposed = np.swapaxes(rows, 1, 2)
        gram, right = transposed @ rows, transposed @ np.concatenate([miss[..., None], ones], axis=2)
        prior = np.concatenate([1.0 / b.constant_std**2 for b in blocks])
        corner = np.einsum("smk,smk->k", ones, ones) + prior
        right_constant = np.einsum("smk,sm->k", ones, miss)
        factor = (cholesky_banded(self._banded(gram), lower=True), True)
        edge = self._scattered(right)
        through = cho_solve_banded(factor, edge)
        schur = np.diag(corner * (1.0 + 1e-9)) - edge[:, 1:].T @ through[:, 1:]
        constant = np.linalg.solve(schur, right_constant - edge[:, 1:].T @ through[:, 0])
        knots = (through[:, 0] - through[:, 1:] @ constant).reshape(self.count, 6)
        near = np.stack([knots[k : k + self.spans] for k in range(4)], axis=1)
        change = [np.einsum("pk,skd->spd", basis, near).reshape(-1, 6) for basis in self.basis]
        constants = {b.name: constant[s : s + w] for b, s, w in zip(blocks, starts, widths, strict=False)}
        return (change[0], change[1], change[2]), constants

    def _sharp(self, block: Block) -> Array:
        """(spans, PER_SPAN w) what is missed over its std."""
        miss = np.where(np.isfinite(block.miss), block.miss, 0.0) / block.std
        return np.asarray(miss.reshape(self.spans, -1))

    def _ones(self, block: Block, starts: NDArray[np.intp], k: int) -> Array:
        """(spans, PER_SPAN w, constants) slopes by the constants of all blocks."""
        w = block.std.size
        out = np.zeros((self.spans, PER_SPAN, w, int(starts[-1])))
        known = np.isfinite(block.miss).reshape(self.spans, PER_SPAN, w) / block.std
        for j in range(w):
            out[:, :, j, int(starts[k]) + j] = known[:, :, j]
        return out.reshape(self.spans, PER_SPAN * w, -1)

    def _scattered(self, by_span: Array) -> Array:
        """(6 count, m) from (spans, 24, m): what each span has of its four knots."""
        out = np.zeros((self.count, 6, by_span.shape[2]))
        for k in range(4):
            out[k : k + self.spans] += by_span[:, 6 * k : 6 * k + 6]
        return out.reshape(6 * self.count, -1)

    def _banded(self, gram: Array) -> Array:
        """Lower band of the normal matrix, with the belief that the body stays near rest."""
        blocks = np.zeros((self.count, 5, 6, 6))
        for low in range(4):
            for high in range(low, 4):
                part = gram[:, 6 * high : 6 * high + 6, 6 * low : 6 * low + 6]
                blocks[low : low + self.spans, high - low] += part
        blocks[:, 0] += np.diag(1.0 / self.away**2)
        band = blocks[:, self._block, self._row, np.arange(6)]
        return np.ascontiguousarray(np.moveaxis(band, 1, 0).reshape(24, 6 * self.count))
