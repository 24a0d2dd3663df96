"""``compare.json``, and the ``result.json`` of several sessions together: strict JSON."""

from __future__ import annotations

import json
from pathlib import Path

from rig_identification.report.plain import plain
from rig_identification.report.result_json import estimate_part
from rig_identification.several.compare import Comparison, Test
from rig_identification.several.fuse import Fused

#: Verdicts from the best to the worst.
VERDICTS = ("none", "explained", "unexplained")


def comparison_to_dict(found: Comparison) -> dict[str, object]:
    """Whether sessions agree: the verdict, each test, and what each number is on average."""
    return {
        "agree": found.agree,
        "level": found.level,
        "p": found.p,
        "together": _test(found.together),
        "numbers": {
            name: {**_test(test), "mean": found.mean[name][0], "std": found.mean[name][1]}
            for name, test in found.numbers.items()
        },
        "disagreeing": list(found.disagreeing),
        "without_session": {name: _test(test) for name, test in found.sessions.items()},
        "shared_doubts": found.shared,
        "sessions": [
            {
                "session": result.name,
                "rig": rig,
                "verdict": result.verdict,
                "correlation_known": result.joint is not None,
                "unobservable": list(result.estimate.unobservable),
            }
            for result, rig in zip(found.results, found.rigs, strict=True)
        ],
    }


def fused_to_dict(fused: Fused) -> dict[str, object]:
    """The contract's result for several sessions together.

    The verdict is the worst of the sessions', and ``unexplained`` where they do not agree. Findings are those
    of the sessions, each with its session's name. ``comparison`` is as in ``compare.json``, and ``gain`` says
    by what factor the fused std is smaller than the best session's.
    """
    results = fused.comparison.results
    worst = max((r.verdict for r in results), key=VERDICTS.index)
    return {
        **estimate_part(fused.total, fused.without_frame),
        "mismatch": {
            "verdict": worst if fused.comparison.agree else VERDICTS[-1],
            "findings": [{**finding, "session": r.name} for r in results for finding in r.findings],
            "alternatives": [],
        },
        "gain": plain(fused.gain),
        "comparison": comparison_to_dict(fused.comparison),
    }


def write_comparison(found: Comparison, path: Path) -> None:
    """Write :func:`comparison_to_dict`."""
    _write(comparison_to_dict(found), path)


def write_fused(fused: Fused, path: Path) -> None:
    """Write :func:`fused_to_dict`."""
    _write(fused_to_dict(fused), path)


def _test(test: Test) -> dict[str, object]:
    return {"chi_square": test.chi_square, "degrees_of_freedom": test.freedom, "p": test.p}


def _write(document: dict[str, object], path: Path) -> None:
    text = json.dumps(plain(document), indent=2, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
