"""Work of an answer: counted, the same on any machine, and what ends at its limit."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from rig_identification.estimate import side_by_side
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.model import work
from rig_identification.model.work import BEYOND


def test_a_budget_counts_what_is_computed_after_it_was_made() -> None:
    with work.counted():
        work.add(5 * work.UNIT)
        budget = Budget(10.0)
        work.add(4 * work.UNIT)
        assert budget.used == 4.0
        assert not budget.spent()
        work.add(6 * work.UNIT)
        assert budget.spent()
        assert not budget.late()
        work.add(round(10.0 * BEYOND) * work.UNIT + work.UNIT)
        assert budget.late()
    assert Budget(0.0).spent()
    assert not UNLIMITED.late()


def test_one_answer_counts_nothing_of_another() -> None:
    with work.counted() as first:
        work.add(3)
        with work.counted() as second:
            work.add(7)
        work.add(1)
    work.add(100)
    assert (first.done, second.done) == (4, 7)
    assert work.meter().done == 0


@pytest.mark.parametrize("cores", [1, 3])
def test_tasks_side_by_side_count_for_whoever_put_them_there(
    cores: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(side_by_side, "cores", lambda: cores)

    def task(amount: int) -> int:
        # Tasks within tasks count as well
        side_by_side.side_by_side(work.add, [amount, 1])
        return amount

    with work.counted() as meter:
        assert side_by_side.side_by_side(task, range(50)) == list(range(50))
    assert meter.done == sum(range(50)) + 50


def test_two_answers_at_once_keep_apart() -> None:
    def answer(amount: int) -> int:
        with work.counted() as meter:
            side_by_side.side_by_side(work.add, [amount] * 200)
            return meter.done

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(answer, [1, 2, 3, 4])) == [200, 400, 600, 800]


def test_what_is_left_untried_is_kept_once_the_work_is_done() -> None:
    with work.counted():
        budget = Budget(1.0)
        budget.leave(["early"])
        work.add(work.UNIT)
        budget.leave(["a", "b"])
        budget.leave(["b", "c"])
    assert budget.untried == ["a", "b", "c"]
