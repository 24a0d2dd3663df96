"""Moments in the cables' hinges, for any law between rate and moment."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bench.concealed.effects.base import State
from bench.concealed.kinematics import hinge_moments_on_body, hinge_rates
from bench.concealed.scene import Array, Geometry


class HingeMoments:
    """Force on the body of moments at the hinges of massless cables.

    A massless cable passes the moment about its own axis on: it spins at half the body's twist where both
    hinges follow the same law, and with the body where only the one at the body resists.
    """

    def __init__(self, geometry: Geometry, law: Callable[[Array], Array], at_ceiling: bool = True) -> None:
        """``law`` gives moments (cables, 3) in N m on what turns at relative rates (cables, 3) in rad/s."""
        self._ceiling = np.ascontiguousarray(geometry.ceiling)
        self._hinge = np.ascontiguousarray(geometry.hinge)
        self._law, self._at_ceiling = law, at_ceiling

    def __call__(self, state: State) -> Array:
        """(6,) generalised force, as :meth:`Effect.force`."""
        place = (self._ceiling, self._hinge, state.position, state.rotation)
        follow = 0.5 if self._at_ceiling else 1.0
        top, bottom = hinge_rates(*place, state.velocity, state.rate, follow)
        on_cable = self._law(top) if self._at_ceiling else np.zeros_like(top)
        return np.asarray(hinge_moments_on_body(*place, on_cable, self._law(bottom)))
