"""A left-out effect as the search sees it: parameters that it frees or adds, and what a person is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from rig_identification.estimate.parameters import Parameter

#: Name in result.json -> (value, std, unit) of a fitted candidate's parameters.
Told = dict[str, tuple[float, float, str]]


@dataclass(frozen=True)
class Candidate:
    """One hypothesis: one effect at one place."""

    effect: str  # word of the recording contract
    parameters: tuple[Parameter, ...]  # free beyond the ideal model: added, or with a wider prior
    sentence: str  # with {value}, {std} and {where}
    advice: str  # what to do about it
    where: dict[str, object] = field(default_factory=dict)
    positive: bool = False  # the first parameter cannot be negative
    tell: Callable[[dict[str, float], dict[str, float]], Told] | None = None  # from values and stds by name
    name_in_result: str = ""  # of the first parameter, where ``tell`` is not given

    @property
    def label(self) -> str:
        """Short name for progress and notes."""
        place = " ".join(str(v) for v in self.where.values() if isinstance(v, str))
        return f"{self.effect} {place}".strip()

    def told(self, values: dict[str, float], stds: dict[str, float]) -> Told:
        """The parameters as the contract names them."""
        if self.tell is not None:
            return self.tell(values, stds)
        first = self.parameters[0]
        return {self.name_in_result: (values[first.name], stds[first.name], first.unit)}
