"""Is the uncertainty budget true? Monte Carlo after JCGM 101 of one session, source by source.

A session of the thesis' case 10 is simulated again and again. Each time one group of sources alone is drawn
(the noise of the load cells, that of the exciter's cells, the lengths of the cables, ...), and the model is
fitted with all its doubts. The scatter of the ten numbers is held against the budget's rows of that group,
and with everything drawn against the whole.

    python -m bench.certificate [--draws 60]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, solve
from rig_identification.estimate.sources import sources
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS
from rig_identification.rig import DEFAULT_TOLERANCE
from rig_identification.simulate import SampleRates, SessionSpec, Truth, case_spec, simulate_session
from rig_identification.simulate.at_truth import point_at_truth
from rig_identification.thesis import load_case

HERE = Path(__file__).parent
DURATION, REST = 4.0, 4.0  # s
RATES = SampleRates(tension=50.0, exciter=100.0, shaft=0.0, imu=50.0, inclinometer=25.0, ground_truth=0.0)
#: Next to nothing, of which the simulator still makes numbers.
NOTHING = 1e-9


@dataclass(frozen=True)
class Group:
    """Sources that are drawn together, and how their rows are named."""

    noise: tuple[str, ...] = ()
    tolerance: tuple[str, ...] = ()
    scale: bool = False

    def holds(self, name: str) -> bool:
        """Whether a row of the budget is one of the group's."""
        if name.startswith("tolerance."):
            return name.removeprefix("tolerance.") in self.tolerance
        if name == "ground scale":
            return self.scale
        if name == "exciter force":
            return "exciter_force" in self.noise
        quantity = name.split(" ", 1)[-1].removesuffix(" at rest").replace(" ", "_")
        return quantity in self.noise


NOISES = ("tension", "exciter_force", "specific_force", "angular_rate", "inclination")
GROUPS = {
    "load cells' noise": Group(noise=("tension",)),
    "IMU's noise": Group(noise=("specific_force", "angular_rate")),
    "exciter's noise": Group(noise=("exciter_force",)),
    "lengths and hinges": Group(tolerance=("cable_length", "hinge_position", "level")),
    "mounts, gains, zeros, biases": Group(
        tolerance=tuple(sorted(set(DEFAULT_TOLERANCE) - {"cable_length", "hinge_position", "level"}))
    ),
    "everything": Group(noise=NOISES, tolerance=tuple(DEFAULT_TOLERANCE), scale=True),
}


def specification() -> SessionSpec:
    """One run as in the thesis, and two recordings at rest."""
    return case_spec(load_case(10), duration=DURATION, rest=REST, holdout=False, rates=RATES)


def drawn(spec: SessionSpec, group: Group, seed: Sequence[int]) -> tuple[Session, Truth]:
    """A session in which only the group's sources are off, told as the lab describes it."""
    rig = spec.rig
    noise = {n: s if n in group.noise else NOTHING * s for n, s in rig.noise.items()}
    tolerance = {n: s if n in group.tolerance else NOTHING * s for n, s in rig.tolerance.items()}
    scale = rig.mass_std if group.scale or rig.mass_std is None else NOTHING * rig.mass_std
    there = replace(spec, rig=replace(rig, noise=noise, tolerance=tolerance, mass_std=scale))
    session, truth = simulate_session(there, np.random.default_rng(seed))
    described = replace(session.rig, noise=rig.noise, tolerance=rig.tolerance, mass_std=rig.mass_std)
    return replace(session, rig=described), truth


def at_truth(session: Session, truth: Truth) -> tuple[Problem, Point]:
    """The session's problem, and its unknowns as they truly are."""
    problem, _, _ = pose_problem(session)
    problem = replace(problem, bound=np.inf)
    return problem, point_at_truth(problem, truth)


def estimate(session: Session, truth: Truth) -> np.ndarray:
    """(10,) error of the ten numbers."""
    problem, point = at_truth(session, truth)
    found, _ = solve(problem, point)
    return np.asarray(inertial_estimate(problem, found).values - truth.elements)


def budget(spec: SessionSpec) -> dict[str, np.ndarray]:
    """Variances of the ten numbers by row, at a session without any error."""
    session, truth = drawn(spec, Group(), [0])
    problem, point = at_truth(session, truth)
    there: Evaluation | None = evaluate(problem, point)
    if there is None:
        raise FloatingPointError("the forward model cannot be evaluated at the truth")
    return {s.name: np.diag(s.covariance) for s in sources(problem, there)}


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: draw what is missing, write the figures."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.certificate", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--draws", type=int, default=60, help="of each group (default: %(default)s)")
    parser.add_argument("--groups", nargs="+", choices=tuple(GROUPS), default=list(GROUPS))
    parser.add_argument("--log", type=Path, default=HERE / "certificate.jsonl", help="one line a draw")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of certificate.md")
    options = parser.parse_args(arguments)
    spec = specification()
    lines = options.log.read_text().splitlines() if options.log.exists() else []
    errors: dict[str, dict[int, list[float]]] = {name: {} for name in GROUPS}
    for entry in map(json.loads, lines):
        errors[entry["group"]][entry["draw"]] = entry["error"]
    for draw in range(options.draws):
        for number, (name, group) in enumerate(GROUPS.items()):
            if draw in errors[name] or name not in options.groups:
                continue
            found = estimate(*drawn(spec, group, [11, number, draw])).tolist()
            errors[name][draw] = found
            with options.log.open("a") as log:
                log.write(json.dumps({"group": name, "draw": draw, "error": found}) + "\n")
    text = as_markdown(
        budget(spec), {n: np.array(list(e.values())[: options.draws]) for n, e in errors.items() if e}
    )
    (options.out / "certificate.md").write_text(text)
    print(text)
    return 0


def as_markdown(rows: dict[str, np.ndarray], errors: dict[str, np.ndarray]) -> str:
    """Scatter over what the rows tell, for each group and number."""
    out = [
        "# Budget against Monte Carlo",
        "",
        "Made by `python -m bench.certificate`. Root mean square error of the ten numbers",
        "with one group of sources drawn, over the root of the budget's rows of that group. The last column",
        "is the root mean square over all ten. With n draws a ratio of 1 scatters by 1/sqrt(2 n).",
        "",
        "| drawn | draws | share of u²(Jzz) | " + " | ".join(ELEMENTS) + " | all |",
        "| --- | --- | --- |" + " --- |" * (len(ELEMENTS) + 1),
    ]
    whole = np.sum(list(rows.values()), axis=0)
    for name, group in ((n, g) for n, g in GROUPS.items() if n in errors):
        told = np.sum([row for n, row in rows.items() if group.holds(n)], axis=0)
        # What is believed of any body is not drawn: it is part of no group
        ratio = np.sqrt(np.mean(errors[name] ** 2, axis=0) / told)
        cells = " | ".join(f"{r:.2f}" for r in ratio)
        every = float(np.sqrt(np.mean(ratio**2)))
        out.append(f"| {name} | {len(errors[name])} | {told[-1] / whole[-1]:.2f} | {cells} | {every:.3f} |")
    return "\n".join([*out, ""])


if __name__ == "__main__":
    raise SystemExit(main())
