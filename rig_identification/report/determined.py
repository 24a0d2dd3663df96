"""What the recordings determined, what not, and why."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.quantity import Z_95, significant
from rig_identification.recording import Recording, Session
from rig_identification.report.ten_numbers import Element, elements
from rig_identification.result import ELEMENTS, Identification


@dataclass(frozen=True)
class Determination:
    """One of the ten numbers: how well, or why not at all."""

    element: Element
    relative: str  # "0.03 % of m"; empty where it means nothing
    reason: str  # empty where determined


def determinations(identification: Identification, session: Session) -> list[Determination]:
    """How well each of the ten numbers is known.

    A reason that the estimator gives in ``figures["unobservable_reasons"]`` (element -> sentence) comes
    first; without one, the reason is what the session lacks.
    """
    given = identification.figures.get("unobservable_reasons")
    reasons = given if isinstance(given, Mapping) else {}
    total = identification.total
    scales = _scales(total.values, total.unobservable)
    rows = []
    for i, (name, element) in enumerate(zip(ELEMENTS, elements(total), strict=True)):
        if element.observable:
            half = Z_95 * float(np.sqrt(max(total.covariance[i, i], 0.0)))
            relative = _relative(half, scales[i], name)
            rows.append(Determination(element, relative, ""))
        else:
            rows.append(Determination(element, "", str(reasons.get(name) or _reason(name, session))))
    return rows


def _scales(values: NDArray[np.float64], unobservable: tuple[str, ...]) -> list[float]:
    """What an interval is compared with: the mass itself, the mean diagonal inertia; lengths stand alone.

    The mean is that of the diagonal elements that are determined: what stands for the others is no inertia.
    """
    known = [i for i in (4, 7, 9) if ELEMENTS[i] not in unobservable and np.isfinite(values[i])]
    inertia = float(np.mean(values[known])) if known else 0.0
    return [float(values[0]), *[0.0] * 3, *[inertia] * 6]


def _relative(half: float, scale: float, name: str) -> str:
    if name.startswith("c"):
        return f"{significant(1e3 * half, 2)} mm"
    if not np.isfinite(scale) or scale <= 0.0:
        return ""
    of = "of m" if name == "m" else "of the mean of the determined diagonal elements"
    return f"{significant(100.0 * half / scale, 2)} % {of}"


def _reason(name: str, session: Session) -> str:
    """What the session lacks that would show this element."""
    recordings = session.recordings
    moving = [r for r in recordings if r.kind == "dynamic"]
    general = "No recording changes by more than its noise when this number changes."
    if name.startswith("J") and not moving:
        return f"{general} The body is at rest in all of them, and inertia shows in motion alone."
    if not any(r.tension or r.exciter_force is not None for r in recordings):
        lacks = "No force is measured"
        lacks += ", so that only ratios to the mass show" if name == "m" or session.rig.mass is None else ""
        return f"{general} {lacks}; the cables guide the body along the few motions that were made."
    if name.startswith("J"):
        return f"{general} The motions that were made hardly turn the body about the axes concerned."
    return f"{general} The poses and motions that were made do not separate it from the doubts about the rig."


def sensors_used(session: Session) -> list[tuple[str, str]]:
    """Each kind of sensor and the recordings that have it."""
    kinds: dict[str, Callable[[Recording], bool]] = {
        "load cells": lambda r: bool(r.tension),
        "exciter force": lambda r: r.exciter_force is not None,
        "IMU": lambda r: r.imu is not None,
        "inclinometer": lambda r: r.inclination is not None,
        "motion capture": lambda r: r.mocap is not None,
    }
    return [(kind, _having(session.recordings, has)) for kind, has in kinds.items()]


def _having(recordings: tuple[Recording, ...], has: Callable[[Recording], bool]) -> str:
    names = [r.name for r in recordings if has(r)]
    if not names:
        return "in no recording"
    return "in every recording" if len(names) == len(recordings) else ", ".join(names)
