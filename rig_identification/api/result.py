"""``Result``: what ``identify`` found, as arrays, as pandas tables and as a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.errors import InputError, did_you_mean

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from rig_identification.recording import Session
    from rig_identification.result import Identification

    Array = NDArray[np.float64]

#: Files of an answer.
RESULT, REPORT = "result.json", "report.html"
UNITS = ("kg", *("m",) * 3, *("kg m^2",) * 6)


@dataclass(frozen=True)
class Inertia:
    """An inertia tensor with one standard deviation of each element, (3, 3) kg m^2."""

    value: Array
    std: Array


@dataclass(frozen=True)
class Result:
    """The answer to one session. SI units; centre of mass and inertia in body axes.

    What the recordings cannot determine is NaN, never a guess.
    """

    identification: Identification
    session: Session  # as it was fitted: faults of the set-up corrected, unusable samples left out
    digests: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of each file that was read

    @property
    def values(self) -> Array:
        """(10,) m, cx, cy, cz, Jxx, Jxy, Jxz, Jyy, Jyz, Jzz; NaN: not determined."""
        import numpy as np

        return np.where(self._known(), self.identification.total.values, np.nan)

    @property
    def std(self) -> Array:
        """(10,) one standard deviation of each of :attr:`values`, from noise and the rig's tolerances."""
        import numpy as np

        return np.sqrt(np.diag(self._covariance()))

    @property
    def mass(self) -> float:
        """kg, body and carrying frame together."""
        return float(self.values[0])

    @property
    def center_of_mass(self) -> Array:
        """(3,) m."""
        return self.values[1:4]

    @property
    def inertia(self) -> Array:
        """(3, 3) kg m^2 about the centre of mass; off-diagonal elements are -∫xy dm and so on."""
        from rig_identification.model.body import tensor

        return tensor(self.values[4:])

    @property
    def unobservable(self) -> tuple[str, ...]:
        """Names of the elements that these recordings cannot determine."""
        return self.identification.total.unobservable

    @property
    def verdict(self) -> str:
        """``none``: the ideal model explains everything. ``explained``: it does with the findings in it.
        ``unexplained``: something is left."""
        return self.identification.mismatch.verdict

    @property
    def holdout_error(self) -> float | None:
        """Rms of the held-out prediction errors in units of noise, 1 is perfect; None: no held-out run."""
        return self.identification.holdout_error

    @property
    def numbers(self) -> pd.DataFrame:
        """One row an element: value, std, the 95 % interval from low to high, unit."""
        from rig_identification.api.tables import table
        from rig_identification.quantity import Z_95
        from rig_identification.result import ELEMENTS

        rows = []
        for name, value, std, unit in zip(ELEMENTS, self.values, self.std, UNITS, strict=True):
            half = Z_95 * std
            row = {"element": name, "value": value, "std": std, "low": value - half, "high": value + half}
            rows.append({**row, "unit": unit})
        return table(rows, index="element")

    @property
    def covariance(self) -> pd.DataFrame:
        """(10, 10) joint covariance of the elements; NaN in rows and columns of what is not determined."""
        from rig_identification.api.tables import square
        from rig_identification.result import ELEMENTS

        return square(self._covariance(), ELEMENTS)

    @property
    def findings(self) -> pd.DataFrame:
        """One row a finding: effect, where, statement, parameters, and its evidence (gains in nats)."""
        from rig_identification.api.tables import table

        rows = []
        for finding in self.identification.mismatch.findings:
            told = {"effect": finding.effect, "where": finding.where, "statement": finding.statement}
            rows.append({**told, "parameters": finding.parameters, **finding.evidence})
        return table(rows)

    @property
    def alternatives(self) -> pd.DataFrame:
        """One row an explanation that fits nearly as well, with its gap in nats."""
        from rig_identification.api.tables import table

        return table(self.identification.mismatch.alternatives)

    @property
    def parameters(self) -> pd.DataFrame:
        """One row a doubt about the rig: what is described, its tolerance, the estimate and its std."""
        from rig_identification.api.tables import table

        rows = [
            {
                "parameter": p.name,
                "described": p.nominal,
                "tolerance": p.prior_std,
                "value": p.value,
                "std": p.std,
                "unit": p.unit,
            }
            for p in self.identification.parameters
        ]
        return table(rows, index="parameter")

    @property
    def channels(self) -> pd.DataFrame:
        """One row a measured channel of a recording: its noise, and its residual's rms in units of it."""
        from rig_identification.api.tables import table

        rows = [
            {
                **self._key(c),
                "unit": c.unit,
                "samples": len(c.time),
                "noise": c.noise_std,
                "rms": c.rms_in_sigma,
            }
            for c in self.identification.channels
        ]
        return table(rows)

    def channel(self, recording: str, channel: str, quantity: str, axis: str | None = None) -> pd.DataFrame:
        """One channel of :attr:`channels` over time: measured, predicted, and the residual in units of noise.

        Raises
        ------
        InputError
            There is no such channel.
        """
        from rig_identification.api.tables import timed

        wanted = " ".join(filter(None, (recording, channel, quantity, axis)))
        named = {" ".join(filter(None, self._key(c).values())): c for c in self.identification.channels}
        if wanted not in named:
            raise InputError(f"{wanted}: is no channel of this result{did_you_mean(wanted, named)}")
        fit = named[wanted]
        columns = {"measured": fit.measured, "predicted": fit.predicted, "residual": fit.residual_in_sigma}
        return timed(fit.time, columns)

    def inertia_about(self, point: Sequence[float], axes: Sequence[Sequence[float]] | None = None) -> Inertia:
        """Inertia about another point of the body, in other axes, with its uncertainty.

        Parameters
        ----------
        point : three numbers
            m, body.
        axes : (3, 3), optional
            Columns are the new axes in body; those of body where it is left out.

        Returns
        -------
        Inertia
            ``value`` and ``std``, (3, 3) kg m^2; NaN where an element that they need is not determined.
        """
        import numpy as np

        from rig_identification.report.other_point import inertia_about

        turned = np.eye(3) if axes is None else np.asarray(axes, dtype=float)
        return Inertia(*inertia_about(self.identification.total, np.asarray(point, dtype=float), turned))

    @property
    def files(self) -> dict[str, str]:
        """The body as ``URDF``, ``MJCF``, ``SDF`` and ``CSV``; the CSV alone where not all is determined."""
        from rig_identification.report.body_files import body_files

        return body_files(self.identification.total)

    @property
    def learned_rig(self) -> str:
        """A ``rig.yaml`` with hinges, lengths and mounts as estimated."""
        from rig_identification.report.learned_rig import learned_rig_text

        return learned_rig_text(self.session.rig, self.identification.parameters, self.session.name)

    def to_dict(self) -> dict[str, object]:
        """The content of ``result.json``."""
        from rig_identification.report import provenance, result_to_dict

        return result_to_dict(self.identification, provenance(self.session, self.digests))

    def write(self, folder: str | Path) -> None:
        """Write ``result.json`` and ``report.html`` into a folder, both or neither. Raises InputError."""
        from rig_identification.files import write_together
        from rig_identification.report import provenance, write_report, write_result

        origin = provenance(self.session, self.digests)
        write_together(
            Path(folder),
            {
                RESULT: lambda path: write_result(self.identification, path, origin),
                REPORT: lambda path: write_report(self.identification, self.session, path),
            },
        )

    def _known(self) -> NDArray[np.bool_]:
        import numpy as np

        from rig_identification.result import ELEMENTS

        return np.array([name not in self.unobservable for name in ELEMENTS])

    def _covariance(self) -> Array:
        import numpy as np

        known = self._known()
        return np.where(np.outer(known, known), self.identification.total.covariance, np.nan)

    @staticmethod
    def _key(channel: Any) -> dict[str, Any]:
        return {key: getattr(channel, key) for key in ("recording", "channel", "quantity", "axis")}

    def __repr__(self) -> str:
        from rig_identification.result import ELEMENTS

        known = [
            f"{name} {value:.5g} ± {std:.2g}"
            for name, value, std in zip(ELEMENTS, self.values, self.std, strict=True)
            if name not in self.unobservable
        ]
        return f"<Result of {self.session.name}: {self.verdict}; ± 1 std: {', '.join(known)}>"

    def _repr_html_(self) -> str:
        from rig_identification.api.html import result_html

        return result_html(self.identification, self.session.name)
