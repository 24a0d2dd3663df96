"""An answer that nobody heard is sent again, for a while."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from rig_identification.nodes.deferred import AGAIN, GIVEN_UP, send_until_heard


class Wire:
    """Warns like the middleware until ``deaf`` answers were sent; time passes only when asked to."""

    def __init__(self, deaf: float) -> None:
        self.deaf, self.sent = deaf, 0
        self.waiting: list[tuple[float, Callable[[], None]]] = []

    def send(self) -> None:
        self.sent += 1
        if self.sent <= self.deaf:
            warnings.warn("failed to send response (timeout): client will not receive", RuntimeWarning, 1)

    def after(self, seconds: float, work: Callable[[], None]) -> None:
        self.waiting.append((seconds, work))

    def run(self) -> float:
        passed = 0.0
        send_until_heard(self.send, self.after)
        while self.waiting:
            seconds, work = self.waiting.pop()
            passed += seconds
            work()
        return passed


def test_an_answer_that_arrives_is_sent_once() -> None:
    wire = Wire(deaf=0)
    assert (wire.run(), wire.sent) == (0.0, 1)


def test_an_answer_that_nobody_heard_is_sent_again() -> None:
    wire = Wire(deaf=3)
    assert (wire.run(), wire.sent) == (pytest.approx(3 * AGAIN), 4)


def test_an_answer_that_nobody_ever_hears_is_given_up() -> None:
    wire = Wire(deaf=float("inf"))
    assert wire.run() == pytest.approx(GIVEN_UP)
