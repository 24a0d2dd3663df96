"""Numbers that are other ones from some instant on: what a fit frees, and what a person is told.

A clamp that slips may slip again. So a change has steps: at each its numbers become other ones, and stay so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import AXES, Parameter, Stretch
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.mismatch.trial import ABSURD

Array = NDArray[np.float64]

#: Seconds after a step within which another one is told together with it: what lies between them, less what
#: is cut out about either, is too short to tell the numbers there.
TOGETHER = 1.5


@dataclass(frozen=True)
class Group:
    """Numbers that change together, as columns of a problem's vector."""

    numbers: tuple[Parameter, ...]  # of the change
    columns: Array  # (size, k) in units of their priors
    of: Candidate | None  # the same, wrong all the time; None: the body


@dataclass(frozen=True)
class Change:
    """Numbers that become other ones, once or several times."""

    group: Group
    #: Of every step the stretches in which it counts, the oldest first
    steps: tuple[tuple[Stretch, ...], ...]
    nets: tuple[float, ...]  # nats that each step adds to the log evidence, to first order
    durations: Mapping[str, float]  # s, of every recording

    @property
    def net(self) -> float:
        """Nats that all of it adds to the log evidence, to first order."""
        return sum(self.nets)

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """In which the numbers are other ones than before the first step."""
        return self.steps[0]

    @property
    def within(self) -> tuple[Stretch, ...]:
        """Of every step that happened within a recording, the stretch that begins there."""
        return tuple(there for step in self.steps if (there := within(step)) is not None)

    @cached_property
    def candidate(self) -> Candidate:
        """The hypothesis."""
        steps = self.told_steps
        own = [_own(self.group.numbers, step) for step in steps]
        since, times = _since(steps), _times(steps, self.durations)
        base = _load(self.group.numbers) if self.group.of is None else self.group.of
        numbers = self.group.numbers if self.group.of is None else base.parameters

        def told(found: Estimates) -> Told:
            out = base.told(_summed(found, numbers, own))
            if len(own) == 1:
                return out
            parts = [base.told(_summed(found, numbers, [step])) for step in own]
            for k, part in enumerate(parts, start=1):
                out |= {f"{name}_step_{k}": value for name, value in part.items()}
            return out

        return Candidate(
            base.effect,
            tuple(p for step in own for p in step),
            f"{since}: {_in_a_sentence(base.sentence)}",
            f"Find out what was touched or came loose then. {base.advice}",
            {**base.where, "times": times},
            tell=told,
        )

    def possible(self, found: Estimates) -> bool:
        """Whether what cannot be negative is not, after any of its steps. found: a fit with it."""
        base = self.group.of
        if base is None or base.positive == 0:
            return True
        own = [_own(self.group.numbers, step) for step in self.told_steps]
        sums = [_summed(found, base.parameters, own[: k + 1]) for k in range(len(own))]
        amounts = [p.name for p in base.parameters[: base.positive]]
        return all(s.values[name] >= -ABSURD * s.std(name) for s in sums for name in amounts)

    def lasting(self, recordings: Mapping[str, float]) -> Change:
        """The same through further ``recordings``, which last so many s."""
        durations = {**self.durations, **recordings}
        later = tuple(map(Stretch, recordings))
        return replace(self, steps=tuple((*step, *later) for step in self.steps), durations=durations)

    def of_steps(self, kept: list[tuple[Stretch, ...]]) -> Change:
        """The same with some of its ``told_steps`` alone."""
        chosen = [i for i, step in enumerate(self.steps) if step in kept]
        steps = tuple(self.steps[i] for i in chosen)
        return replace(self, steps=steps, nets=tuple(self.nets[i] for i in chosen))

    def with_fewer(self, candidates: list[Candidate]) -> list[Change]:
        """Changes of fewer numbers in the same stretches. candidates: errors of numbers."""
        fewer = (c for c in candidates if len(c.parameters) < len(self.group.numbers))
        return [replace(self, group=Group(c.parameters, np.zeros((0, len(c.parameters))), c)) for c in fewer]

    @property
    def told_steps(self) -> tuple[tuple[Stretch, ...], ...]:
        """Steps with numbers of their own: of those that follow soon upon each other the likeliest."""
        chains: list[list[int]] = []
        for i, step in enumerate(self.steps):
            if i and _soon(self.steps[i - 1], step):
                chains[-1].append(i)
            else:
                chains.append([i])
        return tuple(self.steps[max(chain, key=lambda i: self.nets[i])] for chain in chains)


def within(stretches: tuple[Stretch, ...]) -> Stretch | None:
    """The one that begins within its recording."""
    return next((s for s in stretches if s.start > 0.0), None)


def _soon(before: tuple[Stretch, ...], step: tuple[Stretch, ...]) -> bool:
    """Whether nothing between two steps of one recording tells the numbers there."""
    one, two = within(before), within(step)
    return (
        one is not None
        and two is not None
        and one.recording == two.recording
        and two.start - one.start < TOGETHER
    )


def _own(numbers: tuple[Parameter, ...], step: tuple[Stretch, ...]) -> tuple[Parameter, ...]:
    """What one step adds to the numbers of a change."""
    return tuple(
        replace(
            p,
            name=f"{p.name}@{_mark(step)}",
            nominal=0.0,
            index=-1,
            also=(),
            bounded=False,
            freed=False,
            shifts=p.shifts or tuple((entry, 1.0) for entry in p.written),
            during=step,
        )
        for p in numbers
    )


def _summed(
    found: Estimates, numbers: tuple[Parameter, ...], steps: list[tuple[Parameter, ...]]
) -> Estimates:
    """The numbers after some steps, by the names that they have where they never change."""
    names = list(found.values)
    sums = np.zeros((len(numbers), len(names)))
    for step in steps:
        for i, p in enumerate(step):
            sums[i, names.index(p.name)] = 1.0
    amounts = sums @ np.array(list(found.values.values()))
    values = {p.name: p.nominal + float(a) for p, a in zip(numbers, amounts, strict=True)}
    return Estimates(values, sums @ found.covariance @ sums.T)


def _mark(step: tuple[Stretch, ...]) -> str:
    """What tells a changed number's name from that of the number."""
    first = step[0]
    since = f"{first.recording}+{first.start:.2f}" if first.start > 0.0 else first.recording
    return f"{since}({len(step)})"


def _since(steps: tuple[tuple[Stretch, ...], ...]) -> str:
    """When a number is another one, as the beginning of a sentence."""
    first = steps[0][0]
    if first.start <= 0.0:
        return f"In {', '.join(s.recording for s in steps[0])}, unlike before"
    again = [s for s in map(within, steps[1:]) if s is not None]
    others = [
        f"{s.start:.1f} s" + (f" of {s.recording}" if s.recording != first.recording else "") for s in again
    ]
    further = f", and again at {' and '.join(others)} (the sum is told)" if others else ""
    later = "" if len(steps[0]) == 1 else " and in what was recorded later"
    return f"From {first.start:.1f} s of {first.recording} on{later}{further}"


def _times(steps: tuple[tuple[Stretch, ...], ...], durations: Mapping[str, float]) -> list[dict[str, object]]:
    """Every stretch between two steps, and after the last one."""
    begins = {
        s.recording: sorted({t.start for step in steps for t in step if t.recording == s.recording})
        for s in steps[0]
    }
    out: list[dict[str, object]] = []
    for name, starts in begins.items():
        for start, end in zip(starts, (*starts[1:], durations[name]), strict=True):
            if end > start:
                out.append({"recording": name, "start": round(start, 2), "end": round(end, 2)})
    return out


def _in_a_sentence(text: str) -> str:
    """A sentence as it stands after a colon."""
    first = text.split(" ", 1)[0]
    return text[0].lower() + text[1:] if first in ("The", "All", "Every") else text


def _load(numbers: tuple[Parameter, ...]) -> Candidate:
    """Something is put on the body, taken off it, or moved on it."""
    names = [p.name for p in numbers]

    def place(axis: int, *numbers: float) -> float:
        return numbers[1 + axis] / numbers[0]

    def told(found: Estimates) -> Told:
        out: Told = {"mass": (*found.of(names[0]), "kg")}
        for name, a in zip(names[1:4], AXES, strict=True):
            out[f"first_moment_{a}"] = (*found.of(name), "kg*m")
        if abs(found.values[names[0]]) > 3.0 * found.std(names[0]):
            for i, a in enumerate(AXES):
                out[f"position_{a}"] = (*found.following(lambda *v, i=i: place(i, *v), *names[:4]), "m")
        return out

    return Candidate(
        "unknown",
        numbers,
        "The body is heavier by {value} than before, and its first moment of mass is other, "
        "by {told[first_moment_x]}, {told[first_moment_y]} and {told[first_moment_z]} along x, y and z. "
        "A load was put on, taken off, or has moved.",
        "Fasten what lies on it, and record everything with the same load.",
        {"channel": None, "axis": None, "law": "changed load"},
        tell=told,
    )
