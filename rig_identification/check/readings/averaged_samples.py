"""A logger that averages: each reading is the mean over a window, half a window late, its noise not white.

The noise of a running average has a spectrum with a zero at every multiple of 1 / window; no physics and no
filter of a sensor has that (``moving_average.py``). An average whose output is held or thinned out leaves no
trace in its own channel.

Shifting stamps by half a window would leave the amplitudes too small: by 6.5 % at 1 Hz behind 0.2 s. So the
average itself is undone, to within the converter's rounding (``averages_undone.py``). Where rounding covers
what the average left of quick noise, fewer samples are kept, so that their noise is white.
"""

from __future__ import annotations

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.readings.averages_undone import undone
from rig_identification.check.readings.channel_model import (
    FALSE_ALARM,
    Array,
    groups,
    interval,
    noise_std,
    resolution,
)
from rig_identification.check.readings.moving_average import LEAST, Comb, candidates, comb, log_spectrum
from rig_identification.check.readings.telling import (
    Spotted,
    devices_of,
    listed,
    of_recordings,
    only,
    told_of,
    where,
    without,
)
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawSession

ORDER = 60
#: Samples that a spectrum needs.
_SHORTEST = 200
#: Pieces of a recording: an average is in all of them. Two blows make a comb as well, in the piece that has
#: both.
_PIECES = 3
#: Steps of the converter from which noise is more than rounding; of an average's noise little is left.
_NOISY = 0.5
#: A window is this share of a spectrum's length at most, so that each null has samples of it.
_WIDEST = 3
#: Share of the pieces in which an average must show.
_SHOWS = 2.0 / 3.0
#: Cycles of the motion in a window from which its second harmonic is damped threefold or more (sinc 0.7).
_LOST = 0.35
#: A signal is motion from so many std of its averaged noise on; below, nothing is lost by the average.
_MOVES = 10.0
#: An average over a whole number of samples in every recording and in all cells of a logger.
_SAME = 0.02
#: Devices whose loggers average. A mean of quaternions that lie close together is the mean turn.
_AVERAGED = ("tension", "exciter_force", "imu", "inclination", "mocap")


def find(session: RawSession) -> tuple[Found, ...]:
    """Channels that were averaged; the readings before the average take their place."""
    return told_of(session, _AVERAGED, _spotted, _fault, tolerance=_SAME)


def _spotted(recorded: list[tuple[int, RawChannel]]) -> list[Spotted]:
    spectra = {number: _spectra(channel) for number, channel in recorded}
    windows = {int(m) for logs in spectra.values() if logs for m in candidates(logs)}
    if not windows:
        return []
    combs = {
        m: {
            number: [comb(log, m) for log in logs]
            for number, logs in spectra.items()
            if logs and m <= len(logs[0]) // _WIDEST
        }
        for m in windows
    }
    totals = {m: sum(c.gain for several in by.values() for c in several) for m, by in combs.items()}
    samples = max(totals, key=lambda m: totals[m])
    longest = max(len(channel.values) for _, channel in recorded)
    # Each window that was looked at is a chance of its own
    shown = [c.gain > 0.0 for several in combs[samples].values() for c in several]
    if totals[samples] < -np.log(FALSE_ALARM / longest) or np.mean(shown) < _SHOWS:
        return []
    out = []
    for number, channel in recorded:
        by = combs[samples].get(number, [])
        gain = sum(one.gain for one in by)
        if by and gain > 0.0 and len(channel.values) > LEAST * samples:
            window = samples * interval(channel)
            lost = _motion_lost(channel, samples)
            changed = (
                without(channel, np.ones(len(channel.values), bool))
                if lost
                else _undone(channel, samples, by)
            )
            count = 0 if lost else len(changed.stamp_ns)
            out.append(Spotted(channel.device, channel.channel, number, changed, (), count, gain, window))
    return out


def _spectra(channel: RawChannel) -> list[Array]:
    """One spectrum for every piece of every column that varies."""
    columns = [k for kept in groups(channel).values() for k in kept]
    filled = [_filled(channel.values[:, k]) for k in columns]
    # Bends of a signal without noise make combs as well; rounding alone is 0.29 steps
    filled = [column for column in filled if noise_std(column) > _NOISY * resolution(column)]
    return [log_spectrum(piece) for column in filled for piece in _pieces(column)]


def _pieces(column: Array) -> list[Array]:
    """The column in pieces of one length, none where it is too short for one."""
    count = min(_PIECES, len(column) // _SHORTEST)
    return list(column[: len(column) // count * count].reshape(count, -1)) if count else []


def _filled(column: Array) -> Array:
    """The column with single missing samples put in, empty where more than one in ten is missing."""
    finite = np.flatnonzero(np.isfinite(column))
    if len(finite) < 0.9 * len(column):
        return np.zeros(0)
    return np.interp(np.arange(len(column)), finite, column[finite])


def _undone(channel: RawChannel, samples: int, combs: list[Comb]) -> RawChannel:
    values = np.array(channel.values)
    floor = float(np.median([one.floor for one in combs]))
    for kept in groups(channel).values():
        for k in kept:
            values[:, k] = undone(_filled(channel.values[:, k]), samples, floor)
    kept_ones = np.zeros(len(values), bool)
    # The first and the last window are poor; of the rest as many as rounding leaves white
    kept_ones[samples : len(values) - samples : _stride(samples, floor)] = True
    values[~np.isfinite(channel.values)] = np.nan
    return only(
        RawChannel(
            channel.topic, channel.channel, channel.message_type, channel.stamp_ns, channel.received_ns,
            values, channel.cable,
        ),
        kept_ones,
    )  # fmt: skip


def _motion_lost(channel: RawChannel, samples: int) -> bool:
    """Whether twice the motion's frequency comes near the average's first null, where nothing is left of it.

    Tensions and angles of a swing have its second harmonic; a motion's frequency is that of the readings'
    steps.
    """
    for column in (_filled(channel.values[:, k]) for kept in groups(channel).values() for k in kept):
        # Over a quarter window the averaged signal changes, and its noise hardly does
        apart = max(1, samples // 4)
        coarse = column[::apart] - np.mean(column)
        noise = np.median(np.abs(np.diff(column))) * np.sqrt(apart)
        spread, change = float(np.var(coarse)), float(np.mean(np.diff(coarse) ** 2))
        moving = spread > (_MOVES * noise) ** 2
        # The mean square step of a sine of f cycles a step is 4 sin(pi f)^2 times its mean square
        if moving and np.arcsin(min(np.sqrt(change / spread) / 2.0, 1.0)) / np.pi * samples / apart > _LOST:
            return True
    return False


def _stride(samples: int, floor: float) -> int:
    """Samples of which one is kept: up to half the rate left the average's lobes rise over the rounding.

    Between its nulls D^2 is 1 / (M sin(pi f))^2.
    """
    sine = 1.0 / (samples * np.sqrt(floor))
    if sine >= 1.0:
        return 1
    return int(np.clip(np.ceil(np.pi / (2.0 * np.arcsin(sine))), 1, samples))


def _fault(session: RawSession, group: list[Spotted]) -> SetupFault:
    names, window = devices_of(group), float(np.median([one.value for one in group]))
    its = "its" if len(names) == 1 else "their"
    verb = "is averaged" if len(names) == 1 else "are averaged"
    loss = 100.0 * (1.0 - float(np.sinc(window)))
    lost = f" and makes a motion of 1 Hz {loss:.2g} % smaller" if loss > 0.1 and window < 1.0 else ""
    mended = [one for one in group if one.count]
    gone = [one for one in group if not one.count]
    so = f" The average is undone in {of_recordings(session, mended)}." if mended else ""
    so += f" {of_recordings(session, gone)}: too quick a motion for that, left out." if gone else ""
    return SetupFault(
        "averaged_samples", where(session, group),
        {
            "window": {"value": window, "std": 0.0, "unit": "s"},
            "delay": {"value": 0.5 * window, "std": 0.0, "unit": "s"},
        },
        f"{listed(names)} {verb} over the last {window:.4g} s: that delays {its} readings by "
        f"{0.5 * window:.4g} s{lost}.{so}",
        "Switch the filter of the amplifier or logger off and record every reading.",
        "", bool(mended), sum(one.gain for one in group),
    )  # fmt: skip
