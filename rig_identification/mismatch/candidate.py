"""A left-out effect as the search sees it: parameters that it frees or adds, and what a person is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import Parameter
from rig_identification.estimate.solve import Evaluation, Point, Problem
from rig_identification.model.motion import RigModel

#: Name in result.json -> (value, std, unit) of a fitted candidate's parameters.
Told = dict[str, tuple[float, float, str]]

#: Parameters of its own that make the fits of a hypothesis slow: those of a hose or a rider.
MANY = 6

#: What an effect makes of a rig's model, and its parameters there.
Build = Callable[[RigModel], tuple[RigModel, tuple[Parameter, ...]]]
#: Part of a body that moves otherwise on every rig: its cables, connectors, the air about it. Three times as
#: much, a thousandth, moves the inertia by less than the tolerances of a rig do, and is no finding.
LIGHT = 1.0 / 3000.0


@dataclass(frozen=True)
class Candidate:
    """One hypothesis: one effect at one place."""

    effect: str  # word of the recording contract
    parameters: tuple[Parameter, ...]  # free beyond the ideal model: added, or with a wider prior
    sentence: str  # with {value} of the first quantity, {told[name]} of any, and {channel}
    advice: str  # what to do about it
    where: dict[str, object] = field(default_factory=dict)
    positive: int = 0  # so many of the first parameters cannot be negative
    either_way: int = 0  # so many after them are amounts as well, of either sign
    tell: Callable[[Estimates], Told] | None = None
    name_in_result: str = ""  # of the first parameter, where ``tell`` is not given
    build: Build | None = None  # where the effect changes more than numbers
    #: Start states, or a body, that suit the changed model, from a fit without it
    settle: Callable[[Problem, Point, Evaluation], Point] | None = None
    #: From a fit with it: closer descriptions of the same effect that first order cannot tell from it, and
    #: where their fits start
    closer: Callable[[Problem, Evaluation], list[tuple[Candidate, dict[str, float]]]] | None = None
    #: ... and such descriptions that only a fit with a discrepancy of its own is asked for (search/)
    between: Callable[[Problem, Evaluation], list[tuple[Candidate, dict[str, float]]]] | None = None
    #: Other hypotheses that answer to first order as this one does, and where their fits start
    twins: tuple[tuple[Candidate, dict[str, float]], ...] = ()
    curved: bool = False  # its amounts bend the valleys of a fit: a force by a power of the motion
    everywhere: bool = False  # every rig has some of it: only how much is a question
    per_amount: float = 0.0  # its other numbers come to no more than so much of the first; 0: to anything
    places: int = 1  # at which the effect is asked for, this one among them
    #: By name, std of what every such device has of a number that the hypothesis adds
    ordinary: dict[str, float] = field(default_factory=dict)
    hides: tuple[str, ...] = ()  # elements that only a motion which it stands in for would tell

    @property
    def kind(self) -> str:
        """What its places share: the effect, or the law of a reading that the contract has no word for."""
        return f"{self.effect} {self.where.get('law', '')}".strip()

    @property
    def amounts(self) -> tuple[Parameter, ...]:
        """The numbers that say how much of it there is; all of them where none is such."""
        return self.parameters[: self.positive + self.either_way] or self.parameters

    @property
    def doubted(self) -> bool:
        """Whether the lab doubts these numbers itself: nothing is added to the model."""
        return all(p.freed for p in self.parameters)

    @property
    def many(self) -> bool:
        """Whether it has numbers enough to bend to what is none of it: a hose, a rider."""
        return len(self.parameters) >= MANY

    @property
    def slow(self) -> bool:
        """Whether a fit takes ten times as long as that of a sensor's error."""
        return self.build is not None or self.many

    @property
    def label(self) -> str:
        """Short name for progress and notes."""
        place = " ".join(str(v) for v in self.where.values() if isinstance(v, str))
        return f"{self.effect} {place}".strip()

    def built(self, model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        """The model with the effect in it and the effect's parameters there."""
        return (model, self.parameters) if self.build is None else self.build(model)

    def told(self, found: Estimates) -> Told:
        """The parameters as the contract names them."""
        if self.tell is not None:
            return self.tell(found)
        first = self.parameters[0]
        return {self.name_in_result: (*found.of(first.name), first.unit)}


def added(name: str, unit: str, std: float, entry: int, nominal: float = 0.0) -> Parameter:
    """A number that a hypothesis adds to the model: entry ``entry`` of its physics."""
    return Parameter(name, unit, nominal, std, "physics", entry, bounded=False)
