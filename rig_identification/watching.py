"""The use case of a recording under way: what is there of it is examined, looked at, and told in words.

Whoever records hands on all that came so far, again and again; each time costs some seconds of one core.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.identification import fault_text, prepare
from rig_identification.raw import RawSession
from rig_identification.recording import Series, Session
from rig_identification.result import InertialEstimate

Array = NDArray[np.float64]

#: s of motion before which nothing is said of a run: a fit of less than a swing tells nothing.
SHORTEST = 4.0
#: s of motion that are looked at: whoever hands on more waits longer for less.
LONGEST = 30.0


@dataclass(frozen=True)
class Expected:
    """What is to come of the run under way, as one aims for."""

    seconds: float = 60.0  # planned length of the run
    aim: float = 0.01  # share of its natural size to which each element of J is to be known, 95 % half-width
    #: Planned force by run, s after the exciter's start and N in its frame. Where none is carried out, the
    #: measured force is taken to repeat itself.
    forces: Mapping[str, Series] = field(default_factory=dict)


@dataclass(frozen=True)
class Watched:
    """What is to be said of a recording under way."""

    recording: str
    seconds: float  # of it that were looked at
    faults: tuple[str, ...]  # of the set-up, a sentence or two each
    verdict: str  # "none", "explained", "unexplained"; "" where nothing was fitted
    text: str  # for a person
    error: float | None = None  # residuals in units of noise
    cause: str = ""  # short name of what explains the motion
    parameters: dict[str, dict[str, object]] | None = None  # of the finding: name -> value, std, unit
    estimate: InertialEstimate | None = None
    #: seconds, share, std by length; aim; enough: s or None; force: "planned" or "repeated"
    forecast: dict[str, object] | None = None


class Watching:
    """Looks at one run after the other while it grows."""

    def __init__(self, expected: Expected | None = None) -> None:
        self.expected = expected or Expected()
        self._name = ""
        self._before: object | None = None
        self._forecast: dict[str, object] | None = None

    def look(
        self, raw: RawSession, whole: bool = True, progress: Callable[[str], None] | None = None
    ) -> Watched:
        """Say what ``raw`` tells, whose last recording is under way.

        whole: whether that recording is there from its beginning. Where it is not, the forecast made before
        stays: of what was left out it would know nothing.
        """
        name = raw.recordings[-1].name
        if name != self._name:
            self._name, self._before, self._forecast = name, None, None
        try:
            prepared = prepare(raw, progress)
        except InputError as error:
            return Watched(name, 0.0, (str(error),), "", str(error))
        faults = () if prepared.examination is None else prepared.examination.faults
        told = tuple(fault_text(fault) for fault in faults)
        return self._looked(prepared.session, name, told, whole)

    def _looked(self, session: Session, name: str, faults: tuple[str, ...], whole: bool) -> Watched:
        from rig_identification.live.excitation import moves
        from rig_identification.watch.look import Look, look

        run = session.recordings[-1]
        if run.kind != "dynamic" or run.duration < SHORTEST:
            return Watched(name, run.duration, faults, "", f"{name}: {run.duration:.0f} s are there so far.")
        if not moves(run):
            return Watched(name, run.duration, faults, "", f"{name}: the body does not move yet.")
        before = self._before if isinstance(self._before, Look) else None
        try:
            found = look(session, before)
        except InputError as error:
            return Watched(name, run.duration, faults, "", str(error))
        except (FloatingPointError, np.linalg.LinAlgError):
            self._before = None
            return Watched(
                name, run.duration, faults, "unexplained",
                "The model cannot follow the motion: look for a cable that hangs slack, or a hinge that is "
                "not where it is described.",
            )  # fmt: skip
        self._before = found
        if whole and found.verdict == "none":
            self._forecast = self._foreseen(found, session, name)
        finding = found.finding
        return Watched(
            name, run.duration, faults, found.verdict, found.text, found.error, found.cause,
            None if finding is None else finding.parameters, found.estimate, self._forecast,
        )  # fmt: skip

    def _foreseen(self, found: object, session: Session, name: str) -> dict[str, object] | None:
        from rig_identification.watch.forecast import forecast
        from rig_identification.watch.look import Look
        from rig_identification.watch.planned import begun

        assert isinstance(found, Look)
        measured = session.recordings[-1].exciter_force
        force = None if measured is None else begun(measured, self.expected.forces, name)
        made = forecast(found.fitted, name, self.expected.seconds, force)
        if made is None:
            return self._forecast
        return {
            "seconds": made.seconds.tolist(),
            "share": made.share.tolist(),
            "std": made.std.tolist(),
            "aim": self.expected.aim,
            "enough": made.enough(self.expected.aim),
            "force": "repeated" if force is None else "planned",
        }
