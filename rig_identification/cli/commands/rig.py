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
    with tempfile.TemporaryDirectory(prefix="rig_") as folder:
        chosen = Path(folder) / "chosen.yaml"
        chosen.write_text(_chosen(names, arguments), encoding="utf-8")
        files = [*_files(arguments), chosen]
        Supervisor({name: _command(name, files, arguments.namespace) for name in names}).run()


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


def _chosen(names: Sequence[str], arguments: argparse.Namespace) -> str:
    """Parameter file of what the command line chose; as specific as the other files, and after them."""
    lines = ["/**/none:", "  ros__parameters: {none: 0}"]  # a file without parameters is refused
    for name in names:
        chosen = _parameters(name, arguments)
        if chosen:
            lines += [f"/**/{name}:", "  ros__parameters:"]
            lines += [f"    {parameter}: {value}" for parameter, value in chosen]
    return "\n".join(lines) + "\n"


def _files(arguments: argparse.Namespace) -> list[Path]:
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
    files = [rig, *([nodes] if nodes else [])]
    for file in files:
        if not file.is_file():
            raise InputError(f"{file}: does not exist; correct its path")
    return files


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
