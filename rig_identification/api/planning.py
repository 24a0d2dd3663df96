"""``plan``: which runs to record in the minutes that there are, and what they would tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.api.identifying import Progress
from rig_identification.errors import ArgumentError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rig_identification.plan import Before, Known, Means, Plan, Stated
    from rig_identification.rig import Rig
    from rig_identification.several.session_result import SessionResult

    Array = NDArray[np.float64]

#: Files of a plan.
PAGE, DOCUMENT, SESSION, RIG, COMMANDS = "plan.html", "plan.json", "session.yaml", "rig.yaml", "exciter.csv"
FILES = (PAGE, DOCUMENT, SESSION, RIG, COMMANDS)
EXCITERS = ("motor", "shaker")
#: Means -> the largest that makes sense; all are above 0.
LIMITS = {
    "minutes": 1e3,
    "force": 1.0,
    "pull": 0.5,
    "highest": 20.0,
    "travel": 10.0,
    "taut": 0.9,
    "rest": 600.0,
}


@dataclass(frozen=True)
class Planned:
    """A plan, and the rig description that it is for."""

    plan: Plan
    described: bytes

    def write(self, folder: str | Path) -> None:
        """Write the files of a plan into a folder, all or none. Raises InputError."""
        from rig_identification.files import write_together
        from rig_identification.plan_report import (
            write_commands,
            write_plan,
            write_plan_page,
            write_session_text,
        )

        write_together(
            Path(folder),
            {
                PAGE: lambda path: write_plan_page(self.plan, path),
                DOCUMENT: lambda path: write_plan(self.plan, path),
                SESSION: lambda path: write_session_text(self.plan, RIG, path),
                RIG: self._write_rig,
                COMMANDS: lambda path: write_commands(self.plan, path),
            },
        )

    def _write_rig(self, path: Path) -> None:
        path.write_bytes(self.described)


def plan_session(
    rig: str | Path,
    body: Array,
    means: Means,
    *,
    progress: Progress | None = None,
    before: Before | None = None,
) -> Planned:
    """Plan a session on the rig of a description.

    body: (10,) what the plan is for, see :func:`boxed` and :func:`given_body`. means: see :func:`means_of`.
    before: an earlier session of the same body on that rig, see :func:`earlier`. Raises InputError.
    """
    from rig_identification.plan import plan
    from rig_identification.session import read_rig

    file = Path(rig)
    return Planned(plan(read_rig(file), body, means, progress or _unseen, before), file.read_bytes())


def earlier(path: Path) -> Before:
    """What the ``result.json`` of an earlier session leaves open, and what it knows.

    Ties are alternatives that trail by less than what counts as decided. Raises InputError where the file is
    no result.
    """
    import json

    import numpy as np

    from rig_identification.plan import Before
    from rig_identification.plan.apart import DECIDED
    from rig_identification.report.result_file import read_result

    result = read_result(path, path.parent.name)
    mismatch = json.loads(path.read_text(encoding="utf-8"))["mismatch"]
    rivals = [_stated(a) for a in mismatch["alternatives"] if a.get("log_likelihood_gap") is not None]
    return Before(
        tuple(stated for stated in map(_stated, mismatch["findings"]) if stated.numbers),
        tuple(r for r in rivals if r.gap < DECIDED),
        _known(result),
        np.where(result.observed, np.sqrt(np.diag(result.estimate.covariance)), np.nan),
    )


def _stated(entry: Mapping[str, Any]) -> Stated:
    """A finding or an alternative as ``result.json`` has it."""
    from rig_identification.mismatch.findings import called
    from rig_identification.plan import Stated

    told = (entry.get("numbers") or {}).items()
    numbers = {str(name): (float(value), float(std)) for name, (value, std) in told}
    effect, gap = str(entry["effect"]), float(entry.get("log_likelihood_gap") or 0.0)
    where, experiment = entry.get("where") or {}, str(entry.get("experiment") or "")
    return Stated(called(effect, where), effect, numbers, where, gap, experiment)


def _known(result: SessionResult) -> Known | None:
    """What the recordings of a result tell of body and rig; None where nobody knows what its errors share."""
    from rig_identification.plan import Known
    from rig_identification.several.fuse import reduced
    from rig_identification.several.ties import name_of, ties

    if result.joint is None:
        return None
    part = reduced(result, ties([result]), 0)
    return Known(tuple(name_of(key) for key in part.keys), part.information)


def _unseen(stage: str, fraction: float | None = None) -> None:
    """Progress that nobody watches."""


def boxed(
    rig: Rig, size: Sequence[float], mass: float | None = None, center: Sequence[float] | None = None
) -> Array:
    """(10,) a box of even density.

    size: edges, m. mass: kg, by default the description's. center: m, body, by default below the hinges.
    Raises ArgumentError.
    """
    import numpy as np

    from rig_identification.plan import box

    found = mass if mass is not None else rig.mass
    if found is None:
        raise ArgumentError("mass: missing, and the description has none; weigh the body or guess")
    if not (found > 0.0 and min(size) > 0.0):
        raise ArgumentError(f"box: edges and mass must be positive, not {list(size)} m and {found:g} kg")
    return given_body(box(rig, found, np.array(size), None if center is None else np.array(center)))


def given_body(elements: Sequence[float] | Array) -> Array:
    """(10,) m, c, J that a body can have. Raises ArgumentError."""
    import numpy as np

    from rig_identification.model.body import can_exist
    from rig_identification.result import ELEMENTS

    body = np.array(elements, dtype=float)
    if not can_exist(body):
        raise ArgumentError("body: no body has this mass and inertia; check the order " + " ".join(ELEMENTS))
    return body


def means_of(
    *,
    exciter: str = "motor",
    without: Sequence[str] = (),
    mocap: float = 0.0,
    changeover: float = 0.0,
    **amounts: float,
) -> Means:
    """What there is to record with.

    amounts: of :data:`LIMITS`, as the fields of ``plan.Means``. without: devices that do not record.
    mocap: Hz, 0: none. changeover: s. Raises ArgumentError for a number that makes no sense.
    """
    from rig_identification.plan import Means
    from rig_identification.simulate import SampleRates

    for name, value in amounts.items():
        if not 0.0 < value <= LIMITS[name]:
            raise ArgumentError(f"{name} {value:g}: give a number above 0 and up to {LIMITS[name]:g}")
    if not 0.0 <= changeover <= 3600.0:
        raise ArgumentError(f"changeover {changeover:g}: give 0 to 3600 s")
    if not 0.0 <= mocap <= 2000.0:
        raise ArgumentError(f"mocap {mocap:g}: give a rate up to 2000 Hz, or 0 for none")
    if exciter not in EXCITERS:
        raise ArgumentError(f"exciter {exciter}: is unknown; give {' or '.join(EXCITERS)}")
    rates = SampleRates(mocap=mocap, **dict.fromkeys(without, 0.0))
    return Means(exciter=exciter, rates=rates, changeover=changeover, **amounts)
