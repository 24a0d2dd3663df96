"""Which stamps of a topic form one consistent clock, and what was wrong with the others."""

from __future__ import annotations

from bisect import bisect_left, insort
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Stamps = NDArray[np.int64]
Indices = NDArray[np.int64]

_SECOND = 1_000_000_000
#: Receive times may jitter this much against stamps before a clock is taken to have stepped.
_RECEIVE_JITTER = _SECOND
#: A pause that receive times tell of as well is one up to here. Where both clocks say more, the clock of the
#: whole machine was set, as one without a battery is once it finds a network.
_LONGEST_PAUSE = 3600 * _SECOND
#: A late message is put back in its place only where there is room for it, in median intervals.
_ROOM = 0.6


@dataclass(frozen=True)
class StampSelection:
    """Messages with usable stamps, and counts of the others."""

    kept: Indices  # (m,) indices of messages, stamps strictly increasing
    duplicated: int
    backward: int
    notes: tuple[str, ...] = ()


def select_stamps(stamp_ns: Stamps, received_ns: Stamps) -> StampSelection:
    """Choose the messages whose stamps are one device's clock running forwards.

    Zero stamps and stamps far from the others go first. What is left falls into pieces where the stamps jump:
    the longest piece stays, and others where they precede or follow it on the same clock. Inside a piece the
    longest increasing run of stamps stays, and late messages that fit into a gap of it.

    Parameters
    ----------
    stamp_ns, received_ns : (n,) int64
        ``header.stamp`` and receive time of each message, in the order of the file.
    """
    valid = np.flatnonzero(stamp_ns > 0)
    zero = len(stamp_ns) - len(valid)
    near = _near(stamp_ns[valid], received_ns[valid])
    chosen = valid[near]
    notes = []
    if zero:
        notes.append(f"{zero} stamps are zero: left out")
    if far := int(np.count_nonzero(~near)):
        notes.append(f"{far} stamps lie far from the others: left out")
    stamps, received = stamp_ns[chosen], received_ns[chosen]
    pieces = _pieces(stamps, received)
    main = _kept_pieces(pieces, stamps, received)
    if lost := _restart(pieces, main):
        notes.append(f"the clock jumped: {lost} messages on another clock are left out")
    runs = [_increasing(stamps, *piece) for piece in main]
    ordered = [_with_late(stamps, run, *piece) for run, piece in zip(runs, main, strict=True)]
    kept = np.concatenate([np.zeros(0, np.int64), *ordered])
    if late := len(kept) - sum(map(len, runs)):
        notes.append(f"{late} messages came late and were put back in their place")
    duplicated = sum(_repeated(stamps, kept, *piece) for piece in main)
    backward = len(stamps) - len(kept) - duplicated + late
    return StampSelection(chosen[kept], duplicated, backward, tuple(notes))


def _median_interval(stamps: Stamps) -> float:
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else 0.0


def _near(stamps: Stamps, received: Stamps) -> NDArray[np.bool_]:
    """Stamps within reach of the median one: twice the recording's length and a minute.

    Its length is what its messages fill, or what receive times say, pauses included.
    """
    if not len(stamps):
        return np.zeros(0, bool)
    filled = len(stamps) * _median_interval(np.sort(stamps, kind="stable"))
    span = max(filled, min(float(np.ptp(received)), filled + _LONGEST_PAUSE))
    middle = np.partition(stamps, len(stamps) // 2)[len(stamps) // 2]
    return np.asarray(np.abs(stamps - middle) <= 2.0 * span + 60.0 * _SECOND)


def _receive_usable(stamps: Stamps, received: Stamps) -> bool:
    """Receive times that run along with the stamps; a converter may have written anything."""
    return (
        bool(np.ptp(received) >= 0.5 * len(stamps) * _median_interval(stamps)) if len(stamps) > 1 else False
    )


def _pieces(stamps: Stamps, received: Stamps) -> list[tuple[int, int]]:
    """Ranges of messages between long steps of the stamps; a gap makes two pieces that both stay."""
    if not len(stamps):
        return []
    steps = np.diff(stamps)
    interval = _median_interval(stamps)
    jump = np.abs(steps) > max(20.0 * interval, 0.1 * _SECOND)
    if _receive_usable(stamps, received):
        jump |= np.abs(steps - np.diff(received)) > np.maximum(_RECEIVE_JITTER, 0.5 * np.abs(steps))
    cuts = [0, *(np.flatnonzero(jump) + 1).tolist(), len(stamps)]
    return list(pairwise(cuts))


def _kept_pieces(pieces: list[tuple[int, int]], stamps: Stamps, received: Stamps) -> list[tuple[int, int]]:
    """The longest piece and those that lie before or after it by file order, by stamp and on its clock."""
    if len(pieces) < 2:
        return pieces
    bounds = {piece: (int(stamps[slice(*piece)].min()), int(stamps[slice(*piece)].max())) for piece in pieces}
    offset = {piece: float(np.median(stamps[slice(*piece)] - received[slice(*piece)])) for piece in pieces}
    longest = min(pieces, key=lambda piece: piece[0] - piece[1])
    by_length = sorted(pieces, key=lambda piece: (piece[0] - piece[1], abs(offset[piece] - offset[longest])))
    compare_clocks = _receive_usable(stamps[slice(*longest)], received[slice(*longest)])
    kept = [longest]
    for piece in by_length:
        if piece == longest:
            continue
        place = bisect_left(kept, piece)
        after_previous = place == 0 or bounds[kept[place - 1]][1] < bounds[piece][0]
        before_next = place == len(kept) or bounds[piece][1] < bounds[kept[place]][0]
        same_clock = not compare_clocks or abs(offset[piece] - offset[longest]) <= _RECEIVE_JITTER
        if after_previous and before_next and same_clock:
            insort(kept, piece)
    return kept


def _restart(pieces: list[tuple[int, int]], kept: list[tuple[int, int]]) -> int:
    """Messages in left-out pieces too long to be single bad stamps."""
    return sum(end - start for start, end in set(pieces) - set(kept) if end - start >= 10)


def _increasing(stamps: Stamps, start: int, end: int) -> Indices:
    """Longest strictly increasing subsequence of ``stamps[start:end]`` (patience sorting), as indices."""
    if np.all(np.diff(stamps[start:end]) > 0):
        return np.arange(start, end)
    tails: list[int] = []
    tail_indices: list[int] = []
    before = np.full(end - start, -1, np.int64)
    for index, stamp in enumerate(stamps[start:end].tolist()):
        place = bisect_left(tails, stamp)
        if place == len(tails):
            tails.append(stamp)
            tail_indices.append(index)
        elif tails[place] == stamp:
            continue  # of equal stamps the first stays
        else:
            tails[place], tail_indices[place] = stamp, index
        before[index] = tail_indices[place - 1] if place else -1
    chain = np.empty(len(tails), np.int64)
    index = tail_indices[-1]
    for place in range(len(tails) - 1, -1, -1):
        chain[place], index = index, before[index]
    return start + chain


def _with_late(stamps: Stamps, run: Indices, start: int, end: int) -> Indices:
    """The increasing run of a piece with late messages put back where there is room."""
    if len(run) == end - start:
        return run
    late = np.setdiff1d(np.arange(start, end), run)
    late = late[np.sort(np.unique(stamps[late], return_index=True)[1])]
    room = _ROOM * _median_interval(np.sort(stamps[start:end]))
    following = np.searchsorted(stamps[run], stamps[late])
    left = stamps[run[np.maximum(following - 1, 0)]]
    right = stamps[run[np.minimum(following, len(run) - 1)]]
    far_left = (following == 0) | (stamps[late] - left > room)
    far_right = (following == len(run)) | (right - stamps[late] > room)
    merged = np.concatenate((run, late[far_left & far_right]))
    return merged[np.argsort(stamps[merged], kind="stable")]


def _repeated(stamps: Stamps, kept: Indices, start: int, end: int) -> int:
    """Messages of a piece left out because another with the same stamp stays."""
    inside = kept[(kept >= start) & (kept < end)]
    if len(inside) == end - start:
        return 0
    left_out = np.setdiff1d(np.arange(start, end), inside)
    return int(np.count_nonzero(np.isin(stamps[left_out], stamps[inside])))
