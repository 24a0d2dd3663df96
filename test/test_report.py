"""Result and report: the contract's JSON, honest numbers, one self-contained page."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rig_identification.quantity import significant, unit_text, value_and_half_width
from rig_identification.recording import Session
from rig_identification.report import render_report, result_to_dict, write_report, write_result
from rig_identification.report.doubts import doubt_groups
from rig_identification.report.envelope import envelope, worst_stretch
from rig_identification.report.line_chart import Curve, Panel, chart_svg, path_data, ticks
from rig_identification.report.principal import inertia_matrix, principal_inertia
from rig_identification.report.residuals import summarise_residual
from rig_identification.report.rest_pose import rest_pose
from rig_identification.report.ten_numbers import blocks
from rig_identification.result import (
    ELEMENTS,
    ChannelFit,
    Identification,
    InertialEstimate,
    ParameterEstimate,
)
from rig_identification.rig import Cable, Rig

KEYS = ["mass", "center_of_mass", "inertia", "covariance", "without_frame", "unobservable", "mismatch"]


# --- result.json -----------------------------------------------------------------------------------------


def test_result_has_the_contracts_keys(identification: Identification, explained: Identification) -> None:
    result = result_to_dict(identification)
    assert list(result) == KEYS
    assert list(result["without_frame"]) == ["mass", "center_of_mass", "inertia"]
    assert result["mismatch"] == {"verdict": "none", "findings": [], "alternatives": []}
    finding = result_to_dict(explained)["mismatch"]["findings"][0]
    assert list(finding) == ["effect", "where", "parameters", "evidence", "statement"]
    assert finding["where"]["position"] == [1.0, 0.0, -0.6]
    assert finding["where"]["axis"] is None


def test_result_tells_what_the_ideal_model_said(
    identification: Identification, explained: Identification
) -> None:
    both = result_to_dict(replace(explained, figures={"ideal": identification}))
    ideal = both["mismatch"]["ideal_model"]
    assert list(ideal) == ["mass", "center_of_mass", "inertia", "unobservable"]
    np.testing.assert_array_equal(ideal["inertia"]["value"], inertia_matrix(identification.total.values))
    assert ideal["unobservable"] == []
    assert both["inertia"]["value"][2][2] is None
    assert "ideal_model" not in result_to_dict(identification)["mismatch"]


def test_result_carries_the_numbers(identification: Identification) -> None:
    result = result_to_dict(identification)
    values, std = identification.total.values, np.sqrt(np.diag(identification.total.covariance))
    assert result["mass"] == {"value": values[0], "std": pytest.approx(std[0])}
    assert result["center_of_mass"]["value"] == values[1:4].tolist()
    np.testing.assert_array_equal(result["inertia"]["value"], inertia_matrix(values))
    np.testing.assert_allclose(result["inertia"]["std"], inertia_matrix(std))
    np.testing.assert_array_equal(result["covariance"], identification.total.covariance)


def test_what_is_not_determined_is_null_everywhere(explained: Identification, tmp_path: Path) -> None:
    write_result(explained, tmp_path / "result.json")
    result = json.loads((tmp_path / "result.json").read_text(), parse_constant=pytest.fail)
    assert result["unobservable"] == ["Jzz"]
    assert result["inertia"]["value"][2][2] is None
    assert result["inertia"]["std"][2][2] is None
    nulls = np.array([[entry is None for entry in row] for row in result["covariance"]])
    assert nulls[9].all()
    assert nulls[:, 9].all()
    assert not nulls[:9, :9].any()
    assert result["without_frame"] is None


def test_result_is_strict_json_whatever_is_infinite(explained: Identification, tmp_path: Path) -> None:
    finding = replace(
        explained.mismatch.findings[0], evidence={"log_likelihood_gain": np.inf, "other": np.nan}
    )
    values = explained.total.values.copy()
    values[9] = np.nan
    covariance = explained.total.covariance.copy()
    covariance[9, 9] = np.inf
    wild = replace(
        explained,
        total=replace(explained.total, values=values, covariance=covariance),
        mismatch=replace(explained.mismatch, findings=(finding,)),
    )
    write_result(wild, tmp_path / "result.json")
    result = json.loads((tmp_path / "result.json").read_text(), parse_constant=pytest.fail)
    assert result["mismatch"]["findings"][0]["evidence"] == {"log_likelihood_gain": None, "other": None}


# --- principal inertia -----------------------------------------------------------------------------------


def test_principal_inertia_of_a_turned_box() -> None:
    mass, sides = 12.0, np.array([1.0, 0.6, 0.2])
    moments = mass / 12.0 * (np.sum(sides**2) - sides**2)
    R = Rotation.from_euler("zyx", [20.0, -10.0, 5.0], degrees=True).as_matrix()
    J = R @ np.diag(moments) @ R.T
    values = np.array([mass, 0.0, 0.0, 0.0, J[0, 0], J[0, 1], J[0, 2], J[1, 1], J[1, 2], J[2, 2]])
    found = principal_inertia(InertialEstimate(values, 1e-6 * np.eye(10)))
    assert found is not None
    np.testing.assert_allclose(found.moments, np.sort(moments))
    np.testing.assert_allclose(np.abs(np.sum(found.axes * R, axis=0)), 1.0)
    # A homogeneous ellipsoid has m a^2 / 5 where a box of side s has m s^2 / 12.
    np.testing.assert_allclose(found.semi_axes, sides * np.sqrt(5.0 / 12.0))


def test_uncertainty_of_principal_inertia_is_that_of_samples(identification: Identification) -> None:
    estimate = identification.total
    found = principal_inertia(estimate)
    assert found is not None
    draws = np.random.default_rng(0).multivariate_normal(estimate.values, estimate.covariance, size=4000)
    sampled = [principal_inertia(InertialEstimate(draw, estimate.covariance)) for draw in draws]
    moments = np.array([s.moments for s in sampled if s is not None])
    margins = np.array([s.margin for s in sampled if s is not None])
    tilts = np.array(
        [np.arccos(np.abs(np.sum(s.axes * found.axes, axis=0))) for s in sampled if s is not None]
    )
    np.testing.assert_allclose(found.moments_std, moments.std(axis=0), rtol=0.08)
    assert found.margin_std == pytest.approx(margins.std(), rel=0.08)
    np.testing.assert_allclose(found.axes_std, np.sqrt(np.mean(tilts**2, axis=0)), rtol=0.08)


def test_an_impossible_tensor_is_called_so(identification: Identification) -> None:
    values = identification.total.values.copy()
    values[9] = 3000.0
    block = blocks(replace(identification, total=replace(identification.total, values=values)))[0]
    assert block.consistent is False
    assert "No body" in block.consistency


# --- residuals -------------------------------------------------------------------------------------------


def test_white_noise_looks_white() -> None:
    time = np.arange(0.0, 100.0, 0.005)
    summary = summarise_residual(time, np.random.default_rng(1).standard_normal(len(time)))
    assert summary.rms == pytest.approx(1.0, abs=0.02)
    assert summary.beyond_3_sigma == pytest.approx(0.0027, abs=0.0015)
    assert np.mean(summary.power) == pytest.approx(1.0, abs=0.1)
    assert np.mean(np.abs(summary.correlation) < summary.white_band) == pytest.approx(0.95, abs=0.03)
    width = summary.density_at[1] - summary.density_at[0]
    assert np.sum(summary.density) * width == pytest.approx(1.0)


def test_a_swing_shows_at_its_frequency() -> None:
    time = np.arange(0.0, 100.0, 0.01)
    residual = np.random.default_rng(2).standard_normal(len(time)) + np.sin(2.0 * np.pi * 2.0 * time)
    summary = summarise_residual(time, residual)
    assert summary.frequency[np.argmax(summary.power)] == pytest.approx(2.0, rel=0.1)
    assert summary.correlation[np.argmin(np.abs(summary.lag - 0.5))] > 0.2


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_handful_of_samples_is_summarised(count: int) -> None:
    summary = summarise_residual(np.arange(float(count)), np.ones(count))
    assert summary.rms == pytest.approx(1.0)


# --- pictures --------------------------------------------------------------------------------------------


@given(st.integers(2, 3000), st.integers(1, 60), st.integers(0, 10_000))
def test_envelope_keeps_every_peak(count: int, columns: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.01, 1.0, count))
    values = rng.standard_normal(count)
    kept_time, kept = envelope(time, values, columns)
    assert len(kept) <= max(2 * columns, 2)
    assert kept.max() == values.max()
    assert kept.min() == values.min()
    assert np.all(np.diff(kept_time) > 0.0)
    assert np.all(np.isin(kept_time, time))


def test_worst_stretch_is_where_the_error_is() -> None:
    time = np.arange(0.0, 60.0, 0.01)
    residual = np.where((time > 30.0) & (time < 33.0), 5.0, 1.0)
    start, end = worst_stretch(time, residual, 3.0)
    assert start == pytest.approx(30.0, abs=0.02)
    assert end == pytest.approx(33.0, abs=0.02)
    assert worst_stretch(time[:10], residual[:10], 3.0) == (time[0], time[9])


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(2, 8))
def test_ticks_are_round_and_inside(lower: float, span: float, count: int) -> None:
    upper = lower + span
    found = ticks(lower, upper, count)
    assert len(found) <= 2 * count + 1
    slack = 1e-6 * span + 1e-9 * abs(lower)
    assert all(lower - slack <= tick <= upper + slack for tick in found)


def test_path_is_the_curve() -> None:
    """Relative whole steps add up to the points that were given."""
    x, y = np.array([0.0, 1.0, 2.0, 3.5]), np.array([5.0, -2.0, -2.0, 7.3])
    text = path_data(x, y)
    start, steps = text.removeprefix("M").split("l")
    point = np.array([int(v) for v in start.split()])
    numbers = [int(v) for v in steps.replace("-", " -").split()]
    points = point + np.vstack([[0, 0], np.cumsum(np.reshape(numbers, (-1, 2)), axis=0)])
    np.testing.assert_array_equal(points, np.rint(10.0 * np.column_stack([x, y])))


@pytest.mark.parametrize(
    "values", [np.zeros(3), np.full(3, 9.80665), np.array([1e-9, 2e-9, 1e-9]), np.array([1e7] * 3)]
)
def test_a_chart_of_anything_is_well_formed(values: np.ndarray) -> None:
    limits = (values.min() - 1e-9, values.max() + 1e-9)
    panel = Panel((Curve(np.arange(3.0), values, "measured"),), 60, limits, label="N")
    ElementTree.fromstring(chart_svg([panel], x_limits=(0.0, 2.0), x_label="s", title="t"))


def test_rest_pose_of_two_parallel_cables() -> None:
    """A bar on two equal cables hangs level, its centre of mass straight below the middle."""
    cables = tuple(
        Cable(f"cable_{i}", np.array([x, 0.0, 3.0]), np.array([x, 0.0, 0.0]), 2.0)
        for i, x in enumerate((-1.0, 1.0))
    )
    R_world_body, position = rest_pose(Rig(9.81, cables), np.array([0.0, 0.0, -0.3]))
    np.testing.assert_allclose(position, [0.0, 0.0, 1.0], atol=1e-4)
    np.testing.assert_allclose(R_world_body, np.eye(3), atol=1e-3)


def test_rest_pose_stretches_no_cable(rig: Rig) -> None:
    R_world_body, position = rest_pose(rig, np.array([1.93, 1.01, 0.65]))
    for cable in rig.cables:
        reach = np.linalg.norm(position + R_world_body @ cable.body_point - cable.ceiling_point)
        assert reach <= cable.length + 1e-5


# --- numbers as text -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "std", "expected"),
    [
        (1240.1304, 0.4, ("1\u202f240.13", "0.78")),
        (-14.213, 0.5, ("−14.21", "0.98")),
        (0.0000412, 0.5, ("0.00", "0.98")),
        (1651.3, 51.0, ("1\u202f651", "100")),
        (3.0, 0.0, ("3.000", "0.000")),
    ],
)
def test_a_value_has_the_digits_of_its_interval(value: float, std: float, expected: tuple[str, str]) -> None:
    assert value_and_half_width(value, std) == expected


def test_units_and_powers_are_written_out() -> None:
    assert unit_text("m/s^2") == "m/s²"
    assert unit_text("1") == ""
    assert significant(4.1e6, 3) == "4.10×10⁶"
    assert significant(3e-4, 2) == "3.0×10⁻⁴"
    assert significant(float("nan")) == "–"


def test_a_parameter_is_shown_in_tolerances() -> None:
    groups = doubt_groups(
        (
            ParameterEstimate("cable_1.length", "m", 2.5, 5e-4, 2.502, 1e-4),
            ParameterEstimate("cable_1.load_cell_zero", "N", 0.0, 3.0, 1.5, 3.0),
            ParameterEstimate("clock.imu", "s", 0.0, np.inf, 0.2, 1e-3),
        )
    )
    length, zero = groups[0].doubts
    assert (length.shift, length.learned, length.notable) == (pytest.approx(4.0), 80, True)
    assert (zero.shift, zero.learned, zero.notable) == (0.5, 0, False)
    assert groups[1].doubts[0].shift is None
    assert groups[0].notable
    assert not groups[1].notable


# --- the page --------------------------------------------------------------------------------------------


class Page(HTMLParser):
    """Tags, ids and links of a page; what is opened must be closed in order."""

    VOID = frozenset({"meta", "br", "link", "img", "input", "hr"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.stack: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.ids += [v for k, v in given.items() if k == "id" and v]
        self.links += [v for k, v in given.items() if k in ("href", "src") and v]
        if tag not in self.VOID:
            self.stack.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        if tag != "p" or self.stack[-1] == "p":
            assert self.stack.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.stack and self.stack[-1] not in ("style", "script"):
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"[ \n]+", " ", " ".join(self.words))


@pytest.fixture
def page(identification: Identification, session: Session) -> Page:
    return Page(render_report(identification, session))


def test_the_page_stands_alone(
    page: Page, identification: Identification, session: Session, tmp_path: Path
) -> None:
    write_report(identification, session, tmp_path / "report.html")
    assert (tmp_path / "report.html").stat().st_size < 5e6
    assert page.stack == []
    assert all(link.startswith("#") for link in page.links), "the page may load nothing"
    assert {link[1:] for link in page.links} <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    source = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "@import" not in source
    assert "url(" not in source


def test_the_page_begins_with_rig_numbers_lights_and_what_to_do(page: Page) -> None:
    order = [
        "rig",
        "numbers",
        "lights",
        "next",
        "verdict",
        "channels",
        "residuals",
        "findings",
        "determined",
        "doubts",
        "views",
        "quality",
        "notes",
    ]
    assert [i for i in page.ids if i in order] == order
    for number in (
        "1\u202f240.13",
        "1.93120",
        "1.01270",
        "0.6521",
        "372.4",
        "−14.21",
        "31.7",
        "1\u202f651.3",
        "5.4",
    ):
        assert number in page.text
    assert "Body without its carrying frame" in page.text
    assert "the ideal model accounts for the recordings" in page.text


def test_every_channel_is_on_the_page(page: Page, identification: Identification) -> None:
    for fit in identification.channels:
        assert any(i.startswith(fit.recording) and fit.channel in i for i in page.ids)
    assert "31 samples are missing in 2 gaps" in page.text
    assert "a person still holds the body" in page.text


def test_findings_are_on_the_page(
    explained: Identification, identification: Identification, session: Session
) -> None:
    told = Page(render_report(replace(explained, figures={"ideal": identification}), session)).text
    for part in (
        "Cable elasticity",
        "cable_3",
        "run_1, 3.20 s to 5.10 s",
        "(1.00, 0.00, −0.60) m in body",
        "×10⁶ N",
    ):
        assert part in told
    assert "ceiling compliance" in told
    assert "The fit did not settle" in told
    assert "nothing was held out" in told
    assert "What it did to the ten numbers" in told


def test_a_reason_stands_beside_what_is_not_determinable(explained: Identification, session: Session) -> None:
    told = Page(render_report(explained, session)).text
    assert "not determin" in told
    assert "No recording changes by more than its noise" in told
    given_reason = {"unobservable_reasons": {"Jzz": "The body never yaws."}}
    assert (
        "The body never yaws." in Page(render_report(replace(explained, figures=given_reason), session)).text
    )


def test_nothing_determined_and_nothing_compared(identification: Identification, session: Session) -> None:
    nothing = replace(
        identification,
        total=InertialEstimate(np.full(10, np.nan), np.full((10, 10), np.nan), ELEMENTS),
        without_frame=None,
        channels=(),
        parameters=(),
        notes=(),
        holdout_error=None,
    )
    told = Page(render_report(nothing, session))
    assert told.stack == []
    assert not re.search(r"\bnan\b", told.text, re.IGNORECASE)


def test_a_prediction_that_ran_away_is_told(identification: Identification, session: Session) -> None:
    fit, lost = identification.channels[0], identification.channels[1]
    predicted = fit.predicted.copy()
    predicted[-7:] = np.nan
    channels = (
        replace(fit, predicted=predicted),
        replace(lost, predicted=np.full_like(lost.predicted, np.inf)),
    )
    told = Page(render_report(replace(identification, channels=channels, training_error=np.nan), session))
    assert "static_bare, cable_1 tension: 7 samples have no finite prediction." in told.text
    assert "static_bare, cable_2 tension: 4000 samples" in told.text
    assert not re.search(r"\bnan\b", told.text, re.IGNORECASE)


def test_names_from_outside_cannot_become_markup(identification: Identification, session: Session) -> None:
    bad = "<script>alert(1)</script>&\"'"
    fit = replace(identification.channels[0], channel=bad, unit=bad)
    recordings = tuple(
        replace(r, name=bad if r.name == "static_bare" else r.name) for r in session.recordings
    )
    cables = (replace(session.rig.cables[0], name=bad), *session.rig.cables[1:])
    hostile = replace(session, name=bad, recordings=recordings, rig=replace(session.rig, cables=cables))
    fit = replace(fit, recording=bad)
    text = render_report(replace(identification, channels=(fit,), notes=(bad,)), hostile)
    assert "<script>alert" not in text
    assert Page(text).stack == []


def test_many_long_channels_stay_a_small_file(identification: Identification, session: Session) -> None:
    time = np.arange(0.0, 100.0, 0.005)
    rng = np.random.default_rng(5)

    def fit(recording: str, index: int) -> ChannelFit:
        noise = rng.standard_normal((2, len(time)))
        return ChannelFit(
            recording, f"cable_{index}", "tension", None, "N", 1.0, True, time, noise[0], noise[1]
        )

    channels = tuple(fit(f"run_{r}", i) for r in range(10) for i in range(15))
    assert len(render_report(replace(identification, channels=channels), session).encode()) < 5e6
