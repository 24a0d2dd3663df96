"""Effects, one a file; :data:`CATALOGUE` holds the contract's table, :data:`OUTSIDE` what is not in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bench.concealed.effects.base import Effect

if TYPE_CHECKING:
    from bench.concealed.scene import Scene

CATALOGUE: dict[str, type[Effect]] = {}
OUTSIDE: dict[str, type[Effect]] = {}


def draw_effects(rng: np.random.Generator, scene: Scene, kind: str, size: float | None) -> list[Effect]:
    """The effects that ``kind`` asks for, of random place and, if ``size`` is None, of random size."""
    if kind == "clean":
        return []
    raise ValueError(f"unknown kind of session: {kind!r}")
