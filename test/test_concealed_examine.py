"""The runner of concealed sessions, with small programs in place of the tool."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from bench.concealed import examine

WRITES = """
import sys
from pathlib import Path
session, out = Path(sys.argv[1]), Path(sys.argv[3])
(out / "report.html").write_text("page")
if session.name == "bad":
    sys.exit("session.yaml: no bag\\n")
(out / "result.json").write_text(session.name)
"""


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    """Three sessions, one of which cannot be used, and a folder that is none."""
    for name in ("a", "bad", "c"):
        (tmp_path / "in" / name).mkdir(parents=True)
        (tmp_path / "in" / name / "session.yaml").touch()
    (tmp_path / "in" / "notes").mkdir()
    return tmp_path / "in"


@pytest.fixture
def arguments(sessions: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The command line, the tool replaced by a small program."""
    monkeypatch.setattr(examine, "IDENTIFY", (sys.executable, "-c", WRITES))
    return ["--sessions", str(sessions), "--out", str(tmp_path / "out")]


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_all_are_examined_past_a_failure(arguments: list[str], tmp_path: Path, jobs: str) -> None:
    out = tmp_path / "out"
    assert examine.main([*arguments, "--jobs", jobs]) == 1
    assert [(out / name / "result.json").is_file() for name in ("a", "bad", "c")] == [True, False, True]
    assert sorted(p.name for p in (out / "a").iterdir()) == ["report.html", "result.json", "seconds.txt"]
    assert sorted(p.name for p in (out / "bad").iterdir()) == ["seconds.txt", "stderr.txt"]
    assert "no bag" in (out / "bad" / "stderr.txt").read_text()
    assert float((out / "c" / "seconds.txt").read_text()) > 0.0


def test_what_has_a_result_is_left_alone(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out" / "a").mkdir(parents=True)
    (tmp_path / "out" / "a" / "result.json").write_text("from before")
    (tmp_path / "out" / "c" / ".work").mkdir(parents=True)  # broken off
    (tmp_path / "out" / "c" / ".work" / "result.json").write_text("half")
    assert examine.main(arguments) == 1
    assert (tmp_path / "out" / "a" / "result.json").read_text() == "from before"
    assert (tmp_path / "out" / "c" / "result.json").read_text() == "c"
    assert "2 examined, 1 without a result" in capsys.readouterr().out


def test_a_session_that_takes_too_long_is_given_up(sessions: Path, tmp_path: Path) -> None:
    slow = (sys.executable, "-c", "import time; time.sleep(60)")
    wrong = examine.examine(sessions / "a", tmp_path / "out" / "a", 0.5, slow)
    assert wrong is not None
    assert wrong.startswith("given up")
    assert not (tmp_path / "out" / "a" / "result.json").exists()


def test_the_true_command_refuses_a_folder_that_is_no_session(sessions: Path, tmp_path: Path) -> None:
    wrong = examine.examine(sessions / "a", tmp_path / "out" / "a")
    assert wrong is not None
    assert wrong.startswith("exit 2: ")
