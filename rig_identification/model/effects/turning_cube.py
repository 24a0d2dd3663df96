"""What turns a body back about the vertical does not grow in proportion: a moment with its turn's cube.

With s the sine of the turn about the world's z axis from the pose at rest, the moment about that axis is
-k s^3. What the geometry of cables does (W b1 b2 sin / h of two parallel ones) is in the model already; this
is what comes besides. k < 0 softens: a turn of amplitude a is slower than a small one by 3/8 |k| a^2 / K of
its frequency, K being the stiffness (Duffing's oscillator). Air that goes along with wide turns and hinges
that slip do that; at one frequency an inertia that grows with the square of the amplitude looks alike.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.place import REFERENCE_ROTATION, TURNING_CUBE, active


@njit(cache=True)
def add_turning_cube(physics, block, R, r):  # type: ignore[no-untyped-def]
    """Add the moment to r."""
    amount = physics[block + TURNING_CUBE]
    if not active(amount):
        return
    rest = physics[block + REFERENCE_ROTATION : block + REFERENCE_ROTATION + 9].reshape(3, 3)
    # Of R rest^T the two entries whose difference is twice the sine
    one = R[1, 0] * rest[0, 0] + R[1, 1] * rest[0, 1] + R[1, 2] * rest[0, 2]
    other = R[0, 0] * rest[1, 0] + R[0, 1] * rest[1, 1] + R[0, 2] * rest[1, 2]
    sine = 0.5 * (one - other)
    moment = -amount * sine * sine * sine
    r[3] += R[2, 0] * moment
    r[4] += R[2, 1] * moment
    r[5] += R[2, 2] * moment
