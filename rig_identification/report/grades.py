"""Whether a residual's size needs attention: one rule for cells, channels, recordings and whole fits."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

#: Share of reports on sound sessions in which chance calls some figure large: the verdict's own.
FALSE_ALARM = 0.005
#: Root mean square of a residual, in units of its noise, that needs no attention (recording contract), and
#: from which on it is called bad.
ORDINARY, LARGE = 1.1, 1.5


def noise_limit(count: int, compared: int = 1) -> float:
    """Root mean square (σ) that noise alone exceeds once in ``1 / FALSE_ALARM`` reports.

    The sum of ``count`` squares of white noise is a chi-square. compared: how many such figures the report
    shows; each has that part of the false alarm (Bonferroni). A reading at rest is one sample: two or three σ
    are ordinary there.
    """
    return float(np.sqrt(chdtri(max(count, 1), FALSE_ALARM / max(compared, 1)) / max(count, 1)))


def grade(rms: float | None, count: int | None = None, compared: int = 1) -> str:
    """Class of the page's style: good, fair, bad; muted where there is no figure.

    count: samples behind the figure; None: so many that their number does not matter.
    """
    if rms is None or not np.isfinite(rms):
        return "muted"
    noise = 0.0 if count is None else noise_limit(count, compared)
    return "good" if rms <= max(ORDINARY, noise) else "fair" if rms <= max(LARGE, noise) else "bad"


def heat(rms: float, count: int, compared: int) -> int:
    """Percent by which a cell is shaded: 0 as noise, 25 just beyond it, 100 some ten times the noise."""
    limit = max(ORDINARY, noise_limit(count, compared))
    return 0 if not rms > limit else round(min(25.0 + 75.0 * float(np.log10(rms / limit)), 100.0))
