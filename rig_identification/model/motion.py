"""The forward model as a person calls it: a rig, a start, an input; out come motion and derivatives."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.model import layout, work
from rig_identification.model.body import linear_from_elements
from rig_identification.model.constraints import project_columns, project_state
from rig_identification.model.effects.own import code_of
from rig_identification.model.effects.place import (
    CREEP,
    EFFECTS_SIZE,
    HINGE_TWIST,
    LAW_ACROSS,
    LAW_UPRIGHT,
    LINEAR_DENSITY,
    REFERENCE_POSITION,
    REFERENCE_ROTATION,
    SHARING,
    internal_block,
    own_block,
)
from rig_identification.model.integrate import accumulate, propagate
from rig_identification.model.substeps import FINE_STEP, FIT_STEP, hanging, substeps_for
from rig_identification.own import own_effects
from rig_identification.rig import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigModel:
    """Numbers that the motion depends on (layout.py), and what each cable is."""

    physics: Array  # (P,)
    modes: NDArray[np.int64]  # (n,) RIGID, ELASTIC, ELASTIC_ROD or SLACK at the start
    can_slacken: NDArray[np.bool_]  # (n,) rigid cables that let go instead of pushing
    exciter_orientation: Array  # (3, 3) rotates exciter-frame vectors into body

    @property
    def cables(self) -> int:
        """Number of cables."""
        return int(self.modes.size)

    @property
    def internal(self) -> int:
        """Number of internal coordinates (effects/internal.py)."""
        return int((self.physics.size - internal_block(self.cables, 0)) // layout.INTERNAL_SIZE)

    @property
    def states(self) -> int:
        """Length of the local state."""
        return layout.BODY_STATE + 2 * self.internal

    def cable_numbers(self) -> Array:
        """(n, CABLE_SIZE) numbers of each cable, see layout.py."""
        first = layout.cable_offset(0)
        return self.physics[first : first + self.cables * layout.CABLE_SIZE].reshape(self.cables, -1)

    def with_internal(self, blocks: Array) -> RigModel:
        """The same rig with further internal coordinates. blocks (s, INTERNAL_SIZE): see layout.py.

        A leader counts from the first of the blocks given.
        """
        added = np.array(blocks, dtype=float)
        added[:, layout.LEADER] += self.internal
        return self.with_physics(np.concatenate([self.physics, added.ravel()]))

    def referred(self, rest: State) -> RigModel:
        """The same rig with ``rest`` written where effects that know a pose of rest look for it."""
        physics, block = self.physics.copy(), layout.effects_offset(self.cables)
        physics[block + REFERENCE_POSITION : block + REFERENCE_POSITION + 3] = rest.position
        physics[block + REFERENCE_ROTATION : block + REFERENCE_ROTATION + 9] = rest.R_world_body.ravel()
        return self.with_physics(physics)

    def with_physics(self, physics: Array) -> RigModel:
        """The same rig with other numbers."""
        return replace(self, physics=np.ascontiguousarray(physics, dtype=float))


#: Softness (m/s^2 per N) of rigid cables of which more than needed hold the body. It moves nothing that can
#: be measured (3e-7 m/s^2 under 3 kN; lengths are restored at each step) and makes their shares
#: of the load the smallest ones instead of undefined.
SOFTNESS = 1e-10


def redundant(rig: Rig) -> bool:
    """Whether more cables hold the body than it takes: lines of force dependent near the design pose."""
    ceiling = np.array([c.ceiling_point for c in rig.cables])
    body = np.array([c.body_point for c in rig.cables])
    along = hanging(ceiling, body, np.array([c.length for c in rig.cables]))
    arm = body - np.mean(body, axis=0)
    lines = np.concatenate([along, np.cross(arm / max(float(np.max(np.abs(arm))), 1e-9), along)], axis=1)
    if lines.shape[0] > 6:
        return True
    strengths = np.linalg.svd(lines, compute_uv=False)
    return bool(strengths[-1] < 1e-3 * strengths[0])


#: Rate (rad/s) at which dry hinges are believed to creep.
CREEP_RATE = 1e-3


def rig_model(
    rig: Rig, elements: Array, *, axial_stiffness: float | None = None, rods: bool = False
) -> RigModel:
    """Forward model of a described rig carrying a body.

    elements (10,): m, c, J about the centre of mass (see body.py). axial_stiffness: EA in N;
    None: inextensible. rods: cables may push as well (the thesis' rods).
    """
    n = len(rig.cables)
    physics = np.zeros(layout.effects_offset(n) + EFFECTS_SIZE)
    physics[layout.GRAVITY : layout.GRAVITY + 3] = (0.0, 0.0, -rig.gravity)
    physics[layout.INERTIAL : layout.INERTIAL + 10] = linear_from_elements(np.asarray(elements, dtype=float))
    physics[layout.EXCITER_GAIN] = 1.0
    orientation = np.eye(3)
    if rig.exciter is not None:
        physics[layout.EXCITER_POSITION : layout.EXCITER_POSITION + 3] = rig.exciter.position
        orientation = Rotation.from_quat(rig.exciter.orientation).as_matrix()
    for i, cable in enumerate(rig.cables):
        o = layout.cable_offset(i)
        physics[o + layout.CEILING_POINT : o + layout.CEILING_POINT + 3] = cable.ceiling_point
        physics[o + layout.BODY_POINT : o + layout.BODY_POINT + 3] = cable.body_point
        physics[o + layout.LENGTH] = cable.length
        physics[o + layout.CELL_AT_CEILING] = float(cable.load_cell == "ceiling")
        physics[o + layout.AXIAL_STIFFNESS] = axial_stiffness or 0.0
    physics[layout.effects_offset(n) + CREEP] = CREEP_RATE
    physics[layout.effects_offset(n) + HINGE_TWIST] = 1.0
    physics[layout.effects_offset(n) + LAW_UPRIGHT] = 1.0
    physics[layout.effects_offset(n) + LAW_ACROSS] = 1.0
    physics[layout.effects_offset(n) + LINEAR_DENSITY] = rig.cable_linear_density or 0.0
    physics[layout.effects_offset(n) + SHARING] = SOFTNESS if redundant(rig) else 0.0
    for k, effect in enumerate(own_effects()):
        at = own_block(layout.effects_offset(n), k)
        physics[at : at + 2] = [code.address for code in code_of(effect)]
    elastic = layout.ELASTIC_ROD if rods else layout.ELASTIC
    mode = layout.RIGID if axial_stiffness is None else elastic
    return RigModel(
        physics=physics,
        modes=np.full(n, mode, dtype=np.int64),
        can_slacken=np.full(n, mode == layout.RIGID and not rods),
        exciter_orientation=np.ascontiguousarray(orientation),
    )


@dataclass(frozen=True)
class State:
    """Pose and velocity of the body datum."""

    position: Array  # (3,) m, world
    R_world_body: Array  # (3, 3)
    velocity: Array  # (3,) m/s, world
    rate: Array  # (3,) rad/s, body axes
    internal: Array = field(default_factory=lambda: np.zeros(0))  # (2 s,) internal coordinates, their rates

    def vector(self, size: int | None = None) -> Array:
        """(12 + 2 s,) local state with zero rotation increment.

        size: length wanted; internal coordinates of which nothing is known are at rest.
        """
        inner = self.internal
        if size is not None and inner.size != size - layout.BODY_STATE:
            inner = np.zeros(size - layout.BODY_STATE)
        return np.concatenate([self.position, np.zeros(3), self.velocity, self.rate, inner])

    @property
    def is_finite(self) -> bool:
        """Whether every number of it is one."""
        parts = (self.position, self.R_world_body, self.velocity, self.rate, self.internal)
        return all(bool(np.all(np.isfinite(part))) for part in parts)

    def moved(self, increment: Array) -> State:
        """State displaced by (12 + 2 s,): position (world), rotation (body, right), velocity, rate, q, q'."""
        return State(
            position=self.position + increment[:3],
            R_world_body=self.R_world_body @ Rotation.from_rotvec(increment[3:6]).as_matrix(),
            velocity=self.velocity + increment[6:9],
            rate=self.rate + increment[9:12],
            internal=self.vector(increment.size)[12:] + increment[12:],
        )


def state_from_vector(x: Array, R: Array) -> State:
    """Inverse of :meth:`State.vector`."""
    return State(x[:3].copy(), np.array(R), x[6:9].copy(), x[9:12].copy(), x[12:].copy())


def on_cables(model: RigModel, state: State) -> State:
    """The nearest state at which every rigid cable has its length and keeps it."""
    x, R = state.vector(model.states), np.array(state.R_world_body, order="C")
    project_state(model.physics, model.modes, x, R)
    return state_from_vector(x, R)


@dataclass(frozen=True)
class Input:
    """What drives the body, at equidistant nodes."""

    step: float  # s between nodes
    force: Array  # (N, 3) exciter force, exciter frame, N; linear between nodes but for ``middle``
    force_rate: Array  # (N, 3) N/s, linear between nodes
    wrench: Array  # (N, 6) further force and moment about the datum, body axes, held over each interval
    middle: Array | None = None  # (N, 3) force midway to the next node beyond the line; none: linear

    @staticmethod
    def none(nodes: int, step: float) -> Input:
        """Free motion."""
        return Input(step, np.zeros((nodes, 3)), np.zeros((nodes, 3)), np.zeros((nodes, 6)))


@dataclass(frozen=True)
class Motion:
    """Motion at the nodes; derivatives where they were asked for.

    ``outputs`` (N, 18 + n): see the OUT_ entries of layout.py. A, B, H, D, J: see integrate.py.
    """

    step: float
    states: Array  # (N, 12 + 2 s)
    R_world_body: Array  # (N, 3, 3)
    outputs: Array  # (N, 18 + n)
    nodes: int  # nodes reached: fewer than asked where the motion left every bound
    A: Array | None = None
    B: Array | None = None
    H: Array | None = None
    D: Array | None = None
    J: Array | None = None

    @property
    def complete(self) -> bool:
        """Whether every node was reached."""
        return bool(self.nodes == self.states.shape[0])

    @property
    def derivatives(self) -> tuple[Array, Array, Array, Array, Array]:
        """A, B, H, D, J of a motion that was computed with them."""
        if self.A is None or self.B is None or self.H is None or self.D is None or self.J is None:
            raise ValueError("this motion was computed without derivatives")
        return self.A, self.B, self.H, self.D, self.J

    def state(self, node: int) -> State:
        """State at one node."""
        return state_from_vector(self.states[node], self.R_world_body[node])


#: Nodes below which a motion is not worth two threads.
WORTHWHILE = 200
#: What a node costs without derivatives, as a share of one with those in state and wrench alone, and what
#: each direction adds to the latter (measured: bench/forward_model.py).
PLAIN_SHARE, DIRECTION_SHARE = 0.3, 0.03
#: ... and in columns (model/work.py).
PLAIN_WORK = 9


def simulate(
    model: RigModel,
    start: State,
    drive: Input,
    *,
    directions: NDArray[np.int64] | None = None,
    start_basis: Array | None = None,
    substeps: int | None = None,
    threads: int = 1,
) -> Motion:
    """Motion from ``start`` under ``drive``; with derivatives where ``directions`` is given.

    directions (d,): entries of ``model.physics`` (or EXCITER_CLOCK). start_basis (12 + 2 s, b):
    directions of the start state, each a column; the start follows the cables where a
    direction of ``physics`` moves them. The start itself is put on the cables first.
    threads: among which the derivatives are shared; they change no bit of the result.
    """
    sensitivity = directions is not None
    chosen = np.zeros(0, dtype=np.int64) if directions is None else np.asarray(directions, dtype=np.int64)
    size = model.states
    basis = np.zeros((size, 0)) if start_basis is None else start_basis
    x, R = start.vector(size), np.array(start.R_world_body, order="C")
    project_state(model.physics, model.modes, x, R)
    columns = np.zeros((size, basis.shape[1] + chosen.size))
    columns[:, : basis.shape[1]] = basis
    project_columns(model.physics, model.modes, x, R, chosen, basis.shape[1], columns)
    nodes = drive.force.shape[0]
    if substeps is None:
        substeps = substeps_for(model, drive.step, FIT_STEP if sensitivity else FINE_STEP)
    walk = _Walk(model, drive, chosen, substeps)
    cuts = _cuts(nodes, threads if sensitivity else 1, PLAIN_SHARE / (1.0 + DIRECTION_SHARE * chosen.size))
    kept = _Kept.of(nodes, model, chosen.size, sensitivity)
    done = walk.stretches(x, R, cuts, kept)
    if not sensitivity:
        # What derivatives take is counted by whoever asks for them, with what is made of them
        work.add(done * substeps * PLAIN_WORK)
        return Motion(drive.step, kept.states, kept.R_world_body, kept.outputs, done)
    J = accumulate(columns, kept.A, kept.C, kept.H, kept.P)
    return Motion(
        drive.step, kept.states, kept.R_world_body, kept.outputs, done, kept.A, kept.B, kept.H, kept.D, J
    )


def _cuts(nodes: int, threads: int, plain: float) -> list[int]:
    """Where to cut a motion so that all ``threads`` end together: each first walks to its own stretch.

    plain: cost of a node without derivatives over that of one with them. Stretch j from m_j takes
    plain m_j + (m_{j+1} - m_j) = T, so m_{j+1} = T + (1 - plain) m_j.
    """
    count = max(1, min(threads, nodes // WORTHWHILE))
    reach = (1.0 - (1.0 - plain) ** np.arange(count + 1)) / plain
    return [round(nodes * float(m / reach[-1])) for m in reach]


@dataclass(frozen=True)
class _Kept:
    """What is kept of a motion's nodes: see integrate.propagate."""

    states: Array
    R_world_body: Array
    outputs: Array
    A: Array
    B: Array
    C: Array
    H: Array
    D: Array
    P: Array

    @classmethod
    def of(cls, nodes: int, model: RigModel, directions: int, sensitivity: bool) -> _Kept:
        """Room for so many nodes."""
        size, outputs, kept = model.states, layout.OUT_TENSION + model.cables, nodes if sensitivity else 0
        return cls(
            np.zeros((nodes, size)),
            np.zeros((nodes, 3, 3)),
            np.zeros((nodes, outputs)),
            np.zeros((kept, size, size)),
            np.zeros((kept, size, 6)),
            np.zeros((kept, size, directions)),
            np.zeros((kept, outputs, size)),
            np.zeros((kept, outputs, 6)),
            np.zeros((kept, outputs, directions)),
        )


@dataclass(frozen=True)
class _Walk:
    """A model under a drive, ready to be followed from any node to any other."""

    model: RigModel
    drive: Input
    directions: NDArray[np.int64]
    substeps: int

    def stretches(self, x: Array, R: Array, cuts: list[int], kept: _Kept) -> int:
        """Fill ``kept``, each stretch between two cuts in a thread of its own; the nodes done."""

        def stretch(k: int) -> int:
            own_x, own_R, modes = x.copy(), R.copy(), self.model.modes.copy()
            if k and self._along(own_x, own_R, modes, 0, cuts[k], None) < cuts[k]:
                return 0
            return self._along(own_x, own_R, modes, cuts[k], cuts[k + 1], kept)

        if len(cuts) == 2:
            return stretch(0)
        with ThreadPoolExecutor(len(cuts) - 1) as pool:
            done = list(pool.map(stretch, range(len(cuts) - 1)))
        short = (d for d, end in zip(done, cuts[1:], strict=True) if d < end)
        return next(short, cuts[-1])

    def _along(
        self, x: Array, R: Array, modes: NDArray[np.int64], first: int, end: int, kept: _Kept | None
    ) -> int:
        """From node ``first`` to ``end``; x, R and modes go along. Keep nothing, or all there is room for."""
        sensitivity = kept is not None and kept.A.shape[0] > 0
        into = _Kept.of(end, self.model, 0, False) if kept is None else kept
        drive = self.drive
        return int(
            propagate(
                self.model.physics,
                modes,
                self.model.can_slacken,
                self.model.exciter_orientation,
                x,
                R,
                np.ascontiguousarray(drive.force),
                np.ascontiguousarray(drive.force_rate),
                np.zeros_like(drive.force) if drive.middle is None else np.ascontiguousarray(drive.middle),
                np.ascontiguousarray(drive.wrench),
                drive.step,
                self.substeps,
                self.directions,
                sensitivity,
                kept is None,
                first,
                end,
                into.states,
                into.R_world_body,
                into.outputs,
                into.A,
                into.B,
                into.C,
                into.H,
                into.D,
                into.P,
            )
        )
