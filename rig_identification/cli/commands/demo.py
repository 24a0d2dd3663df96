"""Make a small session with the simulator and identify the body in it.

A car of 1145 kg hangs on four cables, is pulled aside and shaken: two runs of 20 s, the second held out, and
two recordings at rest. Writes DIR/session, DIR/result.json and DIR/report.html, and names the report to open.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.api.result import REPORT, RESULT
from rig_identification.cli.commands.identify import identify_session
from rig_identification.cli.output import check_output_folder
from rig_identification.cli.simulated import write_simulated
from rig_identification.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rig_identification.result import InertialEstimate
    from rig_identification.simulate import SessionSpec

    Array = NDArray[np.float64]

SESSION = "session"


def configure(parser: argparse.ArgumentParser) -> None:
    """Take where to write."""
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder for session, result and report"
    )
    parser.add_argument("--seed", type=int, default=14, help="of every random number (default: %(default)s)")
    parser.add_argument("--duration", type=float, default=20.0, metavar="S", help="of a run (default: 20)")


def run(arguments: argparse.Namespace) -> None:
    """Simulate, write, identify, and say how near the truth it comes."""
    import numpy as np

    from rig_identification.simulate import simulate_session

    folder: Path = arguments.out / SESSION
    if not 2.0 <= arguments.duration <= 300.0:
        raise InputError(f"--duration {arguments.duration:g}: give 2 to 300 s")
    check_output_folder(arguments.out, (RESULT, REPORT))
    if folder.exists() and not (folder / "session.yaml").exists():
        raise InputError(f"--out {arguments.out}: {SESSION} in it is no session; name another folder")
    session, truth = simulate_session(demo_spec(arguments.duration), np.random.default_rng(arguments.seed))
    write_simulated(session, truth, folder, overwrite=True)
    print(f"session: {folder}")
    identify_session(folder, arguments.out, remark=lambda found: beside_truth(found.total, truth.elements))


def beside_truth(estimate: InertialEstimate, true: Array) -> str:
    """How far the ten numbers lie from those of the simulation, (10,) in the order of the estimate's."""
    import numpy as np

    from rig_identification.result import ELEMENTS

    known = [i for i, name in enumerate(ELEMENTS) if name not in estimate.unobservable]
    off = np.abs(estimate.values - true)[known] / np.sqrt(np.diag(estimate.covariance)[known])
    farthest = ELEMENTS[known[int(np.argmax(off))]]
    within = f"{len(known)} numbers within {off.max():.1f} σ"
    return f"beside the simulation's truth: {within}, {farthest} the farthest"


def demo_spec(duration: float) -> SessionSpec:
    """The car of case study 14, pulled aside and shaken so that its cables stay taut."""
    from dataclasses import replace

    import numpy as np

    from rig_identification.simulate import Pulled, UnbalancedMass, case_spec
    from rig_identification.thesis import load_case

    spec = case_spec(load_case(14), duration=duration)
    weight = float(spec.elements[0]) * spec.rig.gravity
    runs = []
    for run_spec, heading, frequency in zip(spec.runs, (0.9, 2.1), (0.7, 0.8), strict=True):
        pull = 0.06 * weight * np.array([np.cos(heading), np.sin(heading), 0.0])
        start = Pulled(pull, spec.elements[1:4] + np.array([0.3, 0.2, 0.0]))
        motor = UnbalancedMass(0.05 * weight / (2.0 * np.pi * frequency) ** 2, frequency, ramp=3.0)
        runs.append(replace(run_spec, start=start, force=motor))
    return replace(spec, name="demo", runs=tuple(runs))
