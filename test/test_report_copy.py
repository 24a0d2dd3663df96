"""What other tools take from an answer: the same body in every format, and inertia about any point."""

from __future__ import annotations

import csv
import shutil
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from conftest import make_estimate
from scipy.spatial.transform import Rotation

from rig_identification.recording import Session
from rig_identification.report import write_report
from rig_identification.report.body_files import body_files
from rig_identification.report.learned_rig import learned_rig, learned_rig_text
from rig_identification.report.other_point import inertia_about
from rig_identification.result import ELEMENTS, Identification, InertialEstimate, ParameterEstimate
from rig_identification.rig import Rig
from rig_identification.session import read_rig

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
TURN = Rotation.from_euler("ZYX", [30.0, -20.0, 10.0], degrees=True).as_matrix()
POINT = np.array([0.3, -1.0, 0.4])


def six(matrix: np.ndarray) -> list[float]:
    return [float(matrix[i, j]) for i in range(3) for j in range(i, 3)]


def cloud() -> tuple[InertialEstimate, np.ndarray, np.ndarray]:
    """A body of point masses: its estimate, masses (n,) and places (n, 3)."""
    rng = np.random.default_rng(4)
    masses, places = rng.uniform(1.0, 3.0, 20), rng.normal(0.0, 0.5, (20, 3))
    center = masses @ places / masses.sum()
    values = np.array([masses.sum(), *center, *six(tensor_of(masses, places - center))])
    return InertialEstimate(values, make_estimate().covariance), masses, places


def tensor_of(masses: np.ndarray, places: np.ndarray) -> np.ndarray:
    squares = np.sum(places**2, axis=1)
    return np.einsum(
        "n,nij->ij", masses, squares[:, None, None] * np.eye(3) - places[:, :, None] * places[:, None]
    )


def test_inertia_about_a_point_is_that_of_the_points_masses() -> None:
    estimate, masses, places = cloud()
    value, _ = inertia_about(estimate, POINT, TURN)
    assert value == pytest.approx(tensor_of(masses, (places - POINT) @ TURN))


def test_its_uncertainty_is_that_of_samples() -> None:
    estimate = make_estimate()
    small = replace(estimate, covariance=1e-4 * estimate.covariance)  # where the map is as good as linear
    _, std = inertia_about(small, POINT, TURN)
    samples = np.random.default_rng(2).multivariate_normal(small.values, small.covariance, 20_000)
    found = np.std([inertia_about(replace(small, values=v), POINT, TURN)[0] for v in samples[:4000]], axis=0)
    assert std == pytest.approx(found, rel=0.05)  # the std of 4000 samples is good to 1.1 %


def test_what_is_not_determined_stays_so() -> None:
    estimate = make_estimate(("Jzz",))
    values, covariance = estimate.values.copy(), estimate.covariance.copy()
    values[9], covariance[9], covariance[:, 9] = np.nan, np.nan, np.nan
    value, std = inertia_about(replace(estimate, values=values, covariance=covariance), POINT, np.eye(3))
    assert np.isnan(value[2, 2])
    assert np.isfinite(np.delete(std.ravel(), 8)).all()


def test_every_format_has_the_same_body() -> None:
    estimate = make_estimate()
    files = body_files(estimate)
    assert list(files) == ["URDF", "MJCF", "SDF", "CSV"]
    rows = list(csv.DictReader(files["CSV"].splitlines()))
    assert [float(row["value"]) for row in rows] == pytest.approx(estimate.values, rel=1e-8)
    assert [float(row["std"]) for row in rows] == pytest.approx(
        np.sqrt(np.diag(estimate.covariance)), rel=1e-2
    )
    assert (rows[0]["unit"], rows[9]["unit"]) == ("kg", "kg m^2")
    urdf = ElementTree.fromstring(files["URDF"]).find("link/inertial")
    assert urdf is not None
    tensor = urdf.find("inertia").attrib  # type: ignore[union-attr]
    assert [float(tensor[f"i{e[1:]}"]) for e in ELEMENTS[4:]] == pytest.approx(estimate.values[4:])
    assert float(urdf.find("mass").attrib["value"]) == pytest.approx(1240.13)  # type: ignore[union-attr]
    sdf = ElementTree.fromstring(files["SDF"]).find("model/link/inertial")
    assert sdf is not None
    assert [float(t) for t in sdf.findtext("pose", "").split()[:3]] == pytest.approx(estimate.values[1:4])
    assert [float(sdf.findtext(f"inertia/i{e[1:]}", "")) for e in ELEMENTS[4:]] == pytest.approx(
        estimate.values[4:]
    )


def test_mujoco_takes_the_body() -> None:
    mujoco = pytest.importorskip("mujoco", reason="pip install '.[dev]'")
    estimate = make_estimate()
    model = mujoco.MjModel.from_xml_string(body_files(estimate)["MJCF"])
    assert model.body_mass[1] == pytest.approx(estimate.values[0])
    assert model.body_ipos[1] == pytest.approx(estimate.values[1:4])
    w, x, y, z = model.body_iquat[1]
    turn = Rotation.from_quat([x, y, z, w]).as_matrix()
    assert six(turn @ np.diag(model.body_inertia[1]) @ turn.T) == pytest.approx(
        estimate.values[4:], rel=1e-5, abs=1e-3
    )


def test_of_a_body_that_is_not_all_known_there_is_a_table() -> None:
    files = body_files(make_estimate(("Jzz",)))
    assert list(files) == ["CSV"]
    assert files["CSV"].splitlines()[-1] == "Jzz,,,kg m^2"


def learned(name: str, value: float) -> ParameterEstimate:
    return ParameterEstimate(name, "m", 0.0, 0.001, value, 1e-4)


def test_a_learned_rig_is_read_back(rig: Rig, tmp_path: Path) -> None:
    turn = np.array([0.01, -0.02, 0.03])
    parameters = (
        learned("cable_2.length", 2.503),
        learned("cable_1.body_point.y", 0.002),
        learned("cable_3.ceiling_point.z", 4.004),
        learned("imu.position.x", 0.001),
        learned("exciter.position.z", 0.102),
        *(learned(f"imu.orientation.{axis}", value) for axis, value in zip("xyz", turn, strict=True)),
        learned("imu.gyroscope_bias.x", 0.5),
    )
    (tmp_path / "rig.yaml").write_text(learned_rig_text(rig, parameters, "van"), encoding="utf-8")
    found = read_rig(tmp_path / "rig.yaml")
    assert found.cables[1].length == 2.503
    assert found.cables[0].body_point.tolist() == [0.0, 0.002, 1.4]
    assert found.cables[2].ceiling_point[2] == 4.004
    assert found.cables[3].length == rig.cables[3].length
    assert found.imu is not None
    assert found.imu.position.tolist() == [1.001, 1.2, 0.4]
    assert found.exciter is not None
    assert found.exciter.position.tolist() == [0.3, 1.0, 0.102]
    assert Rotation.from_quat(found.imu.orientation).as_rotvec() == pytest.approx(turn, abs=1e-6)
    assert found.frame is not None
    assert found.mass == rig.mass
    assert [c.length for c in learned_rig(rig, ()).cables] == [c.length for c in rig.cables]


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_the_page_works_out_inertia_elsewhere(
    identification: Identification, session: Session, tmp_path: Path
) -> None:
    """A person enters a point and axes: the page says what Python says."""
    playwright = pytest.importorskip("playwright.sync_api", reason="pip install '.[browser]'")
    write_report(identification, session, tmp_path / "report.html")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        page = browser.new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto((tmp_path / "report.html").as_uri())
        chapter = page.locator(".elsewhere").first
        chapter.locator("summary").click()
        printed = chapter.locator(".tensor b").all_inner_texts()
        for name, value in {
            **dict(zip("xyz", POINT, strict=True)),
            "roll": 10,
            "pitch": -20,
            "yaw": 30,
        }.items():
            chapter.locator(f"input[name={name}]").fill(str(value))
        shown = chapter.locator(".tensor b").all_inner_texts()
        halves = chapter.locator(".tensor .pm").all_inner_texts()
        browser.close()
    assert errors == []
    at_datum, _ = inertia_about(identification.total, np.zeros(3), np.eye(3))
    assert numbers(printed) == pytest.approx(at_datum.ravel(), rel=1e-3, abs=0.5)
    value, std = inertia_about(identification.total, POINT, TURN)
    assert numbers(shown) == pytest.approx(value.ravel(), rel=1e-3, abs=0.5)
    assert numbers(halves) == pytest.approx(1.96 * std.ravel(), rel=0.1)


def numbers(texts: list[str]) -> list[float]:
    return [float(t.replace("−", "-").replace("± ", "").replace("\u202f", "")) for t in texts]


def test_the_page_embeds_what_is_copied(
    identification: Identification, explained: Identification, session: Session, tmp_path: Path
) -> None:
    for answer, bodies in ((identification, 2), (explained, 1)):
        write_report(answer, session, tmp_path / "report.html")
        text = (tmp_path / "report.html").read_text(encoding="utf-8")
        assert text.count("<summary>CSV</summary>") == bodies
        assert text.count("<summary>MJCF</summary>") == (bodies if answer is identification else 0)
        assert "ros__parameters:" in text
