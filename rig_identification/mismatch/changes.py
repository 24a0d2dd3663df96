"""A number of the rig, of a device or of the body that changes at an instant.

A clamp slips, an IMU is bumped, a zero jumps, a mass is taken off the body between two recordings. Any number
that is wrong all the time may be wrong from an instant on, or in one recording alone. Of a number's column j
of the whitened Jacobian such a change has the rows after that instant. What a change of the rig does to the
motion it does from a start of its own, which takes twelve more columns: those of the run's start, after that
instant. With everything that is free anyway eliminated (beyond.py), a group of k such columns has
information F and gradient g, in units of its prior, and adds to the log evidence (Laplace, MacKay, ch. 28)
    1/2 g^T (F + 1)^-1 g - 1/2 log det(F + 1).
From that the logarithm of the number of hypotheses is taken. A change between two recordings is as likely
beforehand as one within any of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import AXES, INERTIAL, Parameter, ParameterSet, Stretch
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.mismatch.screen import Promise, opened_with, promise_of
from rig_identification.model import layout
from rig_identification.model.body import linear_in_log_cholesky
from rig_identification.model.definite import definite
from rig_identification.recording import Recording

Array = NDArray[np.float64]

#: Seconds between the instants of a run that are asked, and about the best of them; and what is left of a run
#: on either side at least.
APART, FINELY, LEFT = 0.5, 0.05, 1.0
#: Share of the body's mass that is put on it or taken off: std of the prior.
LOAD = 0.03
#: Changes that are fitted at most, and the share of the best one's evidence that another one has to come to:
#: first order is right within a factor of two.
ALIKE, SHARE = 4, 0.5


@dataclass(frozen=True)
class Group:
    """Numbers that change together, as columns of a problem's vector."""

    numbers: tuple[Parameter, ...]  # of the change
    columns: Array  # (size, k) in units of their priors
    of: Candidate | None  # the same, wrong all the time; None: the body


@dataclass(frozen=True)
class Change:
    """Numbers that are other ones in some stretches of a session's recordings."""

    group: Group
    stretches: tuple[Stretch, ...]  # in which they are
    net: float  # nats that it adds to the log evidence, to first order
    durations: Mapping[str, float]  # s, of every recording

    @cached_property
    def candidate(self) -> Candidate:
        """The hypothesis."""
        return _changed(self.group, self.stretches, self.durations)

    def lasting(self, recordings: Mapping[str, float]) -> Change:
        """The same through further ``recordings``, which last so many s."""
        durations = {**self.durations, **recordings}
        return replace(self, stretches=(*self.stretches, *map(Stretch, recordings)), durations=durations)

    def with_fewer(self, candidates: list[Candidate]) -> list[Change]:
        """Changes of fewer numbers in the same stretches. candidates: what may be wrong all the time."""
        fewer = (c for c in candidates if changeable(c) and len(c.parameters) < len(self.group.numbers))
        return [replace(self, group=Group(c.parameters, np.zeros((0, len(c.parameters))), c)) for c in fewer]

    @property
    def within(self) -> Stretch | None:
        """The stretch that begins within its recording; None where it happened between two of them."""
        return _within(self.stretches)


def likeliest_changes(
    problem: Problem, evaluation: Evaluation, mass: float, candidates: list[Candidate]
) -> tuple[list[Change], list[Promise]]:
    """Changes that add to the log evidence about ``evaluation``, each of other numbers, the likeliest first.

    mass: kg, of the body. candidates: what may be wrong all the time; also returns what these promise.
    """
    opened = opened_with(problem, evaluation, candidates)
    if opened is None:
        return [], []
    wide, beyond, boxed = opened
    always = [promise_of(wide, beyond, boxed, c) for c in candidates]
    groups = [*_numbers(wide.bench.parameters, candidates), _body(wide, beyond.full, mass)]
    asked = _Asked(wide, beyond, groups)
    best: dict[int, _Told] = {}
    for told in asked.all():
        if told.net > max(0.0, best[told.group].net if told.group in best else 0.0):
            best[told.group] = told
    ranked = sorted(best.values(), key=lambda told: -told.net)
    ranked = [t for t in ranked[:ALIKE] if t.net > SHARE * ranked[0].net]
    finer = [max([t, *asked.near(t)], key=lambda told: told.net) for t in ranked]
    durations = {name: r.duration for name, r in recordings_of(problem).items()}
    changes = [Change(groups[t.group], t.stretches, t.net, durations) for t in finer]
    return sorted(changes, key=lambda change: -change.net), always


def recordings_of(problem: Problem) -> dict[str, Recording]:
    """Recordings of a problem by name, those at rest first."""
    every = [*(rest.recording for rest in problem.rests), *(run.recording for run in problem.runs)]
    return {recording.name: recording for recording in every}


def changeable(candidate: Candidate) -> bool:
    """Whether a hypothesis is an error of numbers that describe the rig or its devices.

    What the contract has no word for is a law of a reading; an effect adds physics, which no one touches.
    """
    numbers = candidate.build is None and not candidate.everywhere and not candidate.curved
    return numbers and candidate.effect in ERRORS


#: Effects of the contract that are errors of a number.
ERRORS = frozenset(
    {
        "imu_bias",
        "imu_scale",
        "imu_misalignment",
        "imu_position",
        "load_cell_gain",
        "load_cell_offset",
        "exciter_gain",
        "exciter_position",
        "exciter_misalignment",
        "inclinometer_offset",
        "clock_offset",
        "sensor_lag",
        "cable_length",
        "hinge_position",
        "level_error",
    }
)


def _numbers(parameters: ParameterSet, candidates: Sequence[Candidate]) -> Iterator[Group]:
    free = {p.name: p for p in parameters.free}
    for c in filter(changeable, candidates):
        columns = np.zeros((parameters.size, len(c.parameters)))
        for k, p in enumerate(c.parameters):
            # A doubt's column is in units of its tolerance
            columns[parameters.index_of(p.name), k] = p.prior_std / free[p.name].prior_std
        yield Group(c.parameters, columns, c)


def _body(problem: Problem, full: Evaluation, mass: float) -> Group:
    """A load on the body, or off it: its ten numbers, which add."""
    size = float(np.max(extent(problem.bench.rig)))
    std = LOAD * mass * np.array([1.0, *(size,) * 3, *(size**2,) * 6])
    columns = np.zeros((problem.bench.parameters.size, INERTIAL))
    columns[:INERTIAL] = np.linalg.inv(linear_in_log_cholesky(full.point.theta[:INERTIAL])) * std
    units = ["kg", *("kg*m",) * 3, *("kg*m^2",) * 6]
    numbers = tuple(
        Parameter(f"load.{name}", unit, 0.0, float(s), "physics", layout.INERTIAL + i, bounded=False)
        for i, (name, unit, s) in enumerate(zip(LINEAR, units, std, strict=True))
    )
    return Group(numbers, columns, None)


#: The ten numbers of a load about the datum, which add (model/body.py).
LINEAR = ("mass", "mx", "my", "mz", "xx", "xy", "xz", "yy", "yz", "zz")


@dataclass(frozen=True)
class _Told:
    """What one group is worth in some stretches."""

    group: int
    stretches: tuple[Stretch, ...]
    net: float


@dataclass(frozen=True)
class _Part:
    """Sums over some rows of a run or a rest pose: they tell all that a restricted column needs."""

    cross: Array  # (unknowns, q) of all unknowns' columns with the asked ones
    right: Array  # (q,) gradient

    def __add__(self, other: _Part) -> _Part:
        return _Part(self.cross + other.cross, self.right + other.right)


class _Asked:
    """All changes of a linearised problem."""

    def __init__(self, problem: Problem, beyond: Beyond, groups: list[Group]) -> None:
        full = beyond.full
        self._problem, self._beyond, self._full = problem, beyond, full
        self._size = problem.bench.parameters.size
        self._maps = np.concatenate([g.columns for g in groups], axis=1)
        ends = np.cumsum([len(g.numbers) for g in groups])
        self._of = [np.arange(end - len(g.numbers), end) for end, g in zip(ends, groups, strict=True)]
        starts = [run.jacobian.shape[1] - self._size for run in full.runs]
        self._places = self._size + np.concatenate([[0], np.cumsum(starts)]).astype(int)
        self._whole = {name: self._of_recording(name) for name in self._recordings()}
        instants = sum(self._instants(i).size for i in range(len(full.runs)))
        between = max(1, len(self._between()))
        count = 2.0 * len(groups)
        self._charge_between, self._charge_within = np.log(count * between), np.log(count * max(1, instants))

    def all(self) -> Iterator[_Told]:
        """Every group in every set of recordings, and from every instant on."""
        for names in self._between():
            part = sum((self._whole[n] for n in names[1:]), self._whole[names[0]])
            yield from self._told(part, tuple(map(Stretch, names)), None, self._charge_between)
        for index in range(len(self._full.runs)):
            yield from self._from_instants(index, self._instants(index))

    def near(self, best: _Told) -> Iterator[_Told]:
        """The same group from instants about the best one's on."""
        there = _within(best.stretches)
        if there is None:
            return
        for index, run in enumerate(self._problem.runs):
            if not _holds(run, there):
                continue
            at = there.start - run.offset + np.arange(-APART, APART, FINELY)
            at = at[(at > LEFT) & (at < run.grid.duration - LEFT)]
            yield from (t for t in self._from_instants(index, at) if t.group == best.group)

    def _recordings(self) -> list[str]:
        """Names of all recordings, the oldest first where their stamps tell."""
        found = recordings_of(self._problem)
        return sorted(found, key=lambda name: found[name].start_ns)

    def _between(self) -> list[tuple[str, ...]]:
        """Sets of recordings in which a number may be another one than in the others."""
        names = self._recordings()
        later = [tuple(names[k:]) for k in range(1, len(names))]
        alone = [(name,) for name in names[: -1 if len(names) > 1 else 0]]
        # Of two recordings one against the other says all
        return later if len(names) == 2 else [*later, *alone]

    def _instants(self, index: int) -> Array:
        """(k,) s after a run's first node, at which it may be cut."""
        duration = self._problem.runs[index].grid.duration
        return np.arange(LEFT, duration - LEFT, APART) if duration > 2.0 * LEFT else np.zeros(0)

    def _of_recording(self, name: str) -> _Part:
        """Sums over all of a recording."""
        total = _Part(np.zeros((int(self._places[-1]), self._maps.shape[1])), np.zeros(self._maps.shape[1]))
        for index, run in enumerate(self._problem.runs):
            if run.recording.name == name:
                total += self._rows(index, slice(None), self._maps)
        for evidence, rest in zip(self._problem.rests, self._full.rests, strict=True):
            if evidence.recording.name == name:
                columns = rest.jacobian @ self._maps
                cross = np.zeros_like(total.cross)
                cross[: self._size] = rest.jacobian.T @ columns
                total += _Part(cross, columns.T @ rest.residual)
        return total

    def _rows(self, index: int, rows: slice, maps: Array) -> _Part:
        """Sums over some rows of a run. maps (size + starts or size, q): what is asked."""
        run = self._full.runs[index]
        jacobian = run.jacobian[rows]
        columns = jacobian[:, : maps.shape[0]] @ maps
        own = jacobian.T @ columns
        cross = np.zeros((int(self._places[-1]), maps.shape[1]))
        cross[: self._size] = own[: self._size]
        cross[self._places[index] : self._places[index + 1]] = own[self._size :]
        return _Part(cross, columns.T @ run.residual[rows])

    def _from_instants(self, index: int, instants: Array) -> Iterator[_Told]:
        """Every group from each of some instants (s after its first node) of a run on."""
        run, lin = self._problem.runs[index], self._full.runs[index]
        starts = lin.jacobian.shape[1] - self._size
        maps = np.zeros((self._size + starts, self._maps.shape[1] + starts))
        maps[: self._size, : self._maps.shape[1]] = self._maps
        maps[self._size :, self._maps.shape[1] :] = np.eye(starts)
        names = self._recordings()
        later = names[names.index(run.recording.name) + 1 :]
        rest = self._later(later, starts)
        # What follows within the same recording, where a run was cut already, changes too
        for other, of in enumerate(self._problem.runs):
            if of.recording is run.recording and of.offset > run.offset:
                rest += self._wider(self._rows(other, slice(None), self._maps), starts)
        part, end = None, lin.nodes.size
        for at in instants[::-1]:
            first = int(np.searchsorted(lin.nodes, at / run.grid.step))
            here = self._rows(index, slice(first, end), maps)
            part, end = here if part is None else part + here, first
            there = Stretch(run.recording.name, run.offset + float(at))
            yield from self._told(part, (there,), starts, self._charge_within)
            if later:
                stretches = (there, *map(Stretch, later))
                yield from self._told(part + rest, stretches, starts, self._charge_within)

    def _later(self, names: Sequence[str], starts: int) -> _Part:
        size = self._maps.shape[1]
        none = _Part(np.zeros((int(self._places[-1]), size)), np.zeros(size))
        return self._wider(sum((self._whole[n] for n in names), none), starts)

    def _wider(self, part: _Part, starts: int) -> _Part:
        """Sums beside which a run's start is asked for, which shows in none of these rows."""
        cross = np.concatenate([part.cross, np.zeros((part.cross.shape[0], starts))], axis=1)
        return _Part(cross, np.concatenate([part.right, np.zeros(starts)]))

    def _told(
        self, part: _Part, stretches: tuple[Stretch, ...], starts: int | None, charge: float
    ) -> Iterator[_Told]:
        """Every group whose rows ``part`` sums. starts: columns of a start of its own, after the groups'."""
        size = self._maps.shape[1]
        columns = self._beyond.of_sums(part.cross, part.right)
        gradient = columns.right
        information = self._inner(part, stretches, starts) - columns.seen.T @ columns.solved
        if starts:
            own = definite(information[size:, size:] + 1e-9 * np.diag(np.diag(information)[size:]))
            across = np.linalg.solve(own, information[size:, :size])
            gradient = gradient[:size] - across.T @ gradient[size:]
            information = information[:size, :size] - information[:size, size:] @ across
        for group, own in enumerate(self._of):
            inside = information[np.ix_(own, own)] + np.eye(own.size)
            values, vectors = np.linalg.eigh(0.5 * (inside + inside.T))
            values = np.maximum(values, 1.0)
            pull = vectors.T @ gradient[own]
            net = 0.5 * float(np.sum(pull**2 / values) - np.sum(np.log(values))) - float(charge)
            yield _Told(group, stretches, net)

    def _inner(self, part: _Part, stretches: tuple[Stretch, ...], starts: int | None) -> Array:
        """(q, q) information of the restricted columns with one another: both are the same rows'."""
        own: Array = self._maps.T @ part.cross[: self._size]
        if not starts:
            return own
        # The start's columns show in one run's rows alone, where ``part`` has them as unknowns as well
        there = stretches[0]
        index = next(i for i, run in enumerate(self._problem.runs) if _holds(run, there))
        first, last = self._places[index], self._places[index + 1]
        return np.concatenate([own, part.cross[first:last]], axis=0)


def _within(stretches: tuple[Stretch, ...]) -> Stretch | None:
    """The one that begins within its recording."""
    return next((s for s in stretches if s.start > 0.0), None)


def _holds(run: Run, stretch: Stretch) -> bool:
    """Whether a stretch begins within a run."""
    begins = stretch.start - run.offset
    return run.recording.name == stretch.recording and 0.0 < begins < run.grid.duration


def _changed(group: Group, stretches: tuple[Stretch, ...], durations: Mapping[str, float]) -> Candidate:
    """The hypothesis that a group's numbers are other ones in some stretches."""
    mark = _mark(stretches)
    own = tuple(
        replace(
            p,
            name=f"{p.name}@{mark}",
            nominal=0.0,
            index=-1,
            also=(),
            bounded=False,
            freed=False,
            shifts=p.shifts or tuple((entry, 1.0) for entry in p.written),
            during=stretches,
        )
        for p in group.numbers
    )
    times: list[dict[str, object]] = [
        {"recording": s.recording, "start": round(s.start, 2), "end": round(durations[s.recording], 2)}
        for s in stretches
    ]
    since = _since(stretches)
    if group.of is None:
        return _load(own, since, times)
    base = group.of

    def told(found: Estimates) -> Told:
        index = [list(found.values).index(p.name) for p in own]
        values = {p.name: p.nominal + found.values[q.name] for p, q in zip(base.parameters, own, strict=True)}
        return base.told(Estimates(values, found.covariance[np.ix_(index, index)]))

    return Candidate(
        base.effect,
        own,
        f"{since}: {_in_a_sentence(base.sentence)}",
        f"Find out what was touched or came loose then. {base.advice}",
        {**base.where, "times": times},
        tell=told,
    )


def _mark(stretches: tuple[Stretch, ...]) -> str:
    """What tells a changed number's name from that of the number."""
    first = stretches[0]
    since = f"{first.recording}+{first.start:.2f}" if first.start > 0.0 else first.recording
    return f"{since}({len(stretches)})"


def _since(stretches: tuple[Stretch, ...]) -> str:
    """When a number is another one, as the beginning of a sentence."""
    first = stretches[0]
    if first.start > 0.0:
        later = "" if len(stretches) == 1 else " and in what was recorded later"
        return f"From {first.start:.1f} s of {first.recording} on{later}"
    return f"In {', '.join(s.recording for s in stretches)}, unlike before"


def _in_a_sentence(text: str) -> str:
    """A sentence as it stands after a colon."""
    first = text.split(" ", 1)[0]
    return text[0].lower() + text[1:] if first in ("The", "All", "Every") else text


def _load(own: tuple[Parameter, ...], since: str, times: list[dict[str, object]]) -> Candidate:
    """Something is put on the body, taken off it, or moved on it."""
    names = [p.name for p in own]

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
        own,
        f"{since}: the body is heavier by {{value}} than before, and its first moment of mass is other, "
        "by {told[first_moment_x]}, {told[first_moment_y]} and {told[first_moment_z]} along x, y and z. "
        "A load was put on, taken off, or has moved.",
        "Fasten what lies on it, and record everything with the same load.",
        {"channel": None, "axis": None, "law": "changed load", "times": times},
        tell=told,
    )
