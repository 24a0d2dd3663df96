r"""Which recording tells apart what an earlier session could not: rivals refitted, to first order.

Let the explanation a be true, with the numbers that the earlier session found. A recording is predicted with
a and with its rival b. With d the whitened difference of the two predictions, the start state projected out,
and J the derivatives of everything that b's fit may move (body, doubts, b's own numbers; priors and the
earlier session among its information P), b's best fit leaves

    D = 1/2 (d'd - g' (J'J + P)^-1 g),    g = J'd,

nats more than a's own. d'd, J'd and J'J add up over recordings. The log likelihood ratio that the next
session finds is normal with mean D and variance 2 D.

Where one explanation is the other with numbers more, the longer one is never fitted worse. What counts is
then how far from nothing its amount would be told, if it is true: the same D with a and b exchanged. Its
amount is not known yet, and D grows with its square: it is taken at the root of its mean square.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.stats import norm

from rig_identification.errors import InputError
from rig_identification.estimate.identify import runs_of
from rig_identification.estimate.parameters import AXES, INERTIAL
from rig_identification.estimate.prediction import linearise_run, model_at
from rig_identification.estimate.rest_evidence import linearise_rest, prepare_rest, with_dummy
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.solve import Point, Problem, evaluate
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import extended, with_reference
from rig_identification.mismatch.riders import DIRECTIONS, Swing, rider_candidate
from rig_identification.mismatch.supports import cable_elasticity, ceiling_candidate, gives_way
from rig_identification.plan.before import Before, Stated
from rig_identification.plan.information import LEFT_AT_REST, Laboratory, recorded
from rig_identification.plan.menu import Item
from rig_identification.simulate.start import rest_state

Array = NDArray[np.float64]

#: Nats by which one explanation has to lead another to be told alone: three standard deviations.
DECIDED = 4.5
#: Chance at which a tie counts as one that a session decides.
SURE = 0.9


@dataclass(frozen=True)
class Told:
    """What recordings tell of a tie if one side of it is true: sums over recordings."""

    square: float  # d'd
    pull: Array  # (p,) J'd
    information: Array  # (p, p) J'J

    def __add__(self, other: Told) -> Told:
        return Told(self.square + other.square, self.pull + other.pull, self.information + other.information)

    def times(self, factor: float) -> Told:
        """The same recordings so many times."""
        return Told(factor * self.square, factor * self.pull, factor * self.information)

    def nats(self, prior: Array) -> float:
        """Expected gain of the true side over the refitted other one. prior: (p, p) of the latter."""
        total = self.information + prior
        scale = 1.0 / np.sqrt(np.maximum(np.diag(total), np.finfo(float).tiny))
        step = scale * np.linalg.lstsq(total * np.outer(scale, scale), scale * self.pull, rcond=1e-13)[0]
        return max(0.5 * (self.square - float(self.pull @ step)), 0.0)


@dataclass(frozen=True)
class Side:
    """One direction of a tie: what is true, and what is fitted to it."""

    prior: Array  # (p, p) of what is fitted
    by_item: Mapping[str, Told]


@dataclass(frozen=True)
class Tie:
    """Two explanations that the earlier session left open."""

    told: str  # what the session told; "" where that is nothing beyond the ideal model
    rival: str
    gap: float  # nats by which the rival trails so far
    experiment: str
    sides: tuple[Side, ...]  # none: the rival cannot be predicted here

    def nats(self, times: Mapping[str, float]) -> float:
        """Nats that items, each so many times, are expected to tell the two apart by, whichever is true."""
        least = np.inf
        for side in self.sides:
            parts = [side.by_item[name].times(n) for name, n in times.items() if name in side.by_item]
            if not parts:
                return 0.0
            total = parts[0]
            for part in parts[1:]:
                total = total + part
            least = min(least, total.nats(side.prior))
        return float(least) if self.sides else 0.0

    def chance(self, nats: float) -> float:
        """Chance that a session with so many expected nats decides, if what is less likely so far is true."""
        if nats <= 0.0:
            return 0.0
        return float(norm.sf((DECIDED + self.gap - nats) / np.sqrt(2.0 * nats)))


@dataclass(frozen=True, eq=False)
class Model:
    """An explanation in the model: where it is predicted, and what a fit of it believes beforehand."""

    problem: Problem  # without recordings
    theta: Array
    prior: Array  # (p, p)


@dataclass(frozen=True, eq=False)
class Predicted:
    """One recording less its prediction by a model, whitened, and its derivatives."""

    residual: Array  # (m,)
    shared: Array  # (m, p)
    start: Array  # (m, s) in its start state; (m, 0) at rest


def ties_of(lab: Laboratory, items: Sequence[Item], before: Before) -> tuple[Tie, ...]:
    """The ties of an earlier session, and what each of ``items`` tells of them.

    A rival stands in place of the finding that it is most alike, or beside nothing. One that cannot be built
    from what the session wrote, or predicted on this rig, has no sides.
    """
    findings = before.findings
    bare = with_reference(lab.problem, rest_state(model_at(lab.problem.bench.parameters, lab.theta)))
    seen = replace(bare, runs=runs_of(lab.spec.rig, recorded(lab.spec, [lab.shown])[0].training))
    everything = _model(lab, seen, before, findings)
    rivals = []
    for rival in before.rivals:
        places = range(len(findings)) if findings else [0]
        without = [(*findings[:k], *findings[k + 1 :], rival) for k in places]
        rivals.append([_model(lab, seen, before, e, mean=bool(findings)) for e in without])
    models = [m for m in (everything, *(m for ways in rivals for m in ways)) if m is not None]
    if everything is None or len(models) < 2:
        return tuple(_not_predicted(before, rival) for rival in before.rivals)

    def pairs(item: Item) -> list[list[tuple[Told, Told] | None]]:
        """What one item tells of each rival in each place, in both directions."""
        known = {id(m): _predicted(lab, item, m) for m in models}
        mine = known[id(everything)]

        def pair(model: Model | None) -> tuple[Told, Told] | None:
            its = None if model is None else known[id(model)]
            return None if its is None or mine is None else (_told(mine, its), _told(its, mine))

        return [[pair(model) for model in ways] for ways in rivals]

    told = {item.name: found for item, found in zip(items, side_by_side(pairs, items), strict=True)}
    out = []
    for k, rival in enumerate(before.rivals):
        ties = [
            _tie(before, rival, place, everything, model, {n: found[k][place] for n, found in told.items()})
            for place, model in enumerate(rivals[k])
            if model is not None
        ]
        out.append(min(ties, key=_most, default=_not_predicted(before, rival)))
    return tuple(out)


def _most(tie: Tie) -> float:
    """Nats by which all items together, each once, would tell a tie apart."""
    return tie.nats({name: 1.0 for side in tie.sides for name in side.by_item})


def _not_predicted(before: Before, rival: Stated) -> Tie:
    told = " and ".join(finding.name for finding in before.findings)
    return Tie(told, rival.name, rival.gap, rival.experiment, ())


def _tie(
    before: Before,
    rival: Stated,
    place: int,
    everything: Model,
    model: Model,
    parts: Mapping[str, tuple[Told, Told] | None],
) -> Tie:
    """A rival in place of one finding. parts: by item, what is left if the finding is true, if it is not."""
    there = {name: part for name, part in parts.items() if part is not None}
    if_told = Side(model.prior, {name: part[0] for name, part in there.items()})
    if_rival = Side(everything.prior, {name: part[1] for name, part in there.items()})
    if not before.findings:
        # Nothing is the rival with an amount of nothing: no fit of the rival is ever worse
        return Tie("", rival.name, rival.gap, rival.experiment, (if_rival,))
    told = before.findings[place].name
    return Tie(told, rival.name, rival.gap, rival.experiment, (if_told, if_rival))


def _model(
    lab: Laboratory, seen: Problem, before: Before, explanation: Sequence[Stated], *, mean: bool = True
) -> Model | None:
    """A problem with an explanation in it, at its numbers; None where it cannot be built.

    seen: the laboratory's problem with a run that shows what records. mean: numbers as they were found; else
    amounts at the root of their mean square.
    """
    problem, numbers = seen, dict[str, tuple[float, float]]()
    for stated in explanation:
        candidate = _candidate(problem, lab, stated)
        if candidate is None:
            return None
        problem = extended(problem, (candidate,))
        numbers |= stated.numbers
    problem = replace(problem, runs=())
    parameters = problem.bench.parameters
    theta = parameters.start(lab.spec.elements)
    for i, p in enumerate(parameters.free, start=INERTIAL):
        if p.name not in numbers:
            continue
        value, std = numbers[p.name]
        if not mean and not p.ratio and p.nominal == 0.0:
            value = float(np.copysign(np.hypot(value, std), value))
        theta[i] = p.position(value)
    there = evaluate(problem, Point(theta, (), ()))
    if there is None or not np.all(np.isfinite(theta)):
        return None
    prior = there.information
    if before.known is not None:
        prior = prior + before.known.on(parameters, theta)
    return Model(problem, theta, prior)


def _candidate(problem: Problem, lab: Laboratory, stated: Stated) -> Candidate | None:
    """The hypothesis that has the stated numbers, and none besides where one has.

    An earlier version may have had fewer numbers: what is not stated is as it is described.
    """
    rig, model, mass = lab.spec.rig, problem.bench.parameters.model, float(lab.spec.elements[0])
    known = catalogue(problem)
    if not gives_way(model):
        known += [
            cable_elasticity(rig, model, mass),
            *(ceiling_candidate(rig, model, mass, a) for a in range(3)),
        ]
        known += _riders(problem, stated, mass)
    names = set(stated.numbers)
    having = (c for c in known if c.effect == stated.effect and names <= {q.name for q in c.parameters})
    return min(having, key=lambda c: len(c.parameters), default=None)


def _riders(problem: Problem, stated: Stated, mass: float) -> list[Candidate]:
    """A liquid or a part on springs, along one axis, several, or a line between, as stated."""
    if stated.effect not in ("liquid_slosh", "sprung_mass"):
        return []
    numbers, effect = stated.numbers, stated.effect
    along = {a: numbers[f"{effect}.frequency.{a}"][0] for a in AXES if f"{effect}.frequency.{a}" in numbers}
    frequency = numbers.get(f"{effect}.frequency")
    swings: list[Swing] = []
    if along:
        swings.append(Swing("".join(along), min(along.values()), tuple(along.values())))
    elif frequency is not None:
        leans = any(name.startswith(f"{effect}.direction.") for name in numbers)
        lines = AXES if leans else tuple(DIRECTIONS)
        swings += [Swing(directions, frequency[0], tilted=leans) for directions in lines]
    axis = stated.where.get("axis")
    ways = [s for s in swings if s.effect == effect and axis in (None, s.directions)]
    return [rider_candidate(problem, s, mass, 0.0, np.zeros(3))[0] for s in ways]


def _predicted(lab: Laboratory, item: Item, model: Model) -> Predicted | None:
    """One item, recorded as the ideal model has it, less its prediction by a model."""
    try:
        session, starts = recorded(lab.spec, [item])
    except InputError:
        return None
    (recording,) = session.recordings
    bench, size = model.problem.bench, model.problem.bench.parameters.size
    if item.static is not None:
        evidence = prepare_rest(lab.spec.rig, recording)
        guess = rest_state(with_dummy(model_at(lab.problem.bench.parameters, lab.theta), evidence.dummy))
        rest = linearise_rest(bench, evidence, model.theta, guess) if evidence.channels else None
        if rest is None:
            return None
        root = np.sqrt(LEFT_AT_REST)
        return Predicted(root * rest.residual, root * rest.jacobian, np.zeros((len(rest.residual), 0)))
    pieces = runs_of(lab.spec.rig, (recording,))
    found = [linearise_run(bench, run, model.theta, starts[recording.name]) for run in pieces]
    parts = [piece for piece in found if piece is not None]
    if len(parts) < len(found):
        return None
    return Predicted(
        np.concatenate([piece.residual for piece in parts]),
        np.concatenate([piece.jacobian[:, :size] for piece in parts]),
        block_diag(*(piece.jacobian[:, size:] for piece in parts)),
    )


def _told(truth: Predicted, fitted: Predicted) -> Told:
    """What is left to the second model of what the first one predicts, start state projected out."""
    basis, _ = np.linalg.qr(fitted.start)
    left = fitted.residual - truth.residual  # what truth predicts less what the fitted model does
    left = left - basis @ (basis.T @ left)
    shared = fitted.shared - basis @ (basis.T @ fitted.shared)
    return Told(float(left @ left), shared.T @ left, shared.T @ shared)


def needed(tie: Tie) -> float:
    """Nats that a session is to be expected to tell, so that it decides with chance SURE."""
    z, least = float(norm.ppf(SURE)), DECIDED + tie.gap
    return float(0.5 * (z + np.sqrt(z**2 + 2.0 * least)) ** 2)


def deciding(
    ties: Sequence[Tie], items: Sequence[Item], seconds: float, most: float, changeover: float = 0.0
) -> dict[str, int]:
    """Which items to record, and how often, so that as many ties as can be are decided in ``seconds``.

    Greedily, by the nats for each second that ties still lack. A tie that cannot be decided in the time takes
    none of it. most: s that runs may take. changeover: s before each recording.
    """
    open_ = [tie for tie in ties if tie.sides]
    for tie in open_:
        alone = _greedy([tie], items, seconds, most, changeover)
        if tie.nats(alone) < needed(tie):
            open_ = [t for t in open_ if t is not tie]
    return _greedy(open_, items, seconds, most, changeover)


def _greedy(
    ties: Sequence[Tie], items: Sequence[Item], seconds: float, most: float, changeover: float
) -> dict[str, int]:
    chosen: dict[str, int] = {}
    spent = moving = 0.0

    def told(times: Mapping[str, int]) -> float:
        return sum(min(tie.nats(times), needed(tie)) for tie in ties)

    def cost(item: Item) -> float:
        return item.seconds + (0.0 if item.name in chosen else changeover)

    now, wanted = 0.0, sum(needed(tie) for tie in ties)
    while now < wanted * (1.0 - 1e-9):
        fits = [
            item
            for item in items
            if spent + cost(item) <= seconds + 1e-6
            and (moving + item.seconds <= most + 1e-6 if item.run is not None else item.name not in chosen)
        ]
        if not fits:
            break
        gains = [(told({**chosen, i.name: chosen.get(i.name, 0) + 1}) - now) / cost(i) for i in fits]
        best = fits[int(np.argmax(gains))]
        if max(gains) <= 0.0:
            break
        spent += cost(best)
        moving += best.seconds if best.run is not None else 0.0
        chosen[best.name] = chosen.get(best.name, 0) + 1
        now = told(chosen)
    return chosen
