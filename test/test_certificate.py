"""The certificate: a result's budget told after the GUM, and refused where it does not add up."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_samples import make_session

from rig_identification.cli.main import main
from rig_identification.errors import InputError
from rig_identification.estimate.sources import closed
from rig_identification.estimate.vehicle import vehicle_quantities
from rig_identification.report import result_to_dict
from rig_identification.report.certificate import Row, certificate_document, certificate_of, effective_freedom
from rig_identification.report.certificate_page import render_certificate
from rig_identification.report.certificate_pdf import write_certificate_pdf
from rig_identification.result import ELEMENTS, Identification, InertialEstimate, UncertaintySource
from rig_identification.rig import Rig, WheelContacts
from rig_identification.session import write_session
from rig_identification.session.provenance import file_digests


@pytest.fixture
def told(identification: Identification) -> Identification:
    """An answer whose covariance has three sources, and a frame."""
    total = identification.total
    parts = (("cable_1 tension", "noise", 0.6, 99.0), ("tolerance.cable_length", "tolerance", 0.3, None))
    sources = tuple(UncertaintySource(n, k, s * total.covariance, f) for n, k, s, f in parts)
    whole = closed(replace(total, sources=sources))
    return replace(identification, total=whole, without_frame=replace(whole, values=whole.values.copy()))


def document(told: Identification) -> dict:
    return json.loads(
        json.dumps(result_to_dict(told, {"session": "van", "recorded": "2026-03-01 10:00 UTC"}))
    )


def test_the_rows_add_up_to_the_variance(told: Identification) -> None:
    certified = certificate_document(certificate_of(document(told), "result.json"))
    for body in certified["bodies"]:  # type: ignore[attr-defined]
        for i, quantity in enumerate(body["quantities"]):
            rows = sum(row["variance"][i] for row in body["budget"])
            assert abs(rows / quantity["standard_uncertainty"] ** 2 - 1.0) < 1e-9
            assert abs(sum(row["share"][i] for row in body["budget"]) - 1.0) < 1e-9
    assert {row["source"] for row in certified["bodies"][0]["budget"]} == {  # type: ignore[index]
        "cable_1 tension",
        "tolerance.cable_length",
        "other explanations",
    }


def test_a_changed_budget_is_refused(told: Identification) -> None:
    changed = document(told)
    changed["budget"][1]["variance"][4] *= 1.01
    with pytest.raises(InputError, match="Jxx come to"):
        certificate_of(changed, "result.json")


def test_degrees_of_freedom_are_those_of_the_estimated_part() -> None:
    """Of two equal variances one with 7 degrees of freedom: (1 + 1)^2 / (1 / 7)."""
    rows = [Row("a", "rest", 7.0, (2.0,) * 10), Row("b", "tolerance", None, (2.0,) * 10)]
    assert effective_freedom(rows, 3) == pytest.approx(28.0)
    assert effective_freedom(rows[1:], 3) is None


def test_the_coverage_factor_is_students(told: Identification) -> None:
    (number, *_) = certificate_of(document(told), "x").bodies[0].numbers
    assert number.freedom == pytest.approx(99.0 / 0.6**2)
    assert number.k == pytest.approx(1.9687, abs=1e-3)
    assert number.expanded == pytest.approx(number.k * number.u)


def test_an_element_that_is_not_determined_has_no_row(told: Identification) -> None:
    hidden = replace(told, total=replace(told.total, unobservable=("Jzz",)), without_frame=None)
    body = certificate_of(document(hidden), "x").bodies[0]
    assert body.numbers[9].value is None
    assert all(row.variance[9] is None for row in body.rows)
    assert body.correlation[9][9] is None
    assert body.correlation[0][0] == pytest.approx(1.0)


def test_page_and_print_hold_the_numbers(told: Identification, tmp_path: Path) -> None:
    certificate = certificate_of(document(told), "x")
    page = render_certificate(certificate)
    assert "tolerance.cable_length" in page
    assert "van" in page
    pytest.importorskip("fpdf", reason="the extra pdf is not installed")
    for name in ("one.pdf", "two.pdf"):
        write_certificate_pdf(certificate, tmp_path / name)
    assert (tmp_path / "one.pdf").read_bytes() == (tmp_path / "two.pdf").read_bytes()
    assert (tmp_path / "one.pdf").read_bytes().startswith(b"%PDF")


def test_the_command_certifies_a_result(
    told: Identification, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "answer").mkdir()
    (tmp_path / "answer" / "result.json").write_text(json.dumps(document(told)))
    assert main(["certificate", str(tmp_path / "answer"), "--out", str(tmp_path / "out")]) == 0
    assert "certificate.html" in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "certificate.json").read_text())["provenance"]["session"] == "van"


@pytest.mark.parametrize(
    ("text", "message"),
    [("[]", "is no result.json"), ("{", "is not JSON"), ('{"inertia": 1}', "budget: missing")],
)
def test_what_is_no_result_is_refused_in_a_line(
    text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "result.json").write_text(text)
    assert main(["certificate", str(tmp_path / "result.json"), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_every_file_of_a_session_has_its_digest(tmp_path: Path) -> None:
    folder = write_session(make_session(), tmp_path / "sample")
    found = file_digests(folder)
    assert {"session.yaml", "rig.yaml"} <= set(found)
    assert any(name.endswith((".mcap", ".db3")) for name in found)
    text = (folder / "rig.yaml").read_bytes()
    assert found["rig.yaml"] == hashlib.sha256(text).hexdigest()


WHEELS = WheelContacts(
    np.array([2.5, 0.8, 0.1]),
    np.array([2.5, -0.8, 0.1]),
    np.array([-0.1, 0.8, 0.1]),
    np.array([-0.1, -0.8, 0.1]),
)


def level_car(center: np.ndarray) -> InertialEstimate:
    values = np.array([1200.0, *center, 400.0, 0.0, 20.0, 1500.0, 0.0, 1700.0])
    return InertialEstimate(values, np.diag([0.5, 1e-3, 1e-3, 2e-3, *[1.0] * 6]) ** 2)


def test_where_a_vehicle_has_its_weight(rig: Rig) -> None:
    """Half a metre behind the front axle of 2.6 m: the rear axle carries 0.5 / 2.6 of the weight."""
    found = vehicle_quantities(level_car(np.array([2.0, 0.08, 0.6])), replace(rig, vehicle=WHEELS))
    values = {q.name: (q.value, q.std) for q in found}
    assert values["center_of_mass_height"] == pytest.approx((0.5, 2e-3))
    assert values["center_of_mass_behind_front_axle"] == pytest.approx((0.5, 1e-3))
    assert values["rear_axle_share"] == pytest.approx((0.5 / 2.6, 1e-3 / 2.6))
    assert values["left_side_share"] == pytest.approx((0.55, 1e-3 / 1.6))
    weight = 1200.0 * rig.gravity
    assert values["rear_axle_load"][0] == pytest.approx(weight * 0.5 / 2.6)
    assert values["front_axle_load"][0] + values["rear_axle_load"][0] == pytest.approx(weight)
    assert values["rear_axle_load"][1] == pytest.approx(weight / 2.6 * np.hypot(1e-3, 0.5 * 0.5 / 1200))
    assert values["radius_of_gyration_yaw"][0] == pytest.approx(np.sqrt(1700.0 / 1200.0))
    assert values["radius_of_gyration_yaw"][1] == pytest.approx(
        0.5 * np.hypot(1 / 1700, 0.5 / 1200) * 1.1902, rel=1e-3
    )


def test_a_vehicle_turned_in_its_body_frame_is_the_same_vehicle(rig: Rig) -> None:
    """Turned by 90 degrees about z: roll is about body y."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    points = [turn @ getattr(WHEELS, n) for n in ("front_left", "front_right", "rear_left", "rear_right")]
    car = level_car(turn @ np.array([2.0, 0.08, 0.6]))
    values = car.values.copy()
    values[[4, 7]], values[6], values[8] = values[[7, 4]], 0.0, 20.0
    found = vehicle_quantities(replace(car, values=values), replace(rig, vehicle=WheelContacts(*points)))
    named = {q.name: q.value for q in found}
    assert named["roll_inertia"] == pytest.approx(400.0)
    assert named["roll_yaw_product"] == pytest.approx(20.0)
    assert named["center_of_mass_to_the_left"] == pytest.approx(0.08)


def test_what_is_not_determined_makes_no_quantity(rig: Rig) -> None:
    lost = replace(level_car(np.zeros(3)), unobservable=("cz",))
    names = {q.name for q in vehicle_quantities(lost, replace(rig, vehicle=WHEELS))}
    assert "center_of_mass_height" not in names
    assert "yaw_inertia" in names
    assert {q.name for q in vehicle_quantities(lost, rig)} == {f"radius_of_gyration_{a}" for a in "xyz"}
    assert ELEMENTS[3] == "cz"
