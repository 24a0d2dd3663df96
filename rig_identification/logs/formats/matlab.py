"""MAT files: 5 to 7.2 by scipy, 7.3 (HDF5) by pymatreader (``pip install 'rig_identification[mat]'``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rig_identification.errors import InputError
from rig_identification.logs.formats import begins
from rig_identification.logs.log import ONLY, Array, Column, Log, Table
from rig_identification.optional import needed

NAME, ORDER = "MAT", 10
_HDF5 = b"\x89HDF"
#: Columns of a matrix that are taken apart.
_AXES = {2: "xy", 3: "xyz", 4: "xyzw"}
#: Byte at which a 7.3 file's HDF5 begins, behind MATLAB's own header.
_USER_BLOCK = 512


def holds(path: Path) -> bool:
    """By the name's ending."""
    return path.is_file() and path.suffix.lower() == ".mat"


def read(path: Path) -> Log:
    """Vectors of equal length make a table; a matrix becomes columns x, y, z. Raises InputError."""
    if begins(path, b"MATLAB 7.3") or _is_hdf5(path):
        variables = needed("pymatreader", f"{path}: MAT 7.3", "mat").read_mat(str(path))
    else:
        from scipy.io import loadmat

        variables = loadmat(str(path), simplify_cells=True)
    found: dict[int, list[Column]] = {}
    for name, values in _vectors("", variables):
        found.setdefault(len(values), []).append(Column(name, values))
    tables = {length: columns for length, columns in found.items() if length > 1 and len(columns) > 1}
    if not tables:
        raise InputError(f"{path}: holds no two vectors of equal length; save time and readings as vectors")
    if len(tables) == 1:
        return Log((Table(ONLY, tuple(*tables.values())),))
    # Named by the first vector: a length is another one in the next run.
    return Log(tuple(Table(columns[0].name, tuple(columns)) for columns in tables.values()))


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(_USER_BLOCK)
        return file.read(len(_HDF5)) == _HDF5 or begins(path, _HDF5)


def _vectors(name: str, value: Any) -> Iterator[tuple[str, Array]]:
    """Vectors of numbers in a variable, a struct's by ``struct.field``."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if not str(key).startswith(("__", "#")):
                yield from _vectors(f"{name}.{key}" if name else str(key), inner)
        return
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" or array.ndim not in (1, 2) or array.size < 2:
        return
    if array.ndim == 1 or 1 in array.shape:
        yield name, np.asarray(array.ravel(), dtype=float)
        return
    rows = array if array.shape[0] >= array.shape[1] else array.T
    ends = _AXES.get(rows.shape[1], [str(i + 1) for i in range(rows.shape[1])])
    for end, column in zip(ends, rows.T, strict=True):
        yield f"{name}.{end}", np.asarray(column, dtype=float)
