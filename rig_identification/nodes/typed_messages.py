"""An answer in result.json's terms as messages of rig_identification_interfaces; NaN: not determined."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from rig_identification_interfaces.msg import Finding, FindingParameter, InertiaWithCovariance, TimeSpan

from rig_identification.nodes.result_messages import inertia_message

_NAN = float("nan")


def number(value: object) -> float:
    """A number; NaN for what is none."""
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else _NAN


def point(values: object) -> Point:
    """Three numbers in the order x y z; NaN where there are none."""
    x, y, z = values if isinstance(values, list) and len(values) == 3 else (None, None, None)
    return Point(x=number(x), y=number(y), z=number(z))


def unknown_body() -> InertiaWithCovariance:
    """A body of which nothing is known: NaN throughout."""
    message = InertiaWithCovariance()
    message.header.frame_id = "body"
    inertia = message.inertia
    inertia.m = inertia.ixx = inertia.ixy = inertia.ixz = inertia.iyy = inertia.iyz = inertia.izz = _NAN
    inertia.com.x = inertia.com.y = inertia.com.z = _NAN
    message.covariance = [_NAN] * 100
    return message


def body_message(body: Mapping[str, Any], stamp: Time, session_sha256: str) -> InertiaWithCovariance:
    """Mass, centre of mass, inertia and their covariance of a part of result.json.

    Where a part holds no covariance of its own, as a body without its frame may not, it is NaN.
    """
    message = unknown_body()
    message.header.stamp = stamp
    message.inertia = inertia_message(dict(body), stamp).inertia
    rows = body.get("covariance")
    if rows is not None:
        message.covariance = [number(value) for row in rows for value in row]
    message.unobservable = list(body.get("unobservable", ()))
    message.session_sha256 = session_sha256
    return message


def finding_message(finding: Mapping[str, Any]) -> Finding:
    """A finding of result.json, or a fault of check.json."""
    where, evidence = finding["where"], finding.get("evidence", {})
    texts = {key: str(where.get(key) or "") for key in ("channel", "axis", "end")}
    return Finding(
        effect=finding["effect"],
        **texts,
        position=point(where.get("position")),
        times=[_span(span) for span in where.get("times") or ()],
        where=json.dumps(where, ensure_ascii=False),
        parameters=[_parameter(name, p) for name, p in finding["parameters"].items()],
        log_likelihood_gain=number(evidence.get("log_likelihood_gain", finding.get("gain"))),
        holdout_error_before=number(evidence.get("holdout_error_before")),
        holdout_error_after=number(evidence.get("holdout_error_after")),
        statement=finding["statement"],
        advice=finding.get("advice", ""),
        correction=finding.get("correction", ""),
    )


def _span(span: Mapping[str, Any]) -> TimeSpan:
    return TimeSpan(
        recording=str(span.get("recording", "")), start=number(span.get("start")), end=number(span.get("end"))
    )


def _parameter(name: str, told: Mapping[str, Any]) -> FindingParameter:
    value, std = number(told.get("value")), number(told.get("std"))
    return FindingParameter(name=name, value=value, std=std, unit=str(told.get("unit") or ""))
