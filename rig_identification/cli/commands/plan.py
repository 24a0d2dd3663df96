r"""Plan a session: which runs to record in the minutes that there are, and what they would tell.

RIG is a rig description with the noise of its devices. The body is guessed from a box (--box, with --mass
where the description has none), given in ten numbers (--body), or taken from an earlier result (--after).
Writes DIR/plan.html, DIR/plan.json, DIR/session.yaml, DIR/rig.yaml and DIR/exciter.csv, all or none. Runs
keep every cable taut and every hinge within --travel.

  rig-identification plan config/car_four_cables.yaml --box 1.7 4.2 1.4 --minutes 4 --out plan
  rig-identification plan rig.yaml --after answer/result.json --minutes 3 --exciter shaker --out plan
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.output import check_output_folder, write_together
from rig_identification.cli.progress import StageProgress
from rig_identification.errors import InputError
from rig_identification.result import ELEMENTS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rig_identification.plan import Means, Plan
    from rig_identification.rig import Rig

    Array = NDArray[np.float64]

PAGE, DOCUMENT, SESSION, RIG, COMMANDS = "plan.html", "plan.json", "session.yaml", "rig.yaml", "exciter.csv"
FILES = (PAGE, DOCUMENT, SESSION, RIG, COMMANDS)
DEVICES = ("tension", "exciter", "imu", "inclinometer")


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the rig, the body, and what there is to record it with."""
    parser.add_argument("rig", type=Path, metavar="RIG", help="rig description")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the plan's files")
    body = parser.add_mutually_exclusive_group(required=True)
    body.add_argument(
        "--box", type=float, nargs=3, metavar=("X", "Y", "Z"), help="m: edges of a box like the body"
    )
    body.add_argument(
        "--body", type=float, nargs=10, metavar=tuple(ELEMENTS), help="kg, m, kg m^2 about the centre of mass"
    )
    body.add_argument("--after", type=Path, metavar="FILE", help="result.json of an earlier session")
    parser.add_argument(
        "--center",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="m: the box's middle (default: below the hinges)",
    )
    parser.add_argument("--mass", type=float, metavar="KG", help="of the box (default: the description's)")
    parser.add_argument("--minutes", type=float, default=5.0, metavar="MIN", help="in all (default: 5)")
    parser.add_argument(
        "--exciter",
        choices=("motor", "shaker"),
        default="motor",
        help="a mass on a motor, or any force (default: motor)",
    )
    for name, default, metavar, text in (
        ("force", 0.05, "SHARE", "largest force of the exciter, share of the weight"),
        ("pull", 0.06, "SHARE", "largest pull aside before a release, share of the weight"),
        ("highest", 2.0, "HZ", "highest frequency of the exciter"),
        ("travel", 0.15, "M", "largest movement of any hinge on the body"),
        ("taut", 0.1, "SHARE", "tension that each cable keeps, share of that at rest"),
        ("rest", 10.0, "S", "length of a recording at rest"),
        ("changeover", 0.0, "S", "time before each recording, which counts"),
        ("mocap", 0.0, "HZ", "motion capture; 0: none"),
    ):
        parser.add_argument(
            f"--{name}", type=float, default=default, metavar=metavar, help=f"{text} (default: {default:g})"
        )
    parser.add_argument(
        "--without", nargs="+", choices=DEVICES, default=[], help="devices that do not record"
    )


def run(arguments: argparse.Namespace) -> None:
    """Plan, write, and print what to record."""
    from rig_identification.plan import plan
    from rig_identification.session import read_rig

    check_output_folder(arguments.out, FILES)
    rig = read_rig(arguments.rig)
    body, means = body_of(arguments, rig), means_of(arguments)
    with StageProgress(sys.stderr) as progress:
        found = plan(rig, body, means, progress)
        progress("writing the plan")
        _write(found, arguments.rig, arguments.out)
    _print(found, arguments.out)


def body_of(arguments: argparse.Namespace, rig: Rig) -> Array:
    """(10,) the body to plan for. Raises InputError where the arguments describe none."""
    import numpy as np

    from rig_identification.cli.commands.modes import found_elements
    from rig_identification.model.body import can_exist
    from rig_identification.plan import box

    if arguments.box is None:
        for name in ("center", "mass"):
            if getattr(arguments, name) is not None:
                raise InputError(f"--{name}: belongs to --box; leave it out")
        elements = np.array(arguments.body or found_elements(arguments.after, "--after"), dtype=float)
    else:
        mass = arguments.mass if arguments.mass is not None else rig.mass
        if mass is None:
            raise InputError("--mass: missing, and the description has none; weigh the body or guess")
        if not (mass > 0.0 and min(arguments.box) > 0.0):
            raise InputError(f"--box: edges and mass must be positive, not {arguments.box} m and {mass:g} kg")
        center = None if arguments.center is None else np.array(arguments.center)
        elements = box(rig, mass, np.array(arguments.box), center)
    if not can_exist(elements):
        raise InputError("--body: no body has this mass and inertia; check the order " + " ".join(ELEMENTS))
    return elements


def means_of(arguments: argparse.Namespace) -> Means:
    """What there is to record with. Raises InputError for a number that makes no sense."""
    from rig_identification.plan import Means
    from rig_identification.simulate import SampleRates

    limits = {
        "minutes": 1e3,
        "force": 1.0,
        "pull": 0.5,
        "highest": 20.0,
        "travel": 10.0,
        "taut": 0.9,
        "rest": 600.0,
    }
    for name, most in limits.items():
        if not 0.0 < getattr(arguments, name) <= most:
            raise InputError(
                f"--{name} {getattr(arguments, name):g}: give a number above 0 and up to {most:g}"
            )
    if not 0.0 <= arguments.changeover <= 3600.0:
        raise InputError(f"--changeover {arguments.changeover:g}: give 0 to 3600 s")
    if not 0.0 <= arguments.mocap <= 2000.0:
        raise InputError(f"--mocap {arguments.mocap:g}: give a rate up to 2000 Hz, or 0 for none")
    rates = SampleRates(mocap=arguments.mocap, **dict.fromkeys(arguments.without, 0.0))
    named = {name: getattr(arguments, name) for name in (*limits, "changeover")}
    return Means(exciter=arguments.exciter, rates=rates, **named)


def _write(found: Plan, rig: Path, out: Path) -> None:
    from rig_identification.plan_report import write_commands, write_plan, write_plan_page, write_session_text

    described = rig.read_bytes()
    write_together(
        out,
        {
            PAGE: lambda path: write_plan_page(found, path),
            DOCUMENT: lambda path: write_plan(found, path),
            SESSION: lambda path: write_session_text(found, RIG, path),
            RIG: lambda path: _copy(described, path),
            COMMANDS: lambda path: write_commands(found, path),
        },
    )


def _copy(content: bytes, path: Path) -> None:
    path.write_bytes(content)


def _print(found: Plan, out: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    from rig_identification.plan_report.page import expected_rows, summary
    from rig_identification.plan_report.programme import instruction

    table = Table("element", "guessed", "σ", "σ if nothing is left out", "unit", "share", box=None)
    for row in expected_rows(found):
        table.add_row(*row)
    Console().print(table)
    print(summary(found))
    for planned in found.recordings:
        item = planned.item
        print(f"{item.name}: {item.seconds:g} s {planned.role}: {instruction(found, item.name)}")
    print(f"plan: {out / PAGE}")
