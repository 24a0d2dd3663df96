"""Results or sessions on a command line that puts several beside each other."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.api.result import RESULT
from rig_identification.cli.commands.identify import identify_session
from rig_identification.errors import InputError
from rig_identification.several.ties import NEW, Sharing

if TYPE_CHECKING:
    from rig_identification.several.session_result import SessionResult

#: Folder below --out for what is identified on the way.
IDENTIFIED = "sessions"


def add_several_options(parser: argparse.ArgumentParser) -> None:
    """Take results or sessions, and what a lab knows of what they share."""
    parser.add_argument(
        "results",
        type=Path,
        nargs="+",
        metavar="RESULT",
        help="a result.json, a folder with one, or a session, which is identified first",
    )
    parser.add_argument(
        "--rigs",
        nargs="+",
        metavar="NAME",
        default=[],
        help="rig of each result, as in A A B; default: one rig where the ceiling points are the same",
    )
    repeated = (
        ("--fresh", "doubts that are new in each session, as in 'imu.*'; may be repeated"),
        ("--kept", "doubts that stay from session to session, as in 'imu.gyroscope_bias.*'; may be repeated"),
        ("--carried", "device that goes from rig to rig, as in imu; may be repeated"),
    )
    for name, text in repeated:
        parser.add_argument(name, action="append", default=[], metavar="NAME", help=text)
    parser.add_argument(
        "--new",
        type=_share,
        default=NEW,
        metavar="SHARE",
        help="how far what stays moves between sessions, as a share of its tolerance (default: %(default)s)",
    )


def sharing_of(arguments: argparse.Namespace) -> Sharing:
    """What the arguments say of what the sessions share. Raises InputError where they do not fit together."""
    rigs, results = arguments.rigs, arguments.results
    if rigs and len(rigs) != len(results):
        told = " ".join(rigs)
        raise InputError(f"--rigs {told}: names {len(rigs)} for {len(results)} results; name one for each")
    return Sharing(
        tuple(rigs), tuple(arguments.fresh), tuple(arguments.kept), tuple(arguments.carried), arguments.new
    )


def sessions_given(arguments: argparse.Namespace, out: Path | None) -> tuple[list[SessionResult], Sharing]:
    """Every result in the order in which they were recorded, and what they share.

    A session is identified into ``out`` first, unless it is there already.

    Raises
    ------
    InputError
        Fewer than two are given, one is neither, or one is to be identified and there is no ``out``.
    """
    from rig_identification.report.several_page import in_time

    sharing, results = sharing_of(arguments), _results(arguments, out)
    order = in_time([0 if result.joint is None else result.joint.start_ns for result in results])
    rigs = tuple(sharing.rigs[k] for k in order) if sharing.rigs else ()
    return [results[k] for k in order], replace(sharing, rigs=rigs)


def _results(arguments: argparse.Namespace, out: Path | None) -> list[SessionResult]:
    paths: Sequence[Path] = arguments.results
    if len(paths) < 2:
        raise InputError(f"{paths[0]}: is one alone; name at least two results")
    return read_all(paths, out)


def read_all(paths: Sequence[Path], out: Path | None) -> list[SessionResult]:
    """The result behind each path, in their order; errors as of :func:`sessions_given`."""
    from rig_identification.report.result_file import read_result

    names = names_of(paths)
    files = [_result_of(path, name, out) for path, name in zip(paths, names, strict=True)]
    return [read_result(file, name) for file, name in zip(files, names, strict=True)]


def names_of(paths: Sequence[Path]) -> list[str]:
    """A name for each path: its folder's, or as much of the path as tells it from the others."""
    folders = [path.parent if path.suffix in (".json", ".yaml") else path for path in paths]
    whole = [folder.absolute().parts for folder in folders]
    if len(set(whole)) < len(whole):
        twice = next(path for k, path in enumerate(paths) if whole[k] in whole[:k])
        raise InputError(f"{twice}: is named twice; a session agrees with itself")
    for length in range(1, max(map(len, whole)) + 1):
        names = ["/".join(parts[-length:]).lstrip("/") for parts in whole]
        if len(set(names)) == len(names):
            break
    return names


def _result_of(path: Path, name: str, out: Path | None) -> Path:
    """The result.json behind a path."""
    if path.is_dir() and (path / RESULT).exists():
        return path / RESULT
    described = path / "session.yaml" if path.is_dir() else path
    if described.name == "session.yaml" and described.exists():
        if out is None:
            raise InputError(f"{path}: is not identified yet; give --out, or a result.json")
        into = out / IDENTIFIED / name
        if not (into / RESULT).exists():
            identify_session(path, into)
        return into / RESULT
    if path.is_dir():
        raise InputError(f"{path}: holds neither a {RESULT} nor a session.yaml; name a folder that does")
    return path


def _share(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= 1.0:
        raise argparse.ArgumentTypeError(f"{text!r} is no number from 0 to 1")
    return value
