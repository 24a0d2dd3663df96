"""Readings that feel more than what they are to measure, which the contract's table has no word for.

Next to gain and zero the commonest fault of a measuring chain is that one channel leaks into another: cells
that share an amplifier or a bracket, a gyroscope that feels acceleration, axes that are not square to each
other. Each is one share, of one other reading, beside a zero that nobody has taken off. Two cells of one
amplifier mostly feel each other.
"""

from __future__ import annotations

from itertools import combinations, permutations

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import AXES, Parameter, ParameterSet
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.mismatch.sensor_errors import RANGE, freed
from rig_identification.rig import Rig

#: Plausible range (std of the prior) of a share of a like quantity, and of what a gyroscope feels of specific
#: force: a poor unit turns by 0.1 deg/s per g.
SHARE = 0.05
FELT_FORCE = 0.005

#: What such a law is called, of one cell and of two that feel each other.
FEELS, EACH_OTHER = "cross-sensitivity", "cross-talk"

_AXES = [("gyroscope", a) for a in AXES] + [("accelerometer", a) for a in AXES]
_QUANTITY = {"gyroscope": "angular_rate", "accelerometer": "specific_force"}


def cross_sensitivity(rig: Rig, parameters: ParameterSet, devices: list[str]) -> list[Candidate]:
    """What one axis, or cell, may feel of another one of its device. devices: those that the runs hold."""
    out, laws = [], parameters.places.laws()
    cells = [c.name for c in rig.cables if c.name in devices]
    for cell, other in permutations(cells, 2):
        name = f"{cell}.feels.{other}"
        zero = freed(parameters, f"{cell}.load_cell_zero", RANGE["load_cell_zero"])
        out.append(
            _felt(
                Parameter(name, "1", 0.0, SHARE, "device", laws[name], bounded=False),
                zero,
                "The load cell of {channel} feels {felt} as well: it reads {value} of that load too much.",
                "Look for what the two share: amplifier, cable, bracket. Load one cell at a time.",
                {"channel": cell, "axis": None, "quantity": "tension", "law": FEELS, "felt": other},
            )
        )
    out += [_each_other(parameters, *pair) for pair in combinations(cells, 2)]
    if "imu" in devices:
        out += _imu(parameters)
    return out


def _each_other(parameters: ParameterSet, one: str, other: str) -> Candidate:
    """Two cells of which each feels the other."""
    laws = parameters.places.laws()
    names = f"{one}.feels.{other}", f"{other}.feels.{one}"
    shares = tuple(Parameter(n, "1", 0.0, SHARE, "device", laws[n], bounded=False) for n in names)
    zeros = [freed(parameters, f"{cell}.load_cell_zero", RANGE["load_cell_zero"]) for cell in (one, other)]

    def told(found: Estimates) -> Told:
        return {"sensitivity": (*found.of(names[0]), "1"), "sensitivity_back": (*found.of(names[1]), "1")}

    return Candidate(
        "unknown",
        (*shares, *(zero for zero in zeros if zero is not None)),
        f"The load cells of {one} and {other} feel each other: {{value}} of the load of {other} is read by "
        f"{{channel}}, and {{told[sensitivity_back]}} of its own by the other.",
        "Look for what the two share: amplifier, cable, bracket. Load one cell at a time.",
        {"channel": one, "axis": None, "quantity": "tension", "law": EACH_OTHER, "felt": other},
        tell=told,
    )


def _imu(parameters: ParameterSet) -> list[Candidate]:
    out, laws = [], parameters.places.laws()
    for (unit, axis), (other, felt) in permutations(_AXES, 2):
        if (unit, other) == ("accelerometer", "gyroscope"):
            # What an accelerometer feels of a turn is where it sits
            continue
        alike = unit == other
        name = f"imu.{unit}.{axis}.feels.{other}.{felt}"
        kind, std = ("1", SHARE) if alike else ("s/m", FELT_FORCE)
        # At rest gravity is felt, as a bias
        bias = None
        if other == "accelerometer":
            bias = freed(parameters, f"imu.{unit}_bias.{axis}", RANGE[f"{unit}_bias"])
        out.append(
            _felt(
                Parameter(name, kind, 0.0, std, "device", laws[name], bounded=False),
                bias,
                f"The {unit}'s {axis} axis feels the {other}'s {felt} axis as well: {{value}} of that.",
                "Calibrate the unit's cross-axis terms on a turntable and in six positions, or replace it.",
                {
                    "channel": "imu",
                    "axis": axis,
                    "quantity": _QUANTITY[unit],
                    "law": FEELS,
                    "felt": f"{other} {felt}",
                },
            )
        )
    return out


def _felt(
    share: Parameter, zero: Parameter | None, sentence: str, advice: str, where: dict[str, object]
) -> Candidate:
    own = (share,) if zero is None else (share, zero)
    told = sentence.replace("{felt}", str(where["felt"]))
    return Candidate("unknown", own, told, advice, where, name_in_result="sensitivity")
