"""A rig's memory: the filter is exact where everything is linear, honest, and sees what moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from several_worlds import BODY, NAMES, STAYING, UNIT, Recordings, answer, designs, record

from rig_identification.several.compare import LEVEL
from rig_identification.several.memory import Memory, learned, recalled
from rig_identification.several.session_result import SessionResult
from rig_identification.several.ties import Sharing

COUNT = len(NAMES)
#: So rare that nothing is said to have moved.
NEVER = 1e-12
RIGID, WALKING = Sharing(rigs=("rig",), new=0.0), Sharing(rigs=("rig",), new=0.1)


def told_by(told: list[SessionResult], sharing: Sharing = RIGID, level: float = LEVEL) -> Memory:
    return learned(told, replace(sharing, rigs=("rig",) * len(told)), level)


def sessions(
    rng: np.random.Generator, count: int, shared: np.ndarray, walk: float = 0.0
) -> tuple[list[SessionResult], list[Recordings], np.ndarray]:
    """Sessions of other bodies on one rig, what they recorded, and where the rig is in the end."""
    out, recorded = [], []
    for k, h in enumerate(designs(rng, count)):
        shared = shared + walk * rng.standard_normal(STAYING)
        doubts = np.concatenate([shared, rng.standard_normal(COUNT - STAYING)])
        recorded.append(record(h, doubts, rng, BODY + 5.0 * UNIT * rng.standard_normal(10)))
        out.append(answer(f"s{k}", recorded[-1]))
    return out, recorded, shared


def test_it_is_the_fit_of_all_sessions_with_a_body_each() -> None:
    """One least-squares fit of shared doubts, and of each session's own body and doubts."""
    rng = np.random.default_rng(0)
    told, recorded, _ = sessions(rng, 4, rng.standard_normal(STAYING))
    own = 10 + COUNT - STAYING
    size = STAYING + own * len(told)
    information, pull = np.eye(size), np.zeros(size)
    for k, one in enumerate(recorded):
        first = STAYING + own * k
        information[first : first + 10, first : first + 10] = 1e-8 * np.eye(10)
        pull[first : first + 10] = 1e-8 * BODY / UNIT
        columns = [*range(first, first + 10), *range(STAYING), *range(first + 10, first + own)]
        information[np.ix_(columns, columns)] += one.design.T @ one.design
        pull[columns] += one.design.T @ one.reading
    inverse = np.linalg.inv(information)
    memory = told_by(told, level=NEVER)
    staying = [k for k, d in enumerate(memory.doubts) if d.name in {n[0] for n in NAMES[:STAYING]}]
    mean = np.array([memory.doubts[k].at for k in staying])
    np.testing.assert_allclose(mean, (inverse @ pull)[:STAYING], atol=1e-5)
    covariance = memory.covariance[np.ix_(staying, staying)]
    np.testing.assert_allclose(covariance, inverse[:STAYING, :STAYING], atol=1e-6)


def test_no_memory_changes_nothing() -> None:
    rng = np.random.default_rng(1)
    one = sessions(rng, 1, np.zeros(STAYING))[0][0]
    total = recalled(one, told_by([]), RIGID)
    std = np.sqrt(np.diag(one.estimate.covariance))
    np.testing.assert_allclose((total.values - one.values) / std, 0.0, atol=1e-5)
    np.testing.assert_allclose(np.diag(total.covariance), std**2, rtol=1e-5)


@pytest.mark.parametrize("walk", [0.0, 0.1])
def test_what_is_recalled_is_narrower_and_as_honest(walk: float) -> None:
    rng = np.random.default_rng(2)
    errors, ratios = [], []
    for _ in range(30):
        told, _, rig = sessions(rng, 5, rng.standard_normal(STAYING), walk)
        h = designs(rng, 1)[0]
        rig = rig + walk * rng.standard_normal(STAYING)
        new = answer("new", record(h, np.concatenate([rig, rng.standard_normal(2)]), rng))
        sharing = WALKING if walk else RIGID
        total = recalled(new, told_by(told, sharing), sharing)
        std = np.sqrt(np.diag(total.covariance))
        errors.append((total.values - BODY) / std)
        ratios.append(std / np.sqrt(np.diag(new.estimate.covariance)))
    assert np.max(ratios) < 1.0
    assert np.median(ratios) < 0.96
    assert np.mean(np.square(errors)) == pytest.approx(1.0, abs=0.35)


def test_what_walks_is_known_less_than_what_stands() -> None:
    rng = np.random.default_rng(3)
    told, _, _ = sessions(rng, 6, np.zeros(STAYING))
    assert np.all(told_by(told, WALKING).std >= told_by(told).std)


def test_a_part_that_moved_is_named_in_one_session() -> None:
    rng = np.random.default_rng(4)
    told, _, _ = sessions(rng, 6, np.zeros(STAYING))
    moved = np.array([4.0, 0.0, 0.0, 0.0])  # 2 mm of a hinge
    new = answer("new", record(designs(rng, 1)[0], np.concatenate([moved, np.zeros(2)]), rng))
    found = told_by([*told, new]).moved
    assert [(m.session, m.part) for m in found] == [("new", "cable_1.ceiling_point")]
    shift, std = found[0].shift["cable_1.ceiling_point.x"]
    assert abs(shift - 2e-3) < 4.0 * std
    # From there on it is believed
    again = answer("again", record(designs(rng, 1)[0], np.concatenate([moved, np.zeros(2)]), rng))
    assert [m.session for m in told_by([*told, new, again]).moved] == ["new"]


def test_alarms_are_as_rare_as_asked_for() -> None:
    rng = np.random.default_rng(5)
    count = 0
    for _ in range(40):
        told, _, _ = sessions(rng, 4, rng.standard_normal(STAYING))
        count += len(learned(told, replace(RIGID, rigs=("rig",) * 4), level=0.05).moved)
    rate = count / 160
    assert rate <= 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / 160)


def test_a_session_of_unknown_make_up_teaches_nothing() -> None:
    rng = np.random.default_rng(6)
    one = replace(sessions(rng, 1, np.zeros(STAYING))[0][0], joint=None)
    assert told_by([one]).sessions == ()
    assert recalled(one, told_by([]), RIGID) is one.estimate
