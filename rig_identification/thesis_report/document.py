"""``thesis.json``: every number of the rerun, SI units."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from rig_identification import __version__
from rig_identification.model.modes import Mode
from rig_identification.thesis import read_text_remarks
from rig_identification.thesis_report.table import ELEMENTS, absolute_elements, case_rows
from rig_identification.thesis_rerun import (
    CaseResult,
    Examination,
    IntegratedPose,
    Rerun,
    worst_percent,
)


def rerun_document(found: Rerun, seconds: float) -> dict[str, Any]:
    """The rerun as plain numbers; ``seconds`` it took."""
    document: dict[str, Any] = {
        "version": __version__,
        "seconds": seconds,
        "units": "SI; errors in percent of the true element, in kg m^2 where that is zero",
        "cases": [_case(result) for result in found.cases],
        "remarks": [{"where": where, "remark": remark} for where, remark in read_text_remarks()],
    }
    if found.statics is not None:
        s = found.statics
        document["table_2_1"] = {
            "axes": "the table's, z down; m",
            "actual": s.actual,
            "published": s.published,
            "published_error": s.published - s.actual,
            "found": s.found,
            "found_error": s.found - s.actual,
            "poses": list(s.poses),
            "statement": s.statement,
            "std": s.std,
            "std_of_inclinometer_alone": s.std_inclinometer,
            "std_with_tensions": s.std_with_tensions,
        }
    if found.tracking is not None:
        t = found.tracking
        document["tracking"] = {
            "case": t.case,
            "duration": t.duration,
            "held": _pose(t.held),
            "integrated": _pose(t.integrated),
            "nees": t.nees,
            "within_95_percent": t.within_95,
            "freedom": t.freedom,
        }
    if found.examination is not None:
        document["examination"] = _examination(found.examination)
    return document


def write_json(document: dict[str, Any], path: Path) -> None:
    """Write a document; what is no number becomes null."""
    path.write_text(json.dumps(_finite(document), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _case(result: CaseResult) -> dict[str, Any]:
    case, comparison = result.case, result.comparison
    out: dict[str, Any] = {
        "case": case.label,
        "title": case.title,
        "true": case.inertia,
        "initial_guess": case.initial_guess,
        "published": None if case.published is None else case.published.identified,
        "tensors": dict(comparison.tensors),
        "searches": {
            name: {"inertia": fit.inertia, "converged": fit.converged, "iterations": fit.iterations}
            for name, fit in comparison.thesis.items()
        },
        "searches_apart": comparison.searches_apart,
        "output_error": {
            "converged": comparison.output_error.converged,
            "begun_from": comparison.output_error.begun,
            "seconds": comparison.output_error.seconds,
            "worst_percent": worst_percent(case, comparison.output_error.inertia),
            "guess_times": {
                f"{factor:g}": {
                    "converged": fit.converged,
                    "begun_from": fit.begun,
                    "worst_percent": worst_percent(case, fit.inertia),
                }
                for factor, fit in comparison.far_off.items()
            },
        },
        "errors": {
            row.key: dict(zip(ELEMENTS, row.values, strict=False)) or None for row in case_rows(result)
        },
        "errors_in_kg_m2": [name for name, a in zip(ELEMENTS, absolute_elements(result), strict=True) if a],
        "least_tension": result.least_tension,
        "modes": [_mode(mode) for mode in result.modes],
        "statements": list(result.statements),
        "remarks": list(case.remarks),
    }
    if result.realistic is not None:
        out["realistic"] = {
            "std": result.realistic.std,
            "error_in_sigma": result.realistic.error_in_sigma,
            "seconds": result.realistic.seconds,
        }
    if result.wrench is not None:
        out["wrench"] = {
            "order": "force N, moment N m about the centre of mass, body axes; rms over the window",
            "size": result.wrench.size,
            "std": result.wrench.std,
            "by_source": result.wrench.by_source,
        }
    if result.integration is not None:
        out["integration"] = {
            name: _integrated(pose)
            for name, pose in (("ideal", result.integration.ideal), ("noisy", result.integration.noisy))
        }
    if result.unknown_force is not None:
        unknown = result.unknown_force
        out["unknown_force"] = {
            "inertia": unknown.inertia,
            "converged": unknown.converged,
            "rounds": unknown.rounds,
            "force_rms": unknown.force_rms,
            "time": unknown.time,
            "force": unknown.force,
        }
    if result.windows is not None:
        w = result.windows
        out["windows"] = {
            "start": w.start,
            "a": w.thesis,
            "a_converged": w.thesis_converged,
            "d": w.output_error,
            "d_std": w.output_error_std,
        }
    return out


def _integrated(pose: IntegratedPose) -> dict[str, Any]:
    """Figures 4.1 and 4.2 in numbers."""
    return {
        "center_percent_worst": np.max(np.abs(pose.center_percent), axis=0),
        "T_percent_worst": np.nanmax(np.abs(pose.T_percent), axis=0),
        "T_worst": np.max(np.abs(pose.T - pose.true_T), axis=0),
    }


def _examination(found: Examination) -> dict[str, Any]:
    """The thesis' assumptions as the ideal model of a session of one case."""
    return {
        "case": found.case,
        "order": "xx xy xz yy yz zz, kg m^2 about the centre of mass without the rotor",
        "rotor_mass": found.rotor_mass,
        "duration": found.duration,
        "true": found.true,
        "before": found.before,
        "after": found.after,
        "std": found.std,
        "percent_before": found.percent(found.before),
        "percent_after": found.percent(found.after),
        "holdout_error_before": found.holdout_before,
        "holdout_error_after": found.holdout_after,
        "verdict": found.verdict,
        "findings": [
            {"effect": f.effect, "where": f.where, "parameters": f.parameters, "statement": f.statement}
            for f in found.findings
        ],
        "seconds": found.seconds,
    }


def _mode(mode: Mode) -> dict[str, Any]:
    return {"frequency": mode.frequency, "shape": mode.shape, "energy": mode.energy}


def _pose(error: Any) -> dict[str, float]:
    return {
        "position_rms": error.position_rms,
        "attitude_rms": error.attitude_rms,
        "position_last": float(error.position[-1]),
        "attitude_last": float(error.attitude[-1]),
    }


def _finite(value: Any) -> Any:
    """Lists and numbers that JSON knows."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _finite(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, np.generic):
        return _finite(value.item())
    if isinstance(value, float):
        # Nine digits are far below any error here
        return float(f"{value:.9g}") if math.isfinite(value) else None
    return value
