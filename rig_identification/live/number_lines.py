"""Lines of numbers as amplifiers and loggers send them, to values in SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LineFormat:
    """Which columns of a line are the channels, and how raw numbers become SI units."""

    columns: tuple[int, ...]  # index of each channel's column, from 0
    scale: Array  # (w,)
    offset: Array  # (w,) SI = scale * raw + offset
    separator: str = ","
    time_column: int | None = None  # None: a line is stamped on arrival
    time_scale: float = 1.0  # s for each unit of the time column

    def parse(self, line: str) -> tuple[float | None, Array] | None:
        """(time s or None, values (w,)) of a line; None where it is no complete line of numbers.

        A field that is no number makes its line worthless: half a line may look like a smaller number.
        """
        fields = line.strip().split(self.separator if self.separator != " " else None)
        needed = max((*self.columns, self.time_column or 0))
        if len(fields) <= needed:
            return None
        try:
            raw = np.array([float(fields[column]) for column in self.columns])
            time = None if self.time_column is None else self.time_scale * float(fields[self.time_column])
        except ValueError:
            return None
        return time, np.asarray(self.scale * raw + self.offset)


class LineBuffer:
    """Bytes of a serial line to whole lines; what was begun before the first line end is dropped."""

    def __init__(self) -> None:
        self._rest: bytes | None = None  # None: the first line end is still awaited

    def add(self, data: bytes) -> list[str]:
        """Lines that ``data`` completes."""
        if self._rest is None:
            _, end, data = data.partition(b"\n")
            if not end:
                return []
            self._rest = b""
        *whole, self._rest = (self._rest + data).split(b"\n")
        return [line.decode("ascii", errors="replace") for line in whole]
