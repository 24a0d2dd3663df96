"""When messages were sent: by what the middleware stamped, on the reader's clock, however late they came."""

from __future__ import annotations

import numpy as np
import pytest

from rig_identification.live.sending_clock import HORIZON, SLOT, SendingClock
from rig_identification.live.stamp_gate import SECOND

START = 1_700_000_000 * SECOND


def sent(count: int, rate: float = 100.0, start: float = 0.0) -> np.ndarray:
    """(count,) ns, sender's clock."""
    return START + np.round((start + np.arange(count) / rate) * SECOND).astype(np.int64)


@pytest.mark.parametrize("difference", [0.0, 7.5, -3.0, 4000.0])
def test_what_was_held_back_is_told_by_when_it_was_sent(difference: float) -> None:
    """The sender's clock may be off by anything; the shortest way of 1 ms counts as none."""
    clock = SendingClock()
    source = sent(1000)
    on_time = source - round(difference * SECOND) + SECOND // 1000
    received = on_time.copy()
    received[500:900] = on_time[900]  # four seconds at once
    told = [clock.times(source[a : a + 50], received[a : a + 50]) for a in range(0, 1000, 50)]
    np.testing.assert_array_equal(np.concatenate(told), on_time)


def test_a_clock_that_is_set_is_followed() -> None:
    """Set back, the sender seems late for as long as the least is remembered; set on, at once."""
    clock = SendingClock()
    for shift in (10, -10):
        source = sent(100 * (HORIZON + 2 * SLOT))
        received = source + shift * SECOND
        told = np.concatenate(
            [clock.times(source[a : a + 50], received[a : a + 50]) for a in range(0, source.size, 50)]
        )
        np.testing.assert_array_equal(told[-100:], received[-100:])


def test_without_stamps_a_message_was_sent_when_it_came() -> None:
    clock = SendingClock()
    received = sent(5)
    np.testing.assert_array_equal(clock.times(np.zeros(5, np.int64), received), received)
    assert clock.times(np.zeros(0, np.int64), np.zeros(0, np.int64)).size == 0
