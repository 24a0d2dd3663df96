"""Plain JSON of numpy values, tuples and mappings."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np


def plain(value: object) -> object:
    """Plain JSON of numpy values, tuples and mappings; what is not finite becomes None."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value
