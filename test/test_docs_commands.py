"""Commands of README and docs: the parser takes every one, and those that need no rig or network are run.

A block stands in one of three lists. ``CASES`` are run as they stand, in a folder that holds what the page
takes for given. ``ELSEWHERE`` are run by another test. What begins with a command of ``OUTSIDE`` needs
what is not here.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from test_docs_pages import DOCS, README, ROOT, blocks
from test_several_commands import sessions, write

import rig_identification as ri
from rig_identification.cli.main import build_parser, main

COMMAND = "rig-identification"
PAGES = [README, *sorted(DOCS.rglob("*.md"))]
SHELL = re.compile(r"^ *```(?:sh|bash|console|)\n(.*?)^ *```$", re.DOTALL | re.MULTILINE)
#: Commands that need a running graph, a network, a cluster or a browser.
OUTSIDE = ("python3", "pip", "ros2", "colcon", "sbatch", "interfaces/build.sh")
#: ``rig`` and ``ui`` run until they are stopped.
ENDLESS = ("rig", "ui")


def name_of(page: Path) -> str:
    """A page as it is named here."""
    return page.relative_to(ROOT).as_posix()


#: Blocks that are run by another test, by page.
ELSEWHERE = {
    "docs/how-to/import.md": "test_newcomer.py",
    "docs/how-to/own-effect.md": "test_own_effect.py",
    "docs/thesis.md": "test_thesis_rerun.py",
    "docs/tutorials/live-rig.md": "test_nodes_tutorial.py",
    **{name_of(page): "test_docs_effects.py" for page in sorted((DOCS / "effects").glob("*.md"))},
    **{name_of(page): "test_docs_recordings.py" for page in sorted((DOCS / "recordings").glob("*.md"))},
}


def commands(block: str) -> list[str]:
    """The lines of a block that are commands, each whole; none where it shows what a command prints."""
    joined = re.sub(r"\\\n\s*", "", block)
    lines = [re.sub(r"\s+#.*$", "", line).removeprefix("$ ").strip() for line in joined.splitlines()]
    return [line for line in lines if line.removeprefix(".venv/bin/").split(" ")[0] in (COMMAND, *OUTSIDE)]


def shell_blocks(page: Path) -> list[list[str]]:
    """The commands of each block of a page."""
    return [told for block in SHELL.findall(page.read_text(encoding="utf-8")) if (told := commands(block))]


ALL = [(page, i, told) for page in PAGES for i, told in enumerate(shell_blocks(page))]
OURS = [
    (name_of(page), line.partition(COMMAND)[2])
    for page, _, told in ALL
    for line in told
    if COMMAND in line.split(" ")[0]
]


@pytest.mark.parametrize(("page", "line"), OURS, ids=lambda value: str(value)[:60])
def test_the_parser_takes_every_command(page: str, line: str) -> None:
    """Its options exist and what it needs is given."""
    words = shlex.split(line.partition(">")[0].replace("[", "").replace("...]", ""))
    asked = build_parser().parse_args(words)
    assert callable(asked.run)


# --- what is run -----------------------------------------------------------------------------------------


def results(*names: str) -> Callable[[Path], None]:
    """Folders with results of one body on one rig."""

    def given(folder: Path) -> None:
        for name, result in zip(names, sessions(len(names)), strict=True):
            write(result, folder / name)

    return given


def simulated(*names: str) -> Callable[[Path], None]:
    """Sessions of eight seconds on the thesis' first rig."""

    def given(folder: Path) -> None:
        for k, name in enumerate(names):
            ri.simulate(case="1", start="pulled", duration=8.0, rest=4.0, seed=k).write(folder / name)

    return given


def nothing(folder: Path) -> None:
    """An empty folder."""


def described(folder: Path) -> None:
    """The description of a car on four cables."""
    shutil.copy(ROOT / "config" / "car_four_cables.yaml", folder / "rig.yaml")


def own_rig(folder: Path) -> None:
    """The page's own description, and a session of a rig that is there already."""
    (folder / "rig.yaml").write_text(blocks(DOCS / "how-to" / "own-rig.md", "yaml")[0], encoding="utf-8")
    simulated("SESSION")(folder)


def certified(folder: Path) -> None:
    """A session, and the page's own description of a laboratory."""
    simulated("SESSION")(folder)
    (folder / "lab.yaml").write_text(blocks(DOCS / "how-to" / "certificate.md", "yaml")[0], encoding="utf-8")


def remembered(folder: Path) -> None:
    """Results of sessions on a rig, and one that is recorded today."""
    simulated("today", "monday")(folder)
    run("rig-identification identify monday --out results/monday", folder)


def drone(folder: Path) -> None:
    """The page's own description of a drone on two strings."""
    (folder / "rig.yaml").write_text(blocks(DOCS / "tutorials" / "drone.md", "yaml")[0], encoding="utf-8")


def mismatch_of(answer: Path) -> dict[str, Any]:
    """What an answer says is left out."""
    told: dict[str, Any] = json.loads((answer / "result.json").read_text(encoding="utf-8"))["mismatch"]
    return told


def car_says(folder: Path) -> None:
    """No fault, nothing left out."""
    assert json.loads((folder / "car" / "check" / "check.json").read_text(encoding="utf-8"))["faults"] == []
    assert mismatch_of(folder / "car" / "answer")["verdict"] == "none"


def drone_says(folder: Path) -> None:
    """Jzz and Jxx as simulated, to some percent; Jyy hardly."""
    told = json.loads((folder / "answer" / "result.json").read_text(encoding="utf-8"))
    assert told["mismatch"]["verdict"] == "none"
    J, std = told["inertia"]["value"], told["inertia"]["std"]
    for i, true in ((0, 0.012), (2, 0.022)):
        assert abs(J[i][i] - true) < 4.0 * std[i][i] < 0.1 * true
    assert J[1][1] is None or std[1][1] > 0.1 * J[1][1]


def mystery_says(folder: Path) -> None:
    """The hidden effect is found; repaired, nothing is left, and both are one body."""
    told = mismatch_of(folder / "mystery_answer")
    assert told["verdict"] == "explained"
    (finding,) = told["findings"]
    assert finding["effect"] == "hinge_damping"
    damping = finding["parameters"]["damping"]
    assert abs(damping["value"] - 20.0) < 4.0 * damping["std"]
    assert mismatch_of(folder / "repaired_answer")["verdict"] == "none"
    assert json.loads((folder / "agreement" / "compare.json").read_text(encoding="utf-8"))["agree"] is True


@dataclass(frozen=True)
class Case:
    """Blocks of a page that are run one after the other in one folder."""

    page: str
    blocks: tuple[int, ...]
    given: Callable[[Path], None]
    makes: tuple[str, ...]  # files that are there in the end
    long: bool = True
    says: Callable[[Path], None] | None = None  # holds what the page says of the results


CASES = (
    Case(
        "docs/how-to/compare.md", (0,), results("monday", "friday"), ("agreement/compare.html",), long=False
    ),
    Case(
        "docs/how-to/rig-memory.md",
        (0,),
        results("results/a", "results/b", "results/c"),
        ("rig/memory.json",),
        long=False,
    ),
    Case("docs/how-to/rig-memory.md", (1,), remembered, ("today_with_memory/result.json",)),
    Case("docs/how-to/fuse.md", (0,), simulated("high", "low"), ("both/result.json",)),
    Case(
        "docs/how-to/certificate.md",
        (0, 1),
        certified,
        ("certified/certificate.pdf", "certified/certificate.xml"),
    ),
    Case("docs/how-to/own-rig.md", (0, 1), own_rig, ("trial_answer/report.html", "ANSWER/report.html")),
    Case("docs/how-to/batch.md", (0,), simulated("sessions/a", "sessions/b"), ("results/a/result.json",)),
    Case("docs/how-to/plan.md", (0,), described, ("plan/plan.html", "plan/session.yaml")),
    Case(
        "docs/tutorials/car.md",
        (0, 1, 2, 3),
        nothing,
        (
            "car/report.html",
            "car/check/check.html",
            "car/answer/report.html",
            "car/certificate/certificate.html",
        ),
        says=car_says,
    ),
    Case("docs/tutorials/drone.md", (0, 1, 2), drone, ("answer/report.html",), says=drone_says),
    Case(
        "docs/tutorials/first-mismatch.md",
        (0, 1, 2, 3, 4),
        nothing,
        (
            "mystery_answer/report.html",
            "wide/session.yaml",
            "repaired_answer/report.html",
            "agreement/compare.html",
        ),
        says=mystery_says,
    ),
    Case("docs/how-to/plan.md", (1,), lambda folder: after_a_session(folder), ("plan/plan.html",)),
)


def after_a_session(folder: Path) -> None:
    """A session's answer, and its rig."""
    simulated("session")(folder)
    run("rig-identification identify session --out answer", folder)
    shutil.copy(folder / "session" / "rig.yaml", folder / "rig.yaml")


def run(line: str, folder: Path) -> None:
    """Run a command as a shell does, with this interpreter's installation."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    script = f"set -euo pipefail; {line}"
    done = subprocess.run(
        ["bash", "-c", script],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, id=f"{c.page}-{c.blocks}", marks=[pytest.mark.long] if c.long else []) for c in CASES],
)
def test_the_commands_of_a_page_do_what_it_says(case: Case, tmp_path: Path) -> None:
    case.given(tmp_path)
    told = shell_blocks(ROOT / case.page)
    for i in case.blocks:
        for line in told[i]:
            run(line, tmp_path)
    assert [name for name in case.makes if not (tmp_path / name).is_file()] == []
    if case.says is not None:
        case.says(tmp_path)


@pytest.mark.parametrize(
    ("hinges", "alike"),
    [("hinge_damping=20", True), pytest.param("hinge_friction=0.15", False, marks=pytest.mark.long)],
)
def test_both_amplitudes_of_the_first_mismatch_lose_the_same_share(
    hinges: str, alike: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The experiment of the page, and its Python, as they stand; dry hinges take more of the small swing."""
    pytest.importorskip("pandas", reason="pip install '.[pandas]'")
    page = DOCS / "tutorials" / "first-mismatch.md"
    monkeypatch.chdir(tmp_path)
    hidden = ri.simulate(case=14, start="pulled", shake=(0.05, 0.7), duration=1.0, rest=0.0)
    hidden.write("mystery")
    for line in shell_blocks(page)[2]:
        assert main(shlex.split(line.replace("hinge_damping=20", hinges))[1:]) == 0
    (code,) = blocks(page, "python")
    names: dict[str, Any] = {}
    if alike:
        exec(compile(code, str(page), "exec"), names)
        assert 0.1 < names["small"] < 0.9  # it does die down
    else:
        with pytest.raises(AssertionError):
            exec(compile(code, str(page), "exec"), names)
        assert names["small"] < 0.8 * names["wide"]


def test_every_block_is_run_or_cannot_be() -> None:
    """A new block has to be put into one of the lists."""
    listed = {(case.page, i) for case in CASES for i in case.blocks}
    left = []
    for page, i, told in ALL:
        first = told[0].removeprefix(".venv/bin/").split(" ")
        outside = any(line.split(" ")[0] in OUTSIDE for line in told)
        endless = first[0] == COMMAND and first[1] in ENDLESS
        if not (outside or endless or (name_of(page), i) in listed or name_of(page) in ELSEWHERE):
            left.append((name_of(page), told))
    assert left == []
    assert all((ROOT / "test" / name).is_file() for name in ELSEWHERE.values())
