r"""Write a commented rig.yaml and session.yaml for the bags in a folder.

Lists the topics that the bags hold and asks for what no bag says: where each cable is hinged, the mass, where
each device sits. Lengths in m, or in mm with --unit mm. With --yes nothing is asked: give the cables as
options. A folder of logs (CSV, MAT, ...) without bags is imported first. The files bear the line by which
editors complete and check them.

  rig-identification init session
  rig-identification init session --yes --unit mm --mass 1.4 \
    --cable left -250 0 2000 -250 0 100 1900 --cable right 250 0 2000 250 0 100 1900
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.cli.output import check_output_folder
from rig_identification.cli.session_options import add_topic_options
from rig_identification.errors import InputError

if TYPE_CHECKING:
    from rig_identification.session.start import Held

CABLE = ("NAME", *(f"{end}_{axis}" for end in ("CEILING", "BODY") for axis in "XYZ"), "LENGTH")


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the folder, and the answers of who does not want to be asked."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of bags, or of logs to import")
    add_topic_options(parser)
    parser.add_argument("--unit", choices=("m", "mm"), help="of every length that is given (default: m)")
    parser.add_argument("--gravity", type=float, metavar="M/S^2", help="default: 9.80665")
    parser.add_argument("--mass", type=float, metavar="KG", help="of body and carrying frame together")
    parser.add_argument("--mass-std", type=float, metavar="KG", help="of the scale's reading")
    parser.add_argument(
        "--cable",
        nargs=8,
        action="append",
        default=[],
        metavar=CABLE,
        help="a cable's hinges in world and body",
    )
    parser.add_argument(
        "--at",
        nargs=4,
        action="append",
        default=[],
        metavar=("DEVICE", "X", "Y", "Z"),
        help="where imu, exciter or mocap sits on the body (default: its origin)",
    )
    parser.add_argument("--yes", action="store_true", help="ask nothing")
    parser.add_argument("--overwrite", action="store_true", help="replace rig.yaml and session.yaml")


def run(arguments: argparse.Namespace) -> None:
    """List, ask, and write."""
    from rig_identification.cli.starting import import_logs, write_start
    from rig_identification.session.not_a_session import FILE, bags_in
    from rig_identification.session.start import RIG_FILE, held_by

    folder: Path = arguments.folder
    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder; give the folder that holds the bags")
    check_output_folder(folder, (RIG_FILE, FILE))
    for name in (RIG_FILE, FILE):
        if (folder / name).exists() and not arguments.overwrite:
            raise InputError(f"{folder / name}: exists already; edit it, or give --overwrite")
    if not arguments.yes and not sys.stdin.isatty():
        raise InputError("--yes: missing; without a terminal nobody can be asked, so give --yes and --cable")
    if not bags_in(folder):
        import_logs(folder, certain=arguments.yes)
    topics = dict(arguments.topic)
    bags = bags_in(folder)
    held = held_by(bags, arguments.namespace, topics)
    _list(held)
    write_start(arguments, bags, held)
    mapped = "".join(f" --topic {name}={topic}" for name, topic in arguments.topic)
    other = "" if arguments.namespace == "/rig" else f" --namespace {arguments.namespace}"
    print(f"next: rig-identification check {folder}{other}{mapped}")


def _list(held: Held) -> None:
    """Each topic with its messages, and what it is not used for."""
    width = max(map(len, held.topics), default=0)
    for name, (kind, count) in held.topics.items():
        told = "" if name in held.used else "  not used: no topic of the contract; --topic can map it"
        print(f"{name:<{width}}  {count:>8}  {kind}{told}")
