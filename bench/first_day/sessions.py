"""Clean sessions, and sessions with one ordinary effect, by the bench's engine: made once, kept as bags."""

from __future__ import annotations

import json
import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.concealed import truth as truths
from bench.concealed.draw import draw_scene
from bench.concealed.effects import CATALOGUE, draw_effects
from bench.concealed.effects.place import released_aside
from bench.concealed.generate import calm_scene, with_effects
from bench.concealed.measure import record
from bench.concealed.scene import Scene
from bench.concealed.signals import Trajectory
from bench.first_day.small import LENGTH, resized
from bench.first_day.tracker import watched
from rig_identification.raw import RawSession
from rig_identification.recording import Session
from rig_identification.session import read_raw, write_session

FIRST_SEED = 48_000
DURATION = 12.0  # s, of each run
DEFAULT_CACHE = Path(tempfile.gettempdir()) / "first_day_sessions"
#: Of four seeds one is a small rig under motion capture without inclinometer, one has motion capture besides.
SMALL, WATCHED = 3, 1


@dataclass(frozen=True)
class Kept:
    """One session of the cache."""

    name: str  # "clean_48000", "ordinary_48000"
    folder: Path
    truth: dict[str, Any]

    def read(self) -> RawSession:
        """Its messages, received as a recorder gets them."""
        return received(read_raw(self.folder), int(self.name.rpartition("_")[2]))


def rig_kind(seed: int) -> str:
    """One of "small", "watched" and "plain"."""
    return {SMALL: "small", WATCHED: "watched"}.get(seed % 4, "plain")


def effect_of(seed: int) -> str:
    """Effect of the catalogue for a seed's ordinary session: the table in turn."""
    return list(CATALOGUE)[(seed - FIRST_SEED) % len(CATALOGUE)]


def kept(cache: Path, kind: str, seed: int) -> Kept | None:
    """A session of the cache, None where it is not there (yet)."""
    name = f"{kind}_{seed}"
    file = cache / f"{name}.json"
    if not file.exists():
        return None
    truth = json.loads(file.read_text())
    return None if "failed" in truth else Kept(name, cache / name, truth)


def all_kept(cache: Path, kind: str, count: int | None = None) -> list[Kept]:
    """Sessions of a kind in the cache by seed, the first ``count`` of them."""
    seeds = sorted(int(f.stem.rpartition("_")[2]) for f in cache.glob(f"{kind}_*.json"))
    found = (kept(cache, kind, seed) for seed in seeds)
    return [one for one in found if one is not None][:count]


def make(cache: Path, seed: int, kinds: tuple[str, ...] = ("clean", "ordinary")) -> None:
    """Make a seed's sessions where the cache lacks them; both of one motion where the effect allows it.

    A scene that the engine cannot make is noted as failed.
    """
    lacking = [kind for kind in kinds if not (cache / f"{kind}_{seed}.json").exists()]
    if not lacking:
        return
    cache.mkdir(parents=True, exist_ok=True)
    small = rig_kind(seed) == "small"
    calm: dict[bool, tuple[Scene, list[Trajectory]]] = {}
    for kind in lacking:
        resize = small and kind == "clean"  # the catalogue's effects have sizes of big rigs
        try:
            if resize not in calm:
                calm[resize] = _calm(seed, resize)
            session, truth = _session(seed, kind, *calm[resize])
        except RuntimeError as err:
            (cache / f"{kind}_{seed}.json").write_text(json.dumps({"failed": str(err)}))
            continue
        _keep(cache, f"{kind}_{seed}", session, truth)


def _calm(seed: int, resize: bool) -> tuple[Scene, list[Trajectory]]:
    scene = draw_scene(seed, DURATION)
    if resize:
        scene = resized(scene)
    return calm_scene(released_aside(scene) if CATALOGUE[effect_of(seed)].aside else scene)


def _session(seed: int, kind: str, scene: Scene, paths: list[Trajectory]) -> tuple[Session, dict[str, Any]]:
    effects = []
    if kind == "ordinary":
        effects = draw_effects(np.random.default_rng([seed, 3]), [CATALOGUE[effect_of(seed)]], scene, None)
        scene, paths, effects = with_effects(scene, paths, effects)
    recordings = tuple(
        record(path, scene, effects, plan, k, with_shaft=seed % 2 == 0)
        for k, (path, plan) in enumerate(zip(paths, scene.plans, strict=True))
    )
    session = Session(f"{kind}_{seed}", scene.rig, recordings)
    truth = truths.describe(scene, effects, paths)
    if scene.geometry_name.startswith("small"):
        session = watched(session, seed, LENGTH * 2.0, described=seed % 8 < 4, inclinometer=False)
    elif rig_kind(seed) == "watched":
        session = watched(session, seed, 2.0, described=seed % 8 < 4, inclinometer=True)
    return session, truth


def _keep(cache: Path, name: str, session: Session, truth: dict[str, Any]) -> None:
    """Write the session, then its truth: what has a truth is whole."""
    shutil.rmtree(cache / name, ignore_errors=True)
    write_session(session, cache / name, compression="storage")
    aside = cache / f".{name}.part"
    aside.write_text(json.dumps(truth))
    aside.replace(cache / f"{name}.json")


#: A recorder's receive times: transport, a scheduler's tick, now and then a stall.
TRANSPORT, TICK, STALL_RATE = 0.0015, 0.001, 0.3  # s, s (mean of an exponential), 1/s


def received(raw: RawSession, seed: int) -> RawSession:
    """The session with receive times as a recorder's: late by milliseconds, in order within a topic.

    A stall of the recorder (some 10 ms) delays what comes meanwhile to its end, all topics alike.
    """
    rng = np.random.default_rng([seed, 12])
    recordings = []
    for recording in raw.recordings:
        first = min(int(c.stamp_ns[0]) for c in recording.channels)
        last = max(int(c.stamp_ns[-1]) for c in recording.channels)
        count = rng.poisson(STALL_RATE * (last - first) / 1e9)
        begins = np.sort(rng.uniform(first, last, count))
        ends = begins + rng.uniform(0.005, 0.02, count) * 1e9
        channels = []
        for channel in recording.channels:
            late = (TRANSPORT + rng.exponential(TICK * 0.2, len(channel.stamp_ns))) * 1e9
            at = channel.stamp_ns + late
            for begin, end in zip(begins, ends, strict=True):
                at = np.where((at >= begin) & (at < end), end, at)
            in_order = np.maximum.accumulate(np.asarray(at, dtype=np.int64))
            channels.append(replace(channel, received_ns=in_order))
        recordings.append(replace(recording, channels=tuple(channels)))
    return replace(raw, recordings=tuple(recordings))
