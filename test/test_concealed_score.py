"""The scorer of concealed sessions on truths and answers small enough to be marked by hand."""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.concealed.answer import Answer, read_answer
from bench.concealed.figures import Share, shares, spreads
from bench.concealed.marks import SessionMarks, mark
from bench.concealed.score import main
from bench.concealed.wording import CLEAR, PARAMETERS, TIE

MASS, CENTER = 1000.0, [1.0, 2.0, 3.0]
INERTIA = [[300.0, -10.0, 5.0], [-10.0, 400.0, 20.0], [5.0, 20.0, 500.0]]
STD = 2.0  # of every element


def truth_of(*effects: dict[str, Any], over_noise: float = 20.0, case: str = "concealed_1") -> dict[str, Any]:
    """A truth.json."""
    outside = any(e["outside"] for e in effects)
    accept = [a for e in effects for a in e["accept"]] or ["none"]
    levels = {"run_1": {"ten": over_noise, "gyr": 0.1}, "run_2": {"ten": 99.0}} if effects else {}
    return {
        "case": case,
        "mass": MASS,
        "center_of_mass": CENTER,
        "inertia": INERTIA,
        "effects": list(effects),
        "outside": outside,
        "accept_first": accept,
        "effect_over_noise": levels,
    }


def effect(name: str, outside: bool = False, near: Sequence[str] = (), **more: Any) -> dict[str, Any]:
    """An entry of a truth's effects; ``more``: its parameters by value, and ``where``."""
    where = more.pop("where", {"channel": None, "axis": None})
    return {
        "effect": name,
        "outside": outside,
        "where": where,
        "parameters": {k: {"value": v, "unit": "1"} for k, v in more.items()},
        "accept": ["unknown"] if outside else [name],
        "near": list(near),
    }


def finding(name: str, held: tuple[float, float] = (4.0, 1.02), **more: Any) -> dict[str, Any]:
    """A finding of a result.json; ``more``: parameters as (value, std), and ``where``."""
    where = more.pop("where", {"channel": None, "axis": None})
    return {
        "effect": name,
        "where": where,
        "parameters": {k: {"value": v, "std": s, "unit": "1"} for k, (v, s) in more.items()},
        "evidence": {
            "log_likelihood_gain": 50.0,
            "holdout_error_before": held[0],
            "holdout_error_after": held[1],
        },
        "statement": "It is so.",
    }


def ten(jxx: float | None = 300.0) -> dict[str, Any]:
    """Mass, centre and inertia of a result, right but for Jxx."""
    value: list[list[float | None]] = [list(row) for row in INERTIA]
    value[0][0] = jxx
    std: list[list[float | None]] = [[STD] * 3 for _ in range(3)]
    std[0][0] = None if jxx is None else STD
    return {
        "mass": {"value": MASS, "std": STD},
        "center_of_mass": {"value": CENTER, "std": [STD] * 3},
        "inertia": {"value": value, "std": std},
    }


def result_of(
    *findings: dict[str, Any],
    verdict: str = "explained",
    alternatives: Sequence[tuple[str, float]] = (),
    jxx: float | None = 300.0,
    ideal_jxx: float | None = None,
) -> dict[str, Any]:
    """A result.json."""
    mismatch: dict[str, Any] = {
        "verdict": verdict,
        "findings": list(findings),
        "alternatives": [{"effect": e, "log_likelihood_gap": g} for e, g in alternatives],
    }
    if ideal_jxx is not None:
        mismatch["ideal_model"] = {**ten(ideal_jxx), "unobservable": []}
    return {**ten(jxx), "unobservable": [], "mismatch": mismatch}


@pytest.fixture
def answer(tmp_path: Path) -> Callable[..., Answer]:
    """An answer read from a file, as the scorer reads it."""

    def read(*findings: dict[str, Any], **more: Any) -> Answer:
        path = tmp_path / "result.json"
        path.write_text(json.dumps(result_of(*findings, **more)))
        return read_answer(path)

    return read


# --- first place -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("findings", "verdict", "first"),
    [
        ([], "none", "none"),
        ([], "unexplained", "unknown"),
        (["imu_bias", "tether"], "explained", "imu_bias"),
        (["unknown"], "explained", "unknown"),
    ],
)
def test_first_place(answer: Callable[..., Answer], findings: list[str], verdict: str, first: str) -> None:
    assert answer(*map(finding, findings), verdict=verdict).first == first


def test_a_clean_session_wants_none(answer: Callable[..., Answer]) -> None:
    assert mark("a", truth_of(), answer(verdict="none")).first_right
    assert not mark("a", truth_of(), answer(verdict="unexplained")).first_right
    assert not mark("a", truth_of(), answer(finding("tether"))).first_right
    assert not mark("a", truth_of(), answer(verdict="none")).clear


def test_either_of_a_pair_is_right_and_both_are_counted(answer: Callable[..., Answer]) -> None:
    truth = truth_of(effect("imu_bias"), effect("tether"))
    one = mark("a", truth, answer(finding("tether"), verdict="unexplained"))
    both = mark("a", truth, answer(finding("tether"), finding("imu_bias")))
    assert (one.kind, one.first_right, one.all_named) == ("pair", True, False)
    assert (both.first_right, both.all_named) == (True, True)


def test_third_place_counts_each_effect_once_and_by_its_gap(answer: Callable[..., Answer]) -> None:
    truth = truth_of(effect("air_drag"))
    places = [("hinge_position", 9.0), ("air_drag", 30.0), ("hinge_position", 8.0)]
    third = mark("a", truth, answer(finding("tether"), alternatives=places))
    assert (third.first_right, third.three_right) == (False, True)
    fourth = mark("a", truth, answer(finding("tether"), alternatives=[*places, ("imu_bias", 20.0)]))
    assert not fourth.three_right
    assert fourth.said == "tether (explained); then hinge_position, imu_bias"


def test_a_tie_counts_wherever_it_stands(answer: Callable[..., Answer]) -> None:
    truth = truth_of(effect("air_drag"))
    rivals = [("cable_mass", 0.5), ("imu_bias", 1.0), ("clock_offset", 1.5)]
    tied = mark("a", truth, answer(finding("tether"), alternatives=[*rivals, ("air_drag", TIE)]))
    beaten = mark("a", truth, answer(finding("tether"), alternatives=[*rivals, ("air_drag", TIE + 0.1)]))
    assert (tied.first_right, tied.three_right) == (False, True)
    assert not beaten.three_right


def test_what_is_inseparable_from_inertia_is_named_or_stated_not_guessed(
    answer: Callable[..., Answer],
) -> None:
    truth = truth_of(effect("air_added_mass"))
    tie = [("air_added_mass", 0.1)]
    assert mark("a", truth, answer(finding("air_added_mass"))).first_right
    assert mark("a", truth, answer(finding("exciter_rotor"), alternatives=tie)).first_right
    assert mark("a", truth, answer(verdict="none", alternatives=tie)).first_right
    assert not mark("a", truth, answer(finding("exciter_rotor"))).first_right
    assert not mark("a", truth, answer(verdict="none")).first_right


# --- outside the table -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("findings", "verdict", "response", "right"),
    [
        ([], "unexplained", "abstained", True),
        (["unknown"], "explained", "abstained", True),
        (["hinge_friction"], "unexplained", "hedged", False),
        (["hinge_friction"], "explained", "named", False),
        ([], "none", "unseen", False),
    ],
)
def test_responses_to_what_is_outside(
    answer: Callable[..., Answer], findings: list[str], verdict: str, response: str, right: bool
) -> None:
    truth = truth_of(effect("stick_slip", outside=True, near=["hinge_friction"]))
    marks = mark("a", truth, answer(*map(finding, findings), verdict=verdict))
    assert (marks.kind, marks.response, marks.first_right) == ("outside", response, right)
    assert marks.near == (findings == ["hinge_friction"])


# --- numbers ---------------------------------------------------------------------------------------------


def test_parameters_in_sigma_and_percent(answer: Callable[..., Answer]) -> None:
    truth = truth_of(effect("sprung_mass", mass=50.0, frequency=2.0, damping_ratio=0.1, travel=3.0))
    found = finding("sprung_mass", mass=(45.0, 2.5), frequency=(2.02, 0.005))
    by_name = {p.name: p for p in mark("a", truth, answer(found)).parameters}
    assert list(by_name) == ["mass", "frequency", "damping_ratio"]
    assert (by_name["mass"].sigma, by_name["mass"].percent) == (-2.0, -10.0)
    assert by_name["frequency"].sigma == pytest.approx(4.0)
    assert by_name["damping_ratio"].value is None
    share = next(s for s in shares([mark("a", truth, answer(found))]) if "3 sigma" in s.label)
    assert (share.hits, share.of) == (1, 2)


def test_a_negative_truth_keeps_the_sign_of_the_percentage(answer: Callable[..., Answer]) -> None:
    truth = truth_of(effect("cable_length", error=-0.01))
    (parameter,) = mark("a", truth, answer(finding("cable_length", error=(-0.011, 0.001)))).parameters
    assert parameter.percent == pytest.approx(-10.0)


def test_parameters_of_another_effect_are_not_compared(answer: Callable[..., Answer]) -> None:
    truth = truth_of(effect("cable_length", error=0.01))
    assert mark("a", truth, answer(finding("imu_position", error=(0.01, 0.001)))).parameters == ()


def test_channel_axis_end_times_and_position(answer: Callable[..., Answer]) -> None:
    hinge = truth_of(effect("hinge_position", where={"channel": "cable_2", "axis": "y", "end": "body"}))
    said = finding("hinge_position", where={"channel": "cable_2", "axis": "x", "end": "body"})
    assert mark("a", hinge, answer(said)).places == {"channel": True, "axis": False, "end": True}
    assert mark("a", hinge, answer(finding("tether"))).places is None

    def push(start: float, end: float) -> dict[str, Any]:
        where = {"times": [{"recording": "run_1", "start": start, "end": end}], "position": [0.0, 0.0, 1.0]}
        return {"where": where}

    truth = truth_of(effect("external_force", **push(3.0, 4.0)))
    close = mark("a", truth, answer(finding("external_force", **push(3.9, 4.5))))
    assert close.places == {"times": True}
    assert close.position_error == 0.0
    for elsewhere in ((4.1, 4.5), (1.0, 2.9)):
        said = finding("external_force", **push(*elsewhere))
        assert mark("a", truth, answer(said)).places == {"times": False}
    assert mark("a", truth, answer(finding("external_force"))).places == {"times": False}


def test_inertia_before_and_after_and_its_intervals(answer: Callable[..., Answer]) -> None:
    truth = truth_of(effect("tether"), over_noise=0.0)
    marks = mark("a", truth, answer(finding("tether"), jxx=304.2, ideal_jxx=330.0))
    norm = np.sqrt(300.0**2 + 10.0**2 + 5.0**2 + 400.0**2 + 20.0**2 + 500.0**2)
    assert marks.before is not None
    assert marks.after is not None
    assert marks.before.inertia_percent == pytest.approx(100.0 * 30.0 / norm)
    assert marks.after.inertia_percent == pytest.approx(100.0 * 4.2 / norm)
    assert marks.after.inertia_sigma == pytest.approx(2.1)
    assert [name for name, inside in marks.after.inside_95.items() if not inside] == ["Jxx"]
    assert len(marks.after.inside_95) == 10
    assert (marks.holdout_before, marks.holdout_after) == (4.0, 1.02)


def test_what_was_not_determined_is_not_marked(answer: Callable[..., Answer]) -> None:
    after = mark("a", truth_of(), answer(verdict="none", jxx=None)).after
    assert after is not None
    assert "Jxx" not in after.inside_95
    assert after.inertia_percent == 0.0


def test_clear_by_a_channel_or_by_the_ideal_models_bias(answer: Callable[..., Answer]) -> None:
    faint, loud = (truth_of(effect("tether"), over_noise=x) for x in (CLEAR - 0.1, CLEAR))
    assert mark("a", loud, answer(verdict="none")).clear
    # 99 in the held-out run does not count: no fit may use it.
    assert not mark("a", faint, answer(verdict="none")).clear
    assert not mark("a", faint, answer(finding("tether"), ideal_jxx=309.9)).clear
    assert mark("a", faint, answer(finding("tether"), ideal_jxx=310.1)).clear
    assert mark("a", faint, answer(verdict="none", jxx=289.0)).clear
    assert mark("a", loud, None).clear


# --- figures ---------------------------------------------------------------------------------------------


def _shares(marks: Sequence[SessionMarks]) -> dict[str, Share]:
    return {s.label: s for s in shares(marks)}


def test_wilson_interval_against_its_formula() -> None:
    z, n, p = 1.959964, 40, 1 / 40
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2)) / (1 + z**2 / n)
    assert Share("x", 1, 40).interval == pytest.approx((middle - half, middle + half), abs=1e-6)
    assert Share("x", 0, 0).interval is None


def test_false_alarms_are_of_clean_sessions_alone(answer: Callable[..., Answer]) -> None:
    clean = [mark("a", truth_of(), answer(verdict="none"))] * 3
    alarms = [
        mark("b", truth_of(), answer(finding("tether"))),
        mark("c", truth_of(), answer(verdict="unexplained")),
    ]
    wrong = mark("d", truth_of(effect("tether")), answer(finding("imu_bias")))
    share = _shares([*clean, *alarms, wrong])["false alarms on clean sessions"]
    assert (share.hits, share.of, share.reached) == (2, 5, False)


def test_a_session_without_a_result_is_a_miss(answer: Callable[..., Answer]) -> None:
    good = mark("a", truth_of(effect("tether")), answer(finding("tether")))
    found = _shares([good, mark("b", truth_of(effect("tether")), None), mark("c", truth_of(), None)])
    first = found["first place right, clear size"]
    assert (first.hits, first.of) == (1, 2)
    assert found["sessions without a result"].hits == 2
    assert found["false alarms on clean sessions"].of == 0


def test_coverage_counts_elements_by_verdict(answer: Callable[..., Answer]) -> None:
    explained = mark("a", truth_of(effect("tether")), answer(finding("tether"), jxx=310.0))
    clean = mark("b", truth_of(), answer(verdict="none"))
    found = _shares([explained, clean])
    tens = found["95 % intervals of the ten elements hold, all answers"]
    assert (tens.hits, tens.of) == (19, 20)
    inertia = found["95 % intervals of J hold, explained"]
    assert (inertia.hits, inertia.of, inertia.reached) == (5, 6, False)


def test_held_out_error_and_medians(answer: Callable[..., Answer]) -> None:
    marks = [
        mark("a", truth_of(effect("tether")), answer(finding("tether", held=(9.0, after)), ideal_jxx=320.0))
        for after in (1.0, 1.1, 1.3)
    ]
    share = _shares(marks)["held-out error after <= 1.1, explained"]
    assert (share.hits, share.of) == (2, 3)
    by_label = {s.label: s for s in spreads(marks)}
    assert by_label["held-out error after"].median == 1.1
    assert by_label["held-out error after"].worst == 1.3
    assert by_label["J error before, worst element in claimed sigma"].median == 10.0


def test_held_out_error_goes_from_before_the_first_finding_to_after_the_last(
    answer: Callable[..., Answer],
) -> None:
    both = answer(finding("tether", held=(9.0, 3.0)), finding("imu_bias", held=(3.0, 1.0)))
    assert (both.holdout_before, both.holdout_after) == (9.0, 1.0)
    assert answer(verdict="none").holdout_after is None


def test_named_answers_to_outside_effects_are_counted_strictly(answer: Callable[..., Answer]) -> None:
    truth = truth_of(effect("mains_hum", outside=True))
    answers = [answer(verdict="unexplained"), answer(finding("tether"), verdict="unexplained")]
    found = _shares([mark("a", truth, a) for a in (*answers, answer(finding("tether")))])
    assert found["outside: answered with a named effect"].hits == 2
    assert found["outside: of these, said to leave something over"].hits == 1
    assert found["outside: honest abstentions"].hits == 1


# --- the command -----------------------------------------------------------------------------------------


def _folder(root: Path, name: str, result: dict[str, Any] | None, truth: dict[str, Any] | None) -> None:
    session = root / "sessions" / name
    session.mkdir(parents=True)
    (session / "session.yaml").write_text("rig: rig.yaml\n")
    if truth is not None:
        (session / "truth.json").write_text(json.dumps(truth))
    if result is not None:
        out = root / "results" / name
        out.mkdir(parents=True)
        (out / "result.json").write_text(json.dumps(result))
        (out / "seconds.txt").write_text("42.5\n")


def _arguments(root: Path, truths: Path, *more: str) -> list[str]:
    places = {"--sessions": "sessions", "--results": "results", "--out": "table"}
    paths = [text for key, name in places.items() for text in (key, str(root / name))]
    return [*paths, "--truths", str(truths), *more]


def _sealed_run(root: Path, commit: bool = True) -> tuple[Path, Path, str]:
    """Two sessions, one with a result, their sealed file and its digest in a repository."""
    cases = [truth_of(effect("tether"), case="concealed_1"), truth_of(case="concealed_2")]
    _folder(root, "concealed_1", result_of(finding("imu_bias")), None)
    _folder(root, "concealed_2", None, None)
    entries = [{"seed": k, "kind": "?", "size": 0.3, "truth": t} for k, t in enumerate(cases)]
    entries.append({"seed": 3, "kind": "?", "size": 0.3, "truth": None, "failed": "start not found"})
    sealed, digests = root / "sealed.json", root / "digests.txt"
    sealed.write_text(json.dumps({"salt": "s", "sessions": entries}))
    digest = hashlib.sha256(sealed.read_bytes()).hexdigest()
    subprocess.run(["git", "init", "-q", str(root)], check=True)
    digests.write_text(f"seeds 1 to 3: SHA-256 {digest}\n")
    if commit:
        subprocess.run(["git", "-C", str(root), "add", "digests.txt"], check=True)
        who = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", "-C", str(root), *who, "commit", "-qm", "seal"], check=True)
    return sealed, digests, digest


def test_a_sealed_run_is_scored(tmp_path: Path) -> None:
    sealed, digests, digest = _sealed_run(tmp_path)
    reasons = tmp_path / "reasons.json"
    reasons.write_text(json.dumps({"concealed_1": "A hose looks like a bias here."}))
    assert main(_arguments(tmp_path, sealed, "--digests", str(digests), "--reasons", str(reasons))) == 0
    document = json.loads((tmp_path / "table" / "concealed.json").read_text())
    assert document["sealed_sha256"] == digest
    assert [s["said"] for s in document["sessions"]] == ["imu_bias (explained)", "no result"]
    assert document["sessions"][0]["seconds"] == 42.5
    page = (tmp_path / "table" / "concealed.md").read_text()
    assert "| concealed_1 | tether | yes | imu_bias (explained) | A hose looks like a bias here. |" in page
    assert "| concealed_2 | clean | no | no result |  |" in page


def test_another_file_than_the_sealed_one_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sealed, digests, _ = _sealed_run(tmp_path)
    sealed.write_text(sealed.read_text().replace("tether", "imu_bias"))
    digest = hashlib.sha256(sealed.read_bytes()).hexdigest()
    digests.write_text(digest)  # in the working tree alone
    assert main(_arguments(tmp_path, sealed, "--digests", str(digests))) == 2
    assert digest in capsys.readouterr().err
    assert not (tmp_path / "table").exists()


def test_a_digest_that_was_never_committed_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sealed, digests, _ = _sealed_run(tmp_path, commit=False)
    assert main(_arguments(tmp_path, sealed, "--digests", str(digests))) == 2
    assert "not in the last commit" in capsys.readouterr().err


def test_a_truth_that_lay_open_spoils_a_sealed_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sealed, digests, _ = _sealed_run(tmp_path)
    (tmp_path / "sessions" / "concealed_2" / "truth.json").write_text("{}")
    assert main(_arguments(tmp_path, sealed, "--digests", str(digests))) == 2
    assert "no sealed run" in capsys.readouterr().err


def test_development_sessions_are_scored_from_open_truths(tmp_path: Path) -> None:
    _folder(tmp_path, "tether_7", result_of(finding("tether")), truth_of(effect("tether")))
    assert main(_arguments(tmp_path, tmp_path / "sessions")) == 0
    document = json.loads((tmp_path / "table" / "concealed.json").read_text())
    assert document["sealed_sha256"] is None
    assert document["sessions"][0]["first_right"] is True
    assert "not a sealed run" in (tmp_path / "table" / "concealed.md").read_text()


def test_every_effect_of_the_table_knows_its_parameters() -> None:
    pytest.importorskip("mujoco")
    from bench.concealed.effects import CATALOGUE

    assert set(PARAMETERS) == set(CATALOGUE)
