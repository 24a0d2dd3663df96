"""Are the numbers honest that are told of a session which hardly tells the inertia?

A car of 1500 kg on three, four or six parallel cables, pulled aside by 640 N and let go, or shaken by a force
of 0.5 % of its weight for a few seconds besides. Rig doubts, sensor errors and noise are drawn. The ideal
model is fitted from no guess. Counted are the numbers that are told and lie more than three of their stds off
the truth: by the covariance at the end of the fit alone (before), and with its valleys asked
(estimate/valley.py, after). Sessions go to a log as they are done; a second call goes on where the first
stopped.

    python -m bench.weak [--seeds 2] [--rig six ...] [--processes 1]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.resumed import entries_of, fingerprint
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.model.work import UNIT, counted
from rig_identification.recording import Dummy
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.simulate import (
    Pulled,
    RunSpec,
    SampleRates,
    SessionSpec,
    StaticSpec,
    UnbalancedMass,
    simulate_session,
)

HERE = Path(__file__).parent
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
RATES = SampleRates(tension=50.0, exciter=100.0, shaft=0.0, imu=50.0, inclinometer=25.0, ground_truth=0.0)
NOISE = {
    "tension": 2.0,
    "exciter_force": 0.5,
    "specific_force": 0.01,
    "angular_rate": 3e-4,
    "inclination": 3e-4,
}
MASS, GRAVITY = 1500.0, 9.80665
#: Cables of a rig, where its body's centre of mass lies over them (m), and EA of those that stretch, N.
RIGS: dict[str, tuple[int, tuple[float, float], dict[str, tuple[float, ...]]]] = {
    "six": (6, (0.8, 1.4), {"cable_elasticity": (1.5e6,)}),
    "four": (4, (0.8, 0.75), {"cable_elasticity": (1.5e6,)}),
    "three": (3, (0.55, 0.5), {}),
}
#: Seconds of a run, and the force of an unbalanced mass at 0.7 Hz as a part of the weight; 0: let go alone.
WAYS: dict[str, tuple[float, float]] = {"2 s": (2.0, 0.0), "4 s": (4.0, 0.0), "4 s shaken": (4.0, 0.005)}
#: Stds beyond which a number that is told counts as wrong.
BEYOND = 3.0
PREFACE = """\
Made by `python -m bench.weak --seeds {seeds}`. Each session: a car of 1500 kg on parallel cables of 2.8 m,
two recordings at rest of 5 s and one run; rig doubts, sensor errors and noise drawn. Cells and IMU 50 Hz.
Of {sessions} sessions {asked} are fitted to the noise; the others' numbers do not come from this fit. Before:
the covariance at the end of the fit. After: each number asked along its valley (`estimate/valley.py`)."""


def specification(rig: str, way: str) -> SessionSpec:
    """A session of one kind."""
    cables, center, effects = RIGS[rig]
    seconds, part = WAYS[way]
    elements = np.array([MASS, *center, -0.9, 1960.0, 12.0, -10.0, 600.0, -25.0, 2080.0])
    points = [np.array([1.6 * (i % 2), 1.5 * (i // 2), 0.0]) for i in range(cables)]
    motor = UnbalancedMass(part * MASS * GRAVITY / (2.0 * np.pi * 0.7) ** 2, 0.7, ramp=2.0)
    described = Rig(
        GRAVITY,
        tuple(Cable(f"cable_{i + 1}", p, p, 2.8) for i, p in enumerate(points)),
        mass=MASS,
        mass_std=0.5,
        imu=Mount(np.array([0.8, 1.0, -0.2]), LEVEL),
        inclinometer=Mount(np.zeros(3), LEVEL),
        exciter=Mount(elements[1:4] + np.array([0.3, 0.2, 0.0]), LEVEL) if part else None,
        noise=NOISE,
    )
    pull = Pulled(np.array([400.0, 500.0, 0.0]), np.array([1.6, 0.0, -0.5]))
    statics = (
        StaticSpec("bare", 5.0),
        StaticSpec("with_dummy", 5.0, Dummy(50.0, np.array([0.3, 0.2, 0.1]))),
    )
    runs = (RunSpec("run_1", seconds, pull, motor if part else None),)
    return SessionSpec("weak", described, elements, runs=runs, statics=statics, rates=RATES, effects=effects)


def one_session(rig: str, way: str, seed: int) -> dict[str, Any]:
    """Simulate and fit one session: what is told of it before and after; nothing of one that is not asked."""
    kind = [*RIGS].index(rig), [*WAYS].index(way)
    session, truth = simulate_session(specification(rig, way), np.random.default_rng([seed, *kind]))
    with counted() as whole:
        fitted = fit_session(session)
    entry = {"code": fingerprint(Path(__file__)), "rig": rig, "way": way, "seed": seed}
    entry |= {"work": whole.done / UNIT, "truth": list(map(float, truth.elements)), "asked": False}
    if fitted.valley is not None:
        before = inertial_estimate(fitted.problem, fitted.valley.began)
        gain = fitted.valley.began.cost - fitted.valley.evaluation.cost
        entry |= {"asked": True, "before": told(before), "after": told(fitted.valley.estimate)}
        entry |= {"fits": fitted.valley.fits, "gain": gain}
    return entry


def told(estimate: InertialEstimate) -> dict[str, Any]:
    """An estimate for the log."""
    std = np.sqrt(np.diag(estimate.covariance))
    return {
        "values": list(map(float, estimate.values)),
        "std": list(map(float, std)),
        "lost": list(estimate.unobservable),
    }


def figures(entries: list[dict[str, Any]], when: str) -> dict[str, Any]:
    """Numbers told, those of them that lie off, the farthest, and the median std of moments that are told."""
    off, moments = [], []
    for entry in entries:
        one, truth = entry[when], np.array(entry["truth"])
        z = np.abs(np.array(one["values"]) - truth) / np.array(one["std"])
        off += [float(z[k]) for k, name in enumerate(ELEMENTS) if name not in one["lost"]]
        shares = np.array(one["std"]) / truth
        moments += [float(shares[ELEMENTS.index(n)]) for n in ("Jxx", "Jyy", "Jzz") if n not in one["lost"]]
    return {
        "told": len(off),
        "beyond": sum(z > BEYOND for z in off),
        "farthest": max(off),
        "moments": len(moments),
        "median_std": float(np.median(moments)) if moments else None,
    }


def score(entries: list[dict[str, Any]], seeds: int) -> dict[str, Any]:
    """All figures, for each kind of session and for all of them."""
    asked = [e for e in entries if e["asked"]]
    rows = []
    for rig in RIGS:
        for way in WAYS:
            own = [e for e in asked if (e["rig"], e["way"]) == (rig, way)]
            if own:
                fits = float(np.mean([e["fits"] for e in own]))
                row = {"rig": rig, "way": way, "sessions": len(own), "fits": fits}
                rows.append(row | {when: figures(own, when) for when in ("before", "after")})
    every = {when: figures(asked, when) for when in ("before", "after")}
    code = entries[0]["code"]
    return {
        "code": code,
        "seeds": seeds,
        "sessions": len(entries),
        "asked": len(asked),
        "all": every,
        "rows": rows,
    }


def as_markdown(scores: dict[str, Any]) -> str:
    """The figures as a page."""
    lines = [
        "# Sessions that hardly tell the inertia",
        "",
        *PREFACE.format(**scores).splitlines(),
        "",
        "| cables, run | sessions | numbers told, before and after | beyond 3 std | farthest, std | "
        "median std of moments told | further fits |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in scores["rows"]:
        lines.append(f"| {row['rig']}, {row['way']} | {row['sessions']} | {_pair(row)} | {row['fits']:.1f} |")
    lines += [f"| all | {scores['asked']} | {_pair(scores['all'])} | |", ""]
    return "\n".join([*lines, f"Fingerprint of the code: {scores['code']}", ""])


def _pair(row: dict[str, Any]) -> str:
    """Four cells of the page."""
    before, after = row["before"], row["after"]

    def share(one: dict[str, Any]) -> str:
        return "none told" if one["median_std"] is None else f"{100 * one['median_std']:.1f} %"

    return (
        f"{before['told']}, {after['told']} | {before['beyond']}, {after['beyond']} | "
        f"{before['farthest']:.1f}, {after['farthest']:.1f} | {share(before)}, {share(after)}"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: run what is missing, write the figures."""
    parser = argparse.ArgumentParser(prog="python -m bench.weak", description=__doc__.partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--rig", nargs="*", default=list(RIGS), choices=list(RIGS))
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--log", type=Path, default=HERE / "weak.jsonl", help="one line a session")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of weak.json and weak.md")
    options = parser.parse_args(arguments)
    jobs = [(rig, way, seed) for seed in range(options.seeds) for rig in options.rig for way in WAYS]
    entries = entries_of(
        options.log,
        fingerprint(Path(__file__)),
        jobs,
        lambda e: (e["rig"], e["way"], e["seed"]),
        one_session,
        options.processes,
    )
    wanted = [e for e in entries if (e["rig"], e["way"], e["seed"]) in jobs]
    scores = score(sorted(wanted, key=lambda e: jobs.index((e["rig"], e["way"], e["seed"]))), options.seeds)
    (options.out / "weak.json").write_text(json.dumps(scores, indent=1) + "\n")
    (options.out / "weak.md").write_text(as_markdown(scores))
    print(as_markdown(scores))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
