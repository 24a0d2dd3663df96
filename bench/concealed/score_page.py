"""The score as a page for people (Markdown) and as a document for programs (JSON)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from bench.concealed.figures import Share, by_effect, by_element, shares, spreads
from bench.concealed.marks import ParameterMark, SessionMarks

DEFINITIONS = """\
- **Clear size**: in a recording that a fit may use, the effects change some channel by an rms of at least 5
  sigma of its noise (so the truth says), or the ideal model's J has an element off by 5 claimed sigma.
- **First place**: the first finding; without findings `none`, or, if the verdict is `unexplained`, `unknown`.
  Either of a pair counts. **First three**: findings, then alternatives by their gap, each effect once.
- **Stated tie**: an alternative with a log likelihood gap of 3 or less. Entrained air and the moving mass of
  the exciter, which motion cannot tell from inertia, are right in first place as a stated tie too.
- **J error**: norm of the six elements' errors over that of the six. The truth holds moving parts frozen.
- **Places and parameters** count where the right effect was named; a place that was not told is wrong.
- **Outside the table**: right is `unknown`. Shares carry 95 % intervals by Wilson."""


def document(marks: Sequence[SessionMarks], digest: str | None) -> dict[str, Any]:
    """Everything, plain."""
    return {
        "sealed_sha256": digest,
        "shares": [_share(s) for s in shares(marks)],
        "coverage_by_element": [_share(s) for s in by_element(marks)],
        "spreads": [asdict(s) for s in spreads(marks)],
        "effects": [asdict(e) for e in by_effect(marks)],
        "sessions": [{**asdict(m), "response": m.response} for m in marks],
    }


def page(marks: Sequence[SessionMarks], digest: str | None) -> str:
    """The same for a reader."""
    source = (
        f"Sealed truths, SHA-256 `{digest}`." if digest else "Open truths: development, not a sealed run."
    )
    parts = [
        "# Concealed sessions: the score",
        f"{len(marks)} sessions. {source}",
        DEFINITIONS,
        "## Counted",
        _table(
            ["what", "count", "share", "95 % interval", "wanted", "reached"], map(_share_row, shares(marks))
        ),
        "## Measured",
        _table(
            ["what", "median", "worst", "of"],
            ([s.label, _number(s.median), _number(s.worst), str(s.of)] for s in spreads(marks)),
        ),
        "## 95 % intervals by element",
        _table(
            ["element", "count", "share", "95 % interval"], (_share_row(s)[:4] for s in by_element(marks))
        ),
        "## By effect",
        _table(
            [
                "effect",
                "sessions",
                "clear",
                "first",
                "first three",
                "parameters within 3 sigma",
                "median error, %",
            ],
            (
                [
                    e.effect,
                    str(e.sessions),
                    str(e.clear),
                    str(e.first_right),
                    str(e.three_right),
                    e.within_3_sigma,
                    _number(e.median_percent),
                ]
                for e in by_effect(marks)
            ),
        ),
        "## Misses",
        _table(
            ["session", "truth", "clear", "said instead", "reason"], map(_miss_row, filter(_missed, marks))
        ),
        "## Every session",
        _table(
            [
                "session",
                "truth",
                "size",
                "over noise",
                "said",
                "first",
                "three",
                "place",
                "parameters: error %, sigma",
                "J % before",
                "J % after",
                "J sigma after",
                "held-out before",
                "after",
                "s",
            ],
            map(_session_row, marks),
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _missed(marks: SessionMarks) -> bool:
    return not marks.first_right


def _share(share: Share) -> dict[str, Any]:
    return {**asdict(share), "share": share.share, "interval": share.interval, "reached": share.reached}


def _share_row(share: Share) -> list[str]:
    low, high = share.interval or (None, None)
    wanted = [f"≥ {_percent(share.least)}"] if share.least is not None else []
    wanted += [f"≤ {_percent(share.most)}"] if share.most is not None else []
    return [
        share.label,
        f"{share.hits} of {share.of}",
        _percent(share.share),
        f"{_percent(low)} to {_percent(high)}" if low is not None else "",
        ", ".join(wanted),
        {None: "", True: "yes", False: "**no**"}[share.reached],
    ]


def _miss_row(marks: SessionMarks) -> list[str]:
    return [marks.session, _truth(marks), _yes(marks.clear), marks.said, marks.reason or ""]


def _session_row(marks: SessionMarks) -> list[str]:
    before, after = marks.before, marks.after
    wrong = [key for key, right in (marks.places or {}).items() if not right]
    return [
        marks.session,
        _truth(marks),
        _number(marks.size),
        _number(marks.over_noise),
        marks.said,
        _yes(marks.first_right),
        _yes(marks.three_right),
        "" if not marks.places else ("not " + ", ".join(wrong) if wrong else "yes"),
        "; ".join(map(_parameter, marks.parameters)),
        _number(before.inertia_percent if before else None),
        _number(after.inertia_percent if after else None),
        _number(after.inertia_sigma if after else None),
        _number(marks.holdout_before),
        _number(marks.holdout_after),
        _number(marks.seconds),
    ]


def _parameter(mark: ParameterMark) -> str:
    if mark.value is None:
        return f"{mark.name} not told"
    return f"{mark.name} {_number(mark.percent)}, {_number(mark.sigma)}"


def _truth(marks: SessionMarks) -> str:
    return (" + ".join(marks.truth) or "clean") + (" (outside)" if marks.kind == "outside" else "")


def _table(head: Sequence[str], rows: Any) -> str:
    lines = [list(head), ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100.0 * share:.1f} %"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def _yes(value: bool) -> str:
    return "yes" if value else "no"
