"""Streams of several devices brought to common instants while they come in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


class CommonTime:
    """Holds samples of named streams until every stream that is alive has passed an instant.

    Parameters
    ----------
    widths : mapping
        Stream name to the width of a sample.
    longest : float
        s of samples that are held at most; older instants are given up.
    """

    def __init__(self, widths: dict[str, int], longest: float = 2.0) -> None:
        self._longest_ns = round(1e9 * longest)
        self._stamps = {name: np.zeros(0, np.int64) for name in widths}
        self._values = {name: np.zeros((0, width)) for name, width in widths.items()}
        self.given_up = 0  # instants that a silent or broken stream left without a value

    def add(self, name: str, stamp_ns: Stamps, values: Array) -> None:
        """Samples with ascending stamps; what does not ascend starts the stream anew."""
        held = self._stamps[name]
        if len(held) and len(stamp_ns) and stamp_ns[0] <= held[-1]:
            held, self._values[name] = held[:0], self._values[name][:0]
        self._stamps[name] = np.concatenate([held, stamp_ns])
        self._values[name] = np.concatenate([self._values[name], values])

    def take(self, lead: str, longest_bridge: float = 0.05) -> tuple[Stamps, dict[str, Array]]:
        """Instants of stream ``lead`` that all streams have passed, and every stream's value at each.

        Straight lines between samples; an instant inside a gap longer than ``longest_bridge`` s is given up.
        """
        instants = self._stamps[lead]
        ends = [stamps[-1] if len(stamps) else 0 for stamps in self._stamps.values()]
        newest = max(ends)
        ready = instants <= min(ends)
        late = instants < newest - self._longest_ns
        self.given_up += int(np.count_nonzero(late & ~ready))
        chosen = instants[ready]
        values, usable = {}, np.ones(len(chosen), bool)
        for name in self._stamps:
            values[name], bridged = self._at(name, chosen, longest_bridge)
            usable &= bridged
        self.given_up += int(np.count_nonzero(~usable))
        self._forget(lead, ready | late, newest)
        return chosen[usable], {name: value[usable] for name, value in values.items()}

    def _at(self, name: str, instants: Stamps, longest_bridge: float) -> tuple[Array, NDArray[np.bool_]]:
        stamps, values = self._stamps[name], self._values[name]
        if not len(instants) or not len(stamps):
            return np.zeros((len(instants), values.shape[1])), np.zeros(len(instants), bool)
        right = np.clip(np.searchsorted(stamps, instants), 0, len(stamps) - 1)
        left = np.where(stamps[right] > instants, np.maximum(right - 1, 0), right)
        span = stamps[right] - stamps[left]
        inside = (stamps[left] <= instants) & (span <= 1e9 * longest_bridge)
        weight = np.where(span > 0, (instants - stamps[left]) / np.maximum(span, 1), 0.0)[:, None]
        return (1.0 - weight) * values[left] + weight * values[right], inside

    def _forget(self, lead: str, done: NDArray[np.bool_], newest: int) -> None:
        kept = ~done
        self._stamps[lead], self._values[lead] = self._stamps[lead][kept], self._values[lead][kept]
        waiting = self._stamps[lead]
        oldest = (waiting[0] if len(waiting) else newest) - 100_000_000
        for name in self._stamps:
            if name != lead:
                behind = np.searchsorted(self._stamps[name], max(oldest, newest - self._longest_ns))
                self._stamps[name], self._values[name] = (
                    self._stamps[name][behind:],
                    self._values[name][behind:],
                )
