"""Motion of the rig by Exudyn: another formulation, another integrator, another author than MuJoCo's.

Bodies in absolute coordinates with Euler parameters, rigid cables as constraints of distance with Lagrange
multipliers, the implicit trapezoidal rule on the constraints' velocities. A tension is the multiplier itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import exudyn as exu
import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.assembly import OUT, Assembly
from bench.concealed.effects.base import Effect, State
from bench.concealed.effects.place import level_origin
from bench.concealed.kinematics import predict
from bench.concealed.scene import Array, Plan, Scene
from bench.concealed.signals import Trajectory

ROW = 0.001  # s
#: Steps in a row. The trapezoidal rule slows a swing of w by (w h)^2 / 12: below 5e-5 of it while w h < TURN.
STEPS_A_ROW = (2, 4, 5, 10)
TURN = 0.025  # rad
OIL = 5.0  # 1/s, while the body settles
SETTLE_TIME = 10.0  # s
SETTLE_STEPS = (
    4e-3,
    1e-2,
)  # s, the shortest and the longest; between, a step turns the fastest swing by 1 rad
SPELLS = 20  # of settling
TOLERANCE = 1e-10  # of the weight
RESTING = 1e-7  # m/s^2 or rad/s^2
WATCHED = {
    "position": OUT.Position,
    "rotation": OUT.RotationMatrix,
    "velocity": OUT.Velocity,
    "rate": OUT.AngularVelocityLocal,
    "acceleration": OUT.Acceleration,
    "rate_change": OUT.AngularAcceleration,  # world axes
}


class SecondEngine:
    """One scene with its effects, ready to rest or to run; released from rest, never from the level pose."""

    def __init__(self, scene: Scene, effects: Sequence[Effect], plan: Plan) -> None:
        self.scene, self.plan = scene, plan
        self.effects = sorted((e for e in effects if e.mechanical), key=lambda e: e.own_cables)
        refused = [e.name for e in self.effects if not e.in_second()]
        if refused:
            raise ValueError(f"the second engine has no {refused[0]}")
        loads = [e for e in self.effects if type(e).assemble is Effect.assemble]
        self.forcing = [law for law in (e.bind(scene) for e in loads) if law is not None]
        fastest = max((e.fastest(scene) for e in self.effects), default=0.0)
        rows = next((n for n in STEPS_A_ROW if fastest * ROW / n < TURN), STEPS_A_ROW[-1])
        self.step = ROW / rows
        self._settle_step = float(np.clip(1.0 / max(fastest, 1e-9), *SETTLE_STEPS))
        self._start: Array | None = None

    def _assemble(self, oil: float) -> Assembly:
        scene, plan = self.scene, self.plan
        whole = scene.body
        for effect in self.effects:
            whole = effect.rigid_part(whole)
        made = Assembly(whole, hung(scene), scene.rig.gravity, oil)
        if plan.dummy_mass > 0.0:
            made.carry(plan.dummy_mass, plan.dummy_position)
        for effect in self.effects:
            effect.assemble(made, scene)
        if not any(e.own_cables for e in self.effects):
            g = scene.geometry
            for top, hinge, length in zip(g.ceiling, g.hinge, g.length, strict=True):
                made.rigid_cable(top, hinge, float(length))
        return made

    def release(self) -> float:
        """Bring the body to rest, held by the plan's pull where it has one; return the acceleration left."""
        hold = 0.0 if self.plan.start == "rest" else 1.0
        residual = np.inf
        for _ in range(SPELLS):
            self._settle(hold)
            residual = self._left(hold)
            if residual < RESTING:
                break
        return residual

    def _settle(self, hold: float) -> None:
        made = self._assemble(OIL)
        loads = _Loads(self, made, None, hold)
        self._solve(made, loads, SETTLE_TIME, self._settle_step, settle=True)
        self._start = np.array(made.mbs.systemData.GetODE2Coordinates())

    def _left(self, hold: float) -> float:
        made = self._assemble(0.0)
        sensors = [made.watch(OUT.Acceleration), made.watch(OUT.AngularAcceleration)]
        self._solve(made, _Loads(self, made, None, hold), self.step, self.step)
        first = [made.mbs.GetSensorStoredData(s)[0, 1:] for s in sensors]
        return float(np.linalg.norm(np.concatenate(first)))

    def _solve(
        self, made: Assembly, loads: _Loads, seconds: float, step: float, settle: bool = False
    ) -> None:
        made.mbs.Assemble()
        if self._start is not None:
            for configuration in (exu.ConfigurationType.Initial, exu.ConfigurationType.Current):
                made.mbs.systemData.SetODE2Coordinates(self._start, configuration)
        settings = exu.SimulationSettings()
        time = settings.timeIntegration
        time.numberOfSteps, time.endTime = round(seconds / step), seconds
        time.generalizedAlpha.useIndex2Constraints = not settle
        time.generalizedAlpha.useNewmark = not settle
        time.generalizedAlpha.spectralRadius = 0.6  # while settling: what rings dies out
        time.newton.useModifiedNewton = not settle
        time.newton.relativeTolerance = 1e-9
        # Stiff cables: what their length is rounded to is more than Exudyn's own 1e-10 N
        time.newton.absoluteTolerance = TOLERANCE * self.scene.body.mass * self.scene.rig.gravity
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = max(step, ROW)
        loads.put_first()
        exu.config.suppressWarnings = True  # of Python functions, which the loads are
        made.mbs.SetPreStepUserFunction(loads.step)
        try:
            made.mbs.SolveDynamic(settings)
        except exu.SolverError as error:
            raise RuntimeError(f"seed {self.scene.seed}, {self.plan.name}: Exudyn found no motion") from error

    def run(self, seconds: float | None = None) -> Trajectory:
        """From the start, let the body move for ``seconds``, by default the plan's duration."""
        wanted = self.plan.duration if seconds is None else seconds
        rows = round((wanted + self.plan.first_sample) / ROW)
        motor, half = self.plan.motor, 0.5 * self.step * np.arange(round(2 * rows * ROW / self.step) + 1)
        if motor is None:
            shaft, force = np.zeros((len(half), 2)), np.zeros((len(half), 3))
        else:
            angle, rate = motor.shaft(half)
            shaft, force = np.stack([angle, rate], axis=1), motor.force(angle, rate)
        made = self._assemble(0.0)
        sensors = {name: made.watch(output) for name, output in WATCHED.items()}
        drive = force[::2] @ self.scene.devices.exciter_rotation.T
        self._solve(made, _Loads(self, made, drive, 0.0), rows * ROW, self.step)
        kept = slice(None, None, round(2 * ROW / self.step))
        return self._trajectory(made, sensors, force[kept], shaft[kept])

    def stand(self) -> Trajectory:
        """Let the body hang at rest for the plan's duration."""
        made = self._assemble(0.0)
        sensors = {name: made.watch(output) for name, output in WATCHED.items()}
        self._solve(made, _Loads(self, made, None, 0.0), self.step, self.step)
        count = round((self.plan.duration + self.plan.first_sample) / ROW) + 1
        return self._trajectory(made, sensors, np.zeros((count, 3)), np.zeros((count, 2)))

    def _trajectory(self, made: Assembly, sensors: dict[str, int], force: Array, shaft: Array) -> Trajectory:
        """What was watched, or at rest its first row over and over."""
        series = {name: made.mbs.GetSensorStoredData(number)[:, 1:] for name, number in sensors.items()}
        pulls = [made.mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in made.cables]
        count = len(force)
        if self.plan.kind == "static":
            series = {name: np.tile(values[:1], (count, 1)) for name, values in series.items()}
            pulls = [np.tile(pull[:1], (count, 1)) for pull in pulls]
        rotation = series["rotation"].reshape(-1, 3, 3)
        geometry = self.scene.geometry
        up = geometry.ceiling - series["position"][:, None]
        up = up - np.einsum("nij,cj->nci", rotation, geometry.hinge)
        reach = np.linalg.norm(up, axis=2)
        return Trajectory(
            time=ROW * np.arange(count, dtype=np.float64),
            position=series["position"],
            quaternion=Rotation.from_matrix(rotation).as_quat(),
            velocity=series["velocity"],
            rate=series["rate"],
            acceleration=series["acceleration"],
            rate_change=np.einsum("nji,nj->ni", rotation, series["rate_change"]),
            tension=np.stack([_pull(p, up[:, i] / reach[:, i : i + 1]) for i, p in enumerate(pulls)], axis=1),
            force=force,
            shaft=shaft,
            stretch=reach - geometry.length,
        )


def hung(scene: Scene) -> tuple[Array, Array]:
    """Position (3,) and rotation (3, 3) near level in which the cables have their unloaded lengths."""
    geometry = scene.geometry
    origin, rotation = level_origin(scene), np.eye(3)
    for _ in range(20):
        arm = geometry.hinge @ rotation.T
        span = origin + arm - geometry.ceiling
        reach = np.linalg.norm(span, axis=1)
        along = span / reach[:, None]
        jacobian = np.concatenate([along, np.cross(arm, along)], axis=1)
        # What nearly parallel cables, more than three, hardly hold stays where it is
        move = np.linalg.lstsq(jacobian, geometry.length - reach, rcond=1e-3)[0]
        origin = origin + move[:3]
        rotation = Rotation.from_rotvec(move[3:]).as_matrix() @ rotation
    return origin, rotation


def _pull(felt: Array, up: Array) -> Array:
    """(n,) N along the cable: a connector reports it, of a joint it is the share along ``up``."""
    return felt[:, 0] if felt.shape[1] == 1 else np.abs(np.sum(felt * up, axis=1))


class _Loads:
    """Forces that are set before every step, to what they are at its end."""

    def __init__(self, engine: SecondEngine, made: Assembly, drive: Array | None, hold: float) -> None:
        self._engine, self._made, self._drive = engine, made, drive
        self._settling = drive is None
        self._mbs, self._node = made.mbs, made.node
        self._exciter = made.force(engine.scene.devices.exciter_position, turning=True)
        self._law = made.force(np.zeros(3), turning=False), made.moment()
        if hold:
            pull = made.force(engine.plan.pull_point, turning=False)
            self._mbs.SetLoadParameter(pull, "loadVector", list(hold * engine.plan.pull))
        self._last = 0.0

    def put_first(self) -> None:
        """The forces of the start, from which the first accelerations follow."""
        if self._drive is not None:
            self._mbs.SetLoadParameter(self._exciter, "loadVector", list(self._drive[0]))
        if self._engine.forcing or self._made.laws:
            self._put_laws(0.0, 0.0)

    def step(self, mbs: exu.MainSystem, time: float) -> bool:
        """Set what acts at ``time``, the end of the step to come."""
        ahead, self._last = time - self._last, time
        if self._drive is not None:
            row = min(round(time / self._engine.step), len(self._drive) - 1)
            mbs.SetLoadParameter(self._exciter, "loadVector", list(self._drive[row]))
        if self._engine.forcing or self._made.laws:
            self._put_laws(time, ahead)
        return True

    def _put_laws(self, time: float, ahead: float) -> None:
        state = self._state(time, ahead)
        total = np.zeros(6)
        for law in self._engine.forcing:
            total += law(state)
        for own in self._made.laws:
            total[3:] += own()
        self._mbs.SetLoadParameter(self._law[0], "loadVector", list(total[:3]))
        self._mbs.SetLoadParameter(self._law[1], "loadVector", list(total[3:]))

    def _state(self, time: float, ahead: float) -> State:
        get, node = self._mbs.GetNodeOutput, self._node
        position, rotation = get(node, OUT.Position), get(node, OUT.RotationMatrix).reshape(3, 3)
        name = self._engine.plan.name
        if self._settling:
            return State(name, -1.0, position, rotation, np.zeros(3), np.zeros(3))
        velocity, rate = get(node, OUT.Velocity), get(node, OUT.AngularVelocityLocal)
        change = rotation.T @ get(node, OUT.AngularAcceleration)
        pose = np.concatenate([position, get(node, OUT.Coordinates)[3:7] + self._made.reference])
        motion = np.concatenate([velocity, rate])
        return State(
            name, time, *predict(pose, motion, np.concatenate([get(node, OUT.Acceleration), change]), ahead)
        )
