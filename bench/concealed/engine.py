"""Motion of the rig by MuJoCo: rigid cables as tendon equalities, everything else at its side.

MuJoCo's constraints are springs in disguise: with a time constant of two steps and an impedance of
0.9999 they yield by less than a micrometre, and the tension reported is the force that truly acted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bench.concealed.effects.base import Effect, State
from bench.concealed.kinematics import predict, put_body_force
from bench.concealed.scene import Array, Plan, Scene

STEP = 0.0005  # s
RECORD_EVERY = 2  # steps
CONSTRAINT_TIME = 2.0 * STEP  # s: the shortest that MuJoCo keeps stable
OIL = 5.0  # 1/s, damping per mass while the body settles
IMPEDANCE = 0.9999  # MuJoCo's largest


@dataclass(frozen=True)
class Trajectory:
    """True motion, sampled every ``STEP * RECORD_EVERY`` from the release on."""

    time: Array  # (n,) s
    position: Array  # (n, 3) m, body origin in world
    quaternion: Array  # (n, 4) xyzw, body to world
    velocity: Array  # (n, 3) m/s, body origin, world
    rate: Array  # (n, 3) rad/s, body
    acceleration: Array  # (n, 3) m/s^2, body origin, world
    rate_change: Array  # (n, 3) rad/s^2, body
    tension: Array  # (n, cables) N, at the end that carries the load cell
    force: Array  # (n, 3) N, exciter on body, exciter frame
    shaft: Array  # (n, 2) rad, rad/s
    stretch: Array  # (n, cables) m, length less described true length


class Engine:
    """One model of a scene with its effects, ready to rest or to run."""

    def __init__(self, scene: Scene, effects: Sequence[Effect], plan: Plan) -> None:
        self.scene, self.plan = scene, plan
        self.effects = [e for e in effects if e.mechanical]
        self.forcing = [e for e in self.effects if type(e).force is not Effect.force]
        self.model = self._compile()
        self.data = mujoco.MjData(self.model)
        # Views into MuJoCo's own arrays: asking for them anew at every step costs more than the step.
        self._pose, self._velocity = self.data.qpos, self.data.qvel
        self._acceleration, self._applied = self.data.qacc, self.data.qfrc_applied
        self.cables = len(scene.geometry.length)
        self._adjust_lengths()

    def _compile(self) -> mujoco.MjModel:
        scene, plan = self.scene, self.plan
        spec = mujoco.MjSpec()
        spec.option.timestep = STEP
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        spec.option.gravity = [0.0, 0.0, -scene.rig.gravity]
        spec.option.tolerance = 1e-14
        spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
        spec.compiler.autolimits = True
        spec.compiler.degree = False
        body = spec.worldbody.add_body(name="body")
        body.add_freejoint(name="body")
        _give_mass(body, scene.body.mass, scene.body.center_of_mass, scene.body.inertia)
        if plan.dummy_mass > 0.0:
            dummy = body.add_body(name="dummy", pos=plan.dummy_position)
            _give_mass(dummy, plan.dummy_mass, np.zeros(3), 1e-9 * np.eye(3))
        for i, (top, hinge) in enumerate(zip(scene.geometry.ceiling, scene.geometry.hinge, strict=True)):
            spec.worldbody.add_site(name=f"ceiling_{i}", pos=top)
            body.add_site(name=f"hinge_{i}", pos=hinge)
        if not any(effect.own_cables for effect in self.effects):
            add_cables(spec, scene)
        for effect in self.effects:
            effect.build(spec, scene, plan)
        return spec.compile()

    def _adjust_lengths(self) -> None:
        """Set each rigid cable to its true length, whatever pose the model was compiled in."""
        for i, length in enumerate(self.scene.geometry.length):
            row = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, f"cable_{i}")
            if row >= 0:
                tendon = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_TENDON, f"cable_{i}")
                self.model.eq_data[row, 0] = length - self.model.tendon_length0[tendon]

    def load(self, time: float, force: Array, ahead: float = 0.0, hold: float = 0.0) -> None:
        """Apply the exciter's ``force`` (body axes), the effects and ``hold`` times the start pull.

        ``ahead``: seconds from the engine's state to the instant that counts.
        """
        pose, applied = self._pose, self._applied
        position, rotation, velocity, rate = predict(pose, self._velocity, self._acceleration, ahead)
        put_body_force(applied, rotation, force, self.scene.devices.exciter_position)
        if hold:
            applied[:3] += hold * self.plan.pull
            applied[3:6] += hold * np.cross(self.plan.pull_point, rotation.T @ self.plan.pull)
        if self.forcing:
            state = State(time, position, rotation, velocity, rate)
            for effect in self.forcing:
                applied[:6] += effect.force(state)

    def rest(self, hold: float = 0.0) -> float:
        """Move to equilibrium: damped motion first, then Newton's method; return the acceleration left."""
        self._guess()
        self._project()
        self._settle(hold)
        for _ in range(12):
            residual = self._acceleration_at_rest(self.data.qpos.copy(), hold)
            if np.linalg.norm(residual) < 1e-8:
                break
            self._newton_step(residual, hold)
        return float(np.linalg.norm(self._acceleration_at_rest(self.data.qpos.copy(), hold)))

    def _settle(self, hold: float, seconds: float = 6.0) -> None:
        """Let the body come to rest in thick oil: Newton's method needs to start close."""
        mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_fullM(self.model, self.data, mass)
        own = self.model.dof_damping.copy()
        self.model.dof_damping[:] = OIL * np.diag(mass)
        for _ in range(int(seconds / STEP)):
            self.load(-1.0, np.zeros(3), hold=hold)
            mujoco.mj_step(self.model, self.data)
        self.model.dof_damping[:] = own
        self.data.qvel[:] = 0.0

    def _guess(self) -> None:
        self.data.qpos[:] = self.model.qpos0
        self.data.qpos[:7] = [*self._described_origin(), 1.0, 0.0, 0.0, 0.0]
        self.data.qvel[:] = 0.0

    def _described_origin(self) -> Array:
        """Where the body origin is if the body hangs level: what the cables allow, least squares."""
        geometry = self.scene.geometry
        origin = np.mean(geometry.ceiling - geometry.hinge, axis=0) - [0.0, 0.0, np.mean(geometry.length)]
        for _ in range(50):
            arm = origin + geometry.hinge - geometry.ceiling
            length = np.linalg.norm(arm, axis=1)
            jacobian = arm / length[:, None]
            origin = origin - np.linalg.lstsq(jacobian, length - geometry.length, rcond=None)[0]
        return origin

    def _acceleration_at_rest(self, pose: Array, hold: float) -> Array:
        self.data.qpos[:] = pose
        self.data.qvel[:] = 0.0
        self.data.qacc[:] = 0.0
        self.load(-1.0, np.zeros(3), hold=hold)
        mujoco.mj_forward(self.model, self.data)
        return self.data.qacc.copy()

    def _newton_step(self, residual: Array, hold: float, eps: float = 1e-6) -> None:
        pose = self.data.qpos.copy()
        size = self.model.nv
        jacobian = np.empty((size, size))
        for k in range(size):
            ends = []
            for sign in (1.0, -1.0):
                moved = pose.copy()
                mujoco.mj_integratePos(self.model, moved, sign * eps * np.eye(size)[k], 1.0)
                ends.append(self._acceleration_at_rest(moved, hold))
            jacobian[:, k] = (ends[0] - ends[1]) / (2.0 * eps)
        step = -np.linalg.lstsq(jacobian, residual, rcond=1e-14)[0]
        step *= min(1.0, 0.1 / max(np.max(np.abs(step)), 1e-12))
        mujoco.mj_integratePos(self.model, pose, step, 1.0)
        self.data.qpos[:] = pose

    def release(self) -> float:
        """Bring the body to the plan's start, at rest; return the residual of that start."""
        if self.plan.start == "thesis":
            self._guess()
            return self._project()
        return self.rest(hold=0.0 if self.plan.start == "rest" else 1.0)

    def _project(self) -> float:
        """Turn and shift the body by the least that gives every cable its length."""
        self.data.qvel[:] = 0.0
        gap = np.zeros(self.cables)
        for _ in range(20):
            pose = self.data.qpos.copy()
            gap = self._gap(pose)
            jacobian = np.empty((self.cables, 6))
            for k in range(6):
                move = np.zeros(self.model.nv)
                move[k] = 1e-6
                forth, back = pose.copy(), pose.copy()
                mujoco.mj_integratePos(self.model, forth, move, 1.0)
                mujoco.mj_integratePos(self.model, back, move, -1.0)
                jacobian[:, k] = (self._gap(forth) - self._gap(back)) / 2e-6
            move = np.zeros(self.model.nv)
            move[:6] = -np.linalg.lstsq(jacobian, gap, rcond=None)[0]
            mujoco.mj_integratePos(self.model, pose, move, 1.0)
            self.data.qpos[:] = pose
        return float(np.max(np.abs(gap)))

    def _gap(self, pose: Array) -> Array:
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, pose[3:7])
        geometry = self.scene.geometry
        tip = pose[:3] + geometry.hinge @ rotation.reshape(3, 3).T
        return np.asarray(np.linalg.norm(tip - geometry.ceiling, axis=1) - geometry.length)

    def run(self) -> Trajectory:
        """Release the body and let it move for the plan's duration."""
        motor, steps = self.plan.motor, self.steps
        half = np.arange(2 * steps + 2) * (0.5 * STEP)
        if motor is None:
            shaft, force = np.zeros((len(half), 2)), np.zeros((len(half), 3))
        else:
            angle, rate = motor.shaft(half)
            shaft, force = np.stack([angle, rate], axis=1), motor.force(angle, rate)
        force_body = np.ascontiguousarray(force @ self.scene.devices.exciter_rotation.T)
        rows = []
        for k in range(steps + 1):
            time = k * STEP
            if k % RECORD_EVERY == 0:
                self.load(time, force_body[2 * k])
                mujoco.mj_forward(self.model, self.data)
                rows.append(self._row())
            self.load(time + 0.5 * STEP, force_body[2 * k + 1], ahead=0.5 * STEP)
            mujoco.mj_step(self.model, self.data)
        kept = slice(0, 2 * steps + 1, 2 * RECORD_EVERY)
        return self._trajectory(np.array(rows), shaft[kept], force[kept])

    def stand(self) -> Trajectory:
        """Let the body hang at rest for the plan's duration."""
        self._acceleration_at_rest(self.data.qpos.copy(), 0.0)
        count = self.steps // RECORD_EVERY + 1
        row = self._row()
        return self._trajectory(np.tile(row, (count, 1)), np.zeros((count, 2)), np.zeros((count, 3)))

    @property
    def steps(self) -> int:
        """Steps that cover the recording, its late start included."""
        return RECORD_EVERY * int(
            round((self.plan.duration + self.plan.first_sample) / (STEP * RECORD_EVERY))
        )

    def _row(self) -> Array:
        data = self.data
        return np.concatenate(
            [data.qpos[:7], data.qvel[:6], data.qacc[:6], self._tension(), self._gap(data.qpos)]
        )

    def _tension(self) -> Array:
        for effect in self.effects:
            tension = effect.tension(self.model, self.data, self.scene)
            if tension is not None:
                return tension
        return cable_tension(self.data, self.cables)

    def _trajectory(self, rows: Array, shaft: Array, force: Array) -> Trajectory:
        n = self.cables
        quaternion = rows[:, [4, 5, 6, 3]]
        return Trajectory(
            time=np.arange(len(rows)) * (STEP * RECORD_EVERY),
            position=rows[:, :3],
            quaternion=quaternion,
            velocity=rows[:, 7:10],
            rate=rows[:, 10:13],
            acceleration=rows[:, 13:16],
            rate_change=rows[:, 16:19],
            tension=rows[:, 19 : 19 + n],
            force=force,
            shaft=shaft,
            stretch=rows[:, 19 + n : 19 + 2 * n],
        )


def add_cables(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add the rigid cables."""
    for i in range(len(scene.geometry.length)):
        tendon = spec.add_tendon(name=f"cable_{i}")
        tendon.wrap_site(f"ceiling_{i}")
        tendon.wrap_site(f"hinge_{i}")
        spec.add_equality(
            name=f"cable_{i}",
            type=mujoco.mjtEq.mjEQ_TENDON,
            name1=f"cable_{i}",
            solref=[CONSTRAINT_TIME, 1.0],
            solimp=[IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0],
        )


def cable_tension(data: mujoco.MjData, cables: int) -> Array:
    """(cables,) force of the tendon equalities, positive when they pull."""
    # MuJoCo lists equalities first, in the order they were added: an effect's own come after the cables.
    return np.asarray(-data.efc_force[:cables])


def _give_mass(body: mujoco.MjsBody, mass: float, center: Array, inertia: Array) -> None:
    body.explicitinertial = True
    body.mass = mass
    body.ipos = center
    j = inertia
    body.fullinertia = [j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2]]
