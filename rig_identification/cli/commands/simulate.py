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

from rig_identification.api.simulating import DEVICES, STARTS
from rig_identification.cli.effects import effects_given
from rig_identification.cli.output import check_output_folder
from rig_identification.cli.simulated import write_simulated
from rig_identification.cli.swings import swing_line, swings
from rig_identification.errors import InputError
from rig_identification.result import ELEMENTS

#: Options that are arguments of ``rig_identification.simulate`` by the same names.
OPTIONS = (
    "case",
    "rig",
    "body",
    "duration",
    "rest",
    "start",
    "pull",
    "displaced",
    "shake",
    "motor",
    "plane",
    "mocap",
    "without",
    "noise",
    "doubts",
    "rods",
    "seed",
)


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
    parser.add_argument("--start", choices=STARTS, help="default: thesis with --case, else pulled")
    parser.add_argument("--pull", type=float, default=0.06, help="share of the weight (default: 0.06)")
    parser.add_argument(
        "--displaced",
        type=float,
        nargs=6,
        metavar=("X", "Y", "Z", "RX", "RY", "RZ"),
        help="let go off its rest: m, then rad about world x, y, z; without --start",
    )
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
    from rig_identification.api import simulate

    check_output_folder(arguments.out, ())
    if arguments.out.exists() and not arguments.overwrite:
        raise InputError(f"--out {arguments.out}: exists already; name another folder, or give --overwrite")
    made = simulate(
        effects=effects_given(arguments.effect),
        name=arguments.out.name,
        **{option: getattr(arguments, option) for option in OPTIONS},
    )
    write_simulated(
        made.session,
        made.truth,
        arguments.out,
        storage=arguments.storage,
        compression=arguments.compression,
        overwrite=arguments.overwrite,
    )
    for name, least in made.truth.least_tension.items():
        if least <= 0.0:
            what = "is pushed" if arguments.rods else "goes slack"
            print(f"note: a cable {what} in {name}; pull or shake less where the ideal model is to hold")
    for mode in swings(made.spec.rig, made.spec.elements):
        print(swing_line(mode))
    print(f"session: {arguments.out}")
