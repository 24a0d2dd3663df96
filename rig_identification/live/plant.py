"""The simulated rig as it hangs, shakes and swings, advanced a block at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.estimate.rest_evidence import with_dummy
from rig_identification.live.plant_blocks import PlantBlock
from rig_identification.live.push import Push
from rig_identification.model import layout
from rig_identification.model.effects.internal import ceiling_shift
from rig_identification.model.equilibrium import design_pose, find_rest, settle
from rig_identification.model.motion import Input, Motion, RigModel, State, simulate
from rig_identification.recording import Dummy

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shaking:
    """A sine on each axis of the exciter frame, faded in over ``ramp`` seconds."""

    amplitude: Array  # (3,) N
    frequency: Array  # (3,) Hz
    ramp: float = 1.0  # s

    def force(self, time: Array) -> Array:
        """(n, 3) N at times (n,) s after shaking began."""
        u = np.clip(time / self.ramp, 0.0, 1.0)[:, None]
        return np.asarray(
            u**2 * (3.0 - 2.0 * u) * self.amplitude * np.sin(2.0 * np.pi * self.frequency * time[:, None])
        )


class Plant:
    """The body on its cables. Time starts at ``start_ns``; nodes are ``step`` seconds apart.

    push: acts on the body; its times count from the start of shaking.
    """

    def __init__(self, model: RigModel, start_ns: int, step: float = 0.001, push: Push | None = None) -> None:
        self._bare, self._model = model, model
        self._start_ns, self._step = start_ns, step
        self.nodes = 0  # nodes done
        self._shaking: Shaking | None = None
        self._shaken_since: int | None = None
        self._push = push
        self.state = self._rest(settle(model, design_pose(model)))

    def _rest(self, guess: State) -> State:
        rest = find_rest(self._model, guess)
        return rest.state if rest.converged else settle(self._model, guess)

    @property
    def now_ns(self) -> int:
        """Time of the last node."""
        return self._start_ns + round(1e9 * self._step * self.nodes)

    def shake(self, shaking: Shaking) -> None:
        """Start the exciter."""
        self._shaking, self._shaken_since = shaking, self.nodes

    def stop_shaking(self) -> None:
        """Stop the exciter; the body swings on."""
        self._shaking = None

    def come_to_rest(self, dummy: Dummy | None = None) -> None:
        """Hang still, with a known mass fixed to the body or without."""
        self._shaking = self._shaken_since = None
        self._model = with_dummy(self._bare, dummy)
        self.state = self._rest(settle(self._model, self.state))

    def advance(self, duration: float) -> tuple[PlantBlock, Motion]:
        """Block from the last node on, ``duration`` seconds long.

        Raises
        ------
        InputError
            The motion leaves every bound; the body is put to rest.
        """
        count = max(1, round(duration / self._step))
        force, wrench = np.zeros((count + 1, 3)), np.zeros((count + 1, 6))
        if self._shaken_since is not None:
            time = self._step * (self.nodes - self._shaken_since + np.arange(count + 1.0))
            force = force if self._shaking is None else self._shaking.force(time)
            # Held over each interval: its value in the middle
            wrench = wrench if self._push is None else self._push.wrench(time + 0.5 * self._step)
        rates = np.asarray(np.gradient(force, self._step, axis=0))
        model = as_taut_as(self._model, self.state)
        motion = simulate(model, self.state, Input(self._step, force, rates, wrench))
        if not motion.complete:
            self.come_to_rest()
            raise InputError("the simulated motion leaves every bound: shake less; the body was put to rest")
        block = PlantBlock(self.now_ns, self._step, np.concatenate([motion.outputs, force], axis=1))
        self.nodes += count
        self.state = motion.state(count)
        return block, motion


#: m that a cable is longer than the way it spans when it hangs loose; taut ones keep their length to 1e-11 m.
LOOSE = 1e-8


def as_taut_as(model: RigModel, state: State) -> RigModel:
    """The rig with those cables slack that span less than their length: they stay so from block to block."""
    modes = model.modes.copy()
    physics, x = model.physics, state.vector(model.states)
    for i in np.flatnonzero(model.can_slacken):
        cable = physics[layout.cable_offset(int(i)) :]
        hinge = state.position + state.R_world_body @ cable[layout.BODY_POINT : layout.BODY_POINT + 3]
        shift = np.array(ceiling_shift(physics, model.cables, x, int(i)))[:3]
        above = cable[layout.CEILING_POINT : layout.CEILING_POINT + 3] + shift
        if np.linalg.norm(above - hinge) < cable[layout.LENGTH] - LOOSE:
            modes[i] = layout.SLACK
    return replace(model, modes=modes)


def odometry_values(motion: Motion, node: int) -> Array:
    """(13,) position and quaternion xyzw of the body in world, twist in body."""
    state = motion.state(node)
    quaternion = Rotation.from_matrix(state.R_world_body).as_quat()
    return np.concatenate([state.position, quaternion, state.velocity @ state.R_world_body, state.rate])
