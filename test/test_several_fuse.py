"""Fusion of sessions: exact where everything is linear, and never surer than what is known allows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from several_worlds import BODY, CEILING, NAMES, STAYING, UNIT, Recordings, answer, designs, record

from rig_identification.errors import InputError
from rig_identification.joint import Weighing
from rig_identification.rig import CarryingFrame
from rig_identification.several.fuse import fuse
from rig_identification.several.ties import Sharing

COUNT = len(NAMES)
EXACT = Sharing(new=0.0)


def joint_fit(told: list[Recordings], scale: Weighing | None = None) -> tuple[np.ndarray, np.ndarray]:
    """One least-squares fit of all recordings, shared doubts as one number: values and covariance."""
    size = 10 + STAYING + len(told) * (COUNT - STAYING)
    information = np.diag([1e-8] * 10 + [1.0] * (size - 10))
    pull = np.zeros(size)
    pull[:10] = 1e-8 * BODY / UNIT
    for k, one in enumerate(told):
        own = 10 + STAYING + k * (COUNT - STAYING)
        columns = [*range(10 + STAYING), *range(own, own + COUNT - STAYING)]
        information[np.ix_(columns, columns)] += one.design.T @ one.design
        pull[columns] += one.design.T @ one.reading
    if scale is not None:
        information[0, 0] += (UNIT[0] / scale.std) ** 2
        pull[0] += (UNIT[0] / scale.std) ** 2 * scale.mass / UNIT[0]
    inverse = np.linalg.inv(information)
    return (inverse @ pull)[:10] * UNIT, inverse[:10, :10] * np.outer(UNIT, UNIT)


@pytest.mark.parametrize("scale", [None, Weighing(1100.3, 0.5)])
@pytest.mark.parametrize("sessions", [1, 2, 4])
def test_it_is_the_joint_fit_of_all_recordings(scale: Weighing | None, sessions: int) -> None:
    rng = np.random.default_rng(sessions)
    shared = rng.standard_normal(STAYING)
    told = [
        record(h, np.concatenate([shared, rng.standard_normal(COUNT - STAYING)]), rng)
        for h in designs(rng, sessions)
    ]
    fused = fuse([answer(f"s{k}", one, weighing=scale) for k, one in enumerate(told)], EXACT)
    values, covariance = joint_fit(told, scale)
    std = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(fused.total.values / std, values / std, atol=1e-4)
    np.testing.assert_allclose(np.sqrt(np.diag(fused.total.covariance)), std, rtol=1e-5)
    assert fused.total.unobservable == ()


def test_the_order_of_the_sessions_does_not_matter() -> None:
    rng = np.random.default_rng(5)
    told = [
        answer(f"s{k}", record(h, rng.standard_normal(COUNT), rng)) for k, h in enumerate(designs(rng, 3))
    ]
    one, other = fuse(told), fuse(told[::-1])
    std = np.sqrt(np.diag(one.total.covariance))
    np.testing.assert_allclose(one.total.values / std, other.total.values / std, atol=1e-5)


def test_a_shared_error_does_not_average_away() -> None:
    """The mass rests on a gain alone: a hundred sessions of one rig know it no better than that gain."""
    rng = np.random.default_rng(6)
    design = np.zeros((40, 10 + COUNT))
    design[:, :10] = rng.standard_normal((40, 10))
    gain = 2
    design[:, 10 + gain] = 3.0 * design[:, 0]  # a tolerance of the gain is 3 kg
    told = [answer(f"s{k}", record(design, np.zeros(COUNT), rng)) for k in range(20)]
    apart = Sharing(rigs=tuple(f"rig {k}" for k in range(20)))
    assert np.sqrt(fuse(told, EXACT).total.covariance[0, 0]) > 3.0
    assert np.sqrt(fuse(told, apart).total.covariance[0, 0]) < 0.8


def test_what_no_pose_determines_alone_two_may_together() -> None:
    """The first session tells the sum of two numbers, the second their difference."""
    rng = np.random.default_rng(7)
    both = []
    for sign in (1.0, -1.0):
        design = np.zeros((40, 10 + COUNT))
        design[:, :10] = rng.standard_normal((40, 10))
        design[:, 5] = sign * design[:, 4]  # Jxx and Jxy come together
        both.append(answer(f"s{sign}", record(design, np.zeros(COUNT), rng), lost=("Jxx", "Jxy")))
    fused = fuse(both)
    assert fused.total.unobservable == ()
    off = (fused.total.values - BODY) / np.sqrt(np.diag(fused.total.covariance))
    assert np.max(np.abs(off)) < 4.0
    assert set(fuse([both[0], replace(both[0], name="again")]).total.unobservable) == {"Jxx", "Jxy"}


def test_errors_of_unknown_make_up_never_average_away_on_one_rig() -> None:
    """Two results without joint information, of one rig or not: nobody knows, so nothing is gained."""
    rng = np.random.default_rng(8)
    h = designs(rng, 1)[0]
    alone = replace(answer("a", record(h, np.zeros(COUNT), rng)), joint=None)
    fused = fuse([alone, replace(alone, name="b")])
    np.testing.assert_allclose(fused.total.covariance, alone.estimate.covariance, rtol=1e-6)
    np.testing.assert_allclose(fused.total.values, alone.estimate.values, rtol=1e-9)


def test_rivals_widen_the_fused_interval_as_they_widen_the_sessions() -> None:
    """An answer four times as wide as its fit: of two such on one rig only the fit's part averages."""
    rng = np.random.default_rng(9)
    told = [
        answer(f"s{k}", record(h, np.zeros(COUNT), rng), loose=16.0) for k, h in enumerate(designs(rng, 2))
    ]
    fused = np.sqrt(np.diag(fuse(told).total.covariance))
    sharp = np.sqrt(
        np.diag(
            fuse(
                [replace(r, estimate=replace(r.estimate, covariance=r.posterior[:10, :10])) for r in told]
            ).total.covariance
        )
    )
    assert np.all(fused > 3.0 * sharp)
    apart = Sharing(rigs=("one", "two"))
    assert np.all(np.sqrt(np.diag(fuse(told, apart).total.covariance)) < fused)


def test_another_carrying_frame_is_refused() -> None:
    rng = np.random.default_rng(10)
    h = designs(rng, 1)[0]
    frame = CarryingFrame(168.0, np.array([1.9, 1.0, 0.9]), np.diag([90.0, 210.0, 260.0]))
    one = answer("a", record(h, np.zeros(COUNT), rng), frame=frame)
    other = answer("b", record(h, np.zeros(COUNT), rng), frame=replace(frame, mass=170.0))
    with pytest.raises(InputError, match="another carrying frame than a"):
        fuse([one, other])
    alone = fuse([one, replace(one, name="b")]).without_frame
    assert alone is not None
    assert alone.values[0] == pytest.approx(one.values[0] - 168.0, abs=3.0)


def test_sessions_of_two_rigs_share_nothing_but_what_is_carried() -> None:
    rng = np.random.default_rng(11)
    elsewhere = {cable: point + 5.0 for cable, point in CEILING.items()}
    h = designs(rng, 1)[0]
    one = answer("a", record(h, np.zeros(COUNT), rng))
    other = answer("b", record(h, np.zeros(COUNT), rng), ceiling=elsewhere)
    assert fuse([one, other]).comparison.rigs == ("rig 1", "rig 2")
    assert fuse([one, other]).comparison.shared == 0
    assert fuse([one, other], Sharing(carried=("imu",))).comparison.shared == 1
