"""``result.json`` of the recording contract: strict JSON, null where nothing was determined."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig_identification.report.examination_json import check_part
from rig_identification.report.joint_json import joint_to_dict
from rig_identification.report.plain import plain
from rig_identification.result import (
    ELEMENTS,
    Finding,
    Identification,
    InertialEstimate,
    Mismatch,
    Quantity,
    TextbookAnswer,
    Work,
)

#: Index into the ten elements of each entry of the inertia tensor.
INERTIA_INDEX = ((4, 5, 6), (5, 7, 8), (6, 8, 9))


def result_to_dict(
    identification: Identification, provenance: Mapping[str, object] | None = None
) -> dict[str, object]:
    """Turn an identification into the contract's result.

    provenance: what it comes from (report/identity.py); it stands under that key.

    Returns
    -------
    dict
        The contract's keys. Elements named in ``unobservable`` are None, with their standard
        deviations and their rows and columns of the covariance.
        ``without_frame`` is None where no frame was described. Where effects were found,
        ``mismatch`` holds one key more, ``ideal_model``: mass, centre of mass, inertia and what is
        unobservable as the ideal model alone has them. Where the session was examined, ``check`` holds
        what was found before anything was fitted. ``textbook`` holds what formulas make of the same
        runs, where there is one for the rig. ``work`` says what the answer took, where it was counted,
        and ``interrupted`` is there, and true, where the user broke the search off. ``joint`` is what
        sessions are compared and fused by, where the model explains this one. ``budget`` holds the
        variances of the ten numbers by source, where they are told; ``vehicle`` what follows from them.
    """
    return {
        **estimate_part(identification.total, identification.without_frame),
        "mismatch": {
            **_mismatch(identification.mismatch),
            **_ideal_model(identification.figures.get("ideal")),
        },
        **_vehicle(identification.vehicle),
        **({} if provenance is None else {"provenance": plain(provenance)}),
        **_textbook(identification.textbook),
        **({} if identification.tie is None else {"tie": identification.tie}),
        **_work(identification.work),
        **({"interrupted": True} if identification.interrupted else {}),
        **({} if identification.examination is None else {"check": check_part(identification.examination)}),
        **({} if identification.joint is None else {"joint": joint_to_dict(identification.joint)}),
    }


def estimate_part(total: InertialEstimate, without_frame: InertialEstimate | None) -> dict[str, object]:
    """The contract's keys that tell of the body."""
    return {
        **_estimate(total),
        "covariance": _masked(total.covariance, _observable(total)),
        **_budget(total),
        "without_frame": None if without_frame is None else _alone(without_frame),
        "unobservable": list(total.unobservable),
    }


def write_result(
    identification: Identification, path: Path, provenance: Mapping[str, object] | None = None
) -> None:
    """Write :func:`result_to_dict` as strict JSON: no NaN, no infinity."""
    document = result_to_dict(identification, provenance)
    text = json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


def _observable(estimate: InertialEstimate) -> NDArray[np.bool_]:
    return np.array([name not in estimate.unobservable for name in ELEMENTS])


def _masked(covariance: NDArray[np.float64], observable: NDArray[np.bool_]) -> object:
    return plain(np.where(np.outer(observable, observable), covariance, np.nan))


def _alone(estimate: InertialEstimate) -> dict[str, object]:
    """The body without its carrying frame, with its covariance where its sources are told."""
    covariance = {"covariance": _masked(estimate.covariance, _observable(estimate))}
    return {**_estimate(estimate), **(covariance if estimate.sources else {}), **_budget(estimate)}


def _budget(estimate: InertialEstimate) -> dict[str, object]:
    """Variances of the ten numbers by source; nothing where they are not told."""
    if not estimate.sources:
        return {}
    seen = _observable(estimate)
    rows = [
        {
            "source": source.name,
            "kind": source.kind,
            "degrees_of_freedom": source.degrees_of_freedom,
            "variance": _numbers(np.where(seen, np.diag(source.covariance), np.nan)),
        }
        for source in estimate.sources
    ]
    return {"budget": rows}


def _vehicle(quantities: tuple[Quantity, ...]) -> dict[str, object]:
    if not quantities:
        return {}
    return {"vehicle": {q.name: plain({"value": q.value, "std": q.std, "unit": q.unit}) for q in quantities}}


def _estimate(estimate: InertialEstimate) -> dict[str, object]:
    """Value and standard deviation of mass, centre of mass and inertia tensor."""
    observable = _observable(estimate)
    variance = np.diag(estimate.covariance)
    with np.errstate(invalid="ignore"):  # an unobservable element may have no variance at all
        columns = {"value": estimate.values, "std": np.sqrt(variance)}
    masked = {key: _numbers(np.where(observable, column, np.nan)) for key, column in columns.items()}
    return {
        "mass": {key: column[0] for key, column in masked.items()},
        "center_of_mass": {key: column[1:4] for key, column in masked.items()},
        "inertia": {
            key: [[column[i] for i in row] for row in INERTIA_INDEX] for key, column in masked.items()
        },
    }


def _mismatch(mismatch: Mismatch) -> dict[str, object]:
    return {
        "verdict": mismatch.verdict,
        "findings": [_finding(finding) for finding in mismatch.findings],
        "alternatives": plain(mismatch.alternatives),
    }


def _textbook(answers: tuple[TextbookAnswer, ...]) -> dict[str, object]:
    """What formulas make of the same runs; nothing where none is for such a rig."""
    if not answers:
        return {}
    return {
        "textbook": [
            {
                "formula": a.formula,
                "element": a.element,
                "value": a.value,
                "std": a.std,
                "unit": a.unit,
                "period": {"value": a.period, "std": a.period_std, "unit": "s"},
                "amplitude": {"value": a.amplitude, "unit": "rad"},
                "decay": {"value": a.decay, "unit": "1/s"},
                "std_from": dict(a.shares),
                "leaves_out": list(a.leaves_out),
            }
            for a in answers
        ]
    }


def _work(work: Work | None) -> dict[str, object]:
    if work is None:
        return {}
    return {"work": plain({"used": work.used, "limit": work.limit, "left_untried": list(work.untried)})}


def _finding(finding: Finding) -> dict[str, object]:
    """The contract's keys; of a fault of the set-up advice and corrected lines beside them."""
    beside = {"advice": finding.advice, "correction": finding.correction}
    return {
        "effect": finding.effect,
        "where": plain(finding.where),
        "parameters": plain(finding.parameters),
        "evidence": plain(finding.evidence),
        "statement": finding.statement,
        **{key: text for key, text in beside.items() if text},
        **({"numbers": plain(finding.numbers)} if finding.numbers else {}),
    }


def _ideal_model(ideal: object) -> dict[str, object]:
    """What the ideal model answered before effects were found; nothing where it is the answer itself."""
    if not isinstance(ideal, Identification):
        return {}
    return {"ideal_model": {**_estimate(ideal.total), "unobservable": list(ideal.total.unobservable)}}


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
