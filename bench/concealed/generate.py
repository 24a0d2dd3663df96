"""One concealed session from a seed: in memory, or as a folder of bags with its truth beside it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed import truth as truths
from bench.concealed.draw import draw_scene, scaled
from bench.concealed.effects import choose, draw_effects
from bench.concealed.effects.base import Effect
from bench.concealed.effects.place import released_aside
from bench.concealed.engine import Engine
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


def make_session(
    seed: int, *, kind: str = "random", size: float | None = None, duration: float = 32.0
) -> tuple[Session, dict[str, Any]]:
    """A session and its truth.

    ``kind``: "clean", the name of an effect (two joined by "+": a pair), or "random".
    ``size``: 0 (faint) to 1 (strong); None draws it. ``duration`` of each run in s.
    The same arguments give the same session, bit for bit, on the same machine.
    """
    rng = np.random.default_rng([seed, 3])
    chosen = choose(rng, kind)
    ideal = draw_scene(seed, duration)
    if any(e.aside for e in chosen):
        ideal = released_aside(ideal)
    ideal, paths = calm_scene(ideal)
    effects = draw_effects(rng, chosen, ideal, size)
    scene, altered, effects = with_effects(ideal, paths, effects)
    with_shaft = bool(np.random.default_rng([seed, 4]).random() < 0.5)
    recordings = tuple(
        record(path, scene, effects, plan, k, with_shaft)
        for k, (path, plan) in enumerate(zip(altered, scene.plans, strict=True))
    )
    session = Session(f"concealed_{seed}", scene.rig, recordings)
    truth = truths.describe(scene, effects, altered)
    if scene.plans is not ideal.plans:  # the effect asks for other runs: compare the same ones
        ideal = replace(ideal, plans=scene.plans)
        paths = simulate(ideal, [])
    truth["effect_over_noise"] = effect_over_noise(ideal, paths, scene, altered, effects)
    if len(effects) > 1:
        truth["alone_over_noise"] = [alone_over_noise(ideal, paths, effect) for effect in effects]
    return session, truth


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


def _released(scene: Scene, effects: Sequence[Effect], plan: Plan) -> Engine:
    engine = Engine(scene, effects, plan)
    residual = engine.release()
    if not residual < START_ACCURACY:
        raise RuntimeError(f"seed {scene.seed}, {plan.name}: start not found, residual {residual:.2g}")
    return engine


def calm_scene(scene: Scene) -> tuple[Scene, list[Trajectory]]:
    """Scale each run until its cables stay clear of slack and its motion is worth recording."""
    plans, paths = [], []
    for plan in scene.plans:
        plan, path = _calm_run(scene, plan)
        plans.append(plan)
        paths.append(path)
    at_rest = (paths[0].position[0], Rotation.from_quat(paths[0].quaternion[0]).as_matrix())
    return replace(scene, plans=tuple(plans), at_rest=at_rest), paths


def _calm_run(scene: Scene, plan: Plan) -> tuple[Plan, Trajectory]:
    if plan.kind == "static":
        path = _simulate_one(scene, [], plan)
        if path.tension.min() < 0.0:
            # The engine's rigid cables would hold a body up that lies on them: no cable does
            raise RuntimeError(f"seed {scene.seed}, {plan.name}: at rest a cable would have to push")
        return plan, path
    for attempt in range(12):
        engine = _released(scene, [], plan)
        # The first seconds tell most; only what passes them is run in full.
        share = _share(scene, engine.run(min(plan.duration, PROBE))) if attempt < 6 else 1.0
        if share == 1.0:
            path = engine.run()
            share = min(_share(scene, path), 1.0)
        if share == 1.0:
            return plan, path
        plan = scaled(plan, share)
    raise RuntimeError(f"seed {scene.seed}, {plan.name}: no fitting motion found")


def _share(scene: Scene, path: Trajectory) -> float:
    """By what to scale a run: 1 if it is good as it is."""
    weight = scene.body.mass * scene.rig.gravity
    rigid = np.abs(path.stretch).max() < MOST_STRETCH
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
    parser.add_argument("--storage", default="mcap", choices=["mcap", "sqlite3"])
    parser.add_argument("--compression", default="none", help="none, message, file or storage")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args(arguments)
    # Imported here: sessions in memory need no bag writer.
    from rig_identification.session import write_session

    session, truth = make_session(
        options.seed, kind=options.effect, size=options.size, duration=options.duration
    )
    write_session(session, options.out, storage=options.storage, compression=options.compression)
    (options.out / "truth.json").write_text(json.dumps(truth, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
