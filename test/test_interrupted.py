"""Ctrl-C while a session is identified: the best answer so far is written and marked, or nothing."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.report import result_to_dict
from rig_identification.result import Identification
from rig_identification.search.identify import identify
from rig_identification.session import read_session, write_session
from rig_identification.simulate import simulate_session

#: The command as it is, which says each stage aloud and waits there, as a long one would, for the signal.
COMMAND = """
import sys, time
from rig_identification.cli import progress
from rig_identification.cli.main import main

def said(self, stage, fraction=None, beside=""):
    print(stage, flush=True)
    if stage.startswith(sys.argv[1]):
        time.sleep(600.0)

progress.StageProgress.__call__ = said
sys.exit(main(["identify", sys.argv[2], "--out", sys.argv[3]]))
"""


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    spec = replace(shaken(14, 4.0), effects={"hinge_damping": (60.0,)}, doubts=False)
    made, _ = simulate_session(spec, np.random.default_rng(3))
    return write_session(made, tmp_path_factory.mktemp("made") / "session")


def interrupted(session: Path, out: Path, at: str) -> subprocess.CompletedProcess[str]:
    """The command, interrupted by a real SIGINT in its first stage that begins with ``at``."""
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, at, str(session), str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(at):
            process.send_signal(signal.SIGINT)
            break
    output, errors = process.communicate(timeout=300)
    return subprocess.CompletedProcess(process.args, process.returncode, output, errors)


def test_while_it_searches_the_best_answer_is_written_and_marked(session: Path, tmp_path: Path) -> None:
    done = interrupted(session, tmp_path, "search: ")
    assert done.returncode == 130, done.stderr
    result = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert result["interrupted"] is True
    assert result["mass"]["value"] > 0.0
    assert 0.0 < result["work"]["used"] < result["work"]["limit"]
    assert result["mismatch"]["verdict"] == "unexplained"
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Interrupted before the search" in page
    assert "kg" in done.stdout
    *before, last = done.stderr.splitlines()
    assert all(line.startswith("so far: ") for line in before)
    assert last == "rig-identification: interrupted: result and report hold the best answer until then"


def test_before_the_ideal_model_is_fitted_nothing_is_written(session: Path, tmp_path: Path) -> None:
    earlier = tmp_path / "result.json"
    earlier.write_text("earlier")
    done = interrupted(session, tmp_path, "fit: ")
    assert done.returncode == 130
    assert done.stderr.splitlines() == ["rig-identification: interrupted"]
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]
    assert earlier.read_text() == "earlier"


def test_whoever_watches_changes_nothing(session: Path) -> None:
    """Answers are shown while the search runs; the last answer is the same to the last digit."""
    recorded = read_session(session)
    seen: list[Identification] = []
    alone = identify(recorded, work=3.0)
    watched = identify(recorded, work=3.0, watcher=seen.append)
    assert result_to_dict(watched) == result_to_dict(alone)
    assert seen  # the ideal model's answer at least, then whatever is found
    assert all(np.isfinite(answer.total.values).all() for answer in seen)
    assert not any(answer.interrupted for answer in seen)
