"""Start the live rig's ROS 2 nodes, one process each.

  simulated   a simulated rig: plant, sensors, tracker, preprocessor, identifier, recorder
  live        the real rig: sensors, tracker, preprocessor, identifier, recorder
  replay      a recorded session played into tracker, preprocessor and identifier

Ctrl-C ends them all. Where a full ROS 2 is installed, the launch files do the same.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import signal
import subprocess
import sys
import sysconfig
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path

from ruamel.yaml import YAML

from rig_identification.errors import InputError

SENSORS = ("load_cells", "imu", "inclinometer")
LISTENERS = ("tracker", "preprocessor", "identifier")
GRAPHS = {
    "simulated": ("rig_simulator", *SENSORS, *LISTENERS, "recorder"),
    "live": (*SENSORS, *LISTENERS, "recorder"),
    "replay": (*LISTENERS, "replay"),
}
#: s that a node has to finish its files after it was told to end.
PATIENCE = 20.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the graph, its files and single parameters."""
    parser.add_argument("graph", choices=tuple(GRAPHS), help="which nodes to start")
    parser.add_argument(
        "session", nargs="?", type=Path, metavar="SESSION", help="replay: the session to play"
    )
    parser.add_argument("--rig", type=Path, metavar="FILE", help="rig description")
    parser.add_argument("--nodes", type=Path, metavar="FILE", help="the nodes' parameters")
    parser.add_argument("--namespace", default="/rig", help="namespace of the graph (default: %(default)s)")
    parser.add_argument(
        "--without", action="append", default=[], metavar="NODE", help="leave a node out; may be repeated"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="parameters",
        metavar="NODE.NAME=VALUE",
        help="a parameter of a node: rig_simulator.speed=2.0; may be repeated",
    )


def run(arguments: argparse.Namespace) -> None:
    """Start the nodes and wait until they end or a signal comes."""
    if importlib.util.find_spec("rclpy") is None:
        raise InputError(
            "ROS 2 is not there: pip install 'rig_identification[ros]', or use a Jazzy installation"
        )
    names = [name for name in GRAPHS[arguments.graph] if name not in arguments.without]
    unknown = set(arguments.without) - set(GRAPHS[arguments.graph])
    if unknown:
        raise InputError(
            f"--without {', '.join(sorted(unknown))}: the graph has {', '.join(GRAPHS[arguments.graph])}"
        )
    rig, nodes = _files(arguments)
    with tempfile.TemporaryDirectory(prefix="rig_") as folder:
        merged = Path(folder) / "nodes.yaml"
        _write_merged(merged, nodes, {name: _parameters(name, arguments) for name in names})
        Supervisor({name: _command(name, [rig, merged], arguments.namespace) for name in names}).run()


class Supervisor:
    """Processes that are started together and ended together."""

    def __init__(self, commands: dict[str, list[str]]) -> None:
        self._ending = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self._ending.set())
        # Sessions of their own: a terminal's Ctrl-C reaches them once, through us
        self._processes = {
            name: subprocess.Popen(command, start_new_session=True) for name, command in commands.items()
        }

    def run(self) -> None:
        """Wait for a signal or for all to end. Raises InputError where a node refused its parameters."""
        refused: list[str] = []
        running = dict(self._processes)
        while running and not self._ending.wait(0.2):
            for name, process in list(running.items()):
                if (status := process.poll()) is not None:
                    del running[name]
                    print(f"{name} ended with status {status}", file=sys.stderr, flush=True)
                    if status == 2:
                        refused.append(name)
                        self._ending.set()
        self._end()
        if refused:
            raise InputError(f"{', '.join(refused)} refused to start, as said above; the others were ended")

    def _end(self) -> None:
        for process in self._processes.values():
            if process.poll() is None:
                process.terminate()
        for name, process in self._processes.items():
            try:
                process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                print(f"{name} did not end within {PATIENCE:g} s and was killed", file=sys.stderr)
                process.kill()
                process.wait()


def _command(name: str, files: Sequence[Path], namespace: str) -> list[str]:
    """Command line of one node."""
    command = [sys.executable, "-m", "rig_identification.nodes", name, "--ros-args"]
    command += ["-r", f"__ns:=/{namespace.strip('/')}"]
    for file in files:
        command += ["--params-file", str(file)]
    return command


def _write_merged(file: Path, nodes: Path | None, chosen: dict[str, list[tuple[str, str]]]) -> None:
    """One parameter file of ``nodes`` and what the command line chose.

    A parameter that two files give in different types keeps the first (rcl), so no two files may.
    """
    yaml = YAML(typ="safe", pure=True)
    sections: dict[str, dict[str, object]] = {}
    if nodes is not None:
        for key, section in (yaml.load(nodes.read_text(encoding="utf-8")) or {}).items():
            sections[key] = _flat(section.get("ros__parameters") or {})
    for name, parameters in chosen.items():
        own = [section for key, section in sections.items() if key.split("/")[-1] == name]
        for parameter, text in parameters:
            for section in own or [sections.setdefault(f"/**/{name}", {})]:
                section[parameter] = yaml.load(text)
    sections.setdefault("/**/none", {"none": 0})  # a file without parameters is refused
    document = {key: {"ros__parameters": section} for key, section in sections.items() if section}
    with file.open("w", encoding="utf-8") as stream:
        yaml.dump(document, stream)


def _flat(tree: dict[str, object], prefix: str = "") -> dict[str, object]:
    """Nested parameters by their dotted names."""
    flat: dict[str, object] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat.update(_flat(value, f"{prefix}{key}."))
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _files(arguments: argparse.Namespace) -> tuple[Path, Path | None]:
    """Rig description and the nodes' parameters."""
    if arguments.graph == "replay":
        if arguments.session is None:
            raise InputError("replay: name the session to play")
        rig, nodes = arguments.rig or _rig_of(arguments.session), arguments.nodes
    elif arguments.graph == "simulated":
        rig = arguments.rig or _packaged("simulated_rig_node_description.yaml")
        nodes = arguments.nodes or _packaged("simulated_rig_nodes.yaml")
    else:
        if arguments.rig is None:
            raise InputError("live: give the rig description with --rig")
        rig, nodes = arguments.rig, arguments.nodes or _packaged("rig_nodes.yaml")
    for file in (rig, nodes):
        if file is not None and not file.is_file():
            raise InputError(f"{file}: does not exist; correct its path")
    return rig, nodes


def _rig_of(session: Path) -> Path:
    from rig_identification.session.session_description import read_session_description

    return read_session_description(session).rig_file


def _parameters(name: str, arguments: argparse.Namespace) -> list[tuple[str, str]]:
    chosen: list[tuple[str, str]] = []
    if arguments.graph == "replay":
        chosen.append(
            ("use_sim_time", "true")
            if name != "replay"
            else ("session", json.dumps(str(arguments.session.resolve())))
        )
        if name == "replay":
            chosen.append(("operate", "identifier"))
    for text in arguments.parameters:
        path, equals, value = text.partition("=")
        node, dot, parameter = path.partition(".")
        if not (equals and dot and parameter) or node not in GRAPHS[arguments.graph]:
            raise InputError(
                f"--set {text}: is not NODE.NAME=VALUE with a node of {', '.join(GRAPHS[arguments.graph])}"
            )
        if node == name:
            chosen.append((parameter, value))
    return chosen


def _packaged(name: str) -> Path:
    """A parameter file as installed, or beside the package in a source tree."""
    here = Path(__file__).resolve().parents[3] / "config" / name
    installed = Path(sysconfig.get_path("data")) / "share" / "rig_identification" / "config" / name
    places: Sequence[Path] = (here, installed)
    for place in places:
        if place.is_file():
            return place
    raise InputError(
        f"{name}: is in neither {here.parent} nor {installed.parent}; name one with --rig or --nodes"
    )
