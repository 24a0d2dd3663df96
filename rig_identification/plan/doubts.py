r"""What the model may lack: how much wider that makes the intervals, and how far it would bend the inertia.

The chosen runs are linearised with every hypothesis of the search's catalogue among the columns. With W the
information of everything that is free anyhow, C its inverse, a hypothesis of k numbers phi (in units of its
prior's std) has across-information G (b, k) and information S of its own, so that beyond what is free

    F = S - G^T C G.

Left out of the model, phi gains phi^T F phi / 2 nats for whoever asks for it (the noncentral half of a
chi-square), and bends what is estimated by C G phi. What is detected has to gain a threshold (hypotheses.py,
needed_gain). So at half its detection limit, and within one std of what is plausible, phi lies in

    phi^T A phi <= 1,    A = 4 F / (2 gain) + 1,

and moves a number with the slope b by sqrt(b^T A^-1 b) at most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.identify import runs_of
from rig_identification.estimate.mixture import weights
from rig_identification.estimate.observability import invert_information
from rig_identification.estimate.parameters import INERTIAL, Parameter
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Point
from rig_identification.estimate.verdict import DOUBTED
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.findings import called
from rig_identification.mismatch.hypotheses import catalogue, count_of, needed_gain
from rig_identification.mismatch.opened import adding, carried, with_reference
from rig_identification.mismatch.supports import ceiling_candidate, gives_way
from rig_identification.mismatch.undecided import STATED, TIED, shared_by_places
from rig_identification.plan.choose import Choice
from rig_identification.plan.information import Laboratory, informations, recorded
from rig_identification.plan.menu import Item
from rig_identification.result import ELEMENTS, natural_size
from rig_identification.simulate.start import rest_state

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bias:
    """What an effect at half of its detection limit would do to the inertia."""

    effect: str  # the recording contract's word
    told: str  # with its place, for a person
    name: str  # of the first of its numbers
    amount: float  # of that number, its unit
    unit: str
    element: str  # of the tensor, that it bends most
    bias: float  # kg m^2, of that element
    in_sigma: float  # the largest bias of any element of the tensor, in its expected std
    limited: bool  # whether what is plausible, and not detection, bounds it


@dataclass(frozen=True)
class Doubts:
    """What the catalogue says of a plan."""

    widened: Array  # (10, 10) expected covariance with what the recordings neither show nor exclude
    undecided: tuple[str, ...]  # ... by name
    biases: tuple[Bias, ...]  # most harmful first


@dataclass(frozen=True)
class _Beyond:
    """One hypothesis beyond what is free."""

    candidate: Candidate
    F: Array  # (k, k) information, in units of its prior's std
    bends: Array  # (10, k) what a std of each number moves the ten elements by
    units: Array  # (k,) std of the hypothesis' prior, in the parameters' own units


def doubts(lab: Laboratory, chosen: Sequence[tuple[Choice, int]], covariance: Array) -> Doubts | None:
    """Rivals and biases of the ``chosen`` items, each so many times; None where a probe cannot be linearised.

    covariance (10, 10): what is expected without them.
    """
    items = [choice.item for choice, _ in chosen]
    candidates, wide = _wide(lab, items)
    found = informations(wide, items)
    if any(part is None for part in found):
        return None
    total = wide.before + np.sum(
        [times * part for (_, times), part in zip(chosen, found, strict=True) if part is not None], axis=0
    )
    asked = _beyond(lab, wide, np.asarray(total), candidates)
    count = count_of(candidates)
    widened, undecided = _rivals(asked, count, covariance)
    std = np.sqrt(np.diag(widened))
    biases = sorted((_bias(b, count, std) for b in asked), key=lambda b: -b.in_sigma)
    return Doubts(widened, undecided, tuple(biases))


def _wide(lab: Laboratory, items: Sequence[Item]) -> tuple[list[Candidate], Laboratory]:
    """The catalogue's hypotheses, and the laboratory with their numbers among what is shared."""
    session, _ = recorded(lab.spec, items)
    problem = replace(lab.problem, runs=runs_of(lab.spec.rig, session.training))
    problem = with_reference(problem, rest_state(model_at(lab.problem.bench.parameters, lab.theta)))
    rig, model, mass = lab.spec.rig, problem.bench.parameters.model, float(lab.spec.elements[0])
    axes = () if gives_way(model) else range(3)
    candidates = catalogue(problem)
    probes = [ceiling_candidate(rig, model, mass, axis, probe=True) for axis in axes]
    wide = adding(problem, [*candidates, *probes])
    point = carried(wide, problem, Point(lab.theta, (), ()))
    probed = wide.bench.parameters.model.states - model.states
    bare = replace(wide, runs=(), rests=())
    return [*candidates, *probes], Laboratory(lab.spec, bare, point.theta, lab.shown, probed, lab.known)


def _beyond(lab: Laboratory, wide: Laboratory, total: Array, candidates: list[Candidate]) -> list[_Beyond]:
    free = wide.problem.bench.parameters.free
    known = {p.name: i for i, p in enumerate(lab.problem.bench.parameters.free, start=INERTIAL)}
    place = {p.name: i for i, p in enumerate(free, start=INERTIAL)}
    base = np.array([*range(INERTIAL), *(i for i, p in enumerate(free, start=INERTIAL) if p.name in known)])
    at = {int(i): k for k, i in enumerate(base)}
    inverse = invert_information(total[np.ix_(base, base)])
    map_ = wide.problem.bench.parameters.elements_jacobian(wide.theta) @ inverse[:INERTIAL]
    out = []
    for candidate in candidates:
        across, own, units = _columns(candidate, free, place, at, total, base)
        F = own - across.T @ inverse @ across
        out.append(_Beyond(candidate, 0.5 * (F + F.T), map_ @ across, units))
    return out


def _columns(
    candidate: Candidate,
    free: tuple[Parameter, ...],
    place: dict[str, int],
    at: dict[int, int],
    total: Array,
    base: NDArray[np.int64],
) -> tuple[Array, Array, Array]:
    """(G (b, k), S (k, k), units (k,)) of one hypothesis.

    A number that is added has columns of its own. One that is only freed is a prior whose center is off: with
    1 for its precision it acts on nothing but its own number.
    """
    k = len(candidate.parameters)
    across, own, units = np.zeros((base.size, k)), np.zeros((k, k)), np.zeros(k)
    index = [place[q.name] for q in candidate.parameters]
    for column, (i, q) in enumerate(zip(index, candidate.parameters, strict=True)):
        units[column] = q.slope(q.position(q.nominal)) if q.ratio else q.prior_std
        wider = q.prior_std / free[i - INERTIAL].prior_std
        if i in at:
            across[at[i], column], own[column, column] = -wider, wider**2
            continue
        across[:, column] = wider * total[base, i]
        for other, j in enumerate(index):
            if j not in at:
                ratio = candidate.parameters[other].prior_std / free[j - INERTIAL].prior_std
                own[column, other] = wider * ratio * (total[i, j] - (i == j))
    return across, own, units


def _name(candidate: Candidate) -> str:
    """An effect with its place; what the contract has no word for, by its law."""
    return candidate.label if candidate.effect != "unknown" else called(candidate.effect, candidate.where)


def _bias(beyond: _Beyond, count: int, std: Array) -> Bias:
    """The worst that an effect may do to the tensor at half of its detection limit."""
    k = beyond.F.shape[0]
    gain = needed_gain(beyond.candidate, count)
    detected = 4.0 * beyond.F / (2.0 * gain)
    inside = np.linalg.inv(detected + np.eye(k))
    moved = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", beyond.bends, inside, beyond.bends), 0.0))
    worst = 4 + int(np.argmax(moved[4:] / std[4:]))
    first = beyond.candidate.parameters[0]
    return Bias(
        beyond.candidate.effect,
        _name(beyond.candidate),
        first.name,
        float(np.sqrt(inside[0, 0]) * beyond.units[0]),
        first.unit,
        ELEMENTS[worst],
        float(moved[worst]),
        float(moved[worst] / std[worst]),
        bool(detected[0, 0] < 1.0),
    )


def _rivals(asked: list[_Beyond], count: int, covariance: Array) -> tuple[Array, tuple[str, ...]]:
    """The covariance with what stays undecided mixed in (mismatch/undecided.py), and what that is.

    By chance a number that is not there gains half a nat, one that cannot be negative half of that.
    """

    def trails(b: _Beyond) -> float:
        prior = np.eye(b.F.shape[0])
        sharper = 0.5 * float(np.linalg.slogdet(prior + b.F)[1])
        chance = 0.0 if b.candidate.everywhere else np.log(count / (DOUBTED if b.candidate.doubted else 1.0))
        told = 0.5 * float(np.trace(np.linalg.solve(prior + b.F, b.F)))
        return sharper + float(chance) - (0.5 if b.candidate.positive else 1.0) * told

    behind = [(trails(b), b) for b in asked if b.candidate.build is None]
    shared = shared_by_places((b.candidate.kind, t) for t, b in behind)
    close: dict[str, tuple[float, _Beyond]] = {}
    for trailing, b in sorted(behind, key=lambda pair: pair[0] - shared[pair[1].candidate.kind]):
        gap = trailing - shared[b.candidate.kind]
        if gap < TIED and len(close) < STATED:
            close.setdefault(b.candidate.kind, (max(gap, 0.0), b))
    share = weights([gap for gap, _ in close.values()])[1:]
    out = covariance.copy()
    for weight, (_, b) in zip(share, close.values(), strict=True):
        known = np.linalg.inv(np.eye(b.F.shape[0]) + b.F)
        wider, moves = b.bends @ known @ b.bends.T, b.bends @ known @ b.F @ known @ b.bends.T
        # Where it cannot be negative, half of the time the fit finds none of it and moves nothing
        out += weight * wider + weight * (1.0 - weight) * (0.5 if b.candidate.positive else 1.0) * moves
    return out, tuple(called(b.candidate.effect, b.candidate.where) for _, b in close.values())


def relative_bias(bias: Bias, elements: Array) -> float:
    """A bias as a share of what an error of its element is to be held against."""
    return bias.bias / float(natural_size(elements)[ELEMENTS.index(bias.element)])
