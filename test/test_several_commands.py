"""compare and fuse as commands: results in, pages and JSON out, one line for what cannot be used."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from several_worlds import BODY, NAMES, UNIT, answer, designs, record

from rig_identification.cli.main import main
from rig_identification.cli.several_options import names_of
from rig_identification.errors import InputError
from rig_identification.joint import Weighing
from rig_identification.report import write_result
from rig_identification.report.joint_json import joint_from_dict, joint_to_dict
from rig_identification.report.result_file import read_result
from rig_identification.report.several_page import in_time
from rig_identification.result import ELEMENTS, Finding, Identification, Mismatch
from rig_identification.several.fuse import fuse
from rig_identification.several.session_result import SessionResult

COUNT = len(NAMES)
YEAR_2026 = 1_790_000_000_000_000_000


def write(result: SessionResult, folder: Path, verdict: str = "none") -> Path:
    """A result as ``identify`` writes it."""
    finding = Finding("hinge_damping", {}, {}, {}, "The hinges damp.")
    findings = () if verdict == "none" else (finding,)
    identification = Identification(
        result.estimate, None, Mismatch(verdict, "", findings), (), (), None, None, True, joint=result.joint
    )
    folder.mkdir(parents=True)
    write_result(identification, folder / "result.json")
    return folder


def sessions(count: int = 2, change: float = 0.0) -> list[SessionResult]:
    """Sessions of one body, of which the last one's is heavier by ``change`` kg."""
    rng = np.random.default_rng(0)
    out = []
    for k, h in enumerate(designs(rng, count)):
        body = BODY + (change if k == count - 1 else 0.0) * np.eye(10)[0]
        found = answer(f"day_{k}", record(h, np.zeros(COUNT), rng, body), weighing=Weighing(1100.0 + k, 50.0))
        assert found.joint is not None
        out.append(replace(found, joint=replace(found.joint, start_ns=YEAR_2026 - k * 10**15)))
    return out


@pytest.fixture
def folders(tmp_path: Path) -> list[str]:
    return [str(write(r, tmp_path / r.name)) for r in sessions()]


def test_joint_information_survives_the_file() -> None:
    joint = sessions()[0].joint
    assert joint is not None
    again = joint_from_dict(json.loads(json.dumps(joint_to_dict(joint))))
    assert again.doubts == joint.doubts
    assert again.weighing == joint.weighing
    for name in ("elements", "root", "weak", "weak_gradient", "belief"):
        np.testing.assert_array_equal(getattr(again, name), getattr(joint, name))
    np.testing.assert_array_equal(again.mounts["imu"], joint.mounts["imu"])


def test_a_tolerance_that_numpy_worked_out_survives_the_file() -> None:
    """As that of a finding whose range scales with a root: it was written by numpy's name for it."""
    joint = sessions()[0].joint
    assert joint is not None
    first, *others = joint.doubts
    joint = replace(joint, doubts=(replace(first, prior_std=np.sqrt(first.prior_std) ** 2), *others))
    written = json.dumps(joint_to_dict(joint))
    assert "np." not in written
    assert joint_from_dict(json.loads(written)).doubts == joint.doubts


def test_a_result_read_again_fuses_as_the_one_that_was_written(tmp_path: Path) -> None:
    told = sessions()
    read = [read_result(write(r, tmp_path / r.name) / "result.json", r.name) for r in told]
    one, again = fuse(told).total, fuse(read).total
    np.testing.assert_array_equal(one.values, again.values)
    np.testing.assert_array_equal(one.covariance, again.covariance)


def test_an_answer_that_leaves_something_shares_nothing_known(tmp_path: Path) -> None:
    folder = write(sessions()[0], tmp_path / "left", "unexplained")
    assert read_result(folder / "result.json", "left").joint is None


def test_what_is_not_determined_is_null_and_read_as_such(tmp_path: Path) -> None:
    told = sessions()[0]
    lost = replace(told, estimate=replace(told.estimate, unobservable=("Jzz",)))
    read = read_result(write(lost, tmp_path / "lost") / "result.json", "lost")
    assert list(read.observed) == [name != "Jzz" for name in ELEMENTS]
    assert np.isfinite(read.values).all()


def test_compare_writes_a_page_that_loads_nothing(
    folders: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["compare", *folders, "--out", str(out)]) == 0
    assert capsys.readouterr().out.startswith("they agree (p ")
    told = json.loads((out / "compare.json").read_text(encoding="utf-8"))
    assert told["agree"] is True
    assert set(told["numbers"]) == set(ELEMENTS)
    # Recorded in the opposite order to the one in which they are named
    assert [s["session"] for s in told["sessions"]] == ["day_1", "day_0"]
    page = (out / "compare.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 10
    assert "They agree" in page
    assert not re.search(r'(?:src|href)="(?!#)', page)


def test_compare_names_the_number(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [str(write(r, tmp_path / r.name)) for r in sessions(change=30.0)]
    assert main(["compare", *folders]) == 0
    first, *rest = capsys.readouterr().out.splitlines()
    assert first.startswith("they disagree")
    assert "m" in first.rpartition(": ")[2].split(", ")
    assert any(re.match(r"m +\d.*disagrees", line) for line in rest)


def test_rigs_follow_their_sessions_when_these_are_put_in_order(tmp_path: Path) -> None:
    folders = [str(write(r, tmp_path / r.name)) for r in sessions(3)]
    out = tmp_path / "out"
    assert main(["compare", *folders, "--rigs", "A", "B", "B", "--out", str(out)]) == 0
    told = json.loads((out / "compare.json").read_text(encoding="utf-8"))["sessions"]
    assert {s["session"]: s["rig"] for s in told} == {"day_0": "A", "day_1": "B", "day_2": "B"}


def test_fuse_answers_in_the_form_of_identify(
    folders: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["fuse", *folders, "--out", str(out)]) == 0
    assert "2 sessions: they agree" in capsys.readouterr().out
    told = json.loads((out / "result.json").read_text(encoding="utf-8"))
    one = json.loads((Path(folders[0]) / "result.json").read_text(encoding="utf-8"))
    assert set(one) - {"joint"} <= set(told)
    assert told["mass"]["std"] < one["mass"]["std"]
    assert told["mismatch"]["verdict"] == "none"
    assert read_result(out / "result.json", "fused").observed.all()
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "The fused numbers stand." in page


def test_sessions_that_disagree_leave_something_unexplained(tmp_path: Path) -> None:
    told = sessions(change=30.0)
    folders = [str(write(told[0], tmp_path / "a")), str(write(told[1], tmp_path / "b", "explained"))]
    assert main(["fuse", *folders, "--out", str(tmp_path / "out")]) == 0
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["mismatch"]["verdict"] == "unexplained"
    assert result["mismatch"]["findings"][0]["session"] == "b"
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "not to be used" in page


def test_sessions_are_read_in_the_order_in_which_they_were_recorded() -> None:
    assert in_time([YEAR_2026 + 2, YEAR_2026, YEAR_2026 + 1]) == [1, 2, 0]
    assert in_time([YEAR_2026 + 2, 0, YEAR_2026 + 1]) == [0, 1, 2]


def test_names_are_as_long_as_it_takes() -> None:
    assert names_of([Path("x/a/result.json"), Path("y/b")]) == ["a", "b"]
    assert names_of([Path("x/a/result.json"), Path("y/a")]) == ["x/a", "y/a"]
    with pytest.raises(InputError, match="named twice"):
        names_of([Path("x/a"), Path("x/a/result.json")])


@pytest.mark.parametrize("wrong", ["alone", "nothing", "no JSON", "no result", "rigs", "level"])
def test_what_cannot_be_used_is_one_line(
    wrong: str, folders: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad"
    bad.mkdir()
    text = {"no JSON": "{", "no result": '{"mass": 1}'}.get(wrong)
    if text is not None:
        (bad / "result.json").write_text(text, encoding="utf-8")
    arguments = {
        "alone": folders[:1],
        "rigs": [*folders, "--rigs", "A"],
        "level": [*folders, "--level", "2"],
    }.get(wrong, [folders[0], str(bad)])
    out = tmp_path / "out"
    assert main(["compare", *arguments, "--out", str(out)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not out.exists()


def test_the_sessions_of_these_tests_determine_every_number() -> None:
    """To a few of its units: nothing above could be tested with numbers that are not known."""
    std = np.sqrt(np.diag(sessions()[0].estimate.covariance)) / UNIT
    assert np.all((std > 0.1) & (std < 10.0))


def test_memory_tells_what_was_learned_and_recalls_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    *before, new = [str(write(r, tmp_path / r.name)) for r in sessions(4)]
    out = tmp_path / "out"
    assert main(["memory", *before, "--for", new, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert said.startswith("3 sessions, 4 doubts about the rig")
    assert "day_3 with the memory of its rig" in said
    told = json.loads((out / "memory.json").read_text(encoding="utf-8"))
    assert told["sessions"] == ["day_2", "day_1", "day_0"]
    assert all(doubt["std"] < doubt["tolerance"] for doubt in told["doubts"])
    alone = json.loads((Path(new) / "result.json").read_text(encoding="utf-8"))
    recalled = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert recalled["mass"]["std"] <= alone["mass"]["std"]
    assert recalled["inertia"]["std"][2][2] < alone["inertia"]["std"][2][2]


def test_a_memory_of_another_rig_is_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its numbers stay those of the session alone."""
    told = sessions(3)
    joint = told[-1].joint
    assert joint is not None
    elsewhere = {cable: point + 5.0 for cable, point in joint.ceiling.items()}
    told[-1] = replace(told[-1], joint=replace(joint, ceiling=elsewhere))
    *before, new = [str(write(r, tmp_path / r.name)) for r in told]
    assert main(["memory", *before, "--for", new, "--out", str(tmp_path / "out")]) == 0
    recalled = read_result(tmp_path / "out" / "result.json", "recalled")
    std = np.sqrt(np.diag(told[-1].estimate.covariance))
    np.testing.assert_allclose(np.sqrt(np.diag(recalled.estimate.covariance)), std, rtol=1e-5)
