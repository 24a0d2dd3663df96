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

from rig_identification.api.planning import EXCITERS, FILES, PAGE
from rig_identification.cli.output import check_output_folder, written
from rig_identification.cli.progress import StageProgress
from rig_identification.errors import ArgumentError
from rig_identification.result import ELEMENTS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rig_identification.plan import Means, Plan
    from rig_identification.rig import Rig

    Array = NDArray[np.float64]

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
        choices=EXCITERS,
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
    from rig_identification.api.planning import earlier, plan_session
    from rig_identification.session import read_rig

    check_output_folder(arguments.out, FILES)
    body, means = body_of(arguments, read_rig(arguments.rig)), means_given(arguments)
    with StageProgress(sys.stderr) as progress:
        before = None if arguments.after is None else earlier(arguments.after)
        found = plan_session(arguments.rig, body, means, progress=progress, before=before)
        progress("writing the plan")
        written(found, arguments.out)
    _print(found.plan, arguments.out)


def body_of(arguments: argparse.Namespace, rig: Rig) -> Array:
    """(10,) the body to plan for. Raises InputError where the arguments describe none."""
    from rig_identification.api.planning import boxed, given_body
    from rig_identification.cli.commands.modes import found_elements

    if arguments.box is not None:
        return boxed(rig, arguments.box, arguments.mass, arguments.center)
    for name in ("center", "mass"):
        if getattr(arguments, name) is not None:
            raise ArgumentError(f"{name}: belongs to --box; leave it out")
    return given_body(arguments.body or found_elements(arguments.after, "--after"))


def means_given(arguments: argparse.Namespace) -> Means:
    """What there is to record with. Raises InputError for a number that makes no sense."""
    from rig_identification.api.planning import LIMITS, means_of

    named = {name: getattr(arguments, name) for name in (*LIMITS, "changeover", "mocap")}
    return means_of(exciter=arguments.exciter, without=arguments.without, **named)


def _print(found: Plan, out: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    from rig_identification.plan_report.page import expected_heads, expected_rows, summary, tie_rows
    from rig_identification.plan_report.programme import instruction

    table = Table(*expected_heads(found), box=None)
    for row in expected_rows(found):
        table.add_row(*row)
    Console().print(table)
    print(summary(found))
    for tie, by, so_far, expected, chance in tie_rows(found):
        sure = f", decides with a chance of {chance}" if chance else ""
        print(f"{tie}: {so_far} apart so far, {expected} expected{sure}: {by}")
    for planned in found.recordings:
        item = planned.item
        print(f"{item.name}: {item.seconds:g} s {planned.role}: {instruction(found, item.name)}")
    print(f"plan: {out / PAGE}")
