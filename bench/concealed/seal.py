"""Truths of a run of sessions, written to one file whose SHA-256 is published before anyone looks.

The seeds alone do not tell what is in a session: kinds and sizes follow from a salt that is drawn here and
kept in the sealed file. Commit the seeds and the digest, examine the sessions, open the file afterwards.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import secrets
import shutil
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np

from bench.concealed.effects import CATALOGUE, OUTSIDE, SECOND, draw_pair
from bench.concealed.generate import SECOND_SHARE, make_session

CLEAN_SHARE, PAIR_SHARE, OUTSIDE_SHARE = 1 / 3, 0.1, 0.15


def compose(seeds: Sequence[int], salt: str, world: str = "first") -> list[dict[str, Any]]:
    """Kind and size of every session: a third clean, some pairs, some outside, sizes evenly from 0 to 1.

    The rest goes through the table in a random order, so that each effect has its turn. In the world of labs
    the second engine moves a third of all, drawn from those whose effects it has.
    """
    rng = np.random.default_rng(int.from_bytes(hashlib.sha256(salt.encode()).digest()[:8], "big"))
    count = len(seeds)
    clean, pairs, outside = (round(share * count) for share in (CLEAN_SHARE, PAIR_SHARE, OUTSIDE_SHARE))
    kinds = ["clean"] * clean + ["+".join(draw_pair(rng)) for _ in range(pairs)]
    kinds += _in_turn(rng, list(OUTSIDE), outside)
    kinds += _in_turn(rng, list(CATALOGUE), count - len(kinds))
    sizes = (rng.permutation(count) + rng.uniform(size=count)) / count
    order = rng.permutation(count)
    entries: list[dict[str, Any]] = [
        {"seed": int(seed), "kind": kinds[k], "size": float(sizes[k])}
        for seed, k in zip(seeds, order, strict=True)
    ]
    if world == "labs":
        able = [e for e in entries if e["kind"] == "clean" or set(e["kind"].split("+")) <= SECOND]
        second = rng.permutation(len(able))[: round(SECOND_SHARE * count)]
        for entry in entries:
            entry.update(world=world, engine="mujoco")
        for k in second:
            able[k]["engine"] = "exudyn"
    return entries


def _in_turn(rng: np.random.Generator, names: list[str], count: int) -> list[str]:
    chosen: list[str] = []
    while len(chosen) < count:
        chosen += [str(n) for n in rng.permutation(names)]
    return chosen[:count]


def _made(entry: dict[str, Any], duration: float, sessions: Path | None) -> dict[str, Any]:
    """One session, written to ``sessions``; its entry with its truth."""
    try:
        session, truth = make_session(
            entry["seed"],
            kind=entry["kind"],
            size=entry["size"],
            duration=duration,
            world=entry.get("world", "first"),
            engine=entry.get("engine", "mujoco"),
        )
    except RuntimeError as error:  # this body with this effect cannot be run: one session less
        return {**entry, "duration": duration, "truth": None, "failed": str(error)}
    if sessions is not None:
        from rig_identification.session import write_session

        shutil.rmtree(sessions / session.name, ignore_errors=True)
        write_session(session, sessions / session.name)
    return {**entry, "duration": duration, "truth": truth}


def seal(
    seeds: Sequence[int],
    path: Path,
    salt: str,
    duration: float = 32.0,
    sessions: Path | None = None,
    jobs: int = 1,
    world: str = "first",
) -> str:
    """Write the truths of all sessions to ``path``; return its SHA-256 in hex.

    ``sessions``: a folder to write the sessions themselves to, each without its truth. One that the
    engine cannot make is left out; its entry says why. What is finished stands in ``path`` at any time: an
    interrupted sealing goes on from there, with the salt that it began with.
    """
    done: dict[int, dict[str, Any]] = {}
    if path.exists():
        begun = json.loads(path.read_text())
        salt, done = begun["salt"], {entry["seed"]: entry for entry in begun["sessions"]}
    wanted = [entry for entry in compose(seeds, salt, world) if entry["seed"] not in done]
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        for future in as_completed([pool.submit(_made, entry, duration, sessions) for entry in wanted]):
            entry = future.result()
            done[entry["seed"]] = entry
            told = "left out" if entry["truth"] is None else "made"
            print(f"{len(done)} of {len(seeds)}: seed {entry['seed']} {told}", file=sys.stderr)
            aside = path.with_suffix(".part")
            aside.write_text(
                json.dumps({"salt": salt, "sessions": [done[k] for k in sorted(done)]}, indent=1)
            )
            aside.replace(path)
    return hashlib.sha256(path.read_bytes()).hexdigest()


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.concealed.seal", description=__doc__)
    parser.add_argument("--first-seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=120)
    parser.add_argument("--duration", type=float, default=32.0, help="of each run, s")
    parser.add_argument("--salt", default=None, help="default: drawn; give one to repeat a sealing")
    parser.add_argument("--sessions", type=Path, default=None, help="folder to write the sessions to")
    parser.add_argument("--world", default="first", choices=["first", "labs"])
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args(arguments)
    seeds = range(options.first_seed, options.first_seed + options.count)
    digest = seal(
        seeds,
        options.out,
        options.salt or secrets.token_hex(16),
        options.duration,
        options.sessions,
        options.jobs,
        options.world,
    )
    print(f"seeds {seeds[0]} to {seeds[-1]}: SHA-256 {digest}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
