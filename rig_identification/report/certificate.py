"""A certificate's numbers, from a ``result.json``: values, expanded uncertainties, and the budget by source.

Terms are those of JCGM 100:2008 (GUM): the standard uncertainty u is one standard deviation; the expanded one
is U = k u with the coverage factor k of Student's distribution for 95 % and for the effective degrees of
freedom of u, which follow from those of its sources by the Welch-Satterthwaite formula (GUM, G.4.1).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from rig_identification.errors import InputError
from rig_identification.report.plain import plain
from rig_identification.report.result_json import INERTIA_INDEX
from rig_identification.result import ELEMENTS

Array = NDArray[np.float64]

#: Probability that an expanded uncertainty stands for.
LEVEL = 0.95
#: By how much of u^2 the rows of a budget may miss it: rounding of twenty sums of numbers written in full.
ADDS_UP = 1e-9
UNITS = ("kg", "m", "m", "m", *("kg m²",) * 6)
#: What each kind of source is called.
KINDS = {
    "noise": "noise in motion",
    "rest": "noise at rest",
    "tolerance": "rig description",
    "scale": "ground scale",
    "belief": "prior belief",
    "frame": "carrying frame",
    "model": "model",
}


@dataclass(frozen=True)
class Number:
    """One certified number; all None but the name where the recordings do not determine it."""

    name: str
    unit: str
    value: float | None
    u: float | None  # standard uncertainty
    freedom: float | None  # effective degrees of freedom; None: infinite
    k: float | None  # coverage factor
    expanded: float | None  # U = k u


@dataclass(frozen=True)
class Row:
    """One source of the budget."""

    source: str
    kind: str
    freedom: float | None
    variance: tuple[float | None, ...]  # of each number, its unit squared


@dataclass(frozen=True)
class CertifiedBody:
    """One body with its budget."""

    heading: str
    numbers: tuple[Number, ...]
    rows: tuple[Row, ...]  # largest first
    correlation: tuple[tuple[float | None, ...], ...]

    def share(self, row: Row, element: int) -> float | None:
        """Part of u^2 of one number that a row is."""
        variance, u = row.variance[element], self.numbers[element].u
        return None if variance is None or not u else variance / u**2


@dataclass(frozen=True)
class Certificate:
    """Everything that a certificate says."""

    provenance: Mapping[str, Any]
    verdict: str
    findings: tuple[str, ...]
    interrupted: bool
    bodies: tuple[CertifiedBody, ...]
    vehicle: tuple[Number, ...]


def read_result(path: Path) -> dict[str, Any]:
    """The document of a ``result.json``. Raises InputError where it is none."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; name a result.json or a session") from error
    except ValueError as error:
        raise InputError(f"{path}: is not JSON ({error}); name a result.json of identify") from error
    if not isinstance(document, dict) or "inertia" not in document:
        raise InputError(f"{path}: is no result.json of identify; name one, or a session")
    return document


def certificate_of(document: Mapping[str, Any], where: str) -> Certificate:
    """The certificate of a result. where: names it in messages.

    Raises
    ------
    InputError
        It holds no budget, or one whose rows do not add up to its variances.
    """
    if not document.get("budget"):
        raise InputError(
            f"{where}: budget: missing; a session without a fit has none, and results of older versions have "
            "none: give the session itself"
        )
    try:
        alone = document.get("without_frame")
        both = "Body" if not alone else "Body with its carrying frame"
        bodies = [_body(both, document, where)]
        if alone:
            bodies.append(_body("Body without its carrying frame", alone, where))
        freedom = min((n.freedom for n in bodies[-1].numbers if n.freedom is not None), default=None)
        return Certificate(
            provenance=document.get("provenance") or {},
            verdict=str(document["mismatch"]["verdict"]),
            findings=tuple(str(f["statement"]) for f in document["mismatch"]["findings"]),
            interrupted=bool(document.get("interrupted", False)),
            bodies=tuple(bodies),
            vehicle=tuple(
                _number(name, str(q["unit"]), q["value"], q["std"], freedom)
                for name, q in document.get("vehicle", {}).items()
            ),
        )
    except (KeyError, TypeError, IndexError, AttributeError) as error:
        raise InputError(
            f"{where}: is no whole result.json ({error!r}); identify the session again"
        ) from error


def _body(heading: str, estimate: Mapping[str, Any], where: str) -> CertifiedBody:
    values, std = _ten(estimate, "value"), _ten(estimate, "std")
    rows = [
        Row(str(r["source"]), str(r["kind"]), r["degrees_of_freedom"], tuple(r["variance"]))
        for r in estimate["budget"]
    ]
    for i, (name, u) in enumerate(zip(ELEMENTS, std, strict=True)):
        told = math.fsum(row.variance[i] or 0.0 for row in rows)
        if u is not None and abs(told - u**2) > ADDS_UP * u**2:
            raise InputError(
                f"{where}: budget: the rows of {name} come to {told:.12g}, its variance is {u**2:.12g}; "
                "the file was changed: identify the session again"
            )
    numbers = tuple(
        _number(name, unit, values[i], std[i], effective_freedom(rows, i))
        for i, (name, unit) in enumerate(zip(ELEMENTS, UNITS, strict=True))
    )
    rows.sort(key=lambda row: -_weight(row, std))
    covariance = np.array(estimate["covariance"], dtype=float)
    return CertifiedBody(heading, numbers, tuple(rows), _correlation(covariance))


def _ten(estimate: Mapping[str, Any], key: str) -> list[float | None]:
    """The ten numbers, or their std, in the order of ELEMENTS."""
    out: list[float | None] = [estimate["mass"][key], *estimate["center_of_mass"][key], *([None] * 6)]
    for i, row in enumerate(INERTIA_INDEX):
        for j, element in enumerate(row):
            out[element] = estimate["inertia"][key][i][j]
    return out


def effective_freedom(rows: Sequence[Row], element: int) -> float | None:
    """Degrees of freedom of a number's u (Welch-Satterthwaite); None: infinite."""
    whole = math.fsum(row.variance[element] or 0.0 for row in rows)
    doubt = math.fsum((row.variance[element] or 0.0) ** 2 / row.freedom for row in rows if row.freedom)
    return None if doubt <= 0.0 else whole**2 / doubt


def _number(name: str, unit: str, value: float | None, u: float | None, freedom: float | None) -> Number:
    if value is None or u is None:
        return Number(name, unit, None, None, None, None, None)
    k = float(t.ppf(0.5 + 0.5 * LEVEL, np.inf if freedom is None else max(freedom, 1.0)))
    return Number(name, unit, value, u, freedom, k, k * u)


def _weight(row: Row, std: Sequence[float | None]) -> float:
    """Largest share of any number that a row has."""
    return max(
        (abs(v) / u**2 for v, u in zip(row.variance, std, strict=True) if v is not None and u), default=0.0
    )


def _correlation(covariance: Array) -> tuple[tuple[float | None, ...], ...]:
    std = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        matrix = covariance / np.outer(std, std)
    return tuple(tuple(float(c) if np.isfinite(c) else None for c in line) for line in matrix)


def certificate_document(certificate: Certificate) -> dict[str, object]:
    """``certificate.json``: SI units, every number in full."""
    return {
        "what": "uncertainty budget after JCGM 100:2008",
        "coverage_probability": LEVEL,
        "provenance": plain(certificate.provenance),
        "verdict": certificate.verdict,
        "findings": list(certificate.findings),
        **({"interrupted": True} if certificate.interrupted else {}),
        "bodies": [_body_document(body) for body in certificate.bodies],
        "vehicle": [_number_document(number) for number in certificate.vehicle],
    }


def _body_document(body: CertifiedBody) -> dict[str, object]:
    return {
        "body": body.heading,
        "order": list(ELEMENTS),
        "quantities": [_number_document(number) for number in body.numbers],
        "budget": [
            {
                "source": row.source,
                "kind": row.kind,
                "degrees_of_freedom": row.freedom,
                "variance": list(row.variance),
                "share": [body.share(row, i) for i in range(len(ELEMENTS))],
            }
            for row in body.rows
        ],
        "correlation": [list(line) for line in body.correlation],
    }


def _number_document(number: Number) -> dict[str, object]:
    return {
        "quantity": number.name,
        "unit": number.unit,
        "value": number.value,
        "standard_uncertainty": number.u,
        "degrees_of_freedom": number.freedom,
        "coverage_factor": number.k,
        "expanded_uncertainty": number.expanded,
    }


def write_certificate(certificate: Certificate, path: Path) -> None:
    """Write :func:`certificate_document` as strict JSON."""
    document = certificate_document(certificate)
    text = json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
