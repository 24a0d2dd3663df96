"""A subscription that no executor serves: its messages wait in the middleware until they are taken."""

from __future__ import annotations

import time
from typing import NamedTuple

from rclpy.subscription import Subscription


class Taken(NamedTuple):
    """A serialized message with the middleware's stamps: system clocks of its publisher and of its reader."""

    message: bytes
    source_ns: int  # 0: the middleware gives none
    received_ns: int


class ByHand:
    """Takes what an executor would, by the same call."""

    def __init__(self, subscription: Subscription) -> None:
        self.subscription = subscription

    def take(self) -> list[Taken]:
        """What waits, in order."""
        subscription, taken = self.subscription, []
        with subscription.handle:
            while (
                got := subscription.handle.take_message(subscription.msg_type, subscription.raw)
            ) is not None:
                message, info = got
                received = info["received_timestamp"] or time.time_ns()
                taken.append(Taken(message, info["source_timestamp"] or 0, received))
        return taken
