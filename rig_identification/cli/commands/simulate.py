r"""Simulate a session: bags and descriptions as from a rig, and the truth beside them.

Writes DIR/session.yaml, DIR/rig.yaml, a bag a recording and DIR/truth.json. The body hangs on a case study
of the thesis (--case), or on a described rig (--rig) whose inertia --body tells. Without --no-doubts the
true rig is drawn about its description, each quantity within three of its tolerances.

  rig-identification simulate --case 14 --start pulled --out car
  rig-identification simulate --rig config/trifilar.yaml --mocap 120 --out trifilar \
    --body 42 0.3 0.18 -0.12 1.9 0.03 -0.05 2.4 0.02 3.6
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.errors import InputError
from rig_identification.result import ELEMENTS

if TYPE_CHECKING:
    from rig_identification.recording import Session
    from rig_identification.simulate import RunSpec, SessionSpec, Truth

TRUTH = "truth.json"
CASE_STARTS = ("thesis", "pulled", "rest")
DEVICES = ("tension", "exciter", "imu", "inclinometer")


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the rig, the body, how it is moved, and how the session is stored."""
    rig = parser.add_mutually_exclusive_group(required=True)
    rig.add_argument("--case", metavar="N", help="case study of the thesis: 1 to 17, or 18a to 18d")
    rig.add_argument("--rig", type=Path, metavar="FILE", help="rig description")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="the session's new folder")
    parser.add_argument(
        "--body", type=float, nargs=10, metavar=tuple(ELEMENTS), help="kg, m, kg m^2 about the centre of mass"
    )
    parser.add_argument("--duration", type=float, default=20.0, metavar="S", help="of a run (default: 20)")
    parser.add_argument(
        "--rest", type=float, default=10.0, metavar="S", help="at rest (default: 10; 0: none)"
    )
    parser.add_argument("--start", choices=CASE_STARTS, help="default: thesis with --case, else pulled")
    parser.add_argument("--pull", type=float, default=0.06, help="share of the weight (default: 0.06)")
    parser.add_argument(
        "--shake",
        type=float,
        nargs=2,
        metavar=("SHARE", "HZ"),
        help="unbalanced mass: share of the weight at a speed",
    )
    parser.add_argument(
        "--mocap", type=float, default=0.0, metavar="HZ", help="motion capture (default: none)"
    )
    parser.add_argument(
        "--without",
        nargs="+",
        choices=DEVICES,
        default=[],
        help="devices that do not record, although mounted",
    )
    on_or_off = argparse.BooleanOptionalAction
    parser.add_argument("--noise", action=on_or_off, default=True, help="noise of the sensors (default: on)")
    parser.add_argument("--doubts", action=on_or_off, default=True, help="a rig not quite as described")
    parser.add_argument("--rods", action="store_true", help="cables that push as well, as in the thesis")
    parser.add_argument("--seed", type=int, default=0, help="of every random number (default: %(default)s)")
    parser.add_argument("--storage", choices=("mcap", "sqlite3"), default="mcap")
    parser.add_argument("--compression", choices=("none", "message", "file", "storage"), default="none")
    parser.add_argument("--overwrite", action="store_true", help="replace DIR")


def run(arguments: argparse.Namespace) -> None:
    """Simulate and write."""
    import numpy as np

    from rig_identification.simulate import simulate_session

    if arguments.out.exists() and not arguments.overwrite:
        raise InputError(f"--out {arguments.out}: exists already; name another folder, or give --overwrite")
    spec = specification(arguments)
    session, truth = simulate_session(spec, np.random.default_rng(arguments.seed))
    write_simulated(
        session,
        truth,
        arguments.out,
        storage=arguments.storage,
        compression=arguments.compression,
        overwrite=arguments.overwrite,
    )
    for name, least in truth.least_tension.items():
        if least <= 0.0:
            what = "is pushed" if arguments.rods else "goes slack"
            print(f"note: a cable {what} in {name}; pull or shake less where the ideal model is to hold")
    print(f"session: {arguments.out}")


def specification(arguments: argparse.Namespace) -> SessionSpec:
    """What the arguments ask for. Raises InputError where they do not fit together."""
    from dataclasses import replace

    for name in ("duration", "rest", "pull", "mocap"):
        if not 0.0 <= getattr(arguments, name) < 1e5:
            raise InputError(f"--{name} {getattr(arguments, name):g}: must be positive")
    if arguments.duration < 1.0:
        raise InputError(f"--duration {arguments.duration:g}: a run lasts at least 1 s")
    if arguments.seed < 0:
        raise InputError(f"--seed {arguments.seed}: must not be negative")
    spec = _of_case(arguments) if arguments.case is not None else _of_rig(arguments)
    return replace(
        spec,
        name=arguments.out.name,
        rates=replace(spec.rates, mocap=arguments.mocap, **dict.fromkeys(arguments.without, 0.0)),
        noise=arguments.noise,
        doubts=arguments.doubts,
        rods=arguments.rods,
        runs=tuple(_moved(arguments, spec, run, i) for i, run in enumerate(spec.runs)),
    )


def _of_case(arguments: argparse.Namespace) -> SessionSpec:
    from rig_identification.simulate import case_spec
    from rig_identification.thesis import load_case

    if arguments.body is not None:
        raise InputError("--body: a case study has its own body; leave it out, or give --rig")
    number, variant = arguments.case.rstrip("abcd"), arguments.case.lstrip("0123456789")
    if not number.isdecimal():
        raise InputError(f"--case {arguments.case}: is no case study; give 1 to 17, or 18a to 18d")
    case = load_case(int(number), variant)
    return case_spec(case, duration=arguments.duration, rest=arguments.rest)


def _of_rig(arguments: argparse.Namespace) -> SessionSpec:
    import numpy as np

    from rig_identification.model.body import can_exist
    from rig_identification.session import read_rig
    from rig_identification.simulate import RunSpec, SessionSpec
    from rig_identification.simulate.thesis_case import resting

    rig = read_rig(arguments.rig)
    if arguments.body is None:
        raise InputError(
            "--body: missing; a rig description says nothing of the inertia, so give all ten numbers"
        )
    elements = np.array(arguments.body)
    if not can_exist(elements):
        raise InputError("--body: no body has this mass and inertia; check the order " + " ".join(ELEMENTS))
    if arguments.start == "thesis":
        raise InputError("--start thesis: only a case study has it; give pulled or rest")
    runs = (RunSpec("run_1", arguments.duration), RunSpec("run_2", arguments.duration, holdout=True))
    return SessionSpec("", rig, elements, runs, resting(rig, float(elements[0]), arguments.rest))


def _moved(arguments: argparse.Namespace, spec: SessionSpec, run: RunSpec, number: int) -> RunSpec:
    """The run with the start and the exciter asked for; a second run differs from the first."""
    from dataclasses import replace

    import numpy as np

    from rig_identification.simulate import AtRest, Pulled, UnbalancedMass

    weight = float(spec.elements[0]) * spec.rig.gravity
    start = arguments.start or ("thesis" if arguments.case is not None else "pulled")
    if start == "rest":
        run = replace(run, start=AtRest())
    elif start == "pulled":
        heading = 0.9 + 1.2 * number
        force = arguments.pull * weight * np.array([np.cos(heading), np.sin(heading), 0.0])
        hinges = np.array([cable.body_point for cable in spec.rig.cables])
        aside = 0.15 * np.ptp(hinges, axis=0) * (1.0 - 2.0 * number)
        run = replace(run, start=Pulled(force, spec.elements[1:4] + aside))
    if arguments.shake is None:
        return run
    if spec.rig.exciter is None:
        raise InputError("--shake: the rig description mounts no exciter; add one, or leave --shake out")
    share, frequency = arguments.shake
    if not (share > 0.0 and 0.0 < frequency <= 20.0):
        raise InputError(f"--shake {share:g} {frequency:g}: give a share above 0 and a speed up to 20 Hz")
    unbalance = share * weight / (2.0 * np.pi * frequency) ** 2
    return replace(run, force=UnbalancedMass(unbalance, frequency, "xy", ramp=3.0, angle=float(number)))


def write_simulated(session: Session, truth: Truth, folder: Path, **options: Any) -> None:
    """The session as bags, and what is true of it as ``truth.json``.

    Raises
    ------
    InputError
        The folder exists or cannot be written to.
    """
    from rig_identification.session import write_session

    try:
        write_session(session, folder, **options)
        (folder / TRUTH).write_text(json.dumps(truth_document(truth), indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"--out {folder}: {reason}; name another folder") from error


def truth_document(truth: Truth) -> dict[str, Any]:
    """Truth in the words of the result."""
    from rig_identification.model.body import tensor

    return {
        "mass": float(truth.elements[0]),
        "center_of_mass": truth.elements[1:4].tolist(),
        "inertia": tensor(truth.elements[4:]).tolist(),
        "effects": [],
        "parameters": {
            name: {"value": value, "described": truth.described[name]}
            for name, value in truth.parameters.items()
        },
        "least_tension": truth.least_tension,
    }
