"""The simulated rig as it hangs, shakes and swings, advanced a block at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.estimate.rest_evidence import with_dummy
from rig_identification.live.plant_blocks import PlantBlock
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
    """The body on its cables. Time starts at ``start_ns``; nodes are ``step`` seconds apart."""

    def __init__(self, model: RigModel, start_ns: int, step: float = 0.001) -> None:
        self._bare, self._model = model, model
        self._start_ns, self._step = start_ns, step
        self.nodes = 0  # nodes done
        self._shaking: Shaking | None = None
        self._shaken_since = 0
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
        self._shaking = None
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
        time = self._step * (self.nodes - self._shaken_since + np.arange(count + 1.0))
        force = np.zeros((count + 1, 3)) if self._shaking is None else self._shaking.force(time)
        rates = np.gradient(force, self._step, axis=0)
        motion = simulate(self._model, self.state, Input(self._step, force, rates, np.zeros((count + 1, 6))))
        if not motion.complete:
            self.come_to_rest()
            raise InputError("the simulated motion leaves every bound: shake less; the body was put to rest")
        block = PlantBlock(self.now_ns, self._step, np.concatenate([motion.outputs, force], axis=1))
        self.nodes += count
        self.state = motion.state(count)
        return block, motion


def odometry_values(motion: Motion, node: int) -> Array:
    """(13,) position and quaternion xyzw of the body in world, twist in body."""
    state = motion.state(node)
    quaternion = Rotation.from_matrix(state.R_world_body).as_quat()
    return np.concatenate([state.position, quaternion, state.velocity @ state.R_world_body, state.rate])
