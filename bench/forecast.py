"""Does the forecast of a run under way keep its word? Forecast std after a quarter against the final fit's.

Each run is simulated with noise and with a rig that is not quite as described, and shaken in a way of its
own after it was pulled aside and let go. The ideal model is fitted to its first quarter. What a fit to the
whole run would tell is forecast three times: with the exciter's force as it will be, as the live graph takes
it from a file of commands whose beginning it has to find, and as it was last, repeated. The file has 50 lines
a second, as a plan's, and began up to three seconds before the recording. All are set beside the std that a
fit to the whole run then states. Rigs: case studies 1, 10 and 14 of the thesis and three inclined cables.
Runs go to a log as they are done; a second call goes on where the first stopped.

    python -m bench.forecast [--runs 20] [--seconds 20]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.forecast_tables import HOW, figure, report
from bench.monte_carlo import GEOMETRIES, specification
from bench.resumed import Entry, entries_of, fingerprint
from rig_identification import watch
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.session.exciter_commands import HEAD, read_commands
from rig_identification.simulate import RunSpec, SampleRates, SessionSpec, simulate_session
from rig_identification.simulate.exciter import ForceProgram, Multisine, UnbalancedMass
from rig_identification.simulate.start import Pulled
from rig_identification.watch.forecast import forecast
from rig_identification.watch.part import Force, so_far
from rig_identification.watch.planned import Begun, begun

HERE = Path(__file__).parent
RATES = SampleRates(tension=100.0, exciter=200.0, shaft=0.0, imu=100.0, inclinometer=50.0, ground_truth=0.0)
#: Share of the run after which it is forecast.
EARLY = 0.25
#: s before the recording at which the exciter was told to begin, at most.
BEFORE = 3.0


def drawn(geometry: str, seconds: float, rng: np.random.Generator) -> tuple[SessionSpec, ForceProgram]:
    """A session with one run, shaken by an unbalanced mass or by several sines at once."""
    spec = specification(geometry)
    weight = float(spec.elements[0]) * spec.rig.gravity
    hinges = np.array([cable.body_point for cable in spec.rig.cables])
    heading = rng.uniform(0.0, 2.0 * np.pi)
    pull = rng.uniform(0.03, 0.06) * weight * np.array([np.cos(heading), np.sin(heading), 0.0])
    at = spec.elements[1:4] + rng.uniform(-0.2, 0.2, 3) * np.ptp(hinges, axis=0)
    force: ForceProgram
    if rng.random() < 0.5:
        frequency = float(rng.uniform(0.5, 1.2))
        share = float(rng.uniform(0.02, 0.05))
        force = UnbalancedMass(share * weight / (2.0 * np.pi * frequency) ** 2, frequency, ramp=2.0)
    else:
        force = Multisine(0.03 * weight, tuple(np.sort(rng.uniform(0.4, 1.5, 3))), ramp=1.0)
    run = RunSpec("run_1", seconds, Pulled(pull, at), force)
    return replace(spec, runs=(run,), rates=RATES, doubts=True, noise=True), force


def one_run(code: str, geometry: str, number: int, seconds: float) -> Entry:
    """Forecast a run and fit it."""
    spec, force = drawn(geometry, seconds, np.random.default_rng([1, number]))
    session, truth = simulate_session(spec, np.random.default_rng([2, number]))
    whole = fit_session(session)
    final = _std(whole)
    early = fit_session(so_far(session, EARLY * seconds))
    found = commanded(force, seconds, early, np.random.default_rng([3, number]))
    forces: dict[str, Force | None] = {"planned": force, "commanded": found, "repeated": None}
    started = time.perf_counter()
    made = {how: forecast(early, "run_1", seconds, forces[how]) for how in HOW}
    took = (time.perf_counter() - started) / len(HOW)
    return {
        "rig": geometry,
        "number": number,
        "duration": seconds,
        "code": code,
        "shaken": type(force).__name__,
        "least_tension": min(truth.least_tension.values()),
        "converged": whole.converged and early.converged,
        "seconds": took,
        "found": found is not None,
        "std_early": _std(early).tolist(),
        "std_final": final.tolist(),
        "ratio": {how: None if f is None else (f.std[-1] / final).tolist() for how, f in made.items()},
    }


def commanded(force: ForceProgram, seconds: float, early: Fitted, rng: np.random.Generator) -> Begun | None:
    """The force as a file of commands tells it, found in what was measured; None: not found, so repeated."""
    before = float(rng.uniform(0.0, BEFORE))
    at = np.arange(0.0, seconds + BEFORE, 0.02)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "exciter.csv"
        rows = [
            f"shake,{t:.2f},,,{x:.5g},{y:.5g},{z:.5g}"
            for t, (x, y, z) in zip(at, force(at - before), strict=True)
        ]
        file.write_text("\n".join([",".join(HEAD), *rows]) + "\n", encoding="utf-8")
        plans = read_commands(file)
    measured = early.problem.runs[-1].recording.exciter_force
    return None if measured is None else begun(measured, plans, "run_1")


def _std(fitted: Fitted) -> np.ndarray:
    return np.sqrt(np.diag(inertial_estimate(fitted.problem, fitted.evaluation).covariance))


def main() -> None:
    """Do what is missing, and write tables and figure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=20.0)
    chosen = parser.parse_args()
    here = Path(watch.__file__).parent
    code = fingerprint(Path(__file__), here / "part.py", here / "forecast.py", here / "planned.py")
    jobs = [(GEOMETRIES[k % len(GEOMETRIES)], k, chosen.seconds) for k in range(chosen.runs)]

    def job_of(entry: Entry) -> tuple[Any, ...]:
        return entry["rig"], entry["number"], entry["duration"]

    entries = entries_of(HERE / "forecast.json", code, jobs, job_of, partial(one_run, code), 1)
    runs = sorted((e for e in entries if job_of(e) in jobs), key=lambda e: int(e["number"]))
    (HERE / "forecast.md").write_text(report(runs), encoding="utf-8")
    (HERE / "forecast.svg").write_text(figure(runs), encoding="utf-8")


if __name__ == "__main__":
    main()
