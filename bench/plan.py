"""Does a plan keep its word? Expected std against what a fit claims; its choice against the usual session.

*Expected*: a session of a release that is shaken and two recordings at rest is expected as ``plan`` does
it, simulated (rig doubts, sensor errors and noise drawn) and fitted. Fits go on from the truth, which ends
where one from no guess does in a fifth of the time. The first sessions are identified in full as well.
*Choice*: each rig is planned, and the worst std of its inertia set beside that of the usual session of
equal length. Rigs: case studies 1, 10 and 14 of the thesis and three inclined cables. Both go to a log as
they are done; a second call goes on where the first stopped.

    python -m bench.plan [--sessions 12] [--identified 0] [--plans 4] [--minutes 1.0]
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.certificate import at_truth
from bench.monte_carlo import GEOMETRIES, specification
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import solve
from rig_identification.plan import Means, plan
from rig_identification.plan.choose import worst
from rig_identification.plan.information import informations, laboratory
from rig_identification.plan.menu import Item
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.search.identify import identify
from rig_identification.simulate import SampleRates, SessionSpec, simulate_session

HERE = Path(__file__).parent
RATES = SampleRates(tension=100.0, exciter=200.0, shaft=0.0, imu=100.0, inclinometer=50.0, ground_truth=0.0)


def session_spec(geometry: str) -> SessionSpec:
    """One run of ten seconds, rest without and with a known mass."""
    return replace(specification(geometry), rates=RATES)


def expected(spec: SessionSpec) -> InertialEstimate:
    """What the plan expects of a session."""
    items = [Item(s.name, "", static=s) for s in spec.statics] + [Item(r.name, "", run=r) for r in spec.runs]
    lab = laboratory(spec, items[-1])
    parts = [part for part in informations(lab, items) if part is not None]
    return lab.expected(np.asarray(lab.prior + np.sum(parts, axis=0)))


def one_session(spec: SessionSpec, seed: Sequence[int], *, whole: bool) -> dict[str, Any]:
    """Simulate a session and fit it. whole: identify it, with the search, as well."""
    session, truth = simulate_session(spec, np.random.default_rng(seed))
    problem, point = at_truth(session, truth)
    fitted, converged = solve(problem, point)
    alone = inertial_estimate(problem, fitted)
    entry = {
        "converged": bool(converged),
        "unobservable": list(alone.unobservable),
        "claimed_fit": np.sqrt(np.diag(alone.covariance)).tolist(),
        "error": (alone.values - truth.elements).tolist(),
    }
    if not whole:
        return entry
    answer = identify(session)
    return entry | {
        "verdict": answer.mismatch.verdict,
        "alternatives": [str(a.get("effect")) for a in answer.mismatch.alternatives],
        "claimed_identify": np.sqrt(np.diag(answer.total.covariance)).tolist(),
    }


def one_plan(geometry: str, minutes: float) -> dict[str, Any]:
    """A plan's choice, and the CPU seconds that it took."""
    spec = session_spec(geometry)
    begin = time.process_time()
    found = plan(spec.rig, spec.elements, Means(minutes=minutes, rates=RATES))
    return {
        "cpu_seconds": time.process_time() - begin,
        "worst": worst(found.chosen.steps[-1].relative, found.chosen.determined),
        "usual_worst": found.usual_worst,
        "undecided": [] if found.doubts is None else list(found.doubts.undecided),
        "recordings": [f"{p.item.name} {p.item.seconds:g} s {p.role}" for p in found.recordings],
    }


#: Share of the claimed std within which an expected one is to lie.
NEAR = 0.15
CLAIMS = ("fit", "identify")


def ratios(entry: dict[str, Any], claim: str) -> dict[str, float]:
    """Expected over claimed std of each element that both determine."""
    lost = set(entry["unobservable"]) | set(entry["expected_unobservable"])
    both = zip(ELEMENTS, entry["expected"], entry[f"claimed_{claim}"], strict=True)
    return {name: x / c for name, x, c in both if name not in lost}


def as_markdown(sessions: list[dict[str, Any]], plans: list[dict[str, Any]]) -> str:
    """The figures as tables."""
    lines = ["# Plans and what comes of them", "", "Made by `python -m bench.plan`.", "", "## Expected", ""]
    lines += [told(sessions), "", "Expected over claimed std:", ""]
    lines += ["| rig | session | claimed by | verdict | " + " | ".join(ELEMENTS) + " |"]
    lines += ["| --- | --- | --- | --- |" + " --- |" * len(ELEMENTS)]
    for e in sessions:
        for claim in CLAIMS:
            if f"claimed_{claim}" in e:
                found = ratios(e, claim)
                cells = " | ".join(f"{found[n]:.2f}" if n in found else "–" for n in ELEMENTS)
                verdict = e.get("verdict", "") if claim == "identify" else ""
                lines.append(f"| {e['geometry']} | {e['session']} | {claim} | {verdict} | {cells} |")
    if not plans:
        return "\n".join([*lines, ""])
    lines += [
        "",
        "## Choice",
        "",
        "Worst std of the inertia's elements, as a share of their natural size.",
        "",
    ]
    lines += ["| rig | minutes | planned | usual session | gain | CPU s | recordings |"]
    lines += ["| --- | --- | --- | --- | --- | --- | --- |"]
    for e in plans:
        usual = e["usual_worst"]
        gain, shown = ("–", "–") if usual is None else (f"{usual / e['worst']:.2f}", f"{100 * usual:.3g} %")
        chosen = ", ".join(e["recordings"])
        lines.append(
            f"| {e['geometry']} | {e['minutes']:g} | {100 * e['worst']:.3g} % | {shown} | {gain} | "
            f"{e['cpu_seconds']:.0f} | {chosen} |"
        )
    return "\n".join([*lines, ""])


def told(sessions: list[dict[str, Any]]) -> str:
    """How many expected std lie near what is claimed."""
    parts = []
    for claim in CLAIMS:
        counted = [e for e in sessions if f"claimed_{claim}" in e and e.get("verdict", "none") == "none"]
        found = [r for e in counted for r in ratios(e, claim).values()]
        if found:
            near = sum(abs(r - 1.0) <= NEAR for r in found)
            share = f"{near} of {len(found)} within {100 * NEAR:.0f} %"
            span = f"from {min(found):.2f} to {max(found):.2f}"
            parts.append(
                f"Against {claim}, {len(counted)} sessions: {share}, median {np.median(found):.3f}, {span}."
            )
    return " ".join(parts) or "No session yet."


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: run what is missing, write the figures."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.plan", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--sessions", type=int, default=12)
    parser.add_argument("--identified", type=int, default=0, help="sessions that are identified in full")
    parser.add_argument("--plans", type=int, default=4, help="rigs that are planned")
    parser.add_argument("--minutes", type=float, default=1.0, help="of a plan")
    parser.add_argument("--log", type=Path, default=HERE / "plan.jsonl", help="one line a session or plan")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of plan.md")
    options = parser.parse_args(arguments)
    entries = [json.loads(x) for x in options.log.read_text().splitlines()] if options.log.exists() else []

    def keep(entry: dict[str, Any]) -> None:
        entries.append(entry)
        with options.log.open("a") as log:
            log.write(json.dumps(entry) + "\n")
        print(json.dumps(entry), flush=True)

    known = {(e["geometry"], e.get("session")) for e in entries}
    predicted: dict[str, InertialEstimate] = {}
    for number in range(options.sessions):
        geometry = GEOMETRIES[number % len(GEOMETRIES)]
        if (geometry, number) not in known:
            spec = session_spec(geometry)
            if geometry not in predicted:
                predicted[geometry] = expected(spec)
            hoped = predicted[geometry]
            keep(
                {
                    "geometry": geometry,
                    "session": number,
                    "expected": np.sqrt(np.diag(hoped.covariance)).tolist(),
                    "expected_unobservable": list(hoped.unobservable),
                    **one_session(spec, [7, number], whole=number < options.identified),
                }
            )
    for geometry in GEOMETRIES[: options.plans]:
        if not any(e["geometry"] == geometry and e.get("minutes") == options.minutes for e in entries):
            keep({"geometry": geometry, "minutes": options.minutes, **one_plan(geometry, options.minutes)})
    text = as_markdown([e for e in entries if "session" in e], [e for e in entries if "minutes" in e])
    (options.out / "plan.md").write_text(text)
    print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
