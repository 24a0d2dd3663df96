"""Load cells with hysteresis, for which the contract has no word: they read behind the load, up and down."""

from __future__ import annotations

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import Parameter, ParameterSet
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.rig import Rig

#: Plausible hysteresis (std of the prior) and play as shares of the load's even share: data sheets state 0.02
#: to 0.1 % of the range, and a mount that rubs has ten times that. The play is known to a factor of e (std of
#: its logarithm, EITHER).
HYSTERESIS, PLAY, EITHER = 0.005, 0.02, 1.0


def lagging_cells(rig: Rig, parameters: ParameterSet, mass: float) -> list[Candidate]:
    """By what each load cell may read behind. mass: kg, roughly."""
    share = mass * rig.gravity / len(rig.cables)
    entries = parameters.places.laws()
    out = []
    for cable in rig.cables:
        name = f"{cable.name}.load_cell_hysteresis"
        amount = Parameter(name, "N", 0.0, HYSTERESIS * share, "device", entries[name], bounded=False)
        name = f"{cable.name}.load_cell_play"
        play = Parameter(name, "N", PLAY * share, EITHER, "device", entries[name], bounded=False, ratio=True)
        out.append(_lagging(cable.name, amount, play))
    return out


def _lagging(cable: str, amount: Parameter, play: Parameter) -> Candidate:
    def told(found: Estimates) -> Told:
        return {"hysteresis": (*found.of(amount.name), "N"), "play": (*found.of(play.name), "N")}

    return Candidate(
        "unknown",
        (amount, play),
        "The load cell of {channel} has hysteresis: it reads {value} less where the load rises, and as much "
        "more where it falls, once the load has turned by twice {told[play]}.",
        "Check the cell's mount for friction and side loads, or calibrate it rising and falling.",
        {"channel": cable, "axis": None, "quantity": "tension", "law": "hysteresis"},
        positive=1,
        tell=told,
    )
