"""A hose or wire pulls: a spring between a point of the body and the room.

Loose in a loop, or held from both sides, it is a spring along each world axis: F = F0 - K (q - q0), q being
the point on the body, q0 where it hangs at rest (a constant of the session), F0 the pull at rest.

Taut, it runs from q to a point w = q0 + c of the room, c being its reach: F = T (w - q)/l with l = |w - q|
and T = max(0, T0 + k (l - |c|) + b dl/dt). It turns with the body, resists sideways by T/l, and what pulls
does not push: a body that swings towards the wall by more than T0/k hangs free there. T0 and k are what F0
and K have along c; a preload adds to T0.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.model.effects.place import (
    TETHER_DAMPING,
    TETHER_POINT,
    TETHER_PRELOAD,
    TETHER_PULL,
    TETHER_REACH,
    TETHER_STIFFNESS,
    active,
)
from rig_identification.model.effects.point import push_at, travel, velocity_of


@njit(cache=True)
def add_tether(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add the tether's pull to r."""
    on = False
    for i in range(3):
        on = on or active(physics[block + TETHER_STIFFNESS + i]) or active(physics[block + TETHER_PULL + i])
    if not on:
        return
    ux, uy, uz = travel(physics, block, TETHER_POINT, x, R)
    c, k, p = block + TETHER_REACH, block + TETHER_STIFFNESS, block + TETHER_PULL
    cx, cy, cz = physics[c], physics[c + 1], physics[c + 2]
    reach = np.sqrt(cx * cx + cy * cy + cz * cz)
    if reach.real == 0.0:
        wx = physics[p] - physics[k] * ux
        wy = physics[p + 1] - physics[k + 1] * uy
        wz = physics[p + 2] - physics[k + 2] * uz
    else:
        sx, sy, sz = cx / reach, cy / reach, cz / reach
        stiffness = physics[k] * sx * sx + physics[k + 1] * sy * sy + physics[k + 2] * sz * sz
        pull = physics[p] * sx + physics[p + 1] * sy + physics[p + 2] * sz
        pull += physics[block + TETHER_PRELOAD]
        dx, dy, dz = cx - ux, cy - uy, cz - uz
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        tension = pull + stiffness * (length - reach)
        if active(physics[block + TETHER_DAMPING]):
            vx, vy, vz = velocity_of(physics, block + TETHER_POINT, x, R)
            tension -= physics[block + TETHER_DAMPING] * (vx * dx + vy * dy + vz * dz) / length
        if tension.real <= 0.0:
            return
        wx, wy, wz = tension * dx / length, tension * dy / length, tension * dz / length
    push_at(physics, block + TETHER_POINT, R, wx, wy, wz, r)
