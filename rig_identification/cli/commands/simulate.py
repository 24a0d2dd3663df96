r"""Simulate a session: bags and descriptions as from a rig, and the truth beside them.

Writes DIR/session.yaml, DIR/rig.yaml, a bag a recording and DIR/truth.json. The body hangs on a case study
of the thesis (--case), or on a described rig (--rig) whose inertia --body tells. Without --no-doubts the
true rig is drawn about its description, each quantity within three of its tolerances. The motor's force is
mass times radius times its speed squared. The frequencies at which the body swings by itself are printed.
--effect adds left-out physics, which truth.json names.

  rig-identification simulate --case 14 --start pulled --out car
  rig-identification simulate --rig config/trifilar.yaml --mocap 120 --out trifilar \
    --body 42 0.3 0.18 -0.12 1.9 0.03 -0.05 2.4 0.02 3.6
  rig-identification simulate --case 1 --start rest --motor 12 0.25 0.9 --plane xz --out shaken
  rig-identification simulate --case 14 --start pulled --out rattling \
    --effect sprung_mass.mass=40 --effect sprung_mass.position=0.9,1.2,-1.1
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.cases import case_named
from rig_identification.cli.effects import effects_given
from rig_identification.cli.output import check_output_folder
from rig_identification.cli.simulated import write_simulated
from rig_identification.cli.swings import swing_line, swings
from rig_identification.errors import InputError
from rig_identification.result import ELEMENTS

if TYPE_CHECKING:
    from rig_identification.simulate import RunSpec, SessionSpec

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
    shaken = parser.add_mutually_exclusive_group()
    shaken.add_argument(
        "--shake",
        type=float,
        nargs=2,
        metavar=("SHARE", "HZ"),
        help="unbalanced mass: share of the weight at a speed",
    )
    shaken.add_argument(
        "--motor",
        type=float,
        nargs=3,
        metavar=("KG", "M", "HZ"),
        help="unbalanced mass: mass, radius and speed",
    )
    parser.add_argument(
        "--plane",
        choices=("xy", "xz", "yz"),
        default="xy",
        help="of its turning, exciter frame (default: xy)",
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
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME=VALUE[,VALUE...]",
        help="left-out physics, as hinge_damping=20 or sprung_mass.mass=30, or a device's error, as "
        "imu.gyroscope_bias.x=0.01; an unknown name lists all; may be repeated",
    )
    parser.add_argument("--rods", action="store_true", help="cables that push as well, as in the thesis")
    parser.add_argument("--seed", type=int, default=0, help="of every random number (default: %(default)s)")
    parser.add_argument("--storage", choices=("mcap", "sqlite3"), default="mcap")
    parser.add_argument("--compression", choices=("none", "message", "file", "storage"), default="none")
    parser.add_argument("--overwrite", action="store_true", help="replace DIR")


def run(arguments: argparse.Namespace) -> None:
    """Simulate and write."""
    import numpy as np

    from rig_identification.simulate import simulate_session

    check_output_folder(arguments.out, ())
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
    for mode in swings(spec.rig, spec.elements):
        print(swing_line(mode))
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
        effects=effects_given(arguments.effect),
        runs=tuple(_moved(arguments, spec, run, i) for i, run in enumerate(spec.runs)),
    )


def _of_case(arguments: argparse.Namespace) -> SessionSpec:
    from rig_identification.simulate import case_spec

    if arguments.body is not None:
        raise InputError("--body: a case study has its own body; leave it out, or give --rig")
    return case_spec(case_named(arguments.case), duration=arguments.duration, rest=arguments.rest)


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
    shaken = _unbalance(arguments, weight)
    if shaken is None:
        return run
    if spec.rig.exciter is None:
        raise InputError("--shake, --motor: the rig description mounts no exciter; add one, or leave it out")
    unbalance, frequency = shaken
    motor = UnbalancedMass(unbalance, frequency, arguments.plane, ramp=3.0, angle=float(number))
    return replace(run, force=motor)


def _unbalance(arguments: argparse.Namespace, weight: float) -> tuple[float, float] | None:
    """(kg m, Hz) of the motor that is asked for; None: none."""
    import math

    if arguments.motor is not None:
        mass, radius, frequency = arguments.motor
        if not (mass > 0.0 and radius > 0.0 and 0.0 < frequency <= 20.0):
            text = f"--motor {mass:g} {radius:g} {frequency:g}"
            raise InputError(f"{text}: give mass and radius above 0 and a speed up to 20 Hz")
        return mass * radius, frequency
    if arguments.shake is None:
        return None
    share, frequency = arguments.shake
    if not (share > 0.0 and 0.0 < frequency <= 20.0):
        raise InputError(f"--shake {share:g} {frequency:g}: give a share above 0 and a speed up to 20 Hz")
    return share * weight / (2.0 * math.pi * frequency) ** 2, frequency
