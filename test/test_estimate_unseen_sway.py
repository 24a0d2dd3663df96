"""What a device that measures a turn alone may read of a swing beside, and how that is integrated out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_estimate_only_turns import PERIOD, TIME, run_of, session
from test_model_rigs import bifilar, trifilar

from rig_identification.estimate.evidence import LONGEST_NODE_STEP, WATCHED_NODE_STEP, prepare
from rig_identification.estimate.swing_period import swing_period
from rig_identification.estimate.unseen_sway import likeliest_sway, one_turn, sway_shapes, without_sway
from rig_identification.estimate.unseen_swing import SWING
from rig_identification.recording import Series
from rig_identification.rig import Rig


def hung(rig: Rig) -> Rig:
    """The rig with vertical threads of one length."""
    length = rig.cables[0].length
    return replace(
        rig, cables=tuple(replace(c, ceiling_point=c.body_point, length=length) for c in rig.cables)
    )


@pytest.mark.parametrize("rig", [hung(bifilar().rig), hung(trifilar().rig)])
def test_the_shapes_are_the_swing_and_its_share_of_the_turn(rig: Rig) -> None:
    run = run_of(session(rig))
    assert one_turn(run)
    (channel,) = run.channels
    time = run.grid.step * np.arange(run.grid.nodes)
    rate = 2.0 * np.pi / PERIOD
    angle = 0.2 * np.cos(rate * channel.time)
    turned = replace(channel, quantity="orientation", values=angle[:, None])
    shapes = sway_shapes(rig, replace(run, channels=(turned,)), turned)
    rates = sway_shapes(rig, run, replace(channel, values=-0.2 * rate * np.sin(rate * channel.time)[:, None]))
    assert shapes is not None
    assert rates is not None
    swing = np.sqrt(rig.gravity / rig.cables[0].length)
    inside = slice(20, -20)
    wanted = SWING * 0.2 * np.cos(rate * time) * np.cos(swing * time)
    assert shapes[inside, 2] == pytest.approx(wanted[inside], abs=0.02 * SWING)
    # A gyroscope reads the rate of the same
    same = (shapes[2:] - shapes[:-2]) / (2.0 * run.grid.step)
    assert rates[1:-1][inside] == pytest.approx(same[inside, :5], abs=0.05 * SWING)


def test_a_camera_reads_its_rows_one_after_the_other() -> None:
    """A marker that turns and swings up the picture is read earlier: at another turn."""
    rig = hung(trifilar().rig)
    run = run_of(session(rig))
    (channel,) = run.channels
    rate, swing = 2.0 * np.pi / PERIOD, np.sqrt(rig.gravity / rig.cables[0].length)

    def turned(time: np.ndarray) -> np.ndarray:
        return np.asarray(0.2 * np.exp(-0.01 * time) * np.cos(rate * time + 0.4))

    def late(time: np.ndarray) -> np.ndarray:
        return np.asarray(0.012 * turned(time) + 0.002 * np.cos(swing * time + 1.0))

    # Samples that do not lie on the nodes
    seen = turned(channel.time + late(channel.time))
    camera = replace(channel, quantity="orientation", values=seen[:, None])
    shapes = sway_shapes(rig, replace(run, channels=(camera,)), camera)
    assert shapes is not None
    assert shapes.shape[1] == 8
    time = run.grid.step * np.arange(run.grid.nodes)
    inside = slice(20, -20)
    left = (turned(time + late(time)) - turned(time))[inside]

    def beyond(columns: np.ndarray) -> float:
        fitted = columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
        return float(np.std(left - fitted) / np.std(left))

    assert beyond(shapes[inside]) < 0.05
    assert beyond(shapes[inside, :5]) > 0.5
    # A gyroscope has no rows
    rates = sway_shapes(rig, run, channel)
    assert rates is not None
    assert rates.shape[1] == 5


def test_where_more_is_measured_nothing_is_taken_out() -> None:
    rig = hung(bifilar().rig)
    whole = np.zeros((TIME.size, 7))
    whole[:, 6] = 1.0
    whole[:, 0] = 0.01 * np.cos(2.0 * TIME)
    run = run_of(session(rig, mocap=Series(TIME, whole)))
    assert not one_turn(run)
    assert sway_shapes(rig, run, run.channels[0]) is None
    splayed = replace(rig.cables[0], ceiling_point=rig.cables[0].ceiling_point + np.array([0.0, 0.8, 0.0]))
    askew = replace(rig, cables=(splayed, *rig.cables[1:]))
    assert sway_shapes(askew, run_of(session(rig)), run_of(session(rig)).channels[0]) is None


def test_whitening_is_the_root_of_the_covariance() -> None:
    rng = np.random.default_rng(3)
    seen = rng.normal(size=(40, 4)) * [3.0, 1.0, 0.1, 10.0]
    columns = np.eye(40)
    log_spread = without_sway(seen, columns)
    covariance = np.eye(40) + seen @ seen.T
    assert columns.T @ columns == pytest.approx(np.linalg.inv(covariance), abs=1e-9)
    assert log_spread == pytest.approx(0.5 * np.linalg.slogdet(covariance)[1])


def test_amounts_are_believed_as_far_as_the_samples_tell() -> None:
    rng = np.random.default_rng(4)
    seen = 10.0 * rng.normal(size=(200, 4))
    amounts = np.array([1.0, -0.5, 0.2, 2.0])
    assert likeliest_sway(seen, seen @ amounts) == pytest.approx(amounts, rel=1e-3)
    assert likeliest_sway(1e-6 * seen, rng.normal(size=200)) == pytest.approx(0.0, abs=1e-3)


def test_nodes_are_as_wide_as_one_slow_turn_allows() -> None:
    one = session(hung(bifilar().rig))
    run = prepare(one.rig, one.recordings[0])
    assert run.grid.step == pytest.approx(PERIOD / 64.0, rel=0.05)
    assert WATCHED_NODE_STEP <= run.grid.step <= LONGEST_NODE_STEP
    assert swing_period(run) == pytest.approx(PERIOD, rel=0.01)
