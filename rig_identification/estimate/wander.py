"""Zeros that are a little other ones in each recording, and move a little in it, as every device's do.

A description states how far a zero may be off (its tolerance). One number for all recordings would have it
come back to a thousandth of that: so well is the mean of half a minute known. Amplifiers, bridges and
gyroscopes do not; their zeros return to a part of what they may be off. A held-out run whose gyroscope stands
3e-5 rad/s elsewhere would refute any model.

So each run has a deviation of its own from each zero, N(0, s^2), which no fit asks for: it is noise, and is
integrated out (marginal.py). What moves a zero from one recording to the next moves it while one lasts: from
end to end of a run by N(0, s^2) as well, along a line. Without it a cell that creeps by a third of its noise
in half a minute leaves a residual that is not white. The zero itself is that of the recordings at rest, whose
means scatter as their blocks do (rest_evidence.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import Rig

if TYPE_CHECKING:
    from rig_identification.estimate.evidence import Channel, Run
    from rig_identification.estimate.marginal import Marginal

Array = NDArray[np.float64]

#: By which part of its tolerance a zero differs from recording to recording: repeatability in data sheets of
#: load cells and of MEMS gyroscopes and accelerometers is 3 to 20 % of the zero error that they state.
WANDER = 0.1
#: Ways in which a zero moves of itself: from one recording to the next, and along one.
MOVES = 2
#: How many times as far zeros move that are freed: ten times their tolerance.
FREED = 100.0
#: Tolerance of each quantity's zero.
ZEROS = {
    "tension": "load_cell_zero",
    "angular_rate": "gyroscope_bias",
    "specific_force": "accelerometer_bias",
    "inclination": "inclinometer_orientation",
}
#: ... and of its gain.
GAINS = {
    "tension": "load_cell_gain",
    "angular_rate": "gyroscope_scale",
    "specific_force": "accelerometer_scale",
}


def wander_of(rig: Rig, quantity: str, tolerances: Mapping[str, str] = ZEROS) -> float:
    """Std of a run's own deviation from a quantity's zero, in its unit; 0 where it has none.

    tolerances: GAINS for that from its gain.
    """
    name = tolerances.get(quantity)
    return 0.0 if name is None else WANDER * rig.tolerance[name]


def zero_moves(run: Run, channel: Channel) -> Array:
    """(groups, MOVES) how a zero deviates in a run in each of the ways, in stds of its wander."""
    return moves_at(run, np.asarray(run.grid.step * channel.node, dtype=np.float64))


def moves_at(run: Run, time: Array) -> Array:
    """(n, MOVES) the same at instants of a run, s after node 0."""
    along = (time - 0.5 * run.grid.duration) / max(run.recording.duration, 1.0)
    return np.stack([np.ones_like(along), along], axis=1)


def likeliest_moves(run: Run, wander: Marginal, residual: Array, stds: Sequence[float]) -> dict[int, Array]:
    """(w, MOVES) by channel how far its zeros are off in each way, as a run's residuals make it likeliest.

    stds: of each channel's wander, 0 where it has none. Of whitened rows e, W e the ``residual``, the
    amounts' mean is B^T W^2 e (marginal.py).
    """
    amounts = wander.responses.T @ wander.without(residual[:, None])[:, 0]
    out, first = {}, 0
    for index, (channel, std) in enumerate(zip(run.channels, stds, strict=True)):
        if std > 0.0:
            own = amounts[first : first + MOVES * channel.width].reshape(channel.width, MOVES)
            out[index] = np.asarray(std * own)
            first += MOVES * channel.width
    return out
