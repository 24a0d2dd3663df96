"""The command line: exit status, one line for what is wrong, both files or neither."""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from rig_identification import __version__
from rig_identification.cli.main import main
from rig_identification.cli.output import write_together
from rig_identification.cli.progress import QUIET_SECONDS, StageProgress
from rig_identification.cli.searching import Searching
from rig_identification.cli.summary import summary
from rig_identification.errors import InputError
from rig_identification.examination import Examination
from rig_identification.identification import Prepared
from rig_identification.model.work import WORK
from rig_identification.raw import RawSession
from rig_identification.recording import Session
from rig_identification.report import result_to_dict
from rig_identification.result import Identification, Interrupted, Work

Install = Callable[[object], None]


@pytest.fixture
def answer(monkeypatch: pytest.MonkeyPatch, session: Session, identification: Identification) -> Install:
    """Stand in for reading and estimating: the command line is tested here, not the estimate."""
    seen: dict[str, object] = {}

    def install(outcome: object) -> None:
        def identify(
            given: Session, *, progress: object = None, work: float = 0.0, watcher: object = None
        ) -> Identification:
            assert given is session
            seen["work"] = work
            if isinstance(outcome, BaseException):
                raise outcome
            return identification

        def read_raw(path: Path, **options: object) -> RawSession:
            seen.update(options, path=path)
            return RawSession("van", session.rig, ())

        module = types.ModuleType("rig_identification.search.identify")
        module.identify = identify  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "rig_identification.search.identify", module)
        monkeypatch.setattr("rig_identification.session.read_raw", read_raw)
        digests = {"session.yaml": "0" * 64}
        monkeypatch.setattr("rig_identification.session.provenance.file_digests", lambda *_: digests)
        prepared = Prepared(session, Examination("van", (), (), (), ("imu: nobody knows.",)))
        monkeypatch.setattr("rig_identification.identification.prepare", lambda *_: prepared)

    install.seen = seen  # type: ignore[attr-defined]
    return install


def test_writes_result_and_report_and_prints_the_numbers(
    answer: Install, session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer(None)
    out = tmp_path / "new" / "out"
    assert main(["identify", "van", "--out", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["report.html", "result.json"]
    result = json.loads((out / "result.json").read_text())
    assert result["mass"]["value"] == 1240.13
    assert result["provenance"]["files"] == {"session.yaml": "0" * 64}
    assert result["provenance"]["session"] == session.name
    printed = capsys.readouterr()
    assert "1240.13 ± 0.78 kg" in " ".join(printed.out.split())
    assert "warning: imu: nobody knows." in printed.out
    assert printed.out.rstrip().endswith(str(out / "report.html"))
    assert printed.err == ""


def test_work_is_handed_on_and_told(answer: Install, tmp_path: Path) -> None:
    answer(None)
    assert main(["identify", "van", "--out", str(tmp_path)]) == 0
    assert answer.seen["work"] == WORK  # type: ignore[attr-defined]
    assert "work" not in json.loads((tmp_path / "result.json").read_text())
    assert main(["identify", "van", "--out", str(tmp_path), "--work", "3e2"]) == 0
    assert answer.seen["work"] == 300.0  # type: ignore[attr-defined]


@pytest.mark.parametrize("text", ["0", "-3", "nan", "many"])
def test_work_that_is_no_amount_is_refused(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["identify", "van", "--out", str(tmp_path), "--work", text])
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert text in line
    assert "units of work" in line


def test_an_answer_that_was_broken_off_is_written_and_marked(
    answer: Install, identification: Identification, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    work = Work(41.5, 120.0, ("tether",))
    answer(Interrupted(replace(identification, work=work, interrupted=True)))
    assert main(["identify", "van", "--out", str(tmp_path)]) == 130
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["interrupted"] is True
    assert result["work"] == {"used": 41.5, "limit": 120.0, "left_untried": ["tether"]}
    printed = capsys.readouterr()
    assert "1240.13 ± 0.78 kg" in " ".join(printed.out.split())
    assert len(printed.err.splitlines()) == 1


def test_keeps_other_files_and_replaces_its_own(answer: Install, tmp_path: Path) -> None:
    answer(None)
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "result.json").write_text("old")
    assert main(["identify", "van", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert json.loads((tmp_path / "result.json").read_text())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["notes.txt", "report.html", "result.json"]


def test_topics_and_namespace_reach_the_reader(answer: Install, tmp_path: Path) -> None:
    answer(None)
    arguments = [
        "--namespace",
        "/lab",
        "--topic",
        "imu/data_raw=/xsens/imu",
        "--topic",
        "mocap/pose=/vicon/van",
    ]
    assert main(["identify", "van", "--out", str(tmp_path), *arguments]) == 0
    seen = answer.seen  # type: ignore[attr-defined]
    assert seen["namespace"] == "/lab"
    assert seen["topics"] == {"imu/data_raw": "/xsens/imu", "mocap/pose": "/vicon/van"}


@pytest.mark.parametrize(
    ("outcome", "status", "word"),
    [
        (InputError("run_1: something\nis wrong"), 2, "error: run_1: something is wrong"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (ZeroDivisionError("division by zero"), 1, "ZeroDivisionError: division by zero"),
    ],
)
def test_a_failed_run_says_one_line_and_writes_nothing(
    answer: Install,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    outcome: object,
    status: int,
    word: str,
) -> None:
    answer(outcome)
    kept = tmp_path / "kept"
    kept.mkdir()
    (kept / "result.json").write_text("old")
    for out in (kept, tmp_path / "new"):
        assert main(["identify", "van", "--out", str(out)]) == status
        printed = capsys.readouterr()
        assert printed.out == ""
        assert printed.err.startswith("rig-identification: ")
        assert printed.err.count("\n") == 1
        assert word in printed.err
    assert [p.name for p in tmp_path.iterdir()] == ["kept"]
    assert [(p.name, p.read_text()) for p in kept.iterdir()] == [("result.json", "old")]


def test_debug_shows_the_defect(answer: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer(ZeroDivisionError("division by zero"))
    assert main(["identify", "van", "--out", str(tmp_path), "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_a_report_that_fails_leaves_no_result(
    answer: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    answer(None)

    def full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("rig_identification.report.write_report", full_disk)
    for out in (tmp_path, tmp_path / "new"):
        assert main(["identify", "van", "--out", str(out)]) == 2
        assert "No space left on device" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_out_that_cannot_be_used(answer: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer(AssertionError("the work must not begin"))
    file = tmp_path / "file"
    file.write_text("")
    occupied = tmp_path / "occupied"
    (occupied / "report.html").mkdir(parents=True)
    (tmp_path / "nowhere").symlink_to(tmp_path / "gone")
    impossible = [file, file / "below", occupied, tmp_path / "nowhere", tmp_path / ("long" * 100)]
    # A file system that takes no new files, whoever asks.
    impossible += [Path("/proc/below")] if sys.platform == "linux" else []
    for out in impossible:
        assert main(["identify", "van", "--out", str(out)]) == 2
        error = capsys.readouterr().err
        assert str(out) in error
        assert error.count("\n") == 1


def test_the_trial_of_the_output_folder_leaves_no_trace(answer: Install, tmp_path: Path) -> None:
    answer(InputError("run_1: no"))
    assert main(["identify", "van", "--out", str(tmp_path / "out")]) == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("effect", ["hinge_dampng=20", "sprung_mas.mass=30", "imu.gyroscope_bais.x=0.01"])
def test_an_effect_misspelt_has_its_right_name_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], effect: str
) -> None:
    out = str(tmp_path / "out")
    arguments = ["simulate", "--case", "14", "--duration", "1", "--rest", "0", "--out", out]
    assert main([*arguments, "--effect", effect]) == 2
    said = capsys.readouterr().err
    meant = {"h": "hinge_damping", "s": "sprung_mass.mass", "i": "imu.gyroscope_bias.x"}[effect[0]]
    assert said.rstrip().endswith(f"; did you mean {meant}?")
    assert list(tmp_path.iterdir()) == []


def test_simulate_says_before_its_work_that_it_cannot_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def work(*_: object) -> None:
        raise AssertionError("the work must not begin")

    monkeypatch.setattr("rig_identification.simulate.simulate_session", work)
    file = tmp_path / "file"
    file.write_text("")
    for out in (file / "below", file):
        assert main(["simulate", "--case", "14", "--out", str(out), "--overwrite"]) == 2
        assert f"--out {out}: " in capsys.readouterr().err


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_out_that_is_not_writable(
    answer: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer(AssertionError("the work must not begin"))
    tmp_path.chmod(0o500)
    assert main(["identify", "van", "--out", str(tmp_path / "out")]) == 2
    assert "not writable" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [[], ["identify"], ["identify", "van"], ["identify", "van", "--out", "x", "--topic", "imu"], ["identfy"]],
)
def test_wrong_arguments_are_one_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_process_itself(tmp_path: Path) -> None:
    """The true reader and a true process, on a session that is not there."""
    command = [sys.executable, "-m", "rig_identification.cli.main"]
    version = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert version.stdout == f"rig-identification {__version__}\n"
    missing = [*command, "identify", str(tmp_path / "nothing"), "--out", str(tmp_path / "out")]
    done = subprocess.run(missing, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert str(tmp_path / "nothing") in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_output_for_a_terminal_of_ascii_alone(tmp_path: Path) -> None:
    """``±`` and ``²`` must not end a run whose numbers are written."""
    code = "from rig_identification.cli.main import main; import sys; main(['--version'])"
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    body = "from rig_identification.cli.main import _accept_any_terminal as a; a(); print('± kg m²')"
    for line in (code, body):
        done = subprocess.run([sys.executable, "-c", line], capture_output=True, env=environment, check=False)
        assert done.returncode == 0, done.stderr


@pytest.mark.skipif(os.name != "posix", reason="needs a pipe that closes")
def test_a_reader_that_leaves_early_is_no_defect() -> None:
    code = (
        "import sys; from rig_identification.cli import main as m\n"
        "from rig_identification.cli.commands import identify\n"
        "def run(arguments):\n    for _ in range(20000):\n        print('line', flush=True)\n"
        "identify.run = run\n"
        "sys.exit(m.main(['identify', 'x', '--out', 'y']))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0


def test_moving_aside_is_undone_when_a_writer_fails(tmp_path: Path) -> None:
    def interrupted(path: Path) -> None:
        path.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_together(tmp_path / "out", {"a": lambda path: path.write_text("a") and None, "b": interrupted})
    assert list(tmp_path.iterdir()) == []


def test_progress_where_nobody_watches_is_a_line_a_stage() -> None:
    now = [0.0]
    stream = io.StringIO()
    with StageProgress(stream, clock=lambda: now[0]) as progress:
        progress("reading run_1")
        now[0] = QUIET_SECONDS + 1.0
        for fraction in (0.1, 0.5, 0.9):
            progress("fitting", fraction)
        progress("covariance")
    assert stream.getvalue() == "fitting\ncovariance\n"


def test_a_search_says_how_long_it_takes_at_most_and_the_numbers_so_far(
    identification: Identification,
) -> None:
    """After 20 s a fifth of what the search may do is done: 80 s are left, and no more lines of the same."""
    now, done = [0.0], [0.0]
    stream = io.StringIO()
    with StageProgress(stream, clock=lambda: now[0]) as progress:
        searching = Searching(progress, 80.0, clock=lambda: now[0], done=lambda: done[0])
        searching("first guess")
        now[0], done[0] = 20.0, 20.0
        searching("search: screening", 0.5)
        searching("search: screening", 0.6)
        searching.better(identification)
        searching.better(identification)
        now[0], done[0] = 80.0, 80.0
        searching("search: whole runs", 0.9)
    first, second, third = stream.getvalue().splitlines()
    assert first == "search: screening (at most 1 min left)"
    assert second.startswith("so far: m 1072.13 ± 0.78 kg, Jxx")
    assert "Jzz" in second
    assert third == "search: whole runs (at most 20 s left)"


def test_progress_on_a_terminal_moves() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream = Terminal()
    with StageProgress(stream) as progress:
        progress("reading [run_1]")
        progress("fitting", 0.5, "at most 20 s left")
        progress.say("so far: m [1] kg")
    assert "fitting" in stream.getvalue()
    assert "so far: m [1] kg" in stream.getvalue()


def test_summary_and_result_tell_what_an_inertia_is_tied_to(explained: Identification) -> None:
    tied = replace(explained, tie="Jzz is tied to where the hinges are.")
    text = summary(tied)
    assert text.index("Jzz ") < text.index("is tied to where") < text.index("verdict")
    assert result_to_dict(tied)["tie"] == tied.tie
    assert "tie" not in result_to_dict(explained)


def test_summary_names_what_is_not_determinable(explained: Identification) -> None:
    text = summary(explained)
    lines = {line.split()[0]: line for line in text.splitlines() if line.startswith("  ")}
    assert list(lines) == ["m", "cx", "cy", "cz", "Jxx", "Jxy", "Jxz", "Jyy", "Jyz", "Jzz"]
    assert "not determinable" in lines["Jzz"]
    assert "-14.21" in lines["Jxy"]
    assert "explained" in text


def test_an_answer_as_json_and_nothing_else(
    answer: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer(None)
    assert main(["identify", "van", "--out", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads((tmp_path / "result.json").read_text())
    assert main(["identify", "van", "--out", str(tmp_path), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("words", "status"), [(["unexplained"], 3), (["explained"], 0)])
def test_a_script_may_fail_on_a_verdict(
    words: list[str], status: int, answer: Install, identification: Identification, tmp_path: Path
) -> None:
    answer(None)
    object.__setattr__(identification.mismatch, "verdict", "unexplained")
    assert main(["identify", "van", "--out", str(tmp_path), "--fail-on", *words]) == status
    assert (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["identfy", "van"], "identify"),
        (["check", "van", "--jsn"], "--json"),
        (["identify", "van", "--out", "x", "--fail-on", "unexplaind"], "unexplained"),
    ],
)
def test_a_word_misspelt_has_its_right_one_said(
    arguments: list[str], meant: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"did you mean {meant}?" in line


def test_an_option_before_its_command_is_told_where_it_belongs(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--debug", "check", "."])
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "unrecognized arguments: --debug; it belongs after the command" in line


def test_a_shell_completes_commands_and_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("shtab", reason="pip install '.[completion]'")
    assert main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    (tmp_path / "script.sh").write_text(script)
    if shutil.which("bash"):
        subprocess.run(["bash", "-n", str(tmp_path / "script.sh")], check=True)
    assert "--fail-on" in script
    assert "identify" in script
