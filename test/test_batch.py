"""A batch of sessions: what is done is not done again, what fails stops nothing, N jobs change no answer."""

from __future__ import annotations

import csv
import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from rig_identification.batch import fingerprint as fingerprints
from rig_identification.batch.batch import Batch, Step, failed
from rig_identification.batch.fingerprint import files_of, fingerprint, seen_files
from rig_identification.batch.processes import Ended, Processes, side_by_side
from rig_identification.batch.record import DEFECT, DONE, STOPPED, UNUSABLE, read_record
from rig_identification.batch.sessions import Shard, sessions_in
from rig_identification.batch.table import table_csv, table_json
from rig_identification.cli.batch_progress import BatchProgress, duration
from rig_identification.cli.main import main
from rig_identification.errors import InputError

DESCRIPTION = "rig: rig.yaml\nrecordings:\n  - {bag: run_1, kind: dynamic}\n"
RESULT = {
    "mass": {"value": 10.0, "std": 0.1},
    "center_of_mass": {"value": [0.1, 0.2, 0.3], "std": [0.01, 0.01, 0.01]},
    "inertia": {
        "value": [[1.0, 0.1, 0.2], [0.1, 2.0, 0.3], [0.2, 0.3, None]],
        "std": [[0.1, 0.1, 0.1], [0.1, 0.1, 0.1], [0.1, 0.1, None]],
    },
    "without_frame": None,
    "unobservable": ["Jzz"],
    "mismatch": {"verdict": "explained", "findings": [{"effect": "hinge_damping"}], "alternatives": []},
}


def make_session(folder: Path, bag: bytes = b"samples") -> Path:
    (folder / "run_1").mkdir(parents=True)
    (folder / "session.yaml").write_text(DESCRIPTION, encoding="utf-8")
    (folder / "rig.yaml").write_text("rig", encoding="utf-8")
    (folder / "run_1" / "run_1_0.mcap").write_bytes(bag)
    return folder


def answer(session: Path, out: Path) -> Ended:
    """An identification that knows its answer."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "result.json").write_text(json.dumps(RESULT), encoding="utf-8")
    return Ended(DONE)


def settle(
    folder: Path,
    out: Path,
    identify: Callable[[Path, Path], Ended] = answer,
    jobs: int = 1,
    **options: object,
) -> tuple[list[dict[str, object]], dict[str, bool]]:
    """The batch's rows, and of each session whether it was done already."""
    steps: list[Step] = []
    rows = Batch(sessions_in(folder), out, options).run(identify, jobs, lambda: None, steps.append)
    return rows, {step.session.name: step.again for step in steps}


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    folder = tmp_path / "sessions"
    for name in ("b", "a/deep", "c"):
        make_session(folder / name)
    return folder


def test_sessions_at_any_depth_by_name(sessions: Path) -> None:
    assert [s.name for s in sessions_in(sessions)] == ["a/deep", "b", "c"]
    assert [s.name for s in sessions_in(sessions / "b")] == ["b"]
    with pytest.raises(InputError, match="holds no session"):
        sessions_in(sessions / "b" / "run_1")
    with pytest.raises(InputError, match="is no folder"):
        sessions_in(sessions / "nowhere")


def test_a_link_back_is_followed_once(sessions: Path) -> None:
    (sessions / "b" / "again").symlink_to(sessions)
    assert [s.name for s in sessions_in(sessions)] == ["a/deep", "b", "c"]


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_every_session_has_one_shard(sessions: Path, count: int) -> None:
    listed = sessions_in(sessions)
    parts = [Shard(k + 1, count).of(listed) for k in range(count)]
    assert sorted(s.name for part in parts for s in part) == [s.name for s in listed]


def test_what_is_done_is_not_done_again(sessions: Path, tmp_path: Path) -> None:
    first, again = settle(sessions, tmp_path / "out")
    assert set(again.values()) == {False}
    second, again = settle(sessions, tmp_path / "out")
    assert set(again.values()) == {True}
    assert first == second


@pytest.mark.parametrize("changed", ["session.yaml", "rig.yaml", "run_1/run_1_0.mcap"])
def test_what_changed_is_done_again(sessions: Path, tmp_path: Path, changed: str) -> None:
    settle(sessions, tmp_path / "out")
    file = sessions / "b" / changed
    file.write_bytes(file.read_bytes() + b"\n# more\n")
    assert settle(sessions, tmp_path / "out")[1] == {"a/deep": True, "b": False, "c": True}


def test_other_options_or_another_version_are_another_answer(
    sessions: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settle(sessions, tmp_path / "out", work=150.0)
    assert set(settle(sessions, tmp_path / "out", work=150.0)[1].values()) == {True}
    assert set(settle(sessions, tmp_path / "out", work=300.0)[1].values()) == {False}
    monkeypatch.setattr(fingerprints, "__version__", "99.0")
    assert set(settle(sessions, tmp_path / "out", work=300.0)[1].values()) == {False}


def test_a_lost_result_is_made_again(sessions: Path, tmp_path: Path) -> None:
    settle(sessions, tmp_path / "out")
    (tmp_path / "out" / "b" / "result.json").unlink()
    assert settle(sessions, tmp_path / "out")[1]["b"] is False


def test_where_a_session_lies_and_when_it_was_copied_do_not_matter(sessions: Path, tmp_path: Path) -> None:
    b, c = sessions / "b", sessions / "c"
    os.utime(c / "rig.yaml", ns=(1, 1))
    hashes = {fingerprint(s, seen_files(files_of(s), {}), {}) for s in (b, c)}
    assert len(hashes) == 1


def test_unchanged_files_are_not_read_again(sessions: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = files_of(sessions / "b")
    seen = seen_files(files, {})

    def read(file: Path) -> str:
        raise AssertionError(f"{file} was read")

    monkeypatch.setattr(fingerprints, "sha256_of", read)
    assert seen_files(files, seen) == seen


def test_one_that_fails_stops_no_other(sessions: Path, tmp_path: Path) -> None:
    tried: list[str] = []

    def some(session: Path, out: Path) -> Ended:
        tried.append(session.name)
        if session.name == "b":
            return Ended(UNUSABLE, "rig.yaml: mass is missing")
        return Ended(STOPPED, "ended by signal 9") if session.name == "c" else answer(session, out)

    rows, _ = settle(sessions, tmp_path / "out", some)
    assert [row["status"] for row in rows] == [DONE, UNUSABLE, STOPPED]
    assert failed(rows) == 2
    assert rows[1]["message"] == "rig.yaml: mass is missing"
    tried.clear()
    rows, _ = settle(sessions, tmp_path / "out", some)
    assert tried == ["c"], "what cannot be used stays so; what was stopped from outside is tried again"
    assert failed(rows) == 2


def test_a_result_of_before_is_no_row_of_a_session_that_failed_since(sessions: Path, tmp_path: Path) -> None:
    settle(sessions, tmp_path / "out")
    (sessions / "b" / "rig.yaml").write_text("worse", encoding="utf-8")
    rows, _ = settle(
        sessions,
        tmp_path / "out",
        lambda session, out: Ended(UNUSABLE, "no") if session.name == "b" else answer(session, out),
    )
    assert (tmp_path / "out" / "b" / "result.json").exists()
    assert "m" not in rows[1]
    assert rows[1]["result"] is None


def test_more_jobs_run_at_once_and_give_the_same_table(sessions: Path, tmp_path: Path) -> None:
    together = threading.Barrier(3, timeout=10.0)

    def at_once(session: Path, out: Path) -> Ended:
        together.wait()  # breaks where fewer than three run at once
        time.sleep(0.01 if session.name == "deep" else 0.0)  # the first ends last
        return answer(session, out)

    one, _ = settle(sessions, tmp_path / "one")
    three, _ = settle(sessions, tmp_path / "three", at_once, jobs=3)
    assert table_json(one, "1") == table_json(three, "1")


def test_the_table_has_every_number_once(sessions: Path, tmp_path: Path) -> None:
    rows, _ = settle(sessions, tmp_path / "out")
    told = list(csv.DictReader(table_csv(rows).splitlines()))
    assert [row["session"] for row in told] == ["a/deep", "b", "c"]
    assert told[0]["m"] == "10.0"
    assert told[0]["Jyz"] == "0.3"
    assert told[0]["Jzz"] == ""
    assert told[0]["unobservable"] == "Jzz"
    assert told[0]["findings"] == "hinge_damping"
    document = json.loads(table_json(rows, "1.2"))
    assert document["version"] == "1.2"
    assert document["sessions"][0]["cx_std"] == 0.01
    assert document["sessions"][0]["result"] == "a/deep/result.json"


def test_a_record_cut_short_counts_as_none(sessions: Path, tmp_path: Path) -> None:
    settle(sessions, tmp_path / "out")
    record = tmp_path / "out" / "b" / "batch.json"
    record.write_text(record.read_text(encoding="utf-8")[:40], encoding="utf-8")
    assert read_record(record.parent) is None
    assert settle(sessions, tmp_path / "out")[1]["b"] is False


@pytest.mark.parametrize(
    ("program", "status", "message"),
    [
        ("pass", DONE, ""),
        (
            "import sys; print('rig-identification: error: no bag', file=sys.stderr); sys.exit(2)",
            UNUSABLE,
            "no bag",
        ),
        (
            "import sys; print('rig-identification: defect: x', file=sys.stderr); sys.exit(1)",
            DEFECT,
            "defect: x",
        ),
        ("import os; os.kill(os.getpid(), 9)", STOPPED, "ended by signal 9"),
    ],
)
def test_a_process_tells_what_became_of_its_session(program: str, status: str, message: str) -> None:
    assert Processes(1).call((sys.executable, "-c", program)) == Ended(status, message)


def test_a_process_is_told_its_share_of_the_cores() -> None:
    program = "import os, sys; sys.exit(0 if os.environ['RIG_IDENTIFICATION_CORES'] == '3' else 1)"
    assert Processes(3).call((sys.executable, "-c", program)).status == DONE


def test_an_interrupt_stops_what_runs_and_begins_nothing() -> None:
    processes = Processes(1)
    began: list[int] = []

    def task(number: int) -> Ended:
        began.append(number)
        if number == 0:
            return Ended(DONE)
        return processes.call((sys.executable, "-c", "import time; time.sleep(60)"))

    start = time.monotonic()
    outcomes = side_by_side(task, range(5), 2, processes.stop)
    assert next(outcomes)[0] == 0
    with pytest.raises(KeyboardInterrupt):
        outcomes.throw(KeyboardInterrupt)  # type: ignore[attr-defined]
    assert time.monotonic() - start < 30.0
    assert processes.call((sys.executable, "-c", "pass")).status == STOPPED


def test_time_left_is_that_of_what_was_identified() -> None:
    now = iter([0.0, 60.0, 60.0])

    class Quiet:
        def isatty(self) -> bool:
            return False

        def write(self, text: str) -> int:
            lines.append(text)
            return len(text)

        def flush(self) -> None: ...

    lines: list[str] = []
    from rig_identification.batch.record import Record
    from rig_identification.batch.sessions import Listed

    with BatchProgress(Quiet(), 4, clock=lambda: next(now)) as progress:  # type: ignore[arg-type]
        progress(Step(Listed("a", Path("a")), Record(DONE, "0"), True))
        progress(Step(Listed("b", Path("b")), Record(UNUSABLE, "0"), False))
    assert "1 of 4, 0 failed, time left not known yet: a: done already" in lines
    assert "2 of 4, 1 failed, about 2 min left: b: unusable" in lines
    assert [duration(s) for s in (1.0, 3600.0, 90000.0, 900000.0)] == [
        "1 min",
        "1 h 0 min",
        "25 h 0 min",
        "10 d 10 h",
    ]


def test_the_command_tabulates_what_cannot_be_used(
    sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Through real processes: every session fails with identify's own line, and the status says so."""
    (sessions / "c" / "session.yaml").unlink()
    out = tmp_path / "out"
    assert main(["batch", str(sessions), "--out", str(out), "--jobs", "2"]) == 3
    told = json.loads((out / "index.json").read_text(encoding="utf-8"))["sessions"]
    assert [row["status"] for row in told] == [UNUSABLE, UNUSABLE]
    assert "rig.yaml" in told[0]["message"]
    assert "0 of 2 sessions have a result" in capsys.readouterr().out
    assert main(["batch", str(sessions), "--out", str(out), "--shard", "2/2"]) == 3
    assert [row["session"] for row in json.loads((out / "index.2-of-2.json").read_text())["sessions"]] == [
        "b"
    ]


@pytest.mark.parametrize("wrong", [["--jobs", "0"], ["--shard", "3/2"], ["--shard", "x"]])
def test_wrong_arguments_are_one_line(
    sessions: Path, tmp_path: Path, wrong: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["batch", str(sessions), "--out", str(tmp_path / "out"), *wrong])
    assert stopped.value.code == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
