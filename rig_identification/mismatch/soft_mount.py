"""An IMU that answers with a resonance, and shows motion larger than it is.

It stands on foam, rubber or a long bracket; or its own seismic mass or filter rings (estimate/mounting.py).
"""

from __future__ import annotations

import numpy as np

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import Parameter, ParameterSet
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.candidate import Candidate, Told

#: Plausible 1/w^2 (s^2) of a mount, of 6 Hz, and its damping ratio, of rubber.
SOFTNESS, DAMPING, DAMPING_RANGE = (2.0 * np.pi * 6.0) ** -2, 0.08, 0.05
#: s by which it is late beside that: 2 z/w where the damper does not stand on the body.
DELAY = 2.0 * DAMPING * SOFTNESS**0.5
#: Readings in words, by quantity.
_SHOWN = {"specific_force": "acceleration", "angular_rate": "rate"}


def soft_mounts(parameters: ParameterSet, channels: set[str]) -> list[Candidate]:
    """The IMU's mount as its accelerometer shows it, as its gyroscope does, and both."""
    seen = [q for q in _SHOWN if q in channels]
    return [
        *(_mount(parameters, (q,)) for q in seen),
        *([_mount(parameters, tuple(seen))] if seen[1:] else []),
    ]


def _mount(parameters: ParameterSet, quantities: tuple[str, ...], *, delayed: bool = False) -> Candidate:
    """delayed: with a delay of its own, which a mount has not: a closer description of what rings."""

    def closer(problem: Problem, evaluation: Evaluation) -> list[tuple[Candidate, dict[str, float]]]:
        values = problem.bench.parameters.named(evaluation.point.theta)
        own = _mount(parameters, quantities, delayed=True)
        return [(own, {p.name: values.get(p.name, 0.0) for p in own.parameters})]

    soft, damped, late = [], [], []
    for quantity in quantities:
        entry, stem = parameters.places.mount(quantity), f"imu.mount.{quantity}"
        soft.append(Parameter(f"{stem}.softness", "s^2", 0.0, SOFTNESS, "device", entry, bounded=False))
        damped.append(
            Parameter(f"{stem}.damping", "1", DAMPING, DAMPING_RANGE, "device", entry + 1, bounded=False)
        )
        late.append(Parameter(f"{stem}.delay", "s", 0.0, DELAY, "device", entry + 2, bounded=False))

    def told(found: Estimates) -> Told:
        out: Told = {}
        # A part whose softness may be none has no frequency to tell
        rings = [k.name for k in soft if found.values[k.name] > 2.0 * found.std(k.name)] or [soft[0].name]
        for quantity, k, z, delay in zip(quantities, soft, damped, late, strict=True):
            if k.name not in rings:
                continue
            word = _SHOWN[quantity]
            own = found.following(lambda k: float(1.0 / (2.0 * np.pi * np.sqrt(max(k, 1e-12)))), k.name)
            out[f"frequency_{word}"] = (*own, "Hz")
            out[f"damping_ratio_{word}"] = (*found.of(z.name), "1")
            if delayed:
                out[f"delay_{word}"] = (*found.of(delay.name), "s")
        lowest = min((v for name, v in out.items() if name.startswith("frequency")), key=lambda v: v[0])
        return {"frequency": lowest, **out}

    parts = " and ".join("accelerometer" if q == "specific_force" else "gyroscope" for q in quantities)
    return Candidate(
        "sensor_resonance",
        (*soft, *damped, *(late if delayed else ())),
        f"The IMU's {parts} shows a resonance, at {{value}}: motion looks larger than it is.",
        "Bolt the IMU to the frame without foam or rubber, and look at its filter's settings.",
        {"channel": "imu", "axis": None},
        positive=len(quantities),
        tell=told,
        closer=None if delayed else closer,
    )
