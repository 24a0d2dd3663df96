"""The bench's log as a table and as figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

Entry = dict[str, Any]

GROUPS = {
    "unit": "units",
    "axes": "axes",
    "wiring": "wiring, files, weights",
    "cells": "cells and loggers",
    "stamps": "stamps",
}
#: Outcomes of a fault that shows, from right to worst.
OUTCOMES = ("named", "tie", "other kind", "later", "wrong", "silent", "refused", "too long", "crash")


def figures(entries: Sequence[Entry]) -> dict[str, Any]:
    """Counts, shares and times by group, and false alarms."""
    faults = [e for e in entries if e["kind"] == "fault" and not e["untellable"]]
    out: dict[str, Any] = {"groups": {}}
    for name in (*GROUPS, "all"):
        own = [e for e in faults if name in (e["group"], "all")]
        if own:
            out["groups"][name] = _group(own)
    out["untellable"] = Counter(e["outcome"] for e in entries if e.get("untellable"))
    for kind in ("clean", "ordinary"):
        own = [e for e in entries if e["kind"] == kind]
        told = [e for e in own if e["outcome"] != "quiet"]
        out[kind] = {"sessions": len(own), "told": len(told), "what": {e["session"]: _short(e) for e in told}}
    return out


def _group(own: Sequence[Entry]) -> dict[str, Any]:
    counts = Counter(e["outcome"] for e in own)
    seconds = [e["seconds"] for e in own if "seconds" in e]
    judged = [e["inertia"] for e in own if "inertia" in e]
    return {
        "cases": len(own),
        **{name: counts.get(name, 0) for name in OUTCOMES},
        "median_seconds": float(np.median(seconds)) if seconds else None,
        "most_seconds": float(np.max(seconds)) if seconds else None,
        "amounts_asked": sum(e.get("amount_right") is not None for e in own),
        "amounts_right": sum(e.get("amount_right") is True for e in own),
        "inertia_judged": len(judged),
        "inertia_within_3_sigma": sum(j["sigma"] is not None and j["sigma"] <= 3.0 for j in judged),
    }


def as_markdown(entries: Sequence[Entry], code: str, tasks: int) -> str:
    """The whole page; ``tasks``: how many there are to do in all."""
    score = figures(entries)
    lines = [
        "# The first day",
        "",
        f"{len(entries)} of {tasks} tasks done.",
        "",
        *_by_group(score),
        "",
        *_alarms(score),
        "",
        *_by_kind(entries),
    ]
    lines += ["", "## Misses", "", *_misses(entries)]
    lines += ["", "## What cannot be told", "", *_untellable(entries)]
    recorded = [e for e in entries if e["kind"] == "recorded"]
    if recorded:
        lines += [
            "",
            "## Recorded sessions",
            "",
            "| session | fault | outcome | told |",
            "| --- | --- | --- | --- |",
        ]
        lines += [
            f"| {e['session']} | {e.get('case') or 'none known'} | {e['outcome']} | {_cell(_short(e))} |"
            for e in recorded
        ]
    return "\n".join([*lines, "", f"Fingerprint of the code: {code}", ""])


def _by_group(score: dict[str, Any]) -> list[str]:
    head = ["group", "cases", *OUTCOMES, "named", "amounts right", "s, median", "s, most", "J within 3 sigma"]
    lines = [_row(head), _row(["---"] * len(head))]
    for name, g in score["groups"].items():
        share = f"{100 * g['named'] / g['cases']:.1f} %"
        judged = f"{g['inertia_within_3_sigma']} of {g['inertia_judged']}" if g["inertia_judged"] else "-"
        median, most = ("-" if g[k] is None else f"{g[k]:.1f}" for k in ("median_seconds", "most_seconds"))
        counts = [g[o] for o in OUTCOMES]
        amounts = f"{g['amounts_right']} of {g['amounts_asked']}"
        lines.append(
            _row([GROUPS.get(name, name), g["cases"], *counts, share, amounts, median, most, judged])
        )
    return lines


def _alarms(score: dict[str, Any]) -> list[str]:
    lines = []
    for kind, label in (("clean", "clean sessions"), ("ordinary", "sessions with an ordinary effect")):
        s = score[kind]
        lines.append(f"- {label}: {s['told']} of {s['sessions']} told as a fault of the set-up")
        lines += [f"  - {name}: {what}" for name, what in sorted(s["what"].items())]
    return lines


def _by_kind(entries: Sequence[Entry]) -> list[str]:
    """One line a kind of fault: the first two parts of the names."""
    lines = ["## By kind", "", "| kind | cases | named | else, as often |", "| --- | --- | --- | --- |"]
    faults = [e for e in entries if e["kind"] == "fault" and not e["untellable"]]
    kinds = dict.fromkeys(kind_of(e["case"]) for e in faults)
    for kind in kinds:
        own = [e for e in faults if kind_of(e["case"]) == kind]
        named = sum(e["outcome"] == "named" for e in own)
        rest = Counter(_short(e) for e in own if e["outcome"] != "named")
        told = "; ".join(f"{what} ({n})" for what, n in rest.most_common(4))
        lines.append(f"| {kind} | {len(own)} | {named} | {_cell(told)} |")
    return lines


def kind_of(case: str) -> str:
    """Group and kind of a fault's name: the unit, or what comes next."""
    parts = case.split("/")
    return "/".join([parts[0], parts[-1]] if parts[0] == "unit" else parts[:2])


def _short(entry: Entry) -> str:
    if entry["outcome"] in ("crash", "refused"):
        return f"{entry['outcome']}: {entry.get('statement', '')[:220]}"
    said = ", ".join(entry.get("said", ())[:3])
    return f"{entry['outcome']}: {said}" if said else entry["outcome"]


def _misses(entries: Iterable[Entry]) -> list[str]:
    lines = ["| rig | case | wanted | told |", "| --- | --- | --- | --- |"]
    for e in entries:
        if e["kind"] == "fault" and not e["untellable"] and e["outcome"] != "named":
            wanted = " ".join([e["effect"], *(e["channels"] if len(e["channels"]) < 3 else ["several"])])
            lines.append(f"| {e['rig']} | {e['case']} | {wanted} | {_cell(_short(e))} |")
    return lines


def _untellable(entries: Iterable[Entry]) -> list[str]:
    lines = ["| case | reason | told |", "| --- | --- | --- |"]
    for e in entries:
        if e.get("untellable"):
            lines.append(f"| {e['case']} ({e['rig']}) | {e['untellable']} | {_cell(_short(e))} |")
    return lines


def _cell(text: str) -> str:
    return text.replace("|", "/").replace("\n", " ")


def _row(cells: Sequence[object]) -> str:
    return "| " + " | ".join(str(c) for c in cells) + " |"
