"""One concealed session from a seed: in memory, or as a folder of bags with its truth beside it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed import truth as truths
from bench.concealed.draw import draw_scene, scaled
from bench.concealed.effects import CATALOGUE, choose, draw_effects
from bench.concealed.effects.base import Effect
from bench.concealed.effects.cable_elasticity import CableElasticity
from bench.concealed.effects.place import released_aside
from bench.concealed.engine import Engine
from bench.concealed.inertia import is_body
from bench.concealed.labs import INDETERMINATE, draw_lab_scene
from bench.concealed.measure import device_samples, record
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Trajectory
from rig_identification.recording import Session

LEAST_TENSION = 0.02  # of the weight: clean scenes stay clear of slack cables by this
PUSH = 1.0  # N: the engine's rods would go on where a cable goes slack
MOST_RATE = 0.8  # rad/s
MOST_STRETCH = 1e-6  # m: faster motion asks more of the engine's rigid cables
START_ACCURACY = 1e-4  # m/s^2 or rad/s^2, m from the level pose
PROBE = 8.0  # s
LEAST_RANGE = 0.035  # m, of the body origin
ATTEMPTS = 12  # draws of a lab's rig and effects
INDETERMINATE_SHARE = 0.5  # of the sessions whose cables stretch
SECOND_SHARE = 1 / 3  # of the seeds, by the second engine
STIFFER = 4.0  # times: what stretch is compared with where cables must stretch


def make_session(
    seed: int,
    *,
    kind: str = "random",
    size: float | None = None,
    duration: float = 32.0,
    world: str = "first",
    rig: str | None = None,
    given: Mapping[str, Any] | None = None,
    engine: str = "mujoco",
) -> tuple[Session, dict[str, Any]]:
    """A session and its truth.

    ``kind``: "clean", the name of an effect (two joined by "+": a pair), or "random".
    ``size``: 0 (faint) to 1 (strong); None draws it. ``duration`` of each run in s.
    ``world``: "first" or "labs", where rigs and effects have the sizes and forms of labs. There ``rig`` names
    one of the rigs, ``given`` sets fields of the effects that have them, in SI units, and ``engine`` is
    "mujoco", "exudyn", or "either": Exudyn for a third of the seeds, where it has the effects.
    The same arguments give the same session, bit for bit, on the same machine.
    """
    if world == "labs":
        drawn = _until_it_runs(partial(_lab, seed, kind, size, duration, rig, given or {}, engine))
    elif rig or given or engine != "mujoco":
        raise ValueError("rig, given and engine are for the world of labs")
    else:
        drawn = _first(seed, kind, size, duration)
    scene, altered, effects = drawn.scene, drawn.altered, drawn.effects
    with_shaft = bool(np.random.default_rng([seed, 4]).random() < 0.5)
    recordings = tuple(
        record(path, scene, effects, plan, k, with_shaft)
        for k, (path, plan) in enumerate(zip(altered, scene.plans, strict=True))
    )
    session = Session(f"concealed_{seed}", scene.rig, recordings)
    truth = truths.describe(scene, effects, altered)
    if world == "labs":
        truth.update(world=world, engine=scene.engine)
    ideal, paths = drawn.ideal, drawn.paths
    if scene.plans is not ideal.plans:  # the effect asks for other runs: compare the same ones
        ideal = replace(ideal, plans=scene.plans)
        paths = simulate(ideal, drawn.base)
    if not drawn.base:
        truth["effect_over_noise"] = effect_over_noise(ideal, paths, scene, altered, effects)
        if len(effects) > 1:
            truth["alone_over_noise"] = [alone_over_noise(ideal, paths, effect) for effect in effects]
        return session, truth
    truth["effect_over_noise"], truth["alone_over_noise"] = _beside_stretch(ideal, paths, drawn)
    return session, truth


class Mover(Protocol):
    """What an engine does."""

    def __init__(self, scene: Scene, effects: Sequence[Effect], plan: Plan) -> None: ...

    def release(self) -> float:
        """Bring the body to the plan's start, at rest; return the residual of that start."""

    def run(self, seconds: float | None = None) -> Trajectory:
        """From the start, let the body move."""

    def stand(self) -> Trajectory:
        """Let the body hang at rest."""


@dataclass(frozen=True)
class Drawn:
    """What a seed gave: the scene without and with its effects, and how each moves."""

    ideal: Scene
    paths: list[Trajectory]
    scene: Scene
    altered: list[Trajectory]
    effects: list[Effect]
    base: list[Effect]  # of the effects those without which the rig cannot be run


def _first(seed: int, kind: str, size: float | None, duration: float) -> Drawn:
    rng = np.random.default_rng([seed, 3])
    chosen = choose(rng, kind)
    ideal = draw_scene(seed, duration)
    if any(e.aside for e in chosen):
        ideal = released_aside(ideal)
    ideal, paths = calm_scene(ideal)
    effects = draw_effects(rng, chosen, ideal, size)
    return Drawn(ideal, paths, *with_effects(ideal, paths, effects), base=[])


def _until_it_runs(draw: Callable[[int], Drawn]) -> Drawn:
    """What an attempt draws; a rig or effect that cannot be run is drawn again."""
    for attempt in range(ATTEMPTS):
        try:
            return draw(attempt)
        except RuntimeError as error:
            told = error
    raise told


def _lab(
    seed: int,
    kind: str,
    size: float | None,
    duration: float,
    rig: str | None,
    given: Mapping[str, Any],
    engine: str,
    attempt: int,
) -> Drawn:
    """As labs have it."""
    # Kind and rig are those of the seed, whatever the attempt.
    rng = np.random.default_rng([seed, 6])
    chosen = choose(rng, kind)
    engine = _mover(rng, engine, chosen)
    stretch = CATALOGUE["cable_elasticity"]
    may = stretch in chosen and CATALOGUE["cable_slack"] not in chosen
    if rig is None and may and rng.random() < INDETERMINATE_SHARE:
        rig = str(rng.choice(INDETERMINATE))
    base: list[Effect] = []
    rng = np.random.default_rng([seed, 7, attempt])
    if rig in INDETERMINATE:
        chosen = [e for e in chosen if e is not stretch]
        share = float(rng.uniform()) if size is None else size
        base = [_given(CableElasticity.of_lab(rng, share), given)]
    stiffness = base[0].axial_stiffness if base else None
    ideal = draw_lab_scene(seed, duration, name=rig, stiffness=stiffness, attempt=attempt)
    ideal = replace(ideal, engine=engine)
    if base or engine != "mujoco" or any(e.aside for e in chosen):
        ideal = released_aside(ideal)
    ideal, paths = calm_scene(ideal, base)
    effects = [_given(e, given) for e in draw_effects(rng, chosen, ideal, size, labs=True)]
    rigid = ideal.body
    for effect in effects:
        rigid = effect.rigid_part(rigid)
    if not is_body(rigid):
        raise RuntimeError(f"seed {seed}: nothing is left of the body beside {kind}")
    drawn = Drawn(ideal, paths, *with_effects(ideal, paths, base + effects), base=base)
    loose = min(path.tension.min() for path in drawn.altered) < PUSH
    if loose and not any(e.lets_go for e in drawn.effects):
        raise RuntimeError(f"seed {seed}: a cable goes slack beside {kind}")
    return drawn


def _mover(rng: np.random.Generator, engine: str, chosen: Sequence[type[Effect]]) -> str:
    lacking = [e.name for e in chosen if not e.in_second()]
    if engine == "either":
        return "exudyn" if rng.random() < SECOND_SHARE and not lacking else "mujoco"
    if engine == "exudyn" and lacking:
        raise ValueError(f"the second engine has no {lacking[0]}: leave it to MuJoCo")
    return engine


def _given(effect: Effect, given: Mapping[str, Any]) -> Any:
    """The effect with those of its fields that are ``given``."""
    names = {f.name for f in fields(effect)} if is_dataclass(effect) else set()
    values = {k: np.array(v, dtype=float) if isinstance(v, list) else v for k, v in given.items()}
    return replace(effect, **{k: v for k, v in values.items() if k in names})


def _beside_stretch(
    ideal: Scene, paths: list[Trajectory], drawn: Drawn
) -> tuple[dict[str, Any], list[dict[str, Any] | None]]:
    """:func:`effect_over_noise` of all, and of each alone, where the cables must stretch.

    No rigid cables could carry such a body: the stretch counts by what cables four times as stiff, set to the
    same loads, would change.
    """
    base = drawn.base[0]
    strain = paths[0].stretch[0] / ideal.geometry.length
    loaded = ideal.geometry.length * (1.0 + strain)
    stiff_scene = replace(ideal, geometry=replace(ideal.geometry, length=loaded / (1.0 + strain / STIFFER)))
    stiff = simulate(stiff_scene, [base.stiffened(STIFFER)])
    every = effect_over_noise(stiff_scene, stiff, drawn.scene, drawn.altered, drawn.effects)
    alone: list[dict[str, Any] | None] = [effect_over_noise(stiff_scene, stiff, ideal, paths, [base])]
    for effect in drawn.effects[1:]:
        scene = effect.alter(ideal)
        pair = [base, effect]
        altered = simulate(scene, pair) if effect.mechanical else paths
        alone.append(effect_over_noise(ideal, paths, scene, altered, pair))
    return every, alone


def with_effects(
    ideal: Scene, paths: list[Trajectory], effects: list[Effect]
) -> tuple[Scene, list[Trajectory], list[Effect]]:
    """The scene and its motion with the effects in it, made stronger until each shows."""
    for _ in range(8):
        scene = ideal
        for effect in effects:
            scene = effect.alter(scene)
        altered = simulate(scene, effects) if any(e.mechanical for e in effects) else paths
        if effects and min(path.tension.min() for path in altered) < -PUSH:
            names = " and ".join(e.name for e in effects)
            raise RuntimeError(f"seed {ideal.seed}: with {names} a cable would have to push")
        unseen = [e.observe(scene, altered) is None for e in effects]
        if not any(unseen):
            return scene, altered, effects
        effects = [e.stronger() if u else e for e, u in zip(effects, unseen, strict=True)]
    raise RuntimeError(f"seed {ideal.seed}: {effects[int(np.argmax(unseen))].name} did not show")


def simulate(scene: Scene, effects: Sequence[Effect]) -> list[Trajectory]:
    """True motion of every recording of the scene."""
    return [_simulate_one(scene, effects, plan) for plan in scene.plans]


def _simulate_one(scene: Scene, effects: Sequence[Effect], plan: Plan) -> Trajectory:
    engine = _released(scene, effects, plan)
    return engine.run() if plan.kind == "dynamic" else engine.stand()


def _released(scene: Scene, effects: Sequence[Effect], plan: Plan) -> Mover:
    engine = _engine(scene.engine)(scene, effects, plan)
    residual = engine.release()
    if not residual < START_ACCURACY:
        raise RuntimeError(f"seed {scene.seed}, {plan.name}: start not found, residual {residual:.2g}")
    return engine


def _engine(name: str) -> type[Mover]:
    if name == "mujoco":
        return Engine
    # Imported here: who asks for MuJoCo's sessions alone needs no Exudyn.
    from bench.concealed.second_engine import SecondEngine

    return SecondEngine


def calm_scene(scene: Scene, base: Sequence[Effect] = ()) -> tuple[Scene, list[Trajectory]]:
    """Scale each run until its cables stay clear of slack and its motion is worth recording.

    ``base``: effects without which the rig cannot be run.
    """
    plans, paths = [], []
    for plan in scene.plans:
        plan, path = _calm_run(scene, plan, base)
        plans.append(plan)
        paths.append(path)
    at_rest = (paths[0].position[0], Rotation.from_quat(paths[0].quaternion[0]).as_matrix())
    return replace(scene, plans=tuple(plans), at_rest=at_rest), paths


def _calm_run(scene: Scene, plan: Plan, base: Sequence[Effect]) -> tuple[Plan, Trajectory]:
    if plan.kind == "static":
        path = _simulate_one(scene, base, plan)
        if path.tension.min() < 0.0:
            # The engine's rigid cables would hold a body up that lies on them: no cable does
            raise RuntimeError(f"seed {scene.seed}, {plan.name}: at rest a cable would have to push")
        return plan, path
    for attempt in range(12):
        engine = _released(scene, base, plan)
        # The first seconds tell most; only what passes them is run in full.
        share = _share(scene, engine.run(min(plan.duration, PROBE)), base) if attempt < 6 else 1.0
        if share == 1.0:
            path = engine.run()
            share = min(_share(scene, path, base), 1.0)
        if share == 1.0:
            return plan, path
        plan = scaled(plan, share)
    raise RuntimeError(f"seed {scene.seed}, {plan.name}: no fitting motion found")


def _share(scene: Scene, path: Trajectory, base: Sequence[Effect]) -> float:
    """By what to scale a run: 1 if it is good as it is."""
    weight = scene.body.mass * scene.rig.gravity
    rigid = bool(base) or np.abs(path.stretch).max() < MOST_STRETCH
    if not rigid or path.tension.min() < LEAST_TENSION * weight or np.abs(path.rate).max() > MOST_RATE:
        return 0.6
    # Enough motion to tell an inertia.
    return 1.0 if np.ptp(path.position, axis=0).max() > LEAST_RANGE else 1.5


def effect_over_noise(
    ideal: Scene,
    ideal_paths: Sequence[Trajectory],
    scene: Scene,
    paths: Sequence[Trajectory],
    effects: Sequence[Effect],
) -> dict[str, dict[str, float]]:
    """By recording and channel: rms of what the effects change, in units of one sample's noise."""
    if not effects:
        return {}
    out = {}
    for k, plan in enumerate(scene.plans):
        clean = device_samples(ideal_paths[k], ideal, [], ideal.plans[k], k, noise=0.0)
        other = device_samples(paths[k], scene, effects, plan, k, noise=0.0)
        out[plan.name] = truths.channel_differences(clean, other, scene)
    return out


def alone_over_noise(
    ideal: Scene, paths: list[Trajectory], effect: Effect
) -> dict[str, dict[str, float]] | None:
    """:func:`effect_over_noise` of one of several effects by itself; None where it cannot be run so."""
    scene = effect.alter(ideal)
    try:
        altered = simulate(scene, [effect]) if effect.mechanical else paths
    except RuntimeError:
        return None
    return effect_over_noise(ideal, paths, scene, altered, [effect])


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: write one session and its truth.json."""
    parser = argparse.ArgumentParser(prog="python -m bench.concealed.generate", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--effect", default="random", help="clean, random, an effect's name, or NAME+NAME")
    parser.add_argument("--size", type=float, default=None, help="0 (faint) to 1 (strong)")
    parser.add_argument("--duration", type=float, default=32.0, help="of each run, s")
    parser.add_argument("--world", default="first", choices=["first", "labs"])
    parser.add_argument("--rig", default=None, help="in the world of labs: the rig's name")
    parser.add_argument(
        "--set", action="append", default=[], metavar="FIELD=JSON", help="of labs' effects, SI units"
    )
    parser.add_argument("--engine", default="mujoco", choices=["mujoco", "exudyn", "either"])
    parser.add_argument("--storage", default="mcap", choices=["mcap", "sqlite3"])
    parser.add_argument("--compression", default="none", help="none, message, file or storage")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args(arguments)
    # Imported here: sessions in memory need no bag writer.
    from rig_identification.session import write_session

    session, truth = make_session(
        options.seed,
        kind=options.effect,
        size=options.size,
        duration=options.duration,
        world=options.world,
        rig=options.rig,
        engine=options.engine,
        given={k: json.loads(v) for k, _, v in (entry.partition("=") for entry in options.set)},
    )
    write_session(session, options.out, storage=options.storage, compression=options.compression)
    (options.out / "truth.json").write_text(json.dumps(truth, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
