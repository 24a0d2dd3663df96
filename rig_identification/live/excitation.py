"""Whether a body moved at all: a fit of a body that hangs still tells nothing of its inertia."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.recording import Recording, Series

#: A channel whose readings scatter by less than so many times its white noise shows no motion.
VISIBLE = 1.5


def motion_in_noise(recording: Recording) -> float:
    """Largest ratio of a channel's scatter to its white noise; 1: the body hangs still; NaN: no channel."""
    series: list[Series] = [*recording.tension.values()]
    series += [s for s in (recording.imu, recording.inclination) if s is not None]
    if recording.mocap is not None:
        series.append(Series(recording.mocap.time, recording.mocap.values[:, :3]))
    ratios = []
    for one in series:
        if len(one.values) > 50:
            ratios.append(float(np.max(np.std(one.values, axis=0) / white_noise(one.values))))
    return max(ratios) if ratios else float("nan")


def white_noise(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(w,) standard deviation of what changes from sample to sample: motion is slow, noise is not.

    Fourth differences cancel what is smooth and widen white noise by sqrt(70).
    """
    return np.asarray(np.maximum(np.std(np.diff(values, n=4, axis=0), axis=0) / np.sqrt(70.0), 1e-12))


def moves(recording: Recording) -> bool:
    """Whether any device saw motion above its noise."""
    return motion_in_noise(recording) > VISIBLE
