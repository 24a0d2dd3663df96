"""How strong a device's noise is at the frequencies of the motion, as it shows where the body hangs at rest.

Real sensors' noise is not white: a filter takes its upper part, an amplifier and a bias that wanders add to
its lower part. One std of a sample, as a description has it, is then too small where the body moves, by the
root of the spectrum there over its mean. A fit that believes it claims too much, and finds physics in noise.

At rest nothing else moves. The spectrum's logarithm is a sum of a few cosines of the frequency (Bloomfield,
Biometrika 60, 1973), which all axes of a device share beside a level of their own. It is fitted to medians of
ordinates over bands: one is ln 2 times the mean (exponential law), and neither a residual swing nor a line of
the mains moves it. So every frequency tells of the few at which the body moves. Load cells of one make share
their cosines too, where that describes them all as well as cosines of each.

A fit weighs each channel of a run by the noise at the frequencies at which that channel moves; what it leaves
is compared with the noise at each frequency (verdict.py).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import detrend

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.rest_evidence import RestEvidence
from rig_identification.recording import Recording, Series

Array = NDArray[np.float64]

#: Hz up to which a rig moves, and the share of the samples' rate that this is at most.
MOTION, SHARE = 10.0, 0.125
#: Ordinates that are left out at the lower end, where a zero drifts; those of a band, and the fewest bands.
DRIFTING, BAND, FEWEST = 3, 12, 4
#: Cosines of a spectrum's logarithm at most.
COSINES = 3
#: Std of the logarithm of a median of n exponential ordinates, times sqrt(n); and by how many of its own a
#: spectrum has to be above what is described.
MEDIAN_STD, CHANCE = 1.44, 3.0

TINY = float(np.finfo(np.float64).tiny)
#: Device and quantity.
Key = tuple[str, str]
#: ... of the exciter's force, which drives the model.
FORCE: Key = ("exciter", "exciter_force")


def slow_noise(rests: Iterable[RestEvidence], exciter_noise: float = 0.0) -> dict[Key, Colour]:
    """By device and quantity the noise of what is measured at rest; none where it may as well be white.

    exciter_noise: std (N) of a sample of the exciter's force; 0: it is not measured.
    """
    found: dict[Key, list[Bands]] = {}
    for evidence in rests:
        for c in evidence.channels:
            series = _series(evidence.recording, c.device, c.quantity)
            part = None if series is None else _bands(series, c.noise)
            if part is not None:
                found.setdefault((c.device, c.quantity), []).append(part)
        force = evidence.recording.exciter_force
        if force is not None and exciter_noise > 0.0 and np.isfinite(force.values).all():
            part = _bands(force, np.full(force.values.shape[1], exciter_noise))
            if part is not None:
                found.setdefault(FORCE, []).append(part)
    colours: dict[Key, Colour] = {}
    for quantity in {quantity for _, quantity in found}:
        devices = {key: parts for key, parts in found.items() if key[1] == quantity}
        alone = [_fitted({key: parts}) for key, parts in devices.items()]
        alike = _fitted(devices)
        chosen = [alike] if alike.criterion < sum(fit.criterion for fit in alone) else alone
        colours |= {key: colour for fit in chosen for key, colour in fit.colours.items()}
    return {key: colour for key, colour in colours.items() if np.any(colour.shown)}


def with_slow_noise(runs: tuple[Run, ...], colours: dict[Key, Colour]) -> tuple[Run, ...]:
    """Runs whose channels are as noisy at their motion's frequencies as they are at rest."""

    def louder(run: Run) -> Run:
        channels = []
        for c in run.channels:
            colour = colours.get((c.device, c.quantity))
            if colour is None or colour.level.size != c.width:
                channels.append(c)
                continue
            slow = np.sqrt(_where_it_moves(Series(c.time, c.values), c.noise, colour))
            channels.append(replace(c, slow=slow, colour=colour) if np.any(slow > 1.0) else c)
        force, colour = run.recording.exciter_force, colours.get(FORCE)
        if colour is None or force is None or run.exciter_noise <= 0.0:
            return replace(run, channels=tuple(channels))
        std = np.full(force.values.shape[1], run.exciter_noise)
        loudest = float(np.sqrt(np.max(_where_it_moves(force, std, colour))))
        return replace(run, channels=tuple(channels), exciter_noise=run.exciter_noise * loudest)

    return tuple(map(louder, runs)) if colours else runs


def _where_it_moves(series: Series, noise: Array, colour: Colour) -> Array:
    """(w,) power of the noise at the frequencies of what samples (n, w) measure, in that of white noise.

    A signal of power P(f) in noise of power S(f) tells as much as in white noise of sum P / sum (P / S)
    (Whittle's likelihood). Of an axis that shows no signal it is that up to where a rig moves.
    """
    anywhere = np.where(colour.shown, np.exp(np.maximum(colour.mean, 0.0)), 1.0)
    part = _spectrum(series, noise)
    if part is None:
        return anywhere
    _, frequency, power = part
    loud = colour.power(frequency)
    signal = np.maximum(power - loud, 0.0)
    there = np.sum(signal, axis=0), np.sum(signal / loud, axis=0)
    return np.where(there[1] > 0.0, there[0] / np.maximum(there[1], TINY), anywhere)


def told(runs: Iterable[Run]) -> tuple[str, ...]:
    """A sentence for each device whose noise in some runs is not white."""
    channels = (c for run in runs for c in run.channels)
    slow = {(c.device, c.quantity): c.slow for c in channels if c.slow is not None}
    return tuple(
        f"{device}: its {quantity.replace('_', ' ')} is {float(np.max(factor)):.2g} times as noisy at the "
        "frequencies of the motion as its samples scatter, as it shows at rest; the fit counts on that."
        for (device, quantity), factor in slow.items()
    )


class Bands(NamedTuple):
    """A spectrum at rest, in units of white noise as described, by bands."""

    angle: Array  # (b,) rad from one sample to the next, of a band's middle
    power: Array  # (b, w) of each axis
    ordinates: Array  # (b,) in each
    moving: float  # angle up to which a rig moves
    step: float  # s from one sample to the next


@dataclass(frozen=True)
class Colour:
    """A noise's spectrum: the logarithm of its power (in that of white noise) is a sum of cosines."""

    step: float  # s from one sample to the next
    level: Array  # (w,) of each axis
    cosines: Array  # (k,) of once, twice, ... the angle from one sample to the next
    shown: NDArray[np.bool_]  # (w,) whether an axis is louder than described at frequencies of motion
    mean: Array  # (w,) of the logarithm over those frequencies

    def power(self, frequency: Array) -> Array:
        """(n, w) at frequencies (n,) Hz; 1 where noise is quieter, and where more may be chance."""
        angle = np.minimum(2.0 * np.pi * frequency * self.step, np.pi)
        shape = _cosines(angle, self.cosines.size) @ self.cosines
        return np.where(self.shown, np.exp(np.maximum(shape[:, None] + self.level, 0.0)), 1.0)


class Fit(NamedTuple):
    """Spectra of devices that share their cosines."""

    criterion: float  # Schwarz's, less what levels cost
    colours: dict[Key, Colour]


def _fitted(devices: dict[Key, list[Bands]]) -> Fit:
    """As many cosines as the logarithms of all the bands' powers ask for (Schwarz's criterion)."""
    level, angle, weight, values, first = [], [], [], [], [0]
    for parts in devices.values():
        width = parts[0].power.shape[1]
        for part in parts:
            for k in range(width):
                level.append(np.full(part.angle.size, first[-1] + k))
                angle.append(part.angle)
                weight.append(np.sqrt(part.ordinates) / MEDIAN_STD)
                values.append(np.log(part.power[:, k]))
        first.append(first[-1] + width)
    levels, w = np.eye(first[-1])[np.concatenate(level)], np.concatenate(weight)
    x, y = np.concatenate(angle), np.concatenate(values) * w
    best: tuple[float, Array, Array] | None = None
    for cosines in range(COSINES + 1):
        columns = np.concatenate([levels, _cosines(x, cosines)], axis=1) * w[:, None]
        inverse = np.linalg.inv(columns.T @ columns)
        found = inverse @ columns.T @ y
        criterion = float(np.sum((y - columns @ found) ** 2)) + cosines * np.log(y.size)
        if best is None or criterion < best[0]:
            best = criterion, found, inverse
    assert best is not None
    criterion, found, inverse = best
    colours = {}
    for k, (key, parts) in enumerate(devices.items()):
        there = np.linspace(0.0, min(part.moving for part in parts), 9)
        own = np.eye(first[-1])[first[k] : first[k + 1]]
        shape = np.mean(_cosines(there, found.size - first[-1]), axis=0)
        rows = np.concatenate([own, np.tile(shape, (own.shape[0], 1))], axis=1)
        above = rows @ found
        # Axes of one device share its electronics: where all of them together are above, each is
        shown = [_shown(row, found, inverse) for row in rows]
        told = np.array(shown) | _shown(np.mean(rows, axis=0), found, inverse)
        colours[key] = Colour(parts[0].step, found[first[k] : first[k + 1]], found[first[-1] :], told, above)
    return Fit(criterion, colours)


def _shown(row: Array, found: Array, inverse: Array) -> bool:
    """Whether a combination ``row`` of what was found lies above 0 by more than chance."""
    return bool(row @ found > CHANCE * np.sqrt(row @ inverse @ row))


def _cosines(angle: Array, count: int) -> Array:
    """(n, count) cosines of once, twice, ... the angles."""
    return np.asarray(np.cos(np.outer(angle, np.arange(1, count + 1))))


def _series(recording: Recording, device: str, quantity: str) -> Series | None:
    """Samples (n, w) of one quantity at rest, where all of it is measured."""
    whole: Series | None
    if quantity == "tension":
        whole, columns = recording.tension.get(device), slice(0, 1)
    elif quantity == "angular_rate":
        whole, columns = recording.imu, slice(0, 3)
    elif quantity == "specific_force":
        whole, columns = recording.imu, slice(3, 6)
    else:
        whole, columns = recording.inclination, slice(0, 2)
    if whole is None or not np.isfinite(whole.values[:, columns]).all():
        return None
    return Series(whole.time, whole.values[:, columns])


def _bands(series: Series, noise: Array) -> Bands | None:
    """The spectrum of samples at rest by bands; None of too few to tell."""
    part = _spectrum(series, noise)
    if part is None:
        return None
    step, frequency, power = part
    angle = 2.0 * np.pi * step * frequency
    kept = np.array_split(np.arange(DRIFTING + 1, angle.size - 1), max(1, (angle.size - DRIFTING) // BAND))
    if len(kept) < FEWEST:
        return None
    medians = np.stack([np.median(power[band], axis=0) for band in kept]) / np.log(2.0)
    return Bands(
        np.array([np.mean(angle[band]) for band in kept]),
        np.maximum(medians, TINY),
        np.array([band.size for band in kept], dtype=np.float64),
        2.0 * np.pi * min(MOTION * step, SHARE),
        step,
    )


def _spectrum(series: Series, noise: Array) -> tuple[float, Array, Array] | None:
    """Step (s) of samples, frequencies (n,) Hz, and power (n, w) in that of white noise; None of too few.

    A sample that is missing here and there is drawn between its neighbours.
    """
    step = float(np.median(np.diff(series.time))) if series.time.size > 2 * FEWEST * BAND else 0.0
    if step <= 0.0 or noise.size != series.values.shape[1] or not np.all(noise > 0.0):
        return None
    time = np.arange(series.time[0], series.time[-1], step)
    even = np.stack([np.interp(time, series.time, v) for v in series.values.T], axis=1) / noise
    # A straight line leaks into all that is slow
    power = np.abs(np.fft.rfft(detrend(even, axis=0), axis=0)) ** 2 / time.size
    return step, np.asarray(np.fft.rfftfreq(time.size, step)), power
