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

What changed once may change again. Beside the steps that are known, another one of the same numbers has the
information that these leave of it; steps are added while they add to the log evidence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import INERTIAL, Parameter, ParameterSet, Stretch
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.beyond import Beyond, Columns
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.change import Change, Group, within
from rig_identification.mismatch.opened import Promise, opened_with, promise_of
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
#: Steps of the same numbers that are told apart at most.
STEPS = 6
#: Share of its own information that is added to a start's, which has no prior.
SLIGHT = 1e-9


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
    durations = {name: r.duration for name, r in recordings_of(problem).items()}
    changes = []
    for t in ranked:
        steps = asked.stepped(max([t, *asked.near(t)], key=lambda told: told.net))
        stretches, nets = tuple(s.stretches for s in steps), tuple(s.net for s in steps)
        changes.append(Change(groups[t.group], stretches, nets, durations))
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
    """Sums over some rows of runs and rest poses: they tell all that restricted columns need.

    What each run's zeros are off by is integrated out of its rows (estimate/marginal.py), and mixes all of
    them. So columns C are restricted before that, and W C stands in the whitened problem, W being symmetric.
    With its columns J they have J^T W C in common, which has the rows of C alone, and with one another
    C^T W^2 C = C^T C - (B^T C)^T N (B^T C).
    """

    cross: Array  # (unknowns, q) of all unknowns' columns with the asked ones
    right: Array  # (q,) gradient
    gram: Array  # (q, q) C^T C
    zeros: tuple[Array, ...]  # of every run, (z, q) B^T C

    def __add__(self, other: _Part) -> _Part:
        zeros = tuple(a + b for a, b in zip(self.zeros, other.zeros, strict=True))
        return _Part(self.cross + other.cross, self.right + other.right, self.gram + other.gram, zeros)

    def of(self, columns: NDArray[np.int64]) -> _Part:
        """Some of the asked columns."""
        zeros = tuple(z[:, columns] for z in self.zeros)
        return _Part(self.cross[:, columns], self.right[columns], self.gram[np.ix_(columns, columns)], zeros)


@dataclass(frozen=True)
class _Restricted:
    """Columns of numbers, and then those of a run's start, from an instant on."""

    stretches: tuple[Stretch, ...]  # in which they count
    part: _Part
    run: int | None  # whose start is another one then; None: none is
    charge: float  # log of how many hypotheses there are

    def cut_to(self, group: NDArray[np.int64], count: int) -> _Restricted:
        """The same of one group's columns alone, of ``count`` numbers, and the start's."""
        starts = np.arange(count, self.part.right.size)
        return replace(self, part=self.part.of(np.concatenate([group, starts])))


@dataclass(frozen=True)
class _Step:
    """One group's columns from an instant on, and what is left of them beside all that is free anyway."""

    restricted: _Restricted
    columns: Columns


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
        # W J and W r of every run
        self._across = [(r.wander.without(r.jacobian), r.wander.without(r.residual)) for r in full.runs]
        self._taken = [run.wander.taken for run in full.runs]
        self._whole = {name: self._of_recording(name) for name in self._recordings()}
        instants = sum(self._instants(i).size for i in range(len(full.runs)))
        between = max(1, len(self._between()))
        count = 2.0 * len(groups)
        self._charge_between = float(np.log(count * between))
        self._charge_within = float(np.log(count * max(1, instants)))

    def all(self) -> Iterator[_Told]:
        """Every group in every set of recordings, and from every instant on."""
        for restricted in chain(self._from_recordings(), self._from_all_instants()):
            yield from self._told(restricted)

    def near(self, best: _Told) -> Iterator[_Told]:
        """The same group from instants about the best one's on."""
        for restricted in self._about(best.stretches):
            yield self._net(self._step(restricted, best.group), best.group, ())

    def stepped(self, first: _Told) -> list[_Told]:
        """Further steps of the same numbers that add to the evidence of the ``first``, the oldest first.

        Where a number stays what it became, it may become another one again at any time. What counts in one
        recording alone is asked again there alone.
        """
        group, lasts = first.group, self._lasts(first.stretches)

        def beside(restricted: Iterator[_Restricted]) -> list[_Step]:
            return [self._step(r, group) for r in restricted if self._nested(r, first, lasts)]

        found = [(first, self._step(self._at(first.stretches), group))]
        asked = beside(self._from_all_instants())
        while len(found) < STEPS:
            known = [step for _, step in found]
            told = [(self._net(step, group, known), step) for step in asked]
            best = max(told, key=lambda told: told[0].net, default=None)
            if best is None or best[0].net <= 0.0:
                break
            finer = beside(self._about(best[0].stretches))
            told = [best, *((self._net(step, group, known), step) for step in finer)]
            found.append(max(told, key=lambda told: told[0].net))
            asked = [s for s in asked if self._apart(s.restricted.stretches, found[-1][0].stretches)]
        return [told for told, _ in sorted(found, key=lambda f: self._time(f[0].stretches))]

    def _step(self, restricted: _Restricted, group: int) -> _Step:
        """One group's columns of what is ``restricted``."""
        own = restricted.cut_to(self._of[group], self._maps.shape[1])
        return _Step(own, self._beyond.of_sums(own.part.cross, own.part.right))

    def _nested(self, restricted: _Restricted, first: _Told, lasts: bool) -> bool:
        """Whether a step may stand beside the first one: of any two, one has all rows of the other."""
        one, two = restricted.stretches, first.stretches
        if not self._apart(one, two):
            return False
        return self._lasts(one) if lasts else len(one) == 1 and one[0].recording == two[0].recording

    def _lasts(self, stretches: tuple[Stretch, ...]) -> bool:
        """Whether a number is another one in everything that was recorded later."""
        names = self._recordings()
        return [s.recording for s in stretches] == names[names.index(stretches[0].recording) :]

    def _time(self, stretches: tuple[Stretch, ...]) -> tuple[int, float]:
        """What orders steps: recording, and seconds in it."""
        return self._recordings().index(stretches[0].recording), stretches[0].start

    def _apart(self, one: tuple[Stretch, ...], two: tuple[Stretch, ...]) -> bool:
        return one[0].recording != two[0].recording or abs(one[0].start - two[0].start) >= APART

    def _about(self, stretches: tuple[Stretch, ...]) -> Iterator[_Restricted]:
        """The same stretches from instants about theirs on."""
        there = within(stretches)
        for index, run in enumerate(self._problem.runs):
            if there is not None and _holds(run, there):
                at = there.start - run.offset + np.arange(-APART, APART, FINELY)
                at = at[(at > LEFT) & (at < run.grid.duration - LEFT)]
                of = self._from_instants(index, at)
                yield from (r for r in of if len(r.stretches) == len(stretches))

    def _at(self, stretches: tuple[Stretch, ...]) -> _Restricted:
        """Exactly these stretches."""
        there = within(stretches)
        if there is None:
            return next(r for r in self._from_recordings() if r.stretches == stretches)
        index = next(i for i, run in enumerate(self._problem.runs) if _holds(run, there))
        at = np.array([there.start - self._problem.runs[index].offset])
        return next(r for r in self._from_instants(index, at) if len(r.stretches) == len(stretches))

    def _from_recordings(self) -> Iterator[_Restricted]:
        """Every set of recordings in which a number may be another one."""
        for names in self._between():
            part = sum((self._whole[n] for n in names[1:]), self._whole[names[0]])
            yield _Restricted(tuple(map(Stretch, names)), part, None, self._charge_between)

    def _from_all_instants(self) -> Iterator[_Restricted]:
        for index in range(len(self._full.runs)):
            yield from self._from_instants(index, self._instants(index))

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

    def _nothing(self, columns: int) -> _Part:
        """Sums over no rows."""
        zeros = tuple(np.zeros((run.wander.responses.shape[1], columns)) for run in self._full.runs)
        cross = np.zeros((int(self._places[-1]), columns))
        return _Part(cross, np.zeros(columns), np.zeros((columns, columns)), zeros)

    def _of_recording(self, name: str) -> _Part:
        """Sums over all of a recording."""
        total = self._nothing(self._maps.shape[1])
        for index, run in enumerate(self._problem.runs):
            if run.recording.name == name:
                total += self._rows(index, slice(None), self._columns(index, self._maps))
        for evidence, rest in zip(self._problem.rests, self._full.rests, strict=True):
            if evidence.recording.name == name:
                columns = rest.jacobian @ self._maps
                cross = np.zeros_like(total.cross)
                cross[: self._size] = rest.jacobian.T @ columns
                none = tuple(np.zeros_like(z) for z in total.zeros)
                total += _Part(cross, columns.T @ rest.residual, columns.T @ columns, none)
        return total

    def _columns(self, index: int, maps: Array) -> Array:
        """(m, q) columns of a run beside its zeros' own deviations. maps (size + starts or size, q)."""
        run = self._full.runs[index]
        return run.wander.back(run.jacobian[:, : maps.shape[0]] @ maps)

    def _rows(self, index: int, rows: slice, columns: Array) -> _Part:
        """Sums over some rows of a run's ``columns``."""
        run = self._full.runs[index]
        columns = columns[rows]
        jacobian, residual = self._across[index]
        own = jacobian[rows].T @ columns
        nothing = self._nothing(columns.shape[1])
        cross = nothing.cross
        cross[: self._size] = own[: self._size]
        cross[self._places[index] : self._places[index + 1]] = own[self._size :]
        zeros = list(nothing.zeros)
        zeros[index] = run.wander.responses[rows].T @ columns
        return _Part(cross, columns.T @ residual[rows], columns.T @ columns, tuple(zeros))

    def _from_instants(self, index: int, instants: Array) -> Iterator[_Restricted]:
        """All groups from each of some instants (s after its first node) of a run on."""
        run, lin = self._problem.runs[index], self._full.runs[index]
        starts = lin.jacobian.shape[1] - self._size
        maps = np.zeros((self._size + starts, self._maps.shape[1] + starts))
        maps[: self._size, : self._maps.shape[1]] = self._maps
        maps[self._size :, self._maps.shape[1] :] = np.eye(starts)
        columns = self._columns(index, maps)
        names = self._recordings()
        later = names[names.index(run.recording.name) + 1 :]
        rest = self._later(later, starts)
        # What follows within the same recording, where a run was cut already, changes too
        for other, of in enumerate(self._problem.runs):
            if of.recording is run.recording and of.offset > run.offset:
                rest += self._wider(self._rows(other, slice(None), self._columns(other, self._maps)), starts)
        part, end = None, lin.nodes.size
        for at in instants[::-1]:
            first = int(np.searchsorted(lin.nodes, at / run.grid.step))
            here = self._rows(index, slice(first, end), columns)
            part, end = here if part is None else part + here, first
            there = Stretch(run.recording.name, run.offset + float(at))
            yield _Restricted((there,), part, index, self._charge_within)
            if later:
                yield _Restricted((there, *map(Stretch, later)), part + rest, index, self._charge_within)

    def _later(self, names: Sequence[str], starts: int) -> _Part:
        return self._wider(sum((self._whole[n] for n in names), self._nothing(self._maps.shape[1])), starts)

    def _wider(self, part: _Part, starts: int) -> _Part:
        """Sums beside which a run's start is asked for, which shows in none of these rows."""
        size = part.right.size
        wide = self._nothing(size + starts)
        wide.cross[:, :size], wide.right[:size], wide.gram[:size, :size] = part.cross, part.right, part.gram
        for own, zeros in zip(wide.zeros, part.zeros, strict=True):
            own[:, :size] = zeros
        return wide

    def _told(self, restricted: _Restricted) -> Iterator[_Told]:
        """Every group by itself in the same stretches."""
        size, part = self._maps.shape[1], restricted.part
        columns = self._beyond.of_sums(part.cross, part.right)
        information = self._inner(restricted, restricted, size) - columns.seen.T @ columns.solved
        starts = np.arange(size, part.right.size)
        information[starts, starts] *= 1.0 + SLIGHT
        information, gradient = _left(information, columns.right, np.arange(size))
        for group, own in enumerate(self._of):
            net = _gained(information[np.ix_(own, own)], gradient[own]) - restricted.charge
            yield _Told(group, restricted.stretches, net)

    def _net(self, step: _Step, group: int, known: Sequence[_Step]) -> _Told:
        """One group in some stretches, beside steps of it that are ``known``."""
        every, count = (*known, step), self._of[group].size
        sizes = [one.columns.right.size for one in every]
        ends = np.cumsum(sizes)
        at = [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]
        F = np.zeros((ends[-1], ends[-1]))
        for i, one in enumerate(every):
            for j, two in enumerate(every):
                inner = self._inner(one.restricted, two.restricted, count)
                F[at[i], at[j]] = inner - one.columns.seen.T @ two.columns.solved
        # Known numbers have their prior, starts hardly any; the prior of what is asked is added last
        prior = np.concatenate([np.arange(size) < count for size in sizes])
        asked = np.arange(ends[-1] - sizes[-1], ends[-1] - sizes[-1] + count)
        more = np.where(prior, 1.0, SLIGHT * np.diag(F))
        more[asked] = 0.0
        gradient = np.concatenate([one.columns.right for one in every])
        net = _gained(*_left(F + np.diag(more), gradient, asked)) - step.restricted.charge
        return _Told(group, step.restricted.stretches, net)

    def _inner(self, one: _Restricted, two: _Restricted, count: int) -> Array:
        """(q, p) information that columns have in common. count: of numbers, which stand before the start's.

        They have the rows of the later of the two in common, where a start's columns are those of its run.
        """
        if self._time(one.stretches) > self._time(two.stretches):
            return np.asarray(self._inner(two, one, count).T)
        together = np.zeros((one.part.right.size, two.part.right.size))
        shown = one.part.right.size if one.run == two.run else count
        together[:shown] = two.part.gram[:shown]
        for taken, own, other in zip(self._taken, one.part.zeros, two.part.zeros, strict=True):
            together -= own.T @ taken @ other
        return together


def _left(information: Array, gradient: Array, asked: NDArray[np.int64]) -> tuple[Array, Array]:
    """Information and gradient that are left of some columns once all others are free: Schur's complement."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    unit, pull = information * np.outer(scale, scale), gradient * scale
    others = np.setdiff1d(np.arange(scale.size), asked)
    across = np.linalg.solve(definite(unit[np.ix_(others, others)]), unit[np.ix_(others, asked)])
    left = unit[np.ix_(asked, asked)] - unit[np.ix_(asked, others)] @ across
    return left / np.outer(scale[asked], scale[asked]), (pull[asked] - across.T @ pull[others]) / scale[asked]


def _gained(information: Array, gradient: Array) -> float:
    """Log evidence that columns in units of their priors add."""
    inside = information + np.eye(gradient.size)
    values, vectors = np.linalg.eigh(0.5 * (inside + inside.T))
    values = np.maximum(values, 1.0)
    pull = vectors.T @ gradient
    return 0.5 * float(np.sum(pull**2 / values) - np.sum(np.log(values)))


def _holds(run: Run, stretch: Stretch) -> bool:
    """Whether a stretch begins within a run."""
    begins = stretch.start - run.offset
    return run.recording.name == stretch.recording and 0.0 < begins < run.grid.duration
