"""The report's first screen and the words of the page: lights, steps, drawing, units, intervals."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from conftest import make_estimate, make_finding
from test_check_command import make_examination, make_fault
from test_report import Page

from rig_identification.estimate.verdict import as_sentence
from rig_identification.examination import Examination
from rig_identification.quantity import with_interval
from rig_identification.recording import ChannelQuality, Session
from rig_identification.report import render_report
from rig_identification.report.determined import determinations
from rig_identification.report.do_next import next_steps
from rig_identification.report.doubts import doubt_groups
from rig_identification.report.grades import grade, heat, noise_limit
from rig_identification.report.identity import digest, recorded_on
from rig_identification.report.labels import LETTER, LINE
from rig_identification.report.lights import lights
from rig_identification.report.narrower import narrower
from rig_identification.report.rig_drawing import picture_svg, rig_svgs
from rig_identification.report.rig_scene import described_scene, rig_scene
from rig_identification.report.words import title
from rig_identification.result import (
    ELEMENTS,
    ChannelFit,
    Identification,
    ParameterEstimate,
    Quantity,
    UncertaintySource,
)
from rig_identification.rig import Cable, Rig, WheelContacts


def still(recording: str, channel: str, off: float) -> ChannelFit:
    """One mean at rest, ``off`` standard deviations from what is predicted."""
    one = np.array([1.0])
    return ChannelFit(
        recording, channel, "tension", None, "N", 2.0, False, one, 3e3 + 2.0 * off * one, 3e3 * one
    )


# --- rest is a table -------------------------------------------------------------------------------------


def test_a_reading_at_rest_is_a_row_and_no_empty_chart(
    identification: Identification, session: Session
) -> None:
    fits = tuple(still("static_bare", f"cable_{i}", 1.9) for i in range(1, 5))
    moving = tuple(c for c in identification.channels if c.recording.startswith("run"))
    text = render_report(replace(identification, channels=(*moving, *fits)), session)
    chapter = text[text.index('id="channels"') : text.index('id="residuals"')]
    assert "static_bare" in chapter
    assert "<svg" not in chapter[chapter.index("static_bare") :]
    assert "static_bare-cable_1-tension" in Page(text).ids
    assert "3\u202f003.8" in text


def test_two_sigma_at_rest_is_ordinary_and_a_hundred_samples_are_not() -> None:
    """One sample in 50 figures goes to three sigma by chance; the mean square of a hundred hardly to 1.4."""
    assert grade(2.5, 1, 50) == "good"
    assert heat(2.5, 1, 50) == 0
    assert grade(5.0, 1, 50) == "bad"
    assert heat(5.0, 1, 50) > 25
    assert grade(1.6, 100, 50) == "bad"
    assert grade(1.05) == "good"
    assert grade(None) == grade(float("nan")) == "muted"


def test_noise_exceeds_its_limit_as_rarely_as_said() -> None:
    samples = np.random.default_rng(0).standard_normal((40_000, 4))
    rms = np.sqrt(np.mean(samples**2, axis=1))
    assert np.mean(rms > noise_limit(4)) == pytest.approx(0.005, abs=0.0015)


# --- one convention of intervals -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "std", "unit", "text"),
    [
        (148.01, 1.0369, "N/m", "148.0 ± 2.0 N/m"),
        (6.5432e5, 1200.0, "N", "(6.543 ± 0.024)×10⁵ N"),
        (-0.25, 0.01, "N*m", "-0.250 ± 0.020 N m"),
        (9.80665, 0.0, "N", "9.807 N"),
        (0.0163, 0.0005, "1", "0.01630 ± 0.00098"),
    ],
)
def test_a_sentence_has_the_interval_that_the_table_has(
    value: float, std: float, unit: str, text: str
) -> None:
    assert with_interval(value, std, unit) == text


def test_names_keep_their_capitals() -> None:
    assert title("imu_bias") == "IMU bias"
    assert title("level_error") == "Level error"


def test_a_verdict_keeps_units_as_they_are_written() -> None:
    reasons = ["the residual of imu x has 3 times the power at 2 Hz", "the scale says 1107.0 ± 1.0 kg"]
    assert as_sentence(reasons).startswith("The residual of imu x has 3 times the power at 2 Hz; the scale")


def test_a_doubts_name_says_what_it_is_and_its_columns_share_one_power_of_ten() -> None:
    (group,) = doubt_groups(
        (
            ParameterEstimate("cable_1.held_xx", "N*m/rad", 0.0, 50.0, 20.0, 8.0),
            ParameterEstimate("cable_1.stiffness", "N", 2.0e6, 5e4, 2.1e6, 2e4),
        )
    )
    held, stiff = group.doubts
    assert "held" not in held.name
    assert held.unit == "N m/rad"
    assert (stiff.nominal, stiff.value, stiff.half_width) == ("2.0000", "2.100", "0.039")
    assert stiff.unit == "×10⁶ N"


def test_percent_is_of_what_is_determined(identification: Identification, session: Session) -> None:
    """An element that is not determined has a value all the same, which is no inertia."""
    odd = ("Jxx", "Jyy")
    total = make_estimate(odd)
    total.values[[4, 7]] = 1e9
    row = determinations(replace(identification, total=total), session)[9]
    half = 1.959964 * float(np.sqrt(total.covariance[9, 9]))
    assert float(row.relative.split()[0]) == pytest.approx(100.0 * half / total.values[9], abs=0.006)


# --- first screen ----------------------------------------------------------------------------------------


def with_fault(corrected: bool) -> Examination:
    return make_examination(faults=(make_fault(corrected=corrected),))


def test_lights_follow_data_model_and_held_out_run(identification: Identification) -> None:
    def states(found: Identification) -> list[str]:
        return [light.state for light in lights(found)]

    assert states(identification) == ["muted", "good", "good"]
    bad = replace(identification.mismatch, verdict="unexplained")
    worse = replace(identification, mismatch=bad, holdout_error=3.0, examination=with_fault(False))
    assert states(worse) == ["bad", "bad", "bad"]
    assert states(replace(worse, examination=with_fault(True)))[0] == "fair"
    assert states(replace(identification, converged=False, holdout_error=None))[1:] == ["bad", "muted"]


def test_what_to_do_next_is_in_order(
    identification: Identification, explained: Identification, session: Session
) -> None:
    fault = make_fault(corrected=False, advice="Swap the plugs.", gain=50.0)
    found = replace(
        explained,
        converged=True,
        parameters=identification.parameters,
        examination=make_examination(faults=(fault,)),
        mismatch=replace(explained.mismatch, findings=(make_finding(), *explained.mismatch.findings)),
    )
    steps = [step.what for step in next_steps(found, session)]
    assert steps[0] == "Swap the plugs."
    assert next_steps(found, session)[0].evidence == "evidence 10 σ"
    assert "Confirm cable elasticity" in steps[1]
    assert "Jzz" in steps[2]
    assert any(step.startswith("Measure again: IMU accelerometer bias x") for step in steps)
    clean = replace(identification, parameters=())
    assert next_steps(clean, session) == []
    assert "The numbers can be used." in Page(render_report(clean, session)).text


def test_only_an_open_question_is_worth_an_experiment(
    identification: Identification, session: Session
) -> None:
    near = {"effect": "cable_mass", "where": {}, "log_likelihood_gap": 2.0, "experiment": "weigh a length"}
    far = {**near, "effect": "tether", "log_likelihood_gap": 50.0}
    mismatch = replace(identification.mismatch, alternatives=(near, far))
    (step,) = next_steps(replace(identification, mismatch=mismatch, parameters=()), session)
    assert step.what == "To decide on cable mass: weigh a length."
    assert step.evidence == "2.0 σ apart so far"


def test_one_experiment_for_two_findings_is_one_step(explained: Identification, session: Session) -> None:
    damping = replace(make_finding(), effect="hinge_damping", where={}, statement="Hinges damp.")
    drag = replace(damping, effect="air_drag", statement="The air resists.")
    mismatch = replace(explained.mismatch, findings=(damping, drag), alternatives=())
    first = next_steps(replace(explained, mismatch=mismatch, converged=True), session)[0]
    assert first.what.startswith("Confirm hinge damping, air drag: let it swing down")
    assert first.why == "Hinges damp. The air resists."


def test_a_session_has_a_date_and_a_digest_of_its_samples(session: Session) -> None:
    assert recorded_on(session) == "2023-11-14 22:13 UTC"
    assert re.fullmatch("[0-9a-f]{12}", digest(session))
    first = session.recordings[0]
    other = replace(
        session, recordings=(replace(first, duration=first.duration + 1e-9), *session.recordings[1:])
    )
    assert digest(other) != digest(session)
    read_otherwise = replace(first, notes=("one more note",), quality=())
    assert digest(replace(session, recordings=(read_otherwise, *session.recordings[1:]))) == digest(session)
    assert recorded_on(replace(session, recordings=(replace(first, start_ns=0),))) == ""


# --- drawing ---------------------------------------------------------------------------------------------


def boxes(svg: str) -> list[tuple[float, float, float, float]]:
    """What each text covers, as the page's style draws it."""
    out = []
    for text in ElementTree.fromstring(svg).iter("text"):
        width, x, y = LETTER * len(text.text or ""), float(text.get("x", 0)), float(text.get("y", 0))
        left = x - width / 2 if "mid" in (text.get("class") or "") else x
        out.append((left, y - 0.8 * LINE, left + width, y + 0.2 * LINE))
    return out


def pendulum() -> Rig:
    """A body on two parallel cables, whose hinges lie on one line."""
    cables = tuple(
        Cable(f"cable_{i}", np.array([x, 0.0, 2.0]), np.array([x, 0.0, 0.1]), 1.2)
        for i, x in enumerate((-0.3, 0.3))
    )
    return Rig(9.81, cables)


def hexapod(rig: Rig) -> Rig:
    """Six cables, of which two pairs lie 2 cm apart."""
    aside = np.array([0.02, 0.0, 0.0])
    more = tuple(
        Cable(f"cable_{i}", c.ceiling_point + aside, c.body_point + aside, c.length)
        for i, c in enumerate(rig.cables[:2], start=5)
    )
    return replace(rig, cables=(*rig.cables, *more))


@pytest.mark.parametrize("kind", ["four", "two", "six"])
@pytest.mark.parametrize("faulty", [frozenset(), frozenset({"cable_1", "imu"})])
def test_no_label_lies_on_another_or_outside(rig: Rig, kind: str, faulty: frozenset[str]) -> None:
    drawn = {"four": rig, "two": pendulum(), "six": hexapod(rig)}[kind]
    scene = described_scene(drawn, faulty)
    for svg in [picture_svg(scene), *(svg for _, svg in rig_svgs(scene))]:
        found = boxes(svg)
        assert all(left >= 0.0 and right <= 440.0 for left, _, right, _ in found)
        for i, a in enumerate(found):
            for b in found[:i]:
                across, down = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
                assert min(across, down) <= 1.0, (a, b)


def test_a_pendulums_body_is_drawn() -> None:
    """Its hinges lie on one line, and in most of its sessions no ellipsoid is determined."""
    unknown = tuple(e for e in ELEMENTS if e not in ("m", "Jzz", "cx", "cy", "cz"))
    estimate = make_estimate(unknown)
    estimate.values[1:4] = 0.0, 0.0, -0.2
    for _, svg in rig_svgs(rig_scene(pendulum(), estimate)):
        (path,) = [p for p in ElementTree.fromstring(svg).iter("path") if p.get("class") == "body"]
        points = np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", path.get("d", "")), dtype=float)
        assert np.all(np.ptp(points, axis=0) > 20.0)


def test_a_finding_is_marked_in_the_drawing(explained: Identification, session: Session) -> None:
    page = render_report(explained, session)
    picture = page[page.index('id="rig"') : page.index("</figure>")]
    assert re.search(r'<g class="faulty"><path class="cable".*?cable_3</text></g>', picture)
    assert "cable elasticity" in picture
    assert "Red: cable elasticity, cable_3" in Page(page).text


def test_truth_is_never_listed_as_used(identification: Identification, session: Session) -> None:
    truth = ChannelQuality("/rig/ground_truth/odometry", 4321, 4321, 100.0, 0.0, 40.0, 0, 0, 0.0, 0, 0, 0, 0)
    run = replace(session.recordings[2], quality=(truth,))
    page = Page(render_report(identification, replace(session, recordings=(*session.recordings[:2], run))))
    assert re.search(r"ground_truth/odometry 4321 truth", page.text)


def test_what_narrows_the_intervals_stands_with_its_gain(
    identification: Identification, session: Session
) -> None:
    """Of a variance of 1 three quarters are noise, of which as long a run again takes half."""
    total = identification.total
    variances = np.zeros(10)
    variances[9] = 1.0
    worst = np.diag(variances + 1e-9)
    sources = tuple(
        UncertaintySource(name, kind, share * worst)
        for name, kind, share in (
            ("imu angular rate", "noise", 0.5),
            ("imu angular rate at rest", "rest", 0.25),
            ("tolerance.cable_length", "tolerance", 0.24),
            ("ground scale", "scale", 0.01),
        )
    )
    told = narrower(replace(identification, total=replace(total, covariance=worst, sources=sources)))
    assert [step.what.partition(" ")[0] for step in told] == ["Record", "Measure"]
    assert told[0].share == pytest.approx(1.0 - np.sqrt(1.0 - 0.375))
    assert told[1].share == pytest.approx(1.0 - np.sqrt(0.76))
    assert told[1].gain == "Jzz ± 2.0 to ± 1.7 kg m²"
    assert "cable length" in told[1].what
    assert narrower(replace(identification, total=replace(total, sources=()))) == []


def test_a_vehicle_has_its_axle_loads_in_the_report(identification: Identification, session: Session) -> None:
    quantities = (
        Quantity("center_of_mass_height", 0.5, 2e-3, "m"),
        Quantity("front_axle_share", 0.55, 1e-3, "1"),
        Quantity("front_axle_load", 6474.0, 3.0, "N"),
    )
    wheels = WheelContacts(*(np.array([x, y, 0.0]) for x in (2.0, 0.0) for y in (0.8, -0.8)))
    rig = replace(session.rig, vehicle=wheels)
    text = Page(render_report(replace(identification, vehicle=quantities), replace(session, rig=rig))).text
    assert "Front axle load" in text
    assert "55.00" in text
    assert "± 0.20" in text
    assert "ISO 8855" in text
    without = Page(render_report(replace(identification, vehicle=()), session)).text
    assert "Front axle load" not in without
