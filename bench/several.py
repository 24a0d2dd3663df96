"""Do `fuse` and `compare` claim what they may? Pairs of simulated sessions of one body in two poses of a rig.

A pair has one true rig: what stays from session to session (several/ties.py) is drawn once and is the same in
both, zeros, biases and clocks are drawn for each, and both rest on one weighing. Between the poses the hinges
move on the body. A third session hangs in the second pose a body that is another one: a mass was put on.
Fits start at the truth: what is tested here is what is made of two optima, not the way to them. Pairs go to a
log as they are done; a second call goes on where the first stopped.

    python -m bench.several [--pairs 60] [--processes 1]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import beta

from bench.monte_carlo import three_cables
from bench.resumed import entries_of, fingerprint
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.joint_information import joint_information
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.parameters import Parameter, parameter_set
from rig_identification.estimate.solve import solve
from rig_identification.model.body import elements_from_linear, linear_from_elements
from rig_identification.model.motion import rig_model
from rig_identification.recording import Session
from rig_identification.report.joint_json import joint_from_dict, joint_to_dict
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.several.compare import LEVEL, compare
from rig_identification.several.fuse import fuse
from rig_identification.several.session_result import SessionResult
from rig_identification.several.ties import STAYING, Sharing
from rig_identification.simulate import SampleRates, SessionSpec, Truth, simulate_session
from rig_identification.simulate.at_truth import point_at_truth
from rig_identification.simulate.true_rig import CUT, channels_of

HERE = Path(__file__).parent
RATES = SampleRates(tension=100.0, exciter=200.0, shaft=0.0, imu=100.0, inclinometer=25.0, ground_truth=0.0)
RUN, REST = 12.0, 4.0  # s
#: Second pose: the hinges sit elsewhere on the body, turned about the vertical and lower (rad, m).
TURN, LOWER = 0.5, -0.35
#: What the third session's body bears more: kg at a place in the body frame, m.
ADDED, ADDED_AT = 1.0, np.array([1.9, 2.2, -0.3])
PREFACE = """\
Made by `python -m bench.several --pairs {pairs}`. Each pair: one body of 1100 kg on three cables, hung in
two poses, one run of {run:g} s and {rest:g} s at rest each. Rig tolerances, gains and scales are drawn once a
pair, zeros, biases and clocks once a session; both rest on one weighing. All fits converged in {converged} of
{pairs} pairs. In brackets: 95 % interval of a share, by the number of pairs."""
#: Sessions of a pair: first pose, second pose, second pose with another body.
FIRST, SECOND, OTHER = "first", "second", "other"


def poses() -> dict[str, SessionSpec]:
    """The three sessions' specifications, less what is drawn for a pair."""
    spec = three_cables()
    spec = replace(spec, rates=RATES, statics=tuple(replace(s, duration=REST) for s in spec.statics[:1]))
    spec = replace(spec, runs=tuple(replace(run, duration=RUN) for run in spec.runs))
    points = np.array([cable.body_point for cable in spec.rig.cables])
    middle = points.mean(axis=0)
    c, s = np.cos(TURN), np.sin(TURN)
    turned = middle + (points - middle) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    turned[:, 2] += LOWER
    cables = tuple(
        replace(cable, body_point=np.round(p, 3)) for cable, p in zip(spec.rig.cables, turned, strict=True)
    )
    second = replace(spec, rig=replace(spec.rig, cables=cables))
    return {FIRST: spec, SECOND: second, OTHER: replace(second, elements=with_mass(spec.elements))}


def with_mass(elements: np.ndarray) -> np.ndarray:
    """The ten numbers of a body that bears ``ADDED`` more at ``ADDED_AT``."""
    at = ADDED_AT
    own = ADDED * (float(at @ at) * np.eye(3) - np.outer(at, at))
    point = np.concatenate([[ADDED], ADDED * at, own[np.triu_indices(3)]])
    return np.asarray(elements_from_linear(linear_from_elements(elements) + point))


def stays(parameter: Parameter) -> bool:
    """Whether a doubt is the same in all sessions of a rig, as the simulated truth has it."""
    name = parameter.name.split(".")
    return name[0] == "level" or name[1] in STAYING


def one_pair(number: int) -> dict[str, Any]:
    """Simulate and fit the sessions of one pair."""
    rng = np.random.default_rng([51, number])
    specs = poses()
    shared: dict[str, float] = {}
    reading = float(specs[FIRST].elements[0] + specs[FIRST].rig.mass_std * rng.standard_normal())
    entry: dict[str, Any] = {"pair": number, "code": fingerprint(), "sessions": {}}
    for name, spec in specs.items():
        model = rig_model(spec.rig, spec.elements)
        for p in parameter_set(spec.rig, model, channels_of(spec)).free:
            if stays(p):
                # A hinge on the body is another one in the second pose
                key = f"{name == FIRST} {p.name}" if "body_point" in p.name else p.name
                shared.setdefault(key, float(np.clip(rng.standard_normal(), -CUT, CUT)))
        given = {k.split(" ")[-1]: v for k, v in shared.items() if not k.startswith(str(name != FIRST))}
        weighed = reading + (ADDED if name == OTHER else 0.0)
        session, truth = simulate_session(replace(spec, given_doubts=given, scale_reading=weighed), rng)
        entry["sessions"][name] = fitted(session, truth)
    return entry


def fitted(session: Session, truth: Truth) -> dict[str, Any]:
    """The fit of one session from the truth, as far as it is kept."""
    problem, _, _ = pose_problem(session)
    evaluation, converged = solve(problem, point_at_truth(problem, truth))
    estimate = inertial_estimate(problem, evaluation)
    return {
        "converged": bool(converged),
        "truth": truth.elements.tolist(),
        "value": estimate.values.tolist(),
        "covariance": estimate.covariance.tolist(),
        "unobservable": list(estimate.unobservable),
        "joint": joint_to_dict(joint_information(session, problem, evaluation)),
    }


def result_of(name: str, entry: dict[str, Any]) -> SessionResult:
    """A session of the log as it is compared and fused."""
    estimate = InertialEstimate(
        np.array(entry["value"]), np.array(entry["covariance"]), tuple(entry["unobservable"])
    )
    return SessionResult(name, estimate, "none", (), joint_from_dict(entry["joint"]))


def score(entries: list[dict[str, Any]]) -> dict[str, Any]:
    """Coverage, sharpness, false alarms and power."""
    done = [e for e in entries if all(s["converged"] for s in e["sessions"].values())]
    truth = np.array(poses()[FIRST].elements)
    errors, singles, alarms, found, single_p, gains, apart = [], [], [], [], [], [], []
    nothing_shared = Sharing(rigs=("one", "other"))
    for entry in done:
        pair = {name: result_of(name, told) for name, told in entry["sessions"].items()}
        fused = fuse([pair[FIRST], pair[SECOND]])
        errors.append((fused.total.values - truth) / np.sqrt(np.diag(fused.total.covariance)))
        singles += [
            (pair[n].values - truth) / np.sqrt(np.diag(pair[n].estimate.covariance)) for n in (FIRST, SECOND)
        ]
        gains.append([fused.gain[name] for name in ELEMENTS])
        alike, unlike = fused.comparison, compare([pair[FIRST], pair[OTHER]])
        alarms.append((alike.p, alike.together.p, alike.together.chi_square))
        single_p.append([alike.numbers[name].p for name in ELEMENTS])
        blind = compare([pair[FIRST], pair[OTHER]], nothing_shared)
        found.append((unlike.p, unlike.disagreeing[:1], blind.p))
        apart.append(independent_chi_square(pair[FIRST], pair[SECOND]))
    z, one = np.array(errors), np.array(singles)
    p, power = np.array([a[0] for a in alarms]), np.array([f[0] for f in found])
    return {
        "pairs": len(entries),
        "converged": len(done),
        "code": entries[0]["code"],
        "fused": {
            "coverage": share(np.abs(z) <= 1.959964),
            "rms_error_in_std": float(np.sqrt(np.mean(z**2))),
            "single_coverage": share(np.abs(one) <= 1.959964),
            "elements": {
                name: {
                    "coverage": float(np.mean(np.abs(z[:, k]) <= 1.959964)),
                    "rms_error_in_std": float(np.sqrt(np.mean(z[:, k] ** 2))),
                    "best_single_std_over_fused": float(np.median(np.array(gains)[:, k])),
                }
                for k, name in enumerate(ELEMENTS)
            },
        },
        "agree": {
            "false_alarms": share(p < LEVEL),
            "false_alarms_at_5_percent": share(p < 0.05),
            "mean_chi_square_over_freedom": float(np.mean([a[2] for a in alarms]) / 10.0),
            "as_if_nothing_were_shared": float(np.mean(apart) / 10.0),
            "numbers_below_5_percent": share(np.array(single_p) < 0.05),
        },
        "differ": {
            "found": share(power < LEVEL),
            "found_as_if_nothing_were_shared": share(np.array([f[2] for f in found]) < LEVEL),
            "named_first": {n: sum(f[1] == (n,) for f in found) for n in ELEMENTS},
        },
    }


def independent_chi_square(one: SessionResult, other: SessionResult) -> float:
    """Chi-square of the difference of two answers as if they shared nothing."""
    both = one.estimate.covariance + other.estimate.covariance
    off = (one.values - other.values) / np.sqrt(np.diag(both))
    return float(off @ np.linalg.solve(both / np.sqrt(np.outer(np.diag(both), np.diag(both))), off))


def share(inside: np.ndarray) -> dict[str, float]:
    """A share, with its 95 % interval by Clopper and Pearson over the pairs."""
    pairs = len(inside)
    rate = float(np.mean(inside))
    # Ten numbers of a pair hang together: the interval is that of so many pairs, on the cautious side
    hits = rate * pairs
    low = float(beta.ppf(0.025, hits, pairs - hits + 1)) if hits > 0 else 0.0
    high = float(beta.ppf(0.975, hits + 1, pairs - hits)) if hits < pairs else 1.0
    return {"share": rate, "low": low, "high": high}


def percent(told: dict[str, float]) -> str:
    """A share for the page."""
    return f"{100 * told['share']:.1f} % ({100 * told['low']:.0f} to {100 * told['high']:.0f} %)"


def as_markdown(scores: dict[str, Any]) -> str:
    """The figures as a page."""
    fused, agree, differ = scores["fused"], scores["agree"], scores["differ"]
    named = ", ".join(f"{n} {count}" for n, count in differ["named_first"].items() if count) or "none"
    lines = [
        "# Monte Carlo of several sessions",
        "",
        *PREFACE.format(run=RUN, rest=REST, **scores).splitlines(),
        "",
        "| what | figure | should be |",
        "| --- | --- | --- |",
        f"| fused 95 % intervals that hold | {percent(fused['coverage'])} | 95 % |",
        f"| fused error, rms in its std | {fused['rms_error_in_std']:.2f} | 1 |",
        f"| single sessions' 95 % intervals that hold | {percent(fused['single_coverage'])} | 95 % |",
        f"| pairs of one body said to disagree, level 1 % | {percent(agree['false_alarms'])} | at most 1 % |",
        f"| ... at level 5 % | {percent(agree['false_alarms_at_5_percent'])} | at most 5 % |",
        f"| single numbers with p below 5 % | {percent(agree['numbers_below_5_percent'])} | 5 % |",
        f"| chi-square over its degrees of freedom | {agree['mean_chi_square_over_freedom']:.2f} | 1 |",
        f"| ... as if the sessions shared nothing | {agree['as_if_nothing_were_shared']:.2f} | |",
        f"| pairs that differ by {ADDED:g} kg, said to disagree | {percent(differ['found'])} | |",
        f"| ... as if the sessions shared nothing | {percent(differ['found_as_if_nothing_were_shared'])} | |",
        "",
        f"Most surely disagreeing number where {ADDED:g} kg were put on: {named}.",
        "",
        "| number | 95 % hold | rms error in std | best single std over fused std, median |",
        "| --- | --- | --- | --- |",
    ]
    for name, told in fused["elements"].items():
        lines.append(
            f"| {name} | {100 * told['coverage']:.0f} % | {told['rms_error_in_std']:.2f} | "
            f"{told['best_single_std_over_fused']:.2f} |"
        )
    return "\n".join([*lines, "", f"Fingerprint of the code: {scores['code']}", ""])


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: run what is missing, write the figures."""
    parser = argparse.ArgumentParser(prog="python -m bench.several", description=__doc__.partition("\n")[0])
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--log", type=Path, default=HERE / "several.jsonl", help="one line a pair")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of several.json and several.md")
    options = parser.parse_args(arguments)
    jobs = [(n,) for n in range(options.pairs)]
    entries = entries_of(
        options.log, fingerprint(), jobs, lambda e: (e["pair"],), one_pair, options.processes
    )
    scores = score(sorted(entries, key=lambda e: e["pair"])[: options.pairs])
    (options.out / "several.json").write_text(json.dumps(scores, indent=1) + "\n")
    (options.out / "several.md").write_text(as_markdown(scores))
    print(as_markdown(scores))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
