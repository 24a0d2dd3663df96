"""Results beside each other: what a folder of sessions tells of one body over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.errors import InputError

if TYPE_CHECKING:
    from rig_identification.several.session_result import SessionResult


def read_results(files: Mapping[str, Path]) -> tuple[list[SessionResult], list[str]]:
    """Results by their names in the order in which they were recorded, and a line for each that is none."""
    from rig_identification.report.result_file import read_result
    from rig_identification.report.several_page import in_time

    found, lines = [], []
    for name, path in files.items():
        try:
            found.append(read_result(path, name))
        except InputError as error:
            lines.append(str(error))
    starts = [0 if result.joint is None else result.joint.start_ns for result in found]
    return [found[k] for k in in_time(starts)], lines


def comparison_page(results: Sequence[SessionResult]) -> str:
    """Whether the sessions agree on one body, and each number session by session, as a page.

    Raises InputError for fewer than two.
    """
    from rig_identification.report.several_page import render_comparison
    from rig_identification.several.compare import compare

    if len(results) < 2:
        raise InputError("one result alone agrees with itself; choose at least two")
    return render_comparison(compare(results))
