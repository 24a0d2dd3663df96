"""What does a rig's memory win, does it stay honest, and does it see a hinge that moved? Simulated rigs.

A rig has ten sessions and an eleventh; what stays (several/ties.py) walks by a tenth of its tolerance from
one to the next. The eleventh is recorded twice: as it is, and with one hinge at the ceiling moved by 2 mm to
a side that is drawn. Fits start at the truth. Rigs go to a log as they are done.

    python -m bench.memory [--rigs 8] [--processes 1]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.several import FIRST, fingerprint, fitted, percent, poses, result_of, share, stays
from rig_identification.estimate.parameters import parameter_set
from rig_identification.model.motion import rig_model
from rig_identification.result import ELEMENTS
from rig_identification.several.compare import LEVEL
from rig_identification.several.memory import learned, recalled
from rig_identification.several.ties import NEW, Sharing
from rig_identification.simulate import simulate_session
from rig_identification.simulate.true_rig import channels_of

HERE = Path(__file__).parent
SESSIONS = 10
MOVED = 0.002  # m
ONE_RIG = Sharing(rigs=("rig",))


def one_rig(number: int) -> dict[str, Any]:
    """Simulate and fit all sessions of a rig."""
    rng = np.random.default_rng([52, number])
    spec = poses()[FIRST]
    doubts = parameter_set(spec.rig, rig_model(spec.rig, spec.elements), channels_of(spec)).free
    now = {p.name: float(np.clip(rng.standard_normal(), -2.5, 2.5)) for p in doubts if stays(p)}
    entry: dict[str, Any] = {"rig": number, "code": fingerprint(), "sessions": []}

    def record(given: dict[str, float]) -> dict[str, Any]:
        return fitted(*simulate_session(replace(spec, given_doubts=given), rng))

    for _ in range(SESSIONS + 1):
        now = {name: at + NEW * rng.standard_normal() for name, at in now.items()}
        entry["sessions"].append(record(now))
    cable = spec.rig.cables[rng.integers(len(spec.rig.cables))].name
    side = rng.standard_normal(3)
    side *= MOVED / np.linalg.norm(side) / spec.rig.tolerance["hinge_position"]
    moved = {f"{cable}.ceiling_point.{a}": s for a, s in zip("xyz", side, strict=True)}
    entry["cable"] = cable
    entry["moved"] = record({name: at + moved.get(name, 0.0) for name, at in now.items()})
    return entry


def score(entries: list[dict[str, Any]]) -> dict[str, Any]:
    """How much narrower, how honest, how often a hinge is said to have moved."""
    ratio, error, alarms, found, named = [], [], [], [], []
    for entry in entries:
        told = [result_of(str(k), s) for k, s in enumerate(entry["sessions"])]
        rigs = Sharing(rigs=("rig",) * len(told))
        for k in range(1, len(told)):
            before = learned(told[:k], replace(rigs, rigs=rigs.rigs[:k]))
            total = recalled(told[k], before, ONE_RIG)
            truth = np.array(entry["sessions"][k]["truth"])
            std = np.sqrt(np.diag(total.covariance))
            error.append((total.values - truth) / std)
            ratio.append((k, std / np.sqrt(np.diag(told[k].estimate.covariance))))
        alarms.append({moved.session for moved in learned(told, rigs).moved})
        # All but the last one, and its like with the hinge moved
        last = learned([*told[:-1], result_of("moved", entry["moved"])], rigs).moved
        parts = [moved.part for moved in last if moved.session == "moved"]
        found.append(bool(parts))
        named.append(any(part.startswith(entry["cable"] + ".") for part in parts))
    z = np.array(error)
    late = np.array([r for k, r in ratio if k == SESSIONS])
    sessions = len(entries) * (SESSIONS + 1)
    flagged = np.zeros(sessions)
    flagged[: sum(map(len, alarms))] = 1.0
    return {
        "rigs": len(entries),
        "code": entries[0]["code"],
        "coverage": share(np.abs(z) <= 1.959964),
        "rms_error_in_std": float(np.sqrt(np.mean(z**2))),
        "std_over_alone_after_ten": {n: float(np.median(late[:, k])) for k, n in enumerate(ELEMENTS)},
        "false_alarms": share(flagged),
        "moved_found": share(np.array(found, dtype=float)),
        "moved_cable_named": share(np.array(named, dtype=float)),
    }


def as_markdown(told: dict[str, Any]) -> str:
    """The figures as a page."""
    ratios = told["std_over_alone_after_ten"]
    return "\n".join(
        [
            "# Monte Carlo of rig memory",
            "",
            f"Made by `python -m bench.memory --rigs {told['rigs']}`. Each rig: three cables, a body of",
            f"1100 kg, {SESSIONS} sessions and one more, a run of 12 s each; what stays walks by {NEW:g} of",
            "its tolerance a session. In brackets: 95 % interval of a share.",
            "",
            "| what | figure |",
            "| --- | --- |",
            f"| 95 % intervals of recalled sessions that hold | {percent(told['coverage'])} |",
            f"| their error, rms in its std | {told['rms_error_in_std']:.2f} |",
            f"| sessions with an alarm and nothing moved, level {100 * LEVEL:g} % | "
            f"{percent(told['false_alarms'])} |",
            f"| a hinge moved by {1e3 * MOVED:g} mm: there is an alarm | {percent(told['moved_found'])} |",
            f"| ... and it is one of that cable | {percent(told['moved_cable_named'])} |",
            "",
            "Std after ten sessions over that of the session alone, median: "
            + ", ".join(f"{name} {ratio:.2f}" for name, ratio in ratios.items())
            + ".",
            "",
            f"Fingerprint of the code: {told['code']}",
            "",
        ]
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: run what is missing, write the figures."""
    parser = argparse.ArgumentParser(prog="python -m bench.memory", description=__doc__.partition("\n")[0])
    parser.add_argument("--rigs", type=int, default=8)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--log", type=Path, default=HERE / "memory.jsonl", help="one line a rig")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of memory.json and memory.md")
    options = parser.parse_args(arguments)
    lines = options.log.read_text().splitlines() if options.log.exists() else []
    entries = [e for e in map(json.loads, lines) if e["code"] == fingerprint()]
    left = [n for n in range(options.rigs) if n not in {e["rig"] for e in entries}]
    with options.log.open("a") as log, ProcessPoolExecutor(options.processes) as pool:
        for future in as_completed([pool.submit(one_rig, n) for n in left]):
            entries.append(future.result())
            log.write(json.dumps(entries[-1]) + "\n")
            log.flush()
    told = score(sorted(entries, key=lambda e: e["rig"])[: options.rigs])
    (options.out / "memory.json").write_text(json.dumps(told, indent=1) + "\n")
    (options.out / "memory.md").write_text(as_markdown(told))
    print(as_markdown(told))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
