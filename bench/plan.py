"""Does a plan keep its word? Expected std against what ``identify`` claims, and against the usual session.

Each rig is planned, the planned session is simulated (rig doubts, sensor errors and noise drawn), and
identified. Rigs: case studies 1, 10 and 14 of the thesis and three inclined cables; a second seed draws other
truths of the same plan. Sessions go to a log as they are done; a second call goes on where the first stopped.

    python -m bench.plan [--sessions 12] [--minutes 1.0] [--only-plan]
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.monte_carlo import GEOMETRIES, specification
from rig_identification.plan import Means, Plan, plan
from rig_identification.plan.planning import session_of
from rig_identification.result import ELEMENTS
from rig_identification.search.identify import identify
from rig_identification.simulate import SampleRates, simulate_session

HERE = Path(__file__).parent
RATES = SampleRates(tension=100.0, exciter=200.0, shaft=0.0, imu=100.0, inclinometer=50.0, ground_truth=0.0)


def planned(geometry: str, minutes: float) -> tuple[Plan, float]:
    """The plan of one rig, and the CPU seconds that it took."""
    spec = specification(geometry)
    begin = time.process_time()
    found = plan(spec.rig, spec.elements, Means(minutes=minutes, rates=RATES))
    return found, time.process_time() - begin


def one_session(found: Plan, seed: Sequence[int]) -> dict[str, Any]:
    """Simulate the plan's session with all doubts, identify it, and set both claims beside each other."""
    session, truth = simulate_session(session_of(found), np.random.default_rng(seed))
    answer = identify(session)
    claimed = np.sqrt(np.diag(answer.total.covariance))
    return {
        "verdict": answer.mismatch.verdict,
        "alternatives": [str(a.get("effect")) for a in answer.mismatch.alternatives],
        "unobservable": list(answer.total.unobservable),
        "claimed": claimed.tolist(),
        "error": (answer.total.values - truth.elements).tolist(),
    }


def entry_of(geometry: str, found: Plan, seconds: float) -> dict[str, Any]:
    """What a plan says."""
    return {
        "geometry": geometry,
        "cpu_seconds": seconds,
        "worst": found.worst,
        "usual_worst": found.usual_worst,
        "expected": np.sqrt(np.diag(found.expected.covariance)).tolist(),
        "alone": np.sqrt(np.diag(found.alone)).tolist(),
        "expected_unobservable": list(found.expected.unobservable),
        "undecided": [] if found.doubts is None else list(found.doubts.undecided),
        "recordings": [f"{p.item.name} {p.item.seconds:g} s {p.role}" for p in found.recordings],
    }


def as_markdown(entries: list[dict[str, Any]], minutes: float) -> str:
    """The figures as two tables."""
    lines = [
        "# Plans and what came of them",
        "",
        f"Made by `python -m bench.plan --minutes {minutes:g}`. Expected over claimed std of each number; "
        "sessions that were answered with another verdict than none are listed and not counted.",
        "",
        "| rig | session | verdict | " + " | ".join(ELEMENTS) + " | median of J |",
        "| --- | --- | --- |" + " --- |" * (len(ELEMENTS) + 1),
    ]
    for e in entries:
        if "claimed" not in e:
            continue
        ratio = np.array(e["expected"]) / np.array(e["claimed"])
        lost = set(e["unobservable"]) | set(e["expected_unobservable"])
        cells = ["–" if n in lost else f"{r:.2f}" for n, r in zip(ELEMENTS, ratio, strict=True)]
        known = [r for n, r in zip(ELEMENTS, ratio, strict=True) if n not in lost and n[0] == "J"]
        middle = f"{np.median(known):.2f}" if known else "–"
        lines.append(
            f"| {e['geometry']} | {e['session']} | {e['verdict']} | {' | '.join(cells)} | {middle} |"
        )
    lines += [
        "",
        "| rig | worst σ(J) planned | of the usual session | gain | CPU s |",
        "| --- | --- | --- | --- | --- |",
    ]
    for geometry in dict.fromkeys(e["geometry"] for e in entries):
        e = next(e for e in entries if e["geometry"] == geometry)
        usual = e["usual_worst"]
        gain = "–" if usual is None else f"{usual / e['worst']:.2f}"
        told = "–" if usual is None else f"{100 * usual:.3g} %"
        lines.append(f"| {geometry} | {100 * e['worst']:.3g} % | {told} | {gain} | {e['cpu_seconds']:.0f} |")
    lines += ["", within(entries), ""]
    return "\n".join(lines)


def within(entries: list[dict[str, Any]]) -> str:
    """How many expected std lie within 15 % of what is claimed."""
    ratios = []
    for e in entries:
        if e.get("verdict") == "none":
            lost = set(e["unobservable"]) | set(e["expected_unobservable"])
            both = zip(ELEMENTS, e["expected"], e["claimed"], strict=True)
            ratios += [x / c for n, x, c in both if n not in lost]
    if not ratios:
        return "No session was answered with verdict none yet."
    inside = sum(abs(r - 1.0) <= 0.15 for r in ratios)
    return (
        f"{inside} of {len(ratios)} expected std within 15 % of the claimed one; median ratio "
        f"{np.median(ratios):.3f}, from {min(ratios):.2f} to {max(ratios):.2f}."
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: run what is missing, write the figures."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.plan", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--sessions", type=int, default=12)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--only-plan", action="store_true", help="no session is simulated and identified")
    parser.add_argument("--log", type=Path, default=HERE / "plan.jsonl", help="one line a session")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of plan.md")
    options = parser.parse_args(arguments)
    lines = options.log.read_text().splitlines() if options.log.exists() else []
    entries = [e for e in map(json.loads, lines) if e["minutes"] == options.minutes]
    known = {(e["geometry"], e["session"]) for e in entries}
    plans: dict[str, dict[str, Any]] = {}
    made: dict[str, Plan] = {}
    for number in range(options.sessions):
        geometry = GEOMETRIES[number % len(GEOMETRIES)]
        if (geometry, number) in known:
            continue
        if geometry not in made:
            made[geometry], seconds = planned(geometry, options.minutes)
            plans[geometry] = entry_of(geometry, made[geometry], seconds)
        entry = {"minutes": options.minutes, "session": number, **plans[geometry]}
        if not options.only_plan:
            entry |= one_session(made[geometry], [7, number])
        entries.append(entry)
        with options.log.open("a") as log:
            log.write(json.dumps(entry) + "\n")
        print(json.dumps(entry), flush=True)
    (options.out / "plan.md").write_text(as_markdown(entries, options.minutes))
    print(as_markdown(entries, options.minutes))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
