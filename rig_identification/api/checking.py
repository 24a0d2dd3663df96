"""``check``: what was set up wrongly, before anything is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.api.reading import Progress, Recorded, read

if TYPE_CHECKING:
    import pandas as pd

    from rig_identification.check.examine import Examined
    from rig_identification.examination import Examination

#: Files of an examination.
DOCUMENT, PAGE = "check.json", "check.html"


@dataclass(frozen=True)
class Check:
    """What an examination found. ``identify`` takes it in place of the session and does not examine again."""

    examination: Examination
    examined: Examined  # the session with what is certain corrected
    recorded: Recorded

    @property
    def sound(self) -> bool:
        """Whether no fault was found."""
        return not self.examination.faults

    @property
    def faults(self) -> pd.DataFrame:
        """One row a fault: effect, where, what is wrong, what to do, whether corrected, gain in nats."""
        from rig_identification.api.tables import table

        keys = ("effect", "where", "statement", "advice", "correction", "corrected", "gain")
        return table([{key: getattr(fault, key) for key in keys} for fault in self.examination.faults])

    @property
    def rest(self) -> pd.DataFrame:
        """One row a number measured at rest, beside what the description says of it."""
        from rig_identification.api.tables import table

        return table([asdict(reading) for reading in self.examination.rest])

    @property
    def topics(self) -> pd.DataFrame:
        """One row a topic of a bag: rate, gaps, and whether it is used."""
        from rig_identification.api.tables import table

        return table([asdict(topic) for topic in self.examination.topics])

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is worth to know and no fault."""
        return self.examination.warnings

    def to_dict(self) -> dict[str, object]:
        """The content of ``check.json``."""
        from rig_identification.report import examination_to_dict

        return examination_to_dict(self.examination)

    def write(self, folder: str | Path) -> None:
        """Write ``check.json`` and ``check.html`` into a folder, both or neither. Raises InputError."""
        from rig_identification.files import write_together
        from rig_identification.report import write_check, write_examination

        write_together(
            Path(folder),
            {
                DOCUMENT: lambda path: write_examination(self.examination, path),
                PAGE: lambda path: write_check(self.examination, self.recorded.rig, path),
            },
        )

    def _repr_html_(self) -> str:
        from rig_identification.api.html import check_html

        return check_html(self.examination)


def check(
    session: str | Path | Recorded,
    *,
    namespace: str = "/rig",
    topics: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> Check:
    """Find within seconds what was set up wrongly: units, axes, wiring, stamps, topics. Nothing is fitted.

    Parameters
    ----------
    session : str, Path or Recorded
        The session's folder or its ``session.yaml``, or what :func:`read` returned.
    namespace, topics
        As of :func:`read`; not used where the session is read already.
    progress : callable, optional
        Called with one sentence before each stage.

    Returns
    -------
    Check
        Faults are results. A session that ``identify`` will refuse bears a warning that says why.

    Raises
    ------
    InputError
        The session cannot be used, and no fault that was found says why.
    """
    from rig_identification.identification import check_raw

    given = session if isinstance(session, Recorded) else None
    recorded = given or read(Path(str(session)), namespace=namespace, topics=topics, progress=progress)
    found = check_raw(recorded.raw, progress)
    return Check(found.examination, found, recorded)
