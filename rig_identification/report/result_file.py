"""``result.json`` read again, for whoever puts several results beside each other."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.joint import JointInformation
from rig_identification.report.joint_json import joint_from_dict
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.several.session_result import SessionResult

Array = NDArray[np.float64]

#: Bytes. A result with the joint information of a thousand doubts takes 20 MB.
LARGEST = 1 << 26


def read_result(path: Path, name: str) -> SessionResult:
    """The answer in a ``result.json``.

    Raises
    ------
    InputError
        It cannot be read, or is no result.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise InputError(f"{path}: is larger than {LARGEST >> 20} MiB, which no result is; leave it out")
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; name a result.json or its folder") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is no JSON ({error}); identify the session again") from error
    try:
        return result_from_dict(document, name)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError(
            f"{path}: is no result of identify: {error!r}; identify the session again"
        ) from error


def result_from_dict(document: Mapping[str, Any], name: str) -> SessionResult:
    """Inverse of ``result_to_dict``, as far as several results need it.

    Raises KeyError, TypeError, ValueError, AttributeError or IndexError where the document is no result.
    """
    lost = tuple(str(element) for element in document["unobservable"])
    tensor = _numbers(document["inertia"]["value"], (3, 3))
    values = np.concatenate(
        [
            [_number(document["mass"]["value"])],
            _numbers(document["center_of_mass"]["value"], (3,)),
            tensor[np.triu_indices(3)],
        ]
    )
    covariance = _numbers(document["covariance"], (10, 10))
    seen = np.array([element not in lost for element in ELEMENTS])
    if not (np.all(np.isfinite(values[seen])) and np.all(np.isfinite(covariance[np.ix_(seen, seen)]))):
        raise ValueError("a number that is not named in unobservable is null")
    verdict = str(document["mismatch"]["verdict"])
    findings = tuple(dict(finding) for finding in document["mismatch"]["findings"])
    joint = _joint(document, verdict)
    return SessionResult(name, InertialEstimate(values, covariance, lost), verdict, findings, joint)


def _joint(document: Mapping[str, Any], verdict: str) -> JointInformation | None:
    # Of an answer that leaves something nobody knows what its errors are made of
    told = document.get("joint")
    return None if told is None or verdict == "unexplained" else joint_from_dict(told)


def _numbers(values: Any, shape: tuple[int, ...]) -> Array:
    numbers = np.array(values, dtype=object)
    if numbers.shape != shape:
        raise ValueError(f"{numbers.shape} numbers where {shape} are due")
    return np.array([_number(value) for value in numbers.ravel()]).reshape(shape)


def _number(value: Any) -> float:
    return np.nan if value is None else float(value)
