"""Results of the folder in the order in which they were recorded, and each number from session to session."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rig_identification.api.comparing import comparison_page, read_results
from rig_identification.report.several_page import date_of
from rig_identification.report.ten_numbers import elements
from rig_identification.ui.desk import Desk, apart, shown
from rig_identification.ui.folder import RESULT

#: Results that are read: each takes some ten milliseconds.
MOST_RESULTS = 200


def _show(desk: Desk, request: Request) -> Response:
    names = desk.folder.results()
    files = {_short(desk, name): desk.folder.below(name) for name in names[:MOST_RESULTS]}
    results, faults = read_results(files)
    chosen = request.query_params.getlist("result") or [result.name for result in results]
    rows = [_row(desk, files[result.name], result, result.name in chosen) for result in results]
    return desk.page(
        "history.html.j2", "/history", rows=rows, faults=faults, left_out=len(names) - len(files),
        query=[row["name"] for row in rows if row["chosen"]],
    )  # fmt: skip


def _short(desk: Desk, name: str) -> str:
    """A result by its folder."""
    return name.removesuffix(RESULT).rstrip("/") or desk.folder.root.name


def _row(desk: Desk, file: Any, result: Any, chosen: bool) -> dict[str, Any]:
    report = file.with_name("report.html")
    effects = dict.fromkeys(str(finding.get("effect")) for finding in result.findings)
    ten = elements(result.estimate)
    return {
        "name": result.name,
        "chosen": chosen,
        "date": date_of(0 if result.joint is None else result.joint.start_ns),
        "verdict": result.verdict,
        "findings": ", ".join(effects),
        "numbers": [ten[0], *ten[1:4], ten[4], ten[7], ten[9]],
        "report": desk.folder.name_of(report) if report.is_file() else "",
    }


def _compare(desk: Desk, request: Request) -> Response:
    """The page of a comparison, as a document by itself."""
    wanted = request.query_params.getlist("result")[:MOST_RESULTS]
    names = {_short(desk, name): name for name in desk.folder.results()}
    files = {name: desk.folder.below(names[name]) for name in wanted if name in names}
    return apart(comparison_page(read_results(files)[0]))


ROUTES = [Route("/history", shown(_show)), Route("/history/compare", shown(_compare))]
