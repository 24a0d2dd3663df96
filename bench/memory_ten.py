"""What ten sessions teach of a rig that walks, and in which poses a moved hinge is seen.

Ten sessions of other bodies teach, an eleventh recalls. Hinges, lengths, gains and scales walk by a tenth of
their tolerance from session to session; zeros, biases and clocks are new in each. A session is its fit's own
joint information, linearised once a pose at a simulated session's truth, and an optimum drawn with it: errors
of recordings and doubts are Gaussian, everything after them is the code under test. Poses are hung on other
eyes of the body (its hinges are new points) or on the same eyes with other cable lengths (these are new).

    python -m bench.memory_ten [--rigs 100] [--seconds 12 60]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.resumed import fingerprint
from bench.several import FIRST, percent, poses, share
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.joint_information import joint_information
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import evaluate
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.several.compare import LEVEL
from rig_identification.several.memory import learned, recalled
from rig_identification.several.session_result import SessionResult
from rig_identification.several.ties import NEW, Sharing, ties
from rig_identification.simulate import SessionSpec, simulate_session
from rig_identification.simulate.at_truth import point_at_truth

HERE = Path(__file__).parent
Array = np.ndarray
SESSIONS, MOVED = 10, 0.002  # m
#: Largest turn (rad) and shift (m) of the eyes, largest share of the lengths, that poses differ by.
TURNED, SHIFTED, LENGTHENED = 0.6, 0.4, 0.12
RIG = "rig"
#: What teaches, and what recalls, by the poses' names.
SCHEMES = {
    "same pose": (["bare"] * SESSIONS, "bare"),
    "ten poses, same eyes": (["length_1", "length_2", "length_3"], "bare"),
    "one other pose, same eyes": (["length_1"], "bare"),
    "ten poses, other eyes": (["eyes_1", "eyes_2", "eyes_3"], "bare"),
    "one other pose, other eyes": (["eyes_1"], "bare"),
}


def specification(name: str, seconds: float) -> SessionSpec:
    """A pose by its name, with a run so long."""
    spec = poses()[FIRST]
    cables, (kind, _, number) = spec.rig.cables, name.partition("_")
    rng = np.random.default_rng([3, len(kind), int(number or 0)])
    if kind == "length":
        factors = 1.0 + rng.uniform(-LENGTHENED, LENGTHENED, len(cables))
        cables = tuple(
            replace(c, length=round(c.length * float(f), 3)) for c, f in zip(cables, factors, strict=True)
        )
    if kind == "eyes":
        points = np.array([c.body_point for c in cables])
        angle = rng.uniform(-TURNED, TURNED)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        points = points.mean(axis=0) + (points - points.mean(axis=0)) @ turn
        points[:, 2] += rng.uniform(-SHIFTED, 0.5 * SHIFTED)
        cables = tuple(replace(k, body_point=np.round(p, 3)) for k, p in zip(cables, points, strict=True))
    runs = tuple(replace(run, duration=seconds) for run in spec.runs)
    return replace(spec, rig=replace(spec.rig, cables=cables), runs=runs)


def at_truth(spec: SessionSpec) -> SessionResult:
    """A session's answer where everything is as it truly is, without a fit."""
    session, truth = simulate_session(spec, np.random.default_rng(0))
    problem, _, _ = pose_problem(session)
    there = evaluate(problem, point_at_truth(problem, truth))
    if there is None:
        raise FloatingPointError("the forward model cannot be evaluated at the truth")
    joint = joint_information(session, problem, there)
    return SessionResult("", inertial_estimate(problem, there), "none", (), joint)


def drawn(
    pose: SessionResult,
    state: dict[Hashable, float],
    rng: np.random.Generator,
    name: str,
    moved: Mapping[str, float] | None = None,
) -> SessionResult:
    """A session in a pose, as a deviation from its truth. state: what stays, in tolerances; moved: m."""
    joint = pose.joint
    if joint is None or joint.weighing is None:
        raise ValueError("a pose tells of body and rig together")
    count = len(joint.doubts)
    whole = joint.root.T @ joint.root
    prior, scale = np.zeros_like(whole), np.zeros_like(whole)
    prior[:10, :10], prior[10:, 10:] = joint.weak, np.eye(count)
    scale[0, 0] = joint.weighing.std**-2
    data = whole - prior - scale
    found = ties([pose], Sharing(rigs=(RIG,), new=0.0))
    truth = np.zeros(10 + count)
    for i, (doubt, key, shared) in enumerate(zip(joint.doubts, found.keys[0], found.shared[0], strict=True)):
        at = float(rng.standard_normal())
        truth[10 + i] = state.setdefault(key, at) if shared > 0.0 else at
        truth[10 + i] += (moved or {}).get(doubt.name, 0.0) / doubt.prior_std
    values, vectors = np.linalg.eigh(data)
    noise = vectors @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(10 + count))
    weighed = joint.weighing.std * float(rng.standard_normal())
    pull = data @ truth + noise
    pull[0] += scale[0, 0] * weighed
    at = np.linalg.solve(whole, pull)
    doubts = tuple(replace(d, at=float(z)) for d, z in zip(joint.doubts, at[10:], strict=True))
    told = replace(
        joint,
        elements=at[:10],
        doubts=doubts,
        weak_gradient=joint.weak @ at[:10],
        weighing=replace(joint.weighing, mass=weighed),
    )
    return SessionResult(name, InertialEstimate(at[:10], pose.estimate.covariance), "none", (), told)


def one_rig(
    teachers: Sequence[SessionResult],
    pupil: SessionResult,
    rng: np.random.Generator,
    moved: Mapping[str, float] | None = None,
) -> tuple[InertialEstimate, Array, bool, list[str]]:
    """Recalled answer, its std over that of the session alone, an alarm before, and what moved in it."""
    state: dict[Hashable, float] = {}
    taught = []
    for k, pose in enumerate(teachers):
        taught.append(drawn(pose, state, rng, f"{k}"))
        for key in state:
            state[key] += NEW * float(rng.standard_normal())
    last = drawn(pupil, state, rng, "last", moved)
    memory = learned(taught, Sharing(rigs=(RIG,) * len(taught)))
    total = recalled(last, memory, Sharing(rigs=(RIG,)))
    ratio = np.sqrt(np.diag(total.covariance) / np.diag(last.estimate.covariance))
    parts = [
        m.part for m in learned([last], Sharing(rigs=(RIG,)), before=memory).moved if m.session == "last"
    ]
    return total, np.asarray(ratio), bool(memory.moved), parts


def score(seconds: float, scheme: str, rigs: int) -> dict[str, Any]:
    """Coverage, sharpness, false alarms and power over drawn rigs."""
    names, last = SCHEMES[scheme]
    known = {name: at_truth(specification(name, seconds)) for name in {*names, last}}
    count = 1 if scheme.startswith("one") else SESSIONS
    teachers = [known[names[k % len(names)]] for k in range(count)]
    rng = np.random.default_rng([54, int(seconds), len(scheme)])
    z, ratios, alarms, found, named = [], [], [], [], []
    for _ in range(rigs):
        total, ratio, _, parts = one_rig(teachers, known[last], rng)
        z.append(total.values / np.sqrt(np.diag(total.covariance)))
        ratios.append(ratio)
        alarms.append(float(bool(parts)))
        side = rng.standard_normal(3)
        cable = f"cable_{rng.integers(1, 4)}"
        shift = MOVED * side / np.linalg.norm(side)
        moved = {f"{cable}.ceiling_point.{a}": float(v) for a, v in zip("xyz", shift, strict=True)}
        _, _, _, parts = one_rig(teachers, known[last], rng, moved)
        found.append(float(bool(parts)))
        named.append(float(any(part.startswith(f"{cable}.") for part in parts)))
    return {
        "coverage": share(np.abs(np.array(z)) <= 1.959964),
        "std_over_alone": dict(zip(ELEMENTS, np.median(ratios, axis=0).tolist(), strict=True)),
        "false_alarms": share(np.array(alarms)),
        "moved_found": share(np.array(found)),
        "moved_cable_named": share(np.array(named)),
    }


def as_markdown(told: dict[str, Any]) -> str:
    """The figures as a page."""
    head = ["run", "taught by", "95 % hold", f"false alarms, level {100 * LEVEL:g} %"]
    head += [f"moved by {1e3 * MOVED:g} mm: found", "its cable named", *ELEMENTS]
    lines = [
        "# Rig memory after ten sessions",
        "",
        f"Made by `python -m bench.memory_ten --rigs {told['rigs']}`: so many rigs a row, each with ten",
        "sessions (or one) that teach, and one that recalls. What stays walks by a tenth of its tolerance",
        "from session to session. In brackets: 95 % interval of a share. The last columns: std over that of",
        "the session alone, median.",
        "",
        "| " + " | ".join(head) + " |",
        "| --- " * len(head) + "|",
    ]
    for row in told["rows"]:
        shares = [percent(row[k]) for k in ("coverage", "false_alarms", "moved_found", "moved_cable_named")]
        ratios = [f"{row['std_over_alone'][n]:.2f}" for n in ELEMENTS]
        lines.append("| " + " | ".join([f"{row['seconds']:g} s", row["scheme"], *shares, *ratios]) + " |")
    return "\n".join([*lines, "", f"Fingerprint of the code: {told['code']}", ""])


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: draw, score, write the figures."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.memory_ten", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--rigs", type=int, default=100)
    parser.add_argument("--seconds", type=float, nargs="+", default=[12.0, 60.0], help="of a run")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of memory_ten.json and memory_ten.md")
    options = parser.parse_args(arguments)
    rows = [
        {"seconds": seconds, "scheme": scheme, **score(seconds, scheme, options.rigs)}
        for seconds in options.seconds
        for scheme in SCHEMES
    ]
    told = {"rigs": options.rigs, "code": fingerprint(), "rows": rows}
    (options.out / "memory_ten.json").write_text(json.dumps(told, indent=1) + "\n")
    (options.out / "memory_ten.md").write_text(as_markdown(told))
    print(as_markdown(told))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
