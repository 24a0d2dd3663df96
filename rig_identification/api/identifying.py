"""``identify``: mass, centre of mass, inertia, and what the rig's model left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.api.checking import Check
from rig_identification.api.reading import Recorded, read
from rig_identification.api.result import Result
from rig_identification.api.simulating import Simulated

if TYPE_CHECKING:
    from rig_identification.identification import Prepared, Watcher
    from rig_identification.recording import Session

#: Called with a stage's name, and with how far it is from 0 to 1 where that is known.
Progress = Callable[..., None]


class Stopped(KeyboardInterrupt):
    """The user broke the search off when there was an answer already; ``result``: the best one until then."""

    def __init__(self, result: Result) -> None:
        super().__init__("interrupted")
        self.result = result


def identify(
    session: str | Path | Recorded | Check | Simulated | Session | Prepared,
    *,
    namespace: str = "/rig",
    topics: Mapping[str, str] | None = None,
    work: float | None = None,
    progress: Progress | None = None,
    watcher: Watcher | None = None,
) -> Result:
    """Estimate the body of a session, and name the physics that the ideal model left out.

    Parameters
    ----------
    session
        The session's folder or its ``session.yaml``; or what :func:`read`, :func:`check` or :func:`simulate`
        returned. What is on disk, or was read, is examined first. What was checked is not examined again.
    namespace, topics
        As of :func:`read`; not used where the session is read already.
    work : float, optional
        After so many units of work the search for left-out physics begins nothing new. The default takes
        about two minutes on two cores.
    progress : callable, optional
        Called as ``progress(stage)`` or ``progress(stage, fraction)``.
    watcher : callable, optional
        Called with each better answer, an ``Identification``, while the search runs. The result stays the
        same.

    Raises
    ------
    InputError
        The session cannot be used.
    Stopped
        The user interrupted (Ctrl-C, or the notebook's stop); ``.result`` holds the best answer until then.
    """
    from rig_identification.identification import identify_prepared
    from rig_identification.result import Interrupted

    if isinstance(session, str | Path):
        session = read(session, namespace=namespace, topics=topics, progress=progress)
    prepared = _prepared(session, progress)
    digests = _digests(session, progress)
    try:
        answer = identify_prepared(prepared, progress, work, watcher)
    except Interrupted as stopped:
        raise Stopped(Result(stopped.answer, prepared.session, digests)) from stopped
    return Result(answer, prepared.session, digests)


def _digests(
    session: Recorded | Check | Simulated | Session | Prepared, progress: Progress | None
) -> Mapping[str, str]:
    """SHA-256 of each file that a session was read from; none where it comes from memory."""
    from rig_identification.session.provenance import file_digests

    recorded = session.recorded if isinstance(session, Check) else session
    return file_digests(recorded.path, progress) if isinstance(recorded, Recorded) else {}


def _prepared(
    session: Recorded | Check | Simulated | Session | Prepared, progress: Progress | None
) -> Prepared:
    """A session ready to be fitted, whatever it was given as."""
    from rig_identification.identification import Prepared, prepare, prepare_examined
    from rig_identification.recording import Session

    if isinstance(session, Prepared):
        return session
    if isinstance(session, Check):
        return prepare_examined(session.examined)
    if isinstance(session, Simulated):
        session = session.session
    if isinstance(session, Session):  # in memory: there is nothing to examine
        return Prepared(session, None)
    return prepare(session.raw, progress)
