"""Inverse dynamics: the wrench with which a body goes on moving as it does once its model changes."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rig_identification.model import layout
from rig_identification.model.dynamics import assemble
from rig_identification.model.integrate import solve
from rig_identification.model.motion import Input, Motion, RigModel

Array = NDArray[np.float64]


@njit(cache=True, nogil=True)
def _missing(old, new, modes, mount, x, wide, R, forces, wrenches, internal, out):  # type: ignore[no-untyped-def]
    """out (N, 6): what wrench the ``new`` model lacks at every node to accelerate as the ``old`` one does.

    old, new: physics. x (N, X), wide (N, Y): local states for either. wrenches (N, 6): of the old model.
    internal: of how many internal coordinates the old model knows the acceleration.
    """
    n = modes.shape[0]
    more = (wide.shape[1] - layout.BODY_STATE) // 2
    size, larger = 6 + n + internal, 6 + n + more
    K, r, z = np.empty((size, size)), np.empty(size), np.empty(size)
    inverse = np.empty((0, 0))
    L, s = np.empty((larger, larger)), np.empty(larger)
    none = np.zeros(6)
    for k in range(x.shape[0]):
        out[k] = 0.0
        if not solve(old, modes, mount, x[k], R[k], forces[k], wrenches[k], K, r, inverse, z):
            continue
        assemble(new, modes, mount, wide[k], R[k], forces[k], none, L, s)
        for i in range(6):
            # What is new within the rig is taken to stay where it is
            total = -s[i] - wrenches[k, i]
            for j in range(size):
                total += L[i, j] * z[j]
            out[k, i] = total


def kept_in_motion(old: RigModel, motion: Motion, drive: Input, new: RigModel) -> Array:
    """(N, 6) the wrench under which the ``new`` model moves as the ``old`` one did under ``drive``.

    Force N and moment N m about the datum, body axes, held over each node interval: w = K z - r of the new
    model at the old one's accelerations and tensions z (dynamics.py). Where cables are something else in the
    new model, their tensions are no longer what they were, and the wrench stays that of ``drive``.
    """
    if not np.array_equal(old.modes, new.modes):
        return drive.wrench
    x = motion.states
    wide = np.zeros((x.shape[0], new.states))
    inner, more = (x.shape[1] - layout.BODY_STATE) // 2, (new.states - layout.BODY_STATE) // 2
    kept = min(inner, more)
    wide[:, : layout.BODY_STATE] = x[:, : layout.BODY_STATE]
    wide[:, layout.BODY_STATE :][:, :kept] = x[:, layout.BODY_STATE :][:, :kept]
    wide[:, layout.BODY_STATE + more :][:, :kept] = x[:, layout.BODY_STATE + inner :][:, :kept]
    missing = np.empty((x.shape[0], 6))
    _missing(
        old.physics,
        new.physics,
        old.modes,
        old.exciter_orientation,
        np.ascontiguousarray(x),
        wide,
        np.ascontiguousarray(motion.R_world_body),
        np.ascontiguousarray(drive.force),
        np.ascontiguousarray(drive.wrench),
        inner,
        missing,
    )
    # At a node, and held over the interval after it
    ahead = np.concatenate([missing[1:], missing[-1:]])
    return np.asarray(drive.wrench + 0.5 * (missing + ahead))
