"""Samples of every channel for the page's own charts: quantised, so that a page stays small.

A number takes two bytes between a channel's limits: a 65536th of its range, far below its noise or a pixel.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig_identification.quantity import unit_text
from rig_identification.report.channels import channel_label
from rig_identification.report.envelope import envelope
from rig_identification.report.plain import plain
from rig_identification.result import ChannelFit

Array = NDArray[np.float64]

#: Bytes that all samples of a page may take, as text: with the charts it stays under five megabytes.
BUDGET = 700_000
#: Of one sample: its time in four bytes, two readings in two bytes each; four letters hold three bytes.
_BYTES = (4 + 2 + 2) * 4 / 3
_STEPS = 65535


def samples_json(channels: Sequence[ChannelFit]) -> str:
    """JSON of each recording's channels: label, unit, noise, time, measured, predicted.

    Where all samples would be too many, each channel keeps its lowest and highest ones, and those of its
    residual, in equal stretches of time.
    """
    drawn = [fit for fit in channels if len(fit.time) > 1]
    most = int(BUDGET / _BYTES / max(len(drawn), 1))
    names = dict.fromkeys(fit.recording for fit in drawn)
    document = {name: [_channel(fit, most) for fit in drawn if fit.recording == name] for name in names}
    # A name could hold what ends a script element.
    return json.dumps(plain(document), allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")


def _channel(fit: ChannelFit, most: int) -> dict[str, object]:
    rows = _kept(fit, most)
    return {
        "label": channel_label(fit),
        "unit": unit_text(fit.unit),
        "noise": fit.noise_std,
        "all": len(rows) == len(fit.time),
        "time": base64.b64encode(fit.time[rows].astype("<f4").tobytes()).decode(),
        "measured": _quantised(fit.measured[rows]),
        "predicted": _quantised(fit.predicted[rows]),
    }


def _kept(fit: ChannelFit, most: int) -> NDArray[np.int64]:
    """Indices of the samples that are kept, ``most`` of them or fewer."""
    if len(fit.time) <= most:
        return np.arange(len(fit.time))
    columns = max(most // 4, 1)
    index = np.arange(len(fit.time), dtype=float)
    kept = [envelope(index, values, columns)[0] for values in (fit.measured, fit.residual_in_sigma)]
    return np.unique(np.concatenate(kept)).astype(np.int64)


def _quantised(values: Array) -> dict[str, object]:
    """Limits, and the steps between them as unsigned 16-bit numbers."""
    low, high = float(values.min()), float(values.max())
    steps = np.rint((values - low) / (high - low or 1.0) * _STEPS).astype("<u2")
    return {"low": low, "high": high, "steps": base64.b64encode(steps.tobytes()).decode()}
