"""Motion of the rig by MuJoCo: rigid cables as tendon equalities, everything else at its side.

MuJoCo's constraints are springs in disguise: with a time constant of two steps and an impedance of
0.9999 they yield by less than a micrometre, and the tension reported is the force that truly acted.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect, State
from bench.concealed.effects.place import level_origin
from bench.concealed.kinematics import predict, put_body_force
from bench.concealed.mechanism import STEP, add_rigid_cables, give_mass, rigid_tension, set_lengths
from bench.concealed.scene import Array, Plan, Scene
from bench.concealed.signals import Trajectory

RECORD_EVERY = 2  # steps
RESTING = 1e-7  # m/s^2 or rad/s^2: what Newton's method must reach
STILL = 5e-5  # m/s^2 or rad/s^2: what is good enough where Newton's method does not serve
PATIENCE = 10  # spells of 20 s in oil
SNAP = 10  # rows: a cable that comes taut rings for so long
OIL = 5.0  # 1/s, damping per mass while the body settles


class Engine:
    """One model of a scene with its effects, ready to rest or to run."""

    def __init__(self, scene: Scene, effects: Sequence[Effect], plan: Plan) -> None:
        self.scene, self.plan = scene, plan
        self.effects = [e for e in effects if e.mechanical]
        laws = [e.bind(scene) for e in self.effects]
        self.forcing = [law for law in laws if law is not None]
        self.driving = [e for e in self.effects if e.drives]
        self.model = self._compile()
        self.data = mujoco.MjData(self.model)
        # Views into MuJoCo's own arrays: asking for them anew at every step costs more than the step.
        self._pose, self._velocity = self.data.qpos, self.data.qvel
        self._acceleration, self._applied = self.data.qacc, self.data.qfrc_applied
        self.cables = len(scene.geometry.length)
        if not any(e.own_cables for e in self.effects):
            set_lengths(self.model, scene.geometry.length)

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
        whole = scene.body
        for effect in self.effects:
            whole = effect.rigid_part(whole)
        give_mass(body, whole.mass, whole.center_of_mass, whole.inertia)
        if plan.dummy_mass > 0.0:
            dummy = body.add_body(name="dummy", pos=plan.dummy_position)
            give_mass(dummy, plan.dummy_mass, np.zeros(3), 1e-9 * np.eye(3))
        plates = [e.ceiling(spec, scene) for e in self.effects]
        ceiling = next((p for p in plates if p is not None), spec.worldbody)
        for i, (top, hinge) in enumerate(zip(scene.geometry.ceiling, scene.geometry.hinge, strict=True)):
            ceiling.add_site(name=f"ceiling_{i}", pos=top)
            body.add_site(name=f"hinge_{i}", pos=hinge)
        if not any(e.own_cables for e in self.effects):
            add_rigid_cables(spec, scene)
        for effect in self.effects:
            effect.build(spec, scene, plan)
        return spec.compile()

    def load(self, time: float, force: Array, ahead: float = 0.0, hold: float = 0.0) -> None:
        """Apply the exciter's ``force`` (body axes), the effects and ``hold`` times the start pull.

        ``ahead``: seconds from the engine's state to the instant that counts.
        """
        pose, applied = self._pose, self._applied
        position, rotation, velocity, rate = predict(pose, self._velocity, self._acceleration, ahead)
        put_body_force(applied, rotation, force, self.scene.devices.exciter_position)
        if hold:
            applied[:3] += hold * self.plan.pull
            applied[3:6] += hold * _cross(self.plan.pull_point, rotation.T @ self.plan.pull)
        if self.forcing or self.driving:
            state = State(self.plan.name, time, position, rotation, velocity, rate)
            for law in self.forcing:
                applied[:6] += law(state)
            for effect in self.driving:
                effect.drive(self.model, self.data, state)

    def rest(self, hold: float = 0.0) -> float:
        """Move to equilibrium; return the acceleration that is left there.

        Damped motion first, then Newton's method. Where stops or unilateral cables bend the law too
        sharply for Newton, damped motion goes on alone.
        """
        self._guess()
        self._project()
        self._settle(hold, 3.0)
        if self._newton(hold) > RESTING:
            self._settle(hold, 20.0)
        residual = self._at_rest(hold)
        # A loose part creeps down a slope of a milliradian for minutes before it meets its stop.
        for _ in range(PATIENCE):
            if residual < STILL:
                break
            self._settle(hold, 20.0)
            residual = self._at_rest(hold)
        return residual

    def _at_rest(self, hold: float) -> float:
        return float(np.linalg.norm(self._acceleration_at_rest(self.data.qpos.copy(), hold)))

    def _newton(self, hold: float) -> float:
        """Newton's method from here; go back if it leads nowhere. Return the acceleration left."""
        best = self.data.qpos.copy()
        start = least = float(np.linalg.norm(self._acceleration_at_rest(best, hold)))
        for _ in range(12):
            pose = self.data.qpos.copy()
            residual = self._acceleration_at_rest(pose, hold)
            size = float(np.linalg.norm(residual))
            if size <= least:
                best, least = pose, size
            if size < 1e-8 or size > 1e4 * max(start, 1.0):
                break
            self._newton_step(residual, hold)
        self.data.qpos[:] = best
        return float(least)

    def _settle(self, hold: float, seconds: float) -> None:
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
        self.data.qpos[:7] = [*level_origin(self.scene), 1.0, 0.0, 0.0, 0.0]
        self.data.qvel[:] = 0.0

    def _acceleration_at_rest(self, pose: Array, hold: float) -> Array:
        self.data.qpos[:] = pose
        self.data.qvel[:] = 0.0
        self.data.qacc[:] = 0.0
        self.load(-1.0, np.zeros(3), hold=hold)
        mujoco.mj_forward(self.model, self.data)
        return np.array(self.data.qacc)

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
            residual = self._project()
        else:
            residual = self.rest(hold=0.0 if self.plan.start == "rest" else 1.0)
        self._start = self.data.qpos.copy()
        return residual

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
            # What nearly parallel cables, more than three, hardly hold stays where it is
            move[:6] = -np.linalg.lstsq(jacobian, gap, rcond=1e-3)[0]
            mujoco.mj_integratePos(self.model, pose, move, 1.0)
            self.data.qpos[:] = pose
        return float(np.max(np.abs(gap)))

    def _gap(self, pose: Array) -> Array:
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, pose[3:7])
        geometry = self.scene.geometry
        tip = pose[:3] + geometry.hinge @ rotation.reshape(3, 3).T
        return np.asarray(np.linalg.norm(tip - geometry.ceiling, axis=1) - geometry.length)

    def run(self, seconds: float | None = None) -> Trajectory:
        """From the start, let the body move for ``seconds``, by default the plan's duration."""
        steps = self._steps(self.plan.duration if seconds is None else seconds)
        motor = self.plan.motor
        self.data.qpos[:] = self._start
        self.data.qvel[:] = 0.0
        self.data.qacc[:] = 0.0
        half = (0.5 * STEP) * np.arange(2 * steps + 2, dtype=np.float64)
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
        count = self._steps(self.plan.duration) // RECORD_EVERY + 1
        row = self._row()
        return self._trajectory(np.tile(row, (count, 1)), np.zeros((count, 2)), np.zeros((count, 3)))

    def _steps(self, seconds: float) -> int:
        """Steps that cover a recording, its late start included."""
        return RECORD_EVERY * round((seconds + self.plan.first_sample) / (STEP * RECORD_EVERY))

    def _row(self) -> Array:
        data = self.data
        return np.concatenate([data.qpos[:7], data.qvel[:6], data.qacc[:6], self._tension()])

    def _tension(self) -> Array:
        for effect in self.effects:
            tension = effect.tension(self.model, self.data, self.scene)
            if tension is not None:
                return tension
        return rigid_tension(self.data, self.cables)

    def _trajectory(self, rows: Array, shaft: Array, force: Array) -> Trajectory:
        n = self.cables
        quaternion = rows[:, [4, 5, 6, 3]]
        acceleration, tension = rows[:, 13:19], rows[:, 19 : 19 + n]
        if not any(e.stretches for e in self.effects) and len(rows) > 2:
            acceleration, tension = self._as_it_moved(rows, quaternion)
        return Trajectory(
            time=np.arange(len(rows), dtype=np.float64) * (STEP * RECORD_EVERY),
            position=rows[:, :3],
            quaternion=quaternion,
            velocity=rows[:, 7:10],
            rate=rows[:, 10:13],
            acceleration=acceleration[:, :3],
            rate_change=acceleration[:, 3:],
            tension=tension,
            force=force,
            shaft=shaft,
            stretch=self._stretch(rows[:, :3], quaternion),
        )

    def _as_it_moved(self, rows: Array, quaternion: Array) -> tuple[Array, Array]:
        """Acceleration (n, 6) and tension (n, cables) of the motion as it came out.

        A rigid cable's force at the start of a step is not what acts over the step: MuJoCo's
        equality leaves out how the cable's direction turns, and the stages of a step make up for it.
        The difference, 1e-3 of a swing's centripetal force, is the cables' own: it is handed to them. What
        heavy cables or an effect's parts take of it is a hundredth of that, and left to the cables too.
        """
        body, hinge = self.scene.body, self.scene.geometry.hinge
        velocity, reported = rows[:, 7:13], rows[:, 13:19]
        tension = rows[:, 19 : 19 + self.cables]
        taut = tension > 0.0 if any(e.lets_go for e in self.effects) else np.ones(tension.shape, dtype=bool)
        # Through five samples: between neighbours it takes 0.2 % off what rings at 16 Hz, 2 % at 52 Hz
        moved = savgol_filter(velocity, 5, 4, deriv=1, delta=STEP * RECORD_EVERY, axis=0)
        # At the ends it is of lower order; a difference across a snap is none
        told = _near(np.any(taut[1:] != taut[:-1], axis=1), SNAP)
        told[[0, 1, -2, -1]] = True
        moved[told] = reported[told]
        missed = moved - reported
        rotation = Rotation.from_quat(quaternion).as_matrix()
        tip = rows[:, None, :3] + np.einsum("nij,cj->nci", rotation, hinge)
        up = self.scene.geometry.ceiling - tip
        up = np.einsum("nji,ncj->nci", rotation, up / np.linalg.norm(up, axis=2, keepdims=True))
        linear = np.einsum("nji,nj->ni", rotation, missed[:, :3])
        angular, c = missed[:, 3:], body.center_of_mass
        about_origin = body.inertia + body.mass * (c @ c * np.eye(3) - np.outer(c, c))
        wrench = np.concatenate(
            [
                body.mass * (linear + np.cross(angular, c)),
                angular @ about_origin + body.mass * np.cross(c, linear),
            ],
            axis=1,
        )
        unit = np.concatenate([up, np.cross(hinge, up)], axis=2).transpose(0, 2, 1) * taut[:, None, :]
        more = np.einsum("nci,ni->nc", np.linalg.pinv(unit), wrench)
        return moved, tension + more

    def _stretch(self, position: Array, quaternion: Array) -> Array:
        geometry = self.scene.geometry
        rotation = Rotation.from_quat(quaternion).as_matrix()
        tip = position[:, None] + np.einsum("nij,cj->nci", rotation, geometry.hinge)
        return np.asarray(np.linalg.norm(tip - geometry.ceiling, axis=2) - geometry.length)


def _near(between: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """(n,) rows within ``reach`` of something that happens ``between`` (n - 1,) two of them."""
    wide = np.convolve(between, np.ones(2 * reach), mode="full") > 0.0
    return wide[reach - 1 : reach + between.size]


def _cross(a: Array, b: Array) -> Array:
    # numpy's own takes longer than a step of MuJoCo.
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
