"""Does a plan keep its word? Expected std against what ``identify`` claims, and against the usual session.

Each rig is planned. The planned session is simulated (rig doubts, sensor errors and noise drawn) and its
ideal model fitted, which tells the std if nothing is left out. The first sessions are identified in full as
well, which adds what stays undecided. Rigs: case studies 1, 10 and 14 of the thesis and three inclined
cables; a second seed draws other truths of the same plan. Sessions go to a log as they are done; a second
call goes on where the first stopped.

    python -m bench.plan [--sessions 12] [--minutes 1.0] [--identified 4]
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
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.plan import Means, Plan, plan
from rig_identification.plan.choose import worst
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


def one_session(found: Plan, seed: Sequence[int], *, whole: bool) -> dict[str, Any]:
    """Simulate the plan's session with all doubts and fit it. whole: identify it as well."""
    session, truth = simulate_session(session_of(found), np.random.default_rng(seed))
    fitted = fit_session(session)
    alone = inertial_estimate(fitted.problem, fitted.evaluation)
    entry = {
        "converged": bool(fitted.converged),
        "unobservable": list(alone.unobservable),
        "claimed_alone": np.sqrt(np.diag(alone.covariance)).tolist(),
        "error": (alone.values - truth.elements).tolist(),
    }
    if not whole:
        return entry
    answer = identify(session)
    return entry | {
        "verdict": answer.mismatch.verdict,
        "alternatives": [str(a.get("effect")) for a in answer.mismatch.alternatives],
        "claimed": np.sqrt(np.diag(answer.total.covariance)).tolist(),
    }


def entry_of(geometry: str, found: Plan, seconds: float) -> dict[str, Any]:
    """What a plan says."""
    return {
        "geometry": geometry,
        "cpu_seconds": seconds,
        "worst": found.worst,
        "worst_alone": worst(found.chosen.steps[-1].relative, found.chosen.determined),
        "usual_worst": found.usual_worst,
        "expected": np.sqrt(np.diag(found.expected.covariance)).tolist(),
        "alone": np.sqrt(np.diag(found.alone)).tolist(),
        "expected_unobservable": list(found.expected.unobservable),
        "undecided": [] if found.doubts is None else list(found.doubts.undecided),
        "recordings": [f"{p.item.name} {p.item.seconds:g} s {p.role}" for p in found.recordings],
    }


#: Share of the claimed std within which an expected one is to lie.
NEAR = 0.15


def ratios(entry: dict[str, Any], expected: str, claimed: str) -> dict[str, float]:
    """Expected over claimed std of each element that both determine."""
    lost = set(entry["unobservable"]) | set(entry["expected_unobservable"])
    both = zip(ELEMENTS, entry[expected], entry[claimed], strict=True)
    return {name: x / c for name, x, c in both if name not in lost}


def as_markdown(entries: list[dict[str, Any]], minutes: float) -> str:
    """The figures as tables."""
    lines = [
        "# Plans and what came of them",
        "",
        f"Made by `python -m bench.plan --minutes {minutes:g}`. Expected over claimed std of each number.",
        "*fit*: if nothing is left out, against the ideal model's fit. *identify*: with what stays",
        "undecided, against the whole answer.",
        "",
        "| rig | session | claimed by | verdict | " + " | ".join(ELEMENTS) + " |",
        "| --- | --- | --- | --- |" + " --- |" * len(ELEMENTS),
    ]
    for e in entries:
        for word, expected, claimed in (
            ("fit", "alone", "claimed_alone"),
            ("identify", "expected", "claimed"),
        ):
            if claimed in e:
                found = ratios(e, expected, claimed)
                cells = " | ".join(f"{found[n]:.2f}" if n in found else "–" for n in ELEMENTS)
                verdict = e.get("verdict", "") if word == "identify" else ""
                lines.append(f"| {e['geometry']} | {e['session']} | {word} | {verdict} | {cells} |")
    head = "| rig | worst σ(J) planned | of the usual session | gain | CPU s |"
    lines += ["", told(entries), "", head, "| --- | --- | --- | --- | --- |"]
    for geometry in dict.fromkeys(e["geometry"] for e in entries):
        e = next(e for e in entries if e["geometry"] == geometry)
        usual = e["usual_worst"]
        gain = "–" if usual is None else f"{usual / e['worst_alone']:.2f}"
        shown = "–" if usual is None else f"{100 * usual:.3g} %"
        planned_worst = f"{100 * e['worst_alone']:.3g} %"
        lines.append(f"| {geometry} | {planned_worst} | {shown} | {gain} | {e['cpu_seconds']:.0f} |")
    return "\n".join([*lines, ""])


def told(entries: list[dict[str, Any]]) -> str:
    """How many expected std lie near what is claimed."""
    parts = []
    for word, expected, claimed in (("fit", "alone", "claimed_alone"), ("identify", "expected", "claimed")):
        counted = [e for e in entries if claimed in e and e.get("verdict", "none") == "none"]
        found = [r for e in counted for r in ratios(e, expected, claimed).values()]
        if found:
            near = sum(abs(r - 1.0) <= NEAR for r in found)
            told_near = f"{near} of {len(found)} within {100 * NEAR:.0f} %"
            span = f"from {min(found):.2f} to {max(found):.2f}"
            middle = f"median {np.median(found):.3f}"
            parts.append(f"Against {word}, {len(counted)} sessions: {told_near}, {middle}, {span}.")
    return " ".join(parts) or "No session yet."


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: run what is missing, write the figures."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.plan", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--sessions", type=int, default=12)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--identified", type=int, default=4, help="sessions that are identified in full")
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
        entry |= one_session(made[geometry], [7, number], whole=number < options.identified)
        entries.append(entry)
        with options.log.open("a") as log:
            log.write(json.dumps(entry) + "\n")
        print(json.dumps(entry), flush=True)
    (options.out / "plan.md").write_text(as_markdown(entries, options.minutes))
    print(as_markdown(entries, options.minutes))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
