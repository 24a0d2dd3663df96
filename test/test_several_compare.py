"""Agreement of sessions: as many false alarms as asked for, and differences found where they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from several_worlds import BODY, NAMES, STAYING, UNIT, answer, designs, record

from rig_identification.joint import JointInformation, Weighing
from rig_identification.result import ELEMENTS
from rig_identification.several.compare import compare, joint_covariance
from rig_identification.several.session_result import SessionResult
from rig_identification.several.ties import Sharing, ties

COUNT = len(NAMES)
EXACT = Sharing(new=0.0)
PAIRS = 400


def pair(rng: np.random.Generator, both: list[np.ndarray], second: np.ndarray = BODY) -> list[SessionResult]:
    """Two sessions of one rig and one weighing, doubts and noise drawn; the second of a body of its own."""
    shared = rng.standard_normal(STAYING)
    scale = Weighing(float(BODY[0] + 0.5 * rng.standard_normal()), 0.5)
    return [
        answer(
            f"s{k}",
            record(h, np.concatenate([shared, rng.standard_normal(COUNT - STAYING)]), rng, body),
            weighing=scale,
        )
        for k, (h, body) in enumerate(zip(both, (BODY, second), strict=True))
    ]


def test_the_covariance_between_sessions_is_that_of_many_draws() -> None:
    rng = np.random.default_rng(0)
    both = designs(rng)
    drawn = np.array([np.concatenate([r.values for r in pair(rng, both)]) for _ in range(1500)])
    told = pair(rng, both)
    expected = joint_covariance(told, ties(told, EXACT))
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        np.cov(drawn.T) / np.outer(scale, scale), expected / np.outer(scale, scale), atol=0.12
    )
    across = (expected / np.outer(scale, scale))[:10, 10:]
    assert np.max(np.abs(across)) > 0.2, "the sessions share nothing: the test could not fail"


def test_false_alarms_are_as_rare_as_asked_for() -> None:
    """Pairs that agree: chi-square has its mean, and no more than the level is said to disagree."""
    rng = np.random.default_rng(1)
    both = designs(rng)
    found = [compare(pair(rng, both), EXACT, level=0.05) for _ in range(PAIRS)]
    mean = np.mean([c.together.chi_square for c in found])
    assert found[0].together.freedom == 10
    assert mean == pytest.approx(10.0, abs=5.0 * np.sqrt(20.0 / PAIRS))
    alarms = np.mean([not c.agree for c in found])
    assert alarms <= 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / PAIRS)
    single = np.mean([[c.numbers[name].p < 0.05 for name in ELEMENTS] for c in found])
    assert single == pytest.approx(0.05, abs=0.02)


def test_the_number_that_differs_is_named() -> None:
    rng = np.random.default_rng(2)
    both = designs(rng)
    changed = BODY.copy()
    k = ELEMENTS.index("Jyy")
    told = pair(rng, both)
    covariance = joint_covariance(told, ties(told, EXACT))
    std = np.sqrt(covariance[k, k] + covariance[10 + k, 10 + k] - 2.0 * covariance[k, 10 + k])
    changed[k] += 8.0 * std
    hits = [compare(pair(rng, both, changed), EXACT).disagreeing[:1] for _ in range(50)]
    assert np.mean([hit == ("Jyy",) for hit in hits]) > 0.9


def test_sharing_sees_differences_that_independence_hides() -> None:
    """Where shared errors dominate, a body that changed by a fraction of its interval is seen."""
    rng = np.random.default_rng(3)
    design = np.zeros((400, 10 + COUNT))
    design[:, :10] = rng.standard_normal((400, 10))
    design[:, 12] = 5.0 * design[:, 0]  # a gain moves the mass by 5 kg
    changed = BODY + np.eye(10)[0]
    shared = np.zeros(COUNT)
    told = [answer("a", record(design, shared, rng)), answer("b", record(design, shared, rng, changed))]
    assert np.sqrt(told[0].estimate.covariance[0, 0]) > 4.0
    found = compare(told, EXACT)
    assert found.disagreeing == ("m",)
    assert compare(told, Sharing(rigs=("one", "two"))).agree


def test_the_odd_one_of_three_is_found() -> None:
    rng = np.random.default_rng(4)
    h = designs(rng, 3)
    bodies = (BODY, BODY + 6.0 * UNIT, BODY)
    told = [
        answer(f"s{k}", record(design, np.zeros(COUNT), rng, body))
        for k, (design, body) in enumerate(zip(h, bodies, strict=True))
    ]
    found = compare(told)
    assert not found.agree
    assert found.together.freedom == 20
    assert min(found.sessions, key=lambda name: found.sessions[name].p) == "s1"


def test_only_what_both_determine_is_compared() -> None:
    rng = np.random.default_rng(5)
    one, other = pair(rng, designs(rng))
    lost = replace(other, estimate=replace(other.estimate, unobservable=("Jxx", "Jxy")))
    found = compare([one, lost])
    assert found.together.freedom == 8
    assert "Jxx" not in found.numbers
    nothing = replace(other, estimate=replace(other.estimate, unobservable=ELEMENTS))
    assert not compare([one, nothing]).numbers
    assert compare([one, nothing]).agree


def doubts_of(result: SessionResult) -> JointInformation:
    assert result.joint is not None
    return result.joint


def test_a_hinge_of_another_pose_is_another_number() -> None:
    rng = np.random.default_rng(6)
    one, other = pair(rng, designs(rng))
    joint = doubts_of(other)
    longer = tuple(replace(d, nominal=2.6) if d.name == "cable_1.length" else d for d in joint.doubts)
    moved = replace(other, joint=replace(joint, doubts=longer))
    assert compare([one, other]).shared == STAYING
    assert compare([one, moved]).shared == STAYING - 1


def test_what_the_lab_says_comes_before_what_is_usual() -> None:
    rng = np.random.default_rng(7)
    told = pair(rng, designs(rng))
    assert compare(told, Sharing(fresh=("imu.*",))).shared == STAYING - 1
    assert compare(told, Sharing(kept=("imu.gyroscope_bias.*",))).shared == STAYING + 1
    assert compare(told, Sharing(rigs=("A", "B"))).shared == 0


def test_what_is_new_in_each_session_loosens_the_tie() -> None:
    rng = np.random.default_rng(8)
    told = pair(rng, designs(rng))
    tight, loose = ties(told, EXACT).correlation(0, 1), ties(told, Sharing(new=0.6)).correlation(0, 1)
    np.testing.assert_allclose(np.diag(tight), [1.0] * STAYING + [0.0] * (COUNT - STAYING))
    np.testing.assert_allclose(np.diag(loose)[:STAYING], 1.0 - 0.6**2)
