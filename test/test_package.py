"""The package as a whole: direction of the imports, one version, one test command."""

from __future__ import annotations

import ast
import importlib.metadata
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

import rig_identification

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "rig_identification"
NAME = "rig_identification"

VALUES = {
    *(
        "",
        "errors",
        "examination",
        "files",
        "joint",
        "laboratory",
        "optional",
        "own",
        "quantity",
        "raw",
        "rig",
        "recording",
    ),
    *("result", "rig_document", "topics"),
}
CORE = {"model", "estimate", "mismatch", "search", "statics", "live"}
# What a room may import of the package besides itself and the shared values; the front door may import all.
ALLOWED = {
    "model": set(),
    "statics": {"model"},
    "estimate": {"model", "statics"},
    "mismatch": {"model", "statics", "estimate"},
    "search": {"model", "statics", "estimate", "mismatch"},
    "cleaning": set(),
    "check": {"model", "statics", "cleaning"},
    "thesis": CORE,
    "simulate": CORE | {"thesis"},
    "thesis_rerun": CORE | {"thesis", "simulate"},
    "thesis_report": CORE | {"thesis", "thesis_rerun", "report"},
    "session": {"cleaning"},
    "several": {"model", "estimate"},
    "batch": {"session"},
    "logs": {"session"},
    "plan": CORE | {"thesis", "simulate"},
    "plan_report": CORE | {"plan", "simulate", "report", "session"},
    "report": CORE | {"several"},
    "live": {"model", "statics", "estimate"},
    "watch": {"model", "estimate", "mismatch"},
    "identification": {"check", "cleaning", "search", "session"},
    "watching": {"identification", "live", "watch"},
    "": {"api"},
    "api": CORE
    | {"check", "identification", "report", "session", "simulate", "thesis"}
    | {"plan", "plan_report", "several"},
    "ui": {"api", "report", "statics", "model", "plan_report", "session"},
    "nodes": CORE | {"cleaning", "session", "report", "identification", "watching"},
}
OUTSIDE_THE_CORE = {
    "argparse",
    "fpdf",
    "jinja2",
    "matplotlib",
    "rclpy",
    "rich",
    "rosbags",
    "ruamel",
    "serial",
    "sqlite3",
    "starlette",
    "uvicorn",
    "yaml",
}
ROS = re.compile(r"rclpy|ament_index_python|launch|\w+_msgs|std_srvs")


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def room(path: Path) -> str:
    """First part of a module's name inside the package."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return "" if parts[0] == "__init__" else parts[0]


def imported(path: Path) -> set[str]:
    """Every absolute module name that a file imports, inside functions too."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found: set[str] = set()
    package = [NAME, *path.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            stem = ".".join([*base, *([node.module] if node.module else [])])
            found |= {f"{stem}.{alias.name}" for alias in node.names}
    return found


def rooms_imported(path: Path) -> set[str]:
    own = {name.split(".")[1] for name in imported(path) if name.startswith(f"{NAME}.")}
    known = {room(module) for module in modules()}
    return own & known - VALUES


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_room_imports_only_rooms_before_it(path: Path) -> None:
    here = room(path)
    if here == "cli":
        assert "nodes" not in rooms_imported(path)
        return
    allowed = ALLOWED.get(here, set())
    assert rooms_imported(path) - {here} <= allowed, f"{here} reaches into a room that it may not know"


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_core_knows_no_files_no_ros_no_terminal(path: Path) -> None:
    outside = {name.split(".")[0] for name in imported(path)}
    if room(path) in CORE | VALUES | {"check", "cleaning", "several", "simulate", "plan", "watch"}:
        assert not outside & OUTSIDE_THE_CORE
    if room(path) != "nodes":
        assert not {name for name in outside if ROS.fullmatch(name)}


#: Rooms whose answers may not depend on when they are asked, or on how fast the machine is.
TIMELESS = {"model", "statics", "estimate", "mismatch", "search", "several", "watch"}
CLOCK_MODULES = {"time", "timeit", "datetime", "sched", "resource", "signal"}
CLOCKS = re.compile(
    r"(monotonic|perf_counter|process_time|thread_time|clock_gettime|time)(_ns)?|now|utcnow|today|getrusage"
    r"|times|default_timer|datetime64"
)


def clocks_read(path: Path) -> set[str]:
    """Modules with a clock that a file imports, and calls in it by a clock's name."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = {name for name in imported(path) if name.split(".")[0] in CLOCK_MODULES}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            named = node.func
            called = named.attr if isinstance(named, ast.Attribute) else getattr(named, "id", "")
            if CLOCKS.fullmatch(called):
                found.add(called)
            # What is imported by a name in quotes
            found |= {
                str(a.value)
                for a in node.args
                if called in {"__import__", "import_module"}
                and isinstance(a, ast.Constant)
                and str(a.value).split(".")[0] in CLOCK_MODULES
            }
    return found


@pytest.mark.parametrize(
    "path", [p for p in modules() if room(p) in TIMELESS], ids=lambda path: str(path.relative_to(PACKAGE))
)
def test_an_answer_asks_no_clock(path: Path) -> None:
    assert not clocks_read(path)


@pytest.mark.parametrize(
    "source",
    [
        "import time as t\nt.monotonic()",
        "def f():\n    from time import perf_counter as p",
        "import numpy as np\nnp.datetime64('now')",
        "import os\nos.times()",
        "clock = __import__('time')",
        "def late(self):\n    return self.clock.monotonic_ns() > self.end",
    ],
)
def test_a_clock_is_seen(source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / NAME
    (package / "model").mkdir(parents=True)
    file = package / "model" / "body.py"
    file.write_text(source)
    monkeypatch.setattr(sys.modules[__name__], "PACKAGE", package)
    assert clocks_read(file)


def test_the_walk_sees_the_rooms() -> None:
    assert {"session", "report", "cli", "model"} <= {room(path) for path in modules()}
    assert "report" in rooms_imported(PACKAGE / "cli" / "summary.py")
    assert f"{NAME}.identification.prepare" in imported(PACKAGE / "cli" / "commands" / "identify.py")


def test_a_relative_import_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / NAME
    (package / "model").mkdir(parents=True)
    source = package / "model" / "body.py"
    source.write_text("def f():\n    from ..session import read_session\n")
    monkeypatch.setattr(sys.modules[__name__], "PACKAGE", package)
    assert imported(source) == {f"{NAME}.session.read_session"}


def test_one_version() -> None:
    manifest = ElementTree.parse(ROOT / "package.xml").getroot()
    assert manifest.findtext("version") == rig_identification.__version__
    assert manifest.findtext("license") == "Apache-2.0"


def test_installed_metadata() -> None:
    try:
        metadata = importlib.metadata.metadata(NAME)
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("runs from the source tree, not installed")
    assert metadata["Version"] == rig_identification.__version__
    ros = [line for line in metadata.get_all("Requires-Dist") if "ros-jazzy" in line]
    assert ros
    assert all('platform_system == "Linux"' in line and "x86_64" in line for line in ros)


def test_the_tool_needs_no_ros() -> None:
    """Everything but the nodes imports where no rclpy can be found."""
    names = [
        ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
        for path in modules()
        if room(path) != "nodes" and path.name != "__init__.py"
    ]
    code = (
        "import sys, importlib\n"
        "sys.modules['rclpy'] = None\n"
        f"for name in {names!r}:\n    importlib.import_module(name)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr


def readme_commands() -> list[str]:
    return re.findall(
        r"^```sh\n(.*?)^```$", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )


def test_readme_has_two_commands() -> None:
    first, second = readme_commands()
    for command in (first, second):
        assert "-m venv" in command
        assert "pip install" in command
    assert "rig-identification" in first
    assert "pytest" in second
    assert "ruff check" in second


@pytest.mark.skipif(shutil.which("bash") is None or shutil.which("awk") is None, reason="needs bash and awk")
def test_ci_runs_the_second_command_of_the_readme(tmp_path: Path) -> None:
    """``.ci/run`` is given a README whose second command leaves a mark instead of testing."""
    (tmp_path / ".ci").mkdir()
    shutil.copy(ROOT / ".ci" / "run", tmp_path / ".ci" / "run")
    second = readme_commands()[1]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    mark = tmp_path / "mark"
    (tmp_path / "README.md").write_text(readme.replace(second, f'pwd > "{mark}"\nfalse\ntouch "{mark}.2"\n'))
    (tmp_path / "untracked.txt").write_text("")
    done = subprocess.run(
        ["bash", str(tmp_path / ".ci" / "run")], capture_output=True, text=True, check=False
    )
    assert done.returncode != 0, "a failing line must fail the run"
    assert not Path(f"{mark}.2").exists(), "lines after a failing one must not run"
    where = Path(mark.read_text().strip())
    assert where != tmp_path
    assert not where.exists(), "the copy must be removed"
