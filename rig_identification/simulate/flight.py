"""The body's true motion under a programme of force, at nodes finer than any sensor's needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.estimate.sampling import Grid
from rig_identification.model import layout
from rig_identification.model.motion import Input, Motion, State, simulate
from rig_identification.simulate.exciter import ForceProgram
from rig_identification.simulate.true_rig import TrueRig

Array = NDArray[np.float64]

#: s; motion and force are linear or cubic between nodes to parts per million.
STEP = 0.002
#: Passes until the axes along which the force acts and the motion agree, and that agreement, N.
PASSES, AGREED = 12, 1e-6


@dataclass(frozen=True)
class Flight:
    """One run as it truly was."""

    grid: Grid
    drive: Input  # force as ideal force cells would read it, exciter frame
    motion: Motion

    def state_at(self, true: TrueRig, time: float) -> State:
        """State at any time, s, integrated from the node before."""
        node = min(int(time / self.grid.step), self.grid.nodes - 2)
        rest = time - node * self.grid.step
        if rest < 1e-9:
            return self.motion.state(node)
        force = self.drive.force[node : node + 2]
        weight = np.array([[0.0], [rest / self.grid.step]])
        short = Input(rest, force[:1] + weight * (force[1:] - force[:1]), np.zeros((2, 3)), np.zeros((2, 6)))
        return simulate(true.model, self.motion.state(node), short).state(1)


def fly(
    true: TrueRig, start: State, force: ForceProgram | None, duration: float, name: str, begin: float = 0.0
) -> Flight:
    """Motion from ``start`` over ``duration`` s. begin: s from which a push's times count.

    Raises InputError where the motion leaves every bound.
    """
    nodes = int(np.ceil(duration / STEP)) + 1
    time = np.arange(nodes, dtype=float) * STEP
    turns = np.broadcast_to(start.R_world_body, (nodes, 3, 3))
    applied, wrench = np.zeros((nodes, 3)), np.zeros((nodes, 6))
    if true.effects.push is not None:
        wrench = true.effects.push.wrench(time - begin + 0.5 * STEP)  # held: its value in the middle
    for _ in range(PASSES):
        before, applied = applied, in_exciter_frame(true, force, time, turns)
        motion = simulate(true.model, start, driven(applied, wrench))
        if not motion.complete:
            reached = STEP * motion.nodes
            raise InputError(
                f"{name}: the simulated motion leaves every bound after {reached:.3g} s; shake it less"
            )
        turns = motion.R_world_body
        if force is None or force.axes != "world" or np.max(np.abs(applied - before)) < AGREED:
            break
    return Flight(Grid(STEP, nodes), driven(applied, wrench), motion)


def driven(applied: Array, wrench: Array) -> Input:
    """Input of a measured force (N, 3) and of an unmeasured wrench (N, 6) at the nodes."""
    return Input(STEP, applied, np.asarray(np.gradient(applied, STEP, axis=0)), wrench)


def in_exciter_frame(true: TrueRig, force: ForceProgram | None, time: Array, R_world_body: Array) -> Array:
    """(N, 3) what ideal force cells read: the true force in the true exciter frame, less their gain."""
    if force is None:
        return np.zeros((time.size, 3))
    gain = true.model.physics[layout.EXCITER_GAIN]
    given: Array = np.asarray(force(time) / gain, dtype=float)
    if force.axes == "exciter":
        return given
    if force.axes == "body":
        return np.asarray(given @ true.R_body_exciter)
    if force.axes != "world":
        raise InputError(f"force: axes {force.axes!r} are unknown; give exciter, body or world")
    return np.asarray(np.einsum("nij,ni->nj", R_world_body @ true.R_body_exciter, given))
