"""The options by which a command finds a session's topics, and the reading that goes with them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig_identification.api import Recorded
    from rig_identification.cli.progress import StageProgress


def add_session_options(
    parser: argparse.ArgumentParser,
    metavar: str = "SESSION",
    what: str = "folder with a session.yaml, or that file",
) -> None:
    """Take the session and what its topics are called."""
    parser.add_argument("session", type=Path, metavar=metavar, help=what)
    add_topic_options(parser)


def add_topic_options(parser: argparse.ArgumentParser) -> None:
    """Take what the topics of sessions are called."""
    parser.add_argument("--namespace", default="/rig", help="namespace of the topics (default: %(default)s)")
    parser.add_argument(
        "--topic",
        type=_mapping,
        action="append",
        default=[],
        metavar="NAME=TOPIC",
        help="a topic of another name: imu/data_raw=/xsens/imu; may be repeated",
    )


def read_recorded(path: Path, namespace: str, topics: Mapping[str, str], progress: StageProgress) -> Recorded:
    """Every message of the session at ``path``.

    Raises
    ------
    InputError
        It cannot be read, or no bag holds a topic that ``topics`` names.
    """
    from rig_identification.api import read

    return read(path, namespace=namespace, topics=topics, progress=watched(progress))


def watched(progress: StageProgress) -> StageProgress | None:
    """Progress on a terminal alone: where nobody watches, what cannot be used is one line and no more."""
    return progress if progress.terminal else None


def _mapping(text: str) -> tuple[str, str]:
    name, equals, topic = text.partition("=")
    if not (name and equals and topic):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=TOPIC, as in imu/data_raw=/xsens/imu")
    return name, topic
