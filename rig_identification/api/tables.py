"""pandas tables, for which pandas has to be installed: ``pip install 'rig_identification[pandas]'``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rig_identification.optional import needed

if TYPE_CHECKING:
    import pandas as pd


def table(rows: Sequence[Mapping[str, Any]], index: str | None = None) -> pd.DataFrame:
    """One row a mapping; ``index``: the key whose values name the rows.

    Raises
    ------
    InputError
        pandas is not installed.
    """
    frame = _pandas().DataFrame(list(rows))
    return frame if index is None or frame.empty else frame.set_index(index)


def square(values: Any, names: Sequence[str]) -> pd.DataFrame:
    """A matrix (n, n) whose rows and columns are named."""
    return _pandas().DataFrame(values, index=list(names), columns=list(names))


def timed(time: Any, columns: Mapping[str, Any]) -> pd.DataFrame:
    """Columns (n,) over a time (n,) in seconds."""
    pandas = _pandas()
    return pandas.DataFrame(dict(columns), index=pandas.Index(time, name="time"))


def _pandas() -> Any:
    return needed("pandas", "tables", "pandas")
