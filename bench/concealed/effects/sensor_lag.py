"""A first-order low-pass in one device."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.signal import lfilter

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.scene import Array, Plan, Scene
from bench.concealed.signals import Readings

FIELDS = {
    "imu": ("rate", "specific_force"),
    "inclinometer": ("inclination",),
    "exciter": ("force",),
}


@dataclass(frozen=True)
class SensorLag(Effect):
    """The device reads y with tau dy/dt = x - y, settled before the release."""

    name = "sensor_lag"
    device: str  # "imu", "inclinometer", "exciter" or a cable
    time_constant: float  # s

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> SensorLag:
        """From 1.5 ms: a few times the doubt of the clocks."""
        device = str(rng.choice(["imu", "inclinometer", "exciter", *scene.geometry.names]))
        faint, strong = (0.01, 0.3) if device == "inclinometer" else (0.0025, 0.06)
        return cls(device, log_size(size, faint, strong))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {"time_constant": quantity(self.time_constant, "s")}
        return {"where": {"channel": self.device}, "parameters": parameters}

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """See :class:`Effect`."""
        if self.device in FIELDS:
            fields = FIELDS[self.device]
            return replace(readings, **{f: self._late(readings.time, getattr(readings, f)) for f in fields})
        cable = scene.geometry.names.index(self.device)
        tension = readings.tension.copy()
        tension[:, cable : cable + 1] = self._late(readings.time, tension[:, cable : cable + 1])
        return replace(readings, tension=tension)

    def _late(self, time: Array, values: Array) -> Array:
        """Exact for inputs that are straight between samples (first-order hold)."""
        ratio = (time[1] - time[0]) / self.time_constant
        decay = np.exp(-ratio)
        new = 1.0 - (1.0 - decay) / ratio
        old = (1.0 - decay) / ratio - decay
        start = (values[:1] - new * values[:1]).copy()
        return np.asarray(lfilter([new, old], [1.0, -decay], values, axis=0, zi=start)[0])
