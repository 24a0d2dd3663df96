"""Load cells whose reading is no straight line of the load, which the contract's table has no word for.

Gain and zero are free beside it: what line a bent cell was calibrated by is not known.
"""

from __future__ import annotations

from rig_identification.estimate.parameters import Parameter, ParameterSet
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.sensor_errors import RANGE, freed
from rig_identification.rig import Rig

#: Plausible share of the reading (std of the prior) by which a cell bends at the load's even share.
BENT = 0.05


def bent_cells(rig: Rig, parameters: ParameterSet, mass: float) -> list[Candidate]:
    """What each load cell may bend by. mass: kg, roughly."""
    share = mass * rig.gravity / len(rig.cables)
    out = []
    for cable in rig.cables:
        line = [
            freed(parameters, f"{cable.name}.load_cell_{name}", RANGE[f"load_cell_{name}"])
            for name in ("gain", "zero")
        ]
        if any(p is None for p in line):
            continue
        name, std = f"{cable.name}.load_cell_curve", BENT / share
        curve = Parameter(name, "1/N", 0.0, std, "device", parameters.places.laws()[name], bounded=False)
        out.append(
            Candidate(
                "unknown",
                (curve, *(p for p in line if p is not None)),
                "The load cell of {channel} is not straight: its reading bends by {value} times the load.",
                "Calibrate the cell at several loads over its range, or replace it.",
                {"channel": cable.name, "axis": None, "quantity": "tension", "law": "curvature"},
                name_in_result="curvature",
            )
        )
    return out
