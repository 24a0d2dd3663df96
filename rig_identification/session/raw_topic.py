"""Serialized messages of one topic, gathered piece by piece into arrays of equal length."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class MessageBlock:
    """Messages of equal length from one topic."""

    index: Integers  # (n,) place of each among the topic's messages, in the order of the file
    data: Bytes  # (n, length)


@dataclass(frozen=True)
class RawTopic:
    """All serialized messages of one topic."""

    name: str
    message_type: str
    received_ns: Integers  # (n,) receive times, in the order of the file
    blocks: tuple[MessageBlock, ...]  # one for each length of message

    @property
    def count(self) -> int:
        """Number of messages."""
        return len(self.received_ns)


def by_value(numbers: Integers) -> list[tuple[int, Integers]]:
    """Each distinct number with the places where it stands, in their order; mostly there is one number."""
    if not len(numbers):
        return []
    if numbers.min() == numbers.max():
        return [(int(numbers[0]), np.arange(len(numbers), dtype=np.int64))]
    order = np.argsort(numbers, kind="stable")
    ends = np.flatnonzero(np.diff(numbers[order])) + 1
    return [(int(numbers[places[0]]), places) for places in np.split(order, ends)]


def slices(buffer: Bytes, starts: Integers, length: int) -> Bytes:
    """(n, length) copies of ``buffer[start : start + length]``."""
    return np.lib.stride_tricks.sliding_window_view(buffer, length)[starts]


class Collector:
    """Gathers messages by topic and length, in the order of the file."""

    def __init__(self) -> None:
        self.counts: dict[str, int] = defaultdict(int)
        self._received: dict[str, list[Integers]] = defaultdict(list)
        self._pieces: dict[str, dict[int, list[MessageBlock]]] = defaultdict(lambda: defaultdict(list))

    def add(self, topic: str, received_ns: ArrayLike, messages: Sequence[bytes]) -> None:
        """Add ``messages``."""
        lengths = np.fromiter(map(len, messages), np.int64, len(messages))
        for length, chosen in by_value(lengths):
            joined = b"".join([messages[i] for i in chosen.tolist()])
            self._append(topic, chosen, np.frombuffer(joined, np.uint8).reshape(len(chosen), length))
        self._advance(topic, received_ns)

    def add_slices(
        self, topic: str, received_ns: ArrayLike, buffer: Bytes, starts: ArrayLike, ends: ArrayLike
    ) -> None:
        """Add the messages ``buffer[start:end]``."""
        first, behind = np.asarray(starts), np.asarray(ends)
        lengths = behind - first
        for length, chosen in by_value(lengths):
            self._append(topic, chosen, slices(buffer, first[chosen], length))
        self._advance(topic, received_ns)

    def take(self, name: str, message_type: str) -> RawTopic:
        """All that was gathered of one topic; its pieces are given up."""
        by_length = self._pieces.pop(name, {})
        blocks = []
        for length in list(by_length):
            pieces = by_length.pop(length)
            index = np.concatenate([piece.index for piece in pieces])
            blocks.append(MessageBlock(index, np.concatenate([piece.data for piece in pieces])))
        received = self._received.pop(name, [])
        return RawTopic(name, message_type, np.concatenate([np.zeros(0, np.int64), *received]), tuple(blocks))

    def _append(self, topic: str, chosen: Integers, data: Bytes) -> None:
        self._pieces[topic][data.shape[1]].append(MessageBlock(chosen + self.counts[topic], data))

    def _advance(self, topic: str, received_ns: ArrayLike) -> None:
        received = np.asarray(received_ns, np.int64)
        self._received[topic].append(received)
        self.counts[topic] += len(received)
