"""What other tools take from an answer: the body in their formats, the rig as learned, inertia elsewhere."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from rig_identification.quantity import value_and_half_width
from rig_identification.recording import Session
from rig_identification.report.body_files import body_files
from rig_identification.report.learned_rig import learned_rig_text
from rig_identification.report.other_point import inertia_about
from rig_identification.report.plain import plain
from rig_identification.result import Identification, InertialEstimate


@dataclass(frozen=True)
class BodyToCopy:
    """One body for other tools."""

    heading: str
    files: dict[str, str]  # format -> text
    about_datum: tuple[tuple[str, str], ...] | None  # (9) value and half-width, row by row; None: not known
    numbers: (
        str  # JSON for the page's own calculation: values (10,), covariance (10, 10); "" where not all known
    )


@dataclass(frozen=True)
class ToCopy:
    """Everything that can be copied from a page."""

    bodies: tuple[BodyToCopy, ...]
    rig: str  # rig.yaml


def to_copy(identification: Identification, session: Session) -> ToCopy:
    """The body, with and without its carrying frame where that is described, and the rig."""
    bodies = [_body("Body", identification.total)]
    if identification.without_frame is not None:
        bodies = [
            _body("Body with its carrying frame", identification.total),
            _body("Body without its carrying frame", identification.without_frame),
        ]
    return ToCopy(tuple(bodies), learned_rig_text(session.rig, identification.parameters, session.name))


def _body(heading: str, estimate: InertialEstimate) -> BodyToCopy:
    whole = not estimate.unobservable and bool(np.all(np.isfinite(estimate.values)))
    numbers = {"values": estimate.values, "covariance": estimate.covariance}
    return BodyToCopy(
        heading,
        body_files(estimate),
        _about_datum(estimate) if whole else None,
        json.dumps(plain(numbers), allow_nan=False) if whole else "",
    )


def _about_datum(estimate: InertialEstimate) -> tuple[tuple[str, str], ...]:
    value, std = inertia_about(estimate, np.zeros(3), np.eye(3))
    pairs = zip(value.ravel(), std.ravel(), strict=True)
    return tuple(value_and_half_width(float(v), float(s)) for v, s in pairs)
