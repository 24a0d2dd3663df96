"""Natural frequencies of a body that hangs on its cables, and the shape of each mode in words.

The motion's exact derivative over one short interval about rest, x(h) = A x(0), has the
eigenvalues exp(lambda h) on the states that the cables allow; lambda = i w for each mode. The
share of each motion in a mode is its share of the mode's kinetic energy about the centre of
mass.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from rig_identification.model import layout
from rig_identification.model.body import elements_from_linear, tensor
from rig_identification.model.constraints import rigid_jacobian
from rig_identification.model.motion import Input, RigModel, State, simulate

Array = NDArray[np.float64]

#: Interval, s: a hundredth of the period of a fast rigid mode; steps within it.
INTERVAL, SUBSTEPS = 0.01, 2
#: A motion with less of the energy than this goes unnamed.
NAMED = 0.05
MOTIONS = ("sway along x", "sway along y", "heave", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class Mode:
    """One way to swing."""

    frequency: float  # Hz; 0: the body moves without being driven back
    decay: float  # 1/s, rate at which the swing dies out
    energy: (
        Array  # (6,) share of the kinetic energy: centre of mass along world x y z, turning about body x y z
    )
    displacement: Array  # (3,) m of the centre of mass, world, scaled
    turn: Array  # (3,) rad, body axes, scaled alike

    @property
    def shape(self) -> str:
        """In words, the largest share first: ``"sway along y with roll"``.

        Roll, pitch and yaw are turns about the body's x, y and z axis.
        """
        order = [int(k) for k in np.argsort(-self.energy) if self.energy[k] >= NAMED]
        names = [MOTIONS[k] for k in order]
        return names[0] if len(names) == 1 else f"{names[0]} with {' and '.join(names[1:])}"


def natural_modes(model: RigModel, rest: State) -> tuple[Mode, ...]:
    """Modes about ``rest`` (model/equilibrium.py), slowest first.

    Any number of cables, rigid or elastic. Four rigid cables that do not meet leave two modes,
    three leave three, two leave four, of which turning about their hinges' line may be free.
    """
    basis = _free_directions(model, rest)
    freedom = basis.shape[1]
    columns = np.zeros((12, 2 * freedom))
    columns[:6, :freedom] = columns[6:, freedom:] = basis
    none = np.zeros(0, dtype=np.int64)
    motion = simulate(
        model, rest, Input.none(2, INTERVAL), directions=none, start_basis=columns, substeps=SUBSTEPS
    )
    if motion.A is None:
        raise AssertionError("derivatives were asked for")
    values, vectors = np.linalg.eig(columns.T @ motion.A[0] @ columns)
    rates = np.log(values.astype(complex)) / INTERVAL
    modes = []
    for k in np.argsort(np.abs(rates.imag), kind="stable"):
        if rates[k].imag > 1e-4:
            modes.append(_mode(model, rest, basis @ vectors[:freedom, k], rates[k]))
    still = (2 * freedom - 2 * len(modes)) // 2
    if still:
        calm = [k for k in np.argsort(np.abs(rates)) if abs(rates[k].imag) <= 1e-4]
        free = [_mode(model, rest, basis @ vectors[:freedom, k], 0.0j) for k in calm[: 2 * still : 2]]
        modes = free + modes
    return tuple(modes)


def _free_directions(model: RigModel, rest: State) -> Array:
    """(6, f) orthonormal displacements of datum (world) and attitude (body) that keep every rigid cable."""
    n = model.cables
    G, gap, rate = np.zeros((n, 6)), np.zeros(n), np.zeros(n)
    turn = np.array(rest.R_world_body, order="C")
    count = rigid_jacobian(model.physics, model.modes, rest.vector(model.states), turn, G, gap, rate)
    return np.asarray(null_space(G[:count], rcond=1e-6)) if count else np.eye(6)


def _mode(model: RigModel, rest: State, shape: NDArray[np.complex128], rate: complex) -> Mode:
    elements = elements_from_linear(model.physics[layout.INERTIAL : layout.INERTIAL + 10])
    shape = shape / shape[np.argmax(np.abs(shape))]
    turn = shape[3:]
    center = shape[:3] + rest.R_world_body @ np.cross(turn, elements[1:4])
    inertia = tensor(elements[4:])
    # Turning about body axes: the cross terms are shared out between the axes
    energy = np.concatenate(
        [elements[0] * np.abs(center) ** 2, np.maximum(np.real(np.conj(turn) * (inertia @ turn)), 0.0)]
    )
    return Mode(
        float(abs(rate.imag) / (2.0 * np.pi)),
        float(-rate.real),
        energy / np.sum(energy),
        np.real(center),
        np.real(turn),
    )
