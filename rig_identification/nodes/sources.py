"""Where a sensor node's samples come from: the simulated plant, a serial line, or a logger's file."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.live.number_lines import LineBuffer, LineFormat
from rig_identification.live.plant_blocks import DeviceSampler, PlantBlock

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


class Source(ABC):
    """Samples of one device."""

    @abstractmethod
    def take(self, now_ns: int) -> tuple[Stamps, Array]:
        """Stamps (n,) ns and values (n, w) since the last call."""

    def skip(self, now_ns: int) -> None:
        """Let go what came since the last call: nobody wants it."""
        self.take(now_ns)

    def complaint(self) -> str:
        """What is wrong at the moment; empty: nothing."""
        return ""

    def close(self) -> None:  # noqa: B027, most sources hold nothing
        """Give back what the source holds."""


@dataclass(frozen=True)
class DeviceErrors:
    """How a simulated device errs."""

    noise: Array  # (w,) standard deviation of one sample
    bias: Array  # (w,)
    gain: Array  # (w,) error of the scale, 0.01 reads 1 % high
    clock_offset: float  # s, positive: stamps are late
    time_constant: float = 0.0  # s, first-order low-pass


class SimulatedSource(Source):
    """A device on the simulated plant."""

    def __init__(
        self, rate: float, read: Callable[[Array], Array], errors: DeviceErrors, rng: np.random.Generator
    ) -> None:
        self._sampler, self._read, self._errors, self._rng = DeviceSampler(rate), read, errors, rng
        self._blocks: list[PlantBlock] = []
        self._rate = rate
        self._held: Array | None = None
        self._heard = time.monotonic()

    def add(self, block: PlantBlock) -> None:
        """The plant moved on."""
        self._blocks.append(block)
        self._heard = time.monotonic()

    def take(self, now_ns: int) -> tuple[Stamps, Array]:
        """Samples of the blocks that came."""
        _ = now_ns
        blocks, self._blocks = self._blocks, []
        sampled = [self._sampler.sample(block) for block in blocks]
        sampled = [(times, rows) for times, rows in sampled if len(times)]
        if not sampled:
            return np.zeros(0, np.int64), np.zeros((0, self._errors.noise.size))
        times = np.concatenate([t for t, _ in sampled])
        true = self._read(np.concatenate([rows for _, rows in sampled]))
        true = self._lag(true)
        noise = self._errors.noise * self._rng.standard_normal(true.shape)
        values = (1.0 + self._errors.gain) * true + self._errors.bias + noise
        return times + round(1e9 * self._errors.clock_offset), np.asarray(values)

    def _lag(self, true: Array) -> Array:
        """The device's low-pass, exact for a reading that is held between samples."""
        if self._errors.time_constant <= 0.0:
            return true
        share = 1.0 - np.exp(-1.0 / (self._rate * self._errors.time_constant))
        out = np.empty_like(true)
        for k, reading in enumerate(true):
            self._held = reading if self._held is None else self._held + share * (reading - self._held)
            out[k] = self._held
        return out

    def complaint(self) -> str:
        """The plant stands still."""
        silent = time.monotonic() - self._heard
        return f"no plant for {silent:.0f} s: is rig_simulator running?" if silent > 3.0 else ""


class SerialSource(Source):
    """Lines over a serial port, read in a thread; unplugged, the port is tried again until it is back."""

    RETRY = 0.5  # s

    def __init__(self, port: str, baud_rate: int, line_format: LineFormat, *, at_once: bool = False) -> None:
        """at_once: raise InputError where the port cannot be opened now."""
        self._port, self._baud_rate, self._format = port, baud_rate, line_format
        self._opened = self._open() if at_once else None
        self._samples: deque[tuple[int, Array]] = deque(maxlen=100_000)
        self._complaint = f"{port} is not open yet"
        self.bad_lines = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._watch, name=f"serial {port}", daemon=True)
        self._thread.start()

    def _open(self) -> Any:
        import serial

        try:
            return serial.Serial(self._port, self._baud_rate, timeout=0.1)
        except (serial.SerialException, OSError, ValueError) as error:
            told = " ".join(str(error).split())
            raise InputError(f"parameter serial.port: {self._port}: {told}; plug the device in") from error

    def _watch(self) -> None:
        import serial

        while not self._ending.is_set():
            try:
                opened, self._opened = self._opened, None
                with opened or serial.Serial(self._port, self._baud_rate, timeout=0.1) as line:
                    self._complaint = ""
                    self._read(line)
            except (serial.SerialException, OSError, TypeError) as error:
                # pyserial raises TypeError where the descriptor goes away under a read
                self._complaint = f"{self._port}: {' '.join(str(error).split())}"
                self._ending.wait(self.RETRY)

    def _read(self, line) -> None:  # type: ignore[no-untyped-def]
        buffer = LineBuffer()
        while not self._ending.is_set():
            data = line.read(max(1, line.in_waiting))
            arrival = time.time_ns()
            for text in buffer.add(data):
                parsed = self._format.parse(text)
                if parsed is None:
                    self.bad_lines += 1
                else:
                    stamp = arrival if parsed[0] is None else round(1e9 * parsed[0])
                    self._samples.append((stamp, parsed[1]))

    def take(self, now_ns: int) -> tuple[Stamps, Array]:
        """Lines that came; two lines of one read get stamps 1 ns apart at least."""
        _ = now_ns
        samples = [self._samples.popleft() for _ in range(len(self._samples))]
        if not samples:
            return np.zeros(0, np.int64), np.zeros((0, len(self._format.columns)))
        stamps = np.array([stamp for stamp, _ in samples], np.int64)
        if self._format.time_column is None:
            stamps = np.maximum.accumulate(stamps - np.arange(len(stamps))) + np.arange(len(stamps))
        return stamps, np.array([values for _, values in samples])

    def complaint(self) -> str:
        """The port is away, or its lines are no numbers."""
        bad = f"{self.bad_lines} lines were no {len(self._format.columns)} numbers" if self.bad_lines else ""
        return self._complaint or bad

    def close(self) -> None:
        """End the thread."""
        self._ending.set()
        self._thread.join(2.0)


class FileSource(Source):
    """A logger's CSV played in real time: its first line is due when somebody first wants it."""

    def __init__(self, file: Path, line_format: LineFormat) -> None:
        if line_format.time_column is None:
            raise InputError("parameter line.time_column: a file needs one; give the column of its time")
        try:
            lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError as error:
            raise InputError(f"parameter file.path: {file}: {error.strerror}; name a logger's CSV") from error
        parsed = [p for p in map(line_format.parse, lines) if p is not None and p[0] is not None]
        if not parsed:
            raise InputError(
                f"{file}: no line holds {len(line_format.columns)} numbers and a time; check line.columns"
            )
        self._time = np.array([p[0] for p in parsed], dtype=float) - float(parsed[0][0] or 0.0)
        self._values = np.array([p[1] for p in parsed])
        if np.any(np.diff(self._time) <= 0.0):
            row = int(np.argmax(np.diff(self._time) <= 0.0)) + 1
            raise InputError(f"{file}: time does not run forwards at line of numbers {row + 1}; sort it")
        self._start: int | None = None
        self._next = 0

    def take(self, now_ns: int) -> tuple[Stamps, Array]:
        """Lines that are due."""
        if self._start is None:
            self._start = now_ns
        due = int(np.searchsorted(self._time, (now_ns - self._start) / 1e9, side="right"))
        chosen = slice(self._next, due)
        self._next = max(due, self._next)
        return self._start + np.round(1e9 * self._time[chosen]).astype(np.int64), self._values[chosen]

    def skip(self, now_ns: int) -> None:
        """Lines that are due are let go, once the first one was taken."""
        if self._start is not None:
            self.take(now_ns)

    def complaint(self) -> str:
        """The file is over."""
        return "the file is over" if self._next >= len(self._time) else ""
