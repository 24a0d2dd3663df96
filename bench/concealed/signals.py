"""Series that pass from the engine to the sensors: frozen values, SI units."""

from __future__ import annotations

from dataclasses import dataclass

from bench.concealed.scene import Array


@dataclass(frozen=True)
class Trajectory:
    """True motion, evenly sampled from the release on."""

    time: Array  # (n,) s
    position: Array  # (n, 3) m, body origin in world
    quaternion: Array  # (n, 4) xyzw, body to world
    velocity: Array  # (n, 3) m/s, body origin, world
    rate: Array  # (n, 3) rad/s, body
    acceleration: Array  # (n, 3) m/s^2, body origin, world
    rate_change: Array  # (n, 3) rad/s^2, body
    tension: Array  # (n, cables) N, at the end that carries the load cell
    force: Array  # (n, 3) N, exciter on body, exciter frame
    shaft: Array  # (n, 2) rad, rad/s
    stretch: Array  # (n, cables) m, distance of the hinges less the true length


@dataclass(frozen=True)
class Readings:
    """What the sensors feel, every millisecond, free of noise and of ordinary errors."""

    time: Array  # (n,) s after the release
    tension: Array  # (n, cables) N
    force: Array  # (n, 3) N, exciter frame
    shaft: Array  # (n, 2) rad, rad/s
    rate: Array  # (n, 3) rad/s, imu frame
    specific_force: Array  # (n, 3) m/s^2, imu frame
    inclination: Array  # (n, 2) rad


@dataclass(frozen=True)
class Samples:
    """What one device sends: time on its own clock, seconds after the release."""

    time: Array  # (n,)
    values: Array  # (n, width)
