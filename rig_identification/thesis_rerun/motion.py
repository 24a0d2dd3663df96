"""The motion of a case study without noise, from the project's own forward model.

The thesis' cables are rods: they push where they must. All cases share one convention of
force (``thesis/case.py``): along world axes, at a point fixed to the body. The forward model
takes a force along body axes, so each short block is run a few times until the attitude that
turned the force is the attitude that came out.

Between nodes the model's force is linear. Linear interpolation of a curved function is too
small by h^2/12 f'' on average, so the nodes carry f - h^2/12 f'': impulse and phase are then
right to fourth order in h.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.model import layout
from rig_identification.model.body import six_elements
from rig_identification.model.motion import Input, RigModel, State, rig_model, simulate
from rig_identification.thesis.case import Case

Array = NDArray[np.float64]

#: Nodes, s, and nodes of a block: a tenth of a second, far below any rigid mode's period.
STEP = 0.005
BLOCK = 20
#: Passes over a block, and the change of force, N, at which they end; what is left is a hundredth of that.
PASSES, AGREED = 12, 1e-4
#: Sides of a jump, s.
BESIDE = 1e-9


@dataclass(frozen=True)
class CaseMotion:
    """One case as it moves: nodes from time 0 on. At a jump of force the values are those after it."""

    case: Case
    model: RigModel
    time: Array  # (N,) s
    position: Array  # (N, 3) m, datum in world
    R_world_body: Array  # (N, 3, 3)
    velocity: Array  # (N, 3) m/s, datum, world
    outputs: Array  # (N, 18 + n) raw outputs (model/layout.py)
    force: Array  # (N, 3) N, exciter's force along body axes
    held_force: Array  # (N, 3) N, the same, but at a jump the mean of both sides
    jumps: NDArray[np.int64]  # nodes at which the force jumps

    @property
    def rate(self) -> Array:
        """(N, 3) rad/s, body axes."""
        return self.outputs[:, layout.OUT_RATE : layout.OUT_RATE + 3]

    @property
    def tension(self) -> Array:
        """(N, n) N; negative where a rod pushes."""
        return self.outputs[:, layout.OUT_TENSION :]

    @property
    def least_tension(self) -> float:
        """N: below zero a rope would have gone slack."""
        return float(np.min(self.tension))

    @property
    def center(self) -> Array:
        """(N, 3) m, centre of mass in world."""
        return np.asarray(self.position + self.R_world_body @ self.case.center_of_mass)

    @property
    def specific_force(self) -> Array:
        """(N, 3) m/s^2, of the centre of mass, body axes: what an accelerometer there would read."""
        first = layout.OUT_SPECIFIC_FORCE
        alpha = self.outputs[:, layout.OUT_ANGULAR_ACCELERATION : layout.OUT_ANGULAR_ACCELERATION + 3]
        c, w = self.case.center_of_mass, self.rate
        return np.asarray(
            self.outputs[:, first : first + 3] + np.cross(alpha, c) + np.cross(w, np.cross(w, c))
        )

    @property
    def acceleration(self) -> Array:
        """(N, 3) m/s^2, of the centre of mass, world."""
        gravity = self.model.physics[layout.GRAVITY : layout.GRAVITY + 3]
        return np.asarray(np.einsum("nij,nj->ni", self.R_world_body, self.specific_force) + gravity)

    def samples(self, window: tuple[float, float] | None = None) -> NDArray[np.int64]:
        """Nodes at which the thesis samples, within its window of identification or another one, s."""
        every = round(self.case.sampling / STEP)
        first, last = (round(edge / STEP) for edge in (window or self.case.window))
        return np.arange(first, min(last, self.time.size - 1) + 1, every)


def case_elements(case: Case, inertia: Array | None = None) -> Array:
    """(10,) m, c, J about the centre of mass; ``inertia`` (3, 3) in place of the case's."""
    tensor = case.inertia if inertia is None else inertia
    return np.concatenate([[case.mass], case.center_of_mass, six_elements(tensor)])


def fly_case(
    case: Case,
    *,
    inertia: Array | None = None,
    duration: float | None = None,
    agreed: float = AGREED,
    substeps: int | None = None,
) -> CaseMotion:
    """Motion of a case over ``duration`` s (its own length where None), from rest in its initial pose.

    inertia (3, 3) kg m^2 in place of the case's: the motion that an identified tensor predicts.
    agreed: change of force, N, at which the passes over a block end. substeps: integration steps between
    two nodes, where the model's own choice is finer than needed.
    Raises InputError where the motion leaves every bound.
    """
    model = rig_model(case.rig, case_elements(case, inertia), rods=True)
    nodes = round((duration or case.duration) / STEP) + 1
    turn = Rotation.from_quat(case.orientation).as_matrix()
    state = State(np.array(case.position, dtype=float), turn, np.zeros(3), np.zeros(3))
    states, rotations = np.zeros((nodes, 12)), np.zeros((nodes, 3, 3))
    out = np.zeros((nodes, layout.OUT_TENSION + model.cables))
    force, held = np.zeros((nodes, 3)), np.zeros((nodes, 3))
    jumps = _jumps(case, nodes)
    edges = _edges(nodes, jumps)
    alpha, jerk = np.zeros(3), np.zeros(3)
    for first, last in pairwise(edges):
        here = slice(first, last + 1)
        motion, plain = _block(case, model, state, (alpha, jerk), first, last, agreed, substeps)
        held[first] = 0.5 * (held[first] + plain[0]) if first in jumps else plain[0]
        held[first + 1 : last + 1] = plain[1:]
        states[here], rotations[here], out[here] = motion.states, motion.R_world_body, motion.outputs
        force[here], state = plain, motion.state(last - first)
        turning = out[here, layout.OUT_ANGULAR_ACCELERATION : layout.OUT_ANGULAR_ACCELERATION + 3]
        alpha, jerk = turning[-1], (turning[-1] - turning[-2]) / STEP
    return CaseMotion(
        case,
        model,
        STEP * np.arange(nodes, dtype=float),
        states[:, :3],
        rotations,
        states[:, 6:9],
        out,
        force,
        held,
        jumps,
    )


def _jumps(case: Case, nodes: int) -> NDArray[np.int64]:
    """Nodes at which the force jumps; a force that acts from the first instant on does not."""
    found = np.array([round(t / STEP) for t in case.force.breaks], dtype=np.int64)
    return found[(found > 0) & (found < nodes - 1)]


def _edges(nodes: int, jumps: NDArray[np.int64]) -> list[int]:
    """First and last nodes of the blocks; none reaches across a jump."""
    outer = [0, *jumps.tolist(), nodes - 1]
    edges = [0]
    for first, last in pairwise(outer):
        count = max(1, round((last - first) / BLOCK))
        edges += np.rint(np.linspace(first, last, count + 1)).astype(int)[1:].tolist()
    return edges


def _block(  # type: ignore[no-untyped-def]
    case: Case,
    model: RigModel,
    state: State,
    turning: tuple[Array, Array],
    first: int,
    last: int,
    agreed: float,
    substeps: int | None,
):
    """(motion, force (k, 3)) of one block.

    turning ((3,) rad/s^2, (3,) rad/s^3), body axes: angular acceleration with which it begins and its rate,
    or guesses of them.
    """
    time = STEP * np.arange(first, last + 1)
    inside = time.copy()
    inside[-1] -= BESIDE
    drive = Input.none(time.size, STEP)
    passed = time - time[0]
    alpha, jerk = turning
    turned = np.outer(passed, state.rate) + np.outer(passed**2 / 2.0, alpha) + np.outer(passed**3 / 6.0, jerk)
    turns = state.R_world_body @ Rotation.from_rotvec(turned).as_matrix()
    force = np.zeros((time.size, 3))
    for _ in range(PASSES):
        before, force = force, _along_body(case, inside, turns)
        motion = simulate(
            model, state, replace(drive, force=force, middle=_between(force)), substeps=substeps
        )
        if not motion.complete:
            raise InputError(f"case {case.label}: the motion leaves every bound at {time[0]:.1f} s")
        turns = motion.R_world_body
        if np.max(np.abs(force - before)) < agreed or case.force.axes == "body":
            break
    return motion, force


def _along_body(case: Case, time: Array, turns: Array) -> Array:
    force = case.force(time)
    return force if case.force.axes == "body" else np.asarray(np.einsum("nji,nj->ni", turns, force))


def _between(force: Array) -> Array:
    """(k, 3) N: the smooth function through ``force`` (k, 3) midway to the next node, beyond the line."""
    out = np.zeros_like(force)
    if len(force) < 3:
        return out
    bend = force[2:] - 2.0 * force[1:-1] + force[:-2]
    bend = np.concatenate([bend[:1], bend, bend[-1:]])
    out[:-1] = -(bend[:-1] + bend[1:]) / 16.0
    return out
