"""What the thesis applies to the body: steps of constant force and a force that goes round."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

AXIS = {"x": 0, "y": 1, "z": 2}


class Segment(Protocol):
    """A force that acts from ``start`` to ``end``."""

    @property
    def start(self) -> float: ...

    @property
    def end(self) -> float: ...

    def force(self, time: Array) -> Array: ...


@dataclass(frozen=True)
class StepForce:
    """A constant force over an interval."""

    vector: Array  # (3,) N
    start: float  # s
    end: float  # s

    def force(self, time: Array) -> Array:
        """(n, 3) N at (n,) s, whether or not the segment acts then."""
        return np.tile(self.vector, (len(time), 1))


@dataclass(frozen=True)
class HarmonicForce:
    """A force of constant magnitude that turns in a plane, as an unbalanced mass gives it.

    In the plane ``xy`` it is Fx = A sin(2 pi f t), Fy = A cos(2 pi f t). The thesis says only
    that the two components are a quarter period apart (section 3.2); this order is the one
    that gives back its published errors (case 14). ``phase`` and ``backwards`` are there for
    what the thesis leaves open.
    """

    amplitude: float  # N
    frequency: float  # Hz
    plane: str  # "xy", "xz" or "yz": first axis sine, second cosine
    start: float  # s
    end: float  # s
    phase: float = 0.0  # rad, at time 0
    backwards: bool = False  # the second component turns its sign

    def force(self, time: Array) -> Array:
        """(n, 3) N at (n,) s, whether or not the segment acts then."""
        phase = 2.0 * np.pi * self.frequency * time + self.phase
        vector = np.zeros((len(time), 3))
        vector[:, AXIS[self.plane[0]]] = self.amplitude * np.sin(phase)
        vector[:, AXIS[self.plane[1]]] = (-1.0 if self.backwards else 1.0) * self.amplitude * np.cos(phase)
        return vector


@dataclass(frozen=True)
class ForceProgram:
    """Every force of one experiment; all act at one point that is fixed to the body."""

    point: Array  # (3,) m, body
    axes: str  # "world" or "body": the axes that the components are given in
    segments: tuple[Segment, ...] = ()

    def __call__(self, time: Array) -> Array:
        """(n, 3) N at the times (n,) s in :attr:`axes`; a segment acts for start <= t < end."""
        instants = np.atleast_1d(np.asarray(time, dtype=float))
        total = np.zeros((len(instants), 3))
        for segment in self.segments:
            acts = (instants >= segment.start) & (instants < segment.end)
            total[acts] += segment.force(instants[acts])
        return total

    def in_body(self, time: Array, orientation: Array) -> Array:
        """(n, 3) N along body axes at (n,) s; ``orientation`` (n, 4) xyzw rotates body vectors into world."""
        force = self(time)
        return (
            force if self.axes == "body" else np.asarray(Rotation.from_quat(orientation).inv().apply(force))
        )

    @property
    def breaks(self) -> tuple[float, ...]:
        """Instants (s) at which the force jumps: no integration step should straddle one."""
        edges = {edge for s in self.segments for edge in (s.start, s.end)}
        return tuple(sorted(edge for edge in edges if np.isfinite(edge)))
