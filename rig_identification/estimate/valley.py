"""Whether a number that is told of a body is as sure as the end of a fit says, where it may lie far off.

A short recording of a body that hardly turns holds combinations of its inertia, the rig's numbers and the
start far tighter than each of them. Where such a valley bends, the covariance at the one place at which a fit
ends (Laplace) is that of a straight valley: it may be a tenth of what is open, and the fit may creep to its
end nats above the bottom. So each number u that would be told is asked of the cost itself,

    p(u) ~ exp(-c(u)) |I(u)|^(-1/2) (g' I(u)^-1 g)^(-1/2),    g = du/dtheta,

with c(u) the least cost over all else and I(u) the information there: its marginal density by Laplace's
method over all but u (Tierney and Kadane, Journal of the American Statistical Association 81, 1986). The
numbers are those of the lowest place; their covariance is raised to the second moment about it over the
nodes of u.

What is spent follows what is open. A number whose interval moves the body by little is not asked: a body that
was shaken well costs nothing. One that costs at both ends of its interval what Laplace says takes two
evaluations without derivatives. One that is open as far as one would believe without any recording is
followed no farther, for it is not told.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.observability import (
    GAIN,
    believed_std,
    inertial_estimate,
    root_of_inverse,
    with_products,
)
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import (
    NEARLY,
    CannotBeFollowed,
    Evaluation,
    Pin,
    Problem,
    evaluate,
    moved_by,
    pinned,
    solve,
)
from rig_identification.estimate.swing_period import FORCES
from rig_identification.result import ELEMENTS, InertialEstimate

Array = NDArray[np.float64]

#: Stds at which a number is asked, and part of what the cost should rise by there that it may be off by: its
#: std is then right within a quarter.
ASKED, OFF = 2.0, 0.5
#: Change of the body by ASKED stds within which valleys are straight, in stds of the weak prior: of a moment
#: of inertia a tenth.
STRAIGHT = 0.1
#: Nodes on each side at most, factor from one step to the next, and nats below the likeliest that end a side.
NODES, FARTHER, NEGLIGIBLE = 5, 1.5, 3.0
#: Steps of a fit of all but u, and what one may still promise at its end (nats).
STEPS, SETTLED = 6, 0.05
#: A number is held to within this part of its std.
HELD = 0.01
#: Such fits at most. A number that is not followed to its end by then is not told.
FITS = 24
#: Elements that are nowhere below nothing: no step takes more than half of them.
POSITIVE = ("m", "Jxx", "Jyy", "Jzz")
#: Fits from a place along a valley that lies lower than where the fit had ended.
AGAIN = 2

NOTE = (
    "These recordings move the body so little that other bodies, with a slightly different rig each, explain "
    "them about as well. The intervals of {names} cover those bodies."
)


@dataclass(frozen=True)
class Valley:
    """What a look along the valleys about the end of a fit found."""

    evaluation: Evaluation  # the lowest place
    converged: bool | None  # ... whether the fit to it settled; None: it is where the fit had ended
    estimate: InertialEstimate  # the ten numbers there
    began: Evaluation  # where the fit had ended
    followed: tuple[str, ...] = ()  # numbers whose valley is not straight
    fits: int = 0  # of all but one number, which it took

    @property
    def note(self) -> str | None:
        """What a person is told; None where every valley is straight."""
        if not self.followed:
            return None
        lost = [name for name in self.followed if name in self.estimate.unobservable]
        said = f" They do not tell {', '.join(lost)}." if lost else ""
        return NOTE.format(names=", ".join(self.followed)) + said


@dataclass(frozen=True)
class _Node:
    """The best place at one value of u."""

    evaluation: Evaluation  # of the problem without a pin
    u: float
    std: float  # of u by the information there
    along: Array  # change of every unknown with u, by the information there
    log_density: float  # up to a constant
    elements: Array  # (10,)
    covariance: Array  # (10, 10) of the elements where u is held


@dataclass
class _Patience:
    """Fits of all but u that are left."""

    left: int = FITS


def to_be_asked(problem: Problem, evaluation: Evaluation) -> bool:
    """Whether the numbers of a fit are told with the covariance at its end.

    Those of one that leaves more than noise are not, nor those of a body that is only watched: they come from
    a cautious fit of short pieces (cautious.py). Rest alone tells mass and centre, along straight valleys.
    """
    measured = {c.quantity for run in problem.runs for c in run.channels}
    return bool(measured & FORCES) and misfit(evaluation) < NEAR_SQUARE


def along_valleys(problem: Problem, evaluation: Evaluation, *, lower: bool = True) -> Valley:
    """The lowest place about the end of a fit, and the ten numbers there as sure as its valleys allow.

    lower: whether to go on from a place that lies lower; without it the numbers stay those of the fit.
    """
    began, converged = evaluation, None
    patience = _Patience()
    for again in range(AGAIN + 1):
        estimate, followed, lowest = _asked(problem, evaluation, patience, lower and again < AGAIN)
        if lowest is None:
            break
        evaluation, converged = solve(problem, lowest.point)
    return Valley(evaluation, converged, estimate, began, followed, FITS - patience.left)


def _asked(
    problem: Problem, evaluation: Evaluation, patience: _Patience, lower: bool
) -> tuple[InertialEstimate, tuple[str, ...], Evaluation | None]:
    """The ten numbers, those of them whose valley bends, and a place that lies lower, at which it ends.

    lower: whether a lower place is of use.
    """
    estimate = inertial_estimate(problem, evaluation)
    followed: list[str] = []
    root = root_of_inverse(evaluation.information)
    centres = [_node(problem, evaluation, element, root) for element in range(INERTIAL)]
    spans = [_span(problem, centre) for centre in centres]
    # Most open first: a product of inertia falls with its moments
    for element in sorted(range(INERTIAL), key=lambda k: -spans[k]):
        name, centre = ELEMENTS[element], centres[element]
        if spans[element] < STRAIGHT:
            break
        if name in estimate.unobservable or not _bends(problem, centre):
            continue
        followed.append(name)
        nodes = [centre]
        for sign in (-1.0, 1.0):
            side = _one_side(problem, centre, element, sign, patience)
            nodes = [*nodes, *side] if sign > 0.0 else [*reversed(side), *nodes]
            raised = _raised(problem, estimate, nodes)
            if name in raised.unobservable:
                break
        lowest = min((node.evaluation for node in nodes), key=lambda e: e.cost)
        if lower and name not in raised.unobservable and lowest.cost < evaluation.cost - NEARLY:
            return estimate, tuple(followed), lowest
        estimate = raised
        if patience.left <= 0:
            lost = {*estimate.unobservable, name}
            estimate = replace(estimate, unobservable=with_products(lost))
    return estimate, tuple(followed), None


def _span(problem: Problem, centre: _Node) -> float:
    """How far ASKED stds of u move the body, in stds of the weak prior."""
    return float(np.max(np.abs(ASKED * centre.std * centre.along[:INERTIAL]) / problem.weak))


def _bends(problem: Problem, centre: _Node) -> bool:
    """Whether a straight step to either end of u's interval costs something else than Laplace says."""
    change = ASKED * centre.std * centre.along
    here = centre.evaluation
    for step in (-change, change):
        there = evaluate(problem, moved_by(problem, here, step), residuals_only=True)
        told = here.cost + 0.5 * ASKED**2 - float(step @ here.gradient)
        if there is None or abs(there.cost - told) > OFF * 0.5 * ASKED**2:
            return True
    return False


def _one_side(problem: Problem, centre: _Node, element: int, sign: float, patience: _Patience) -> list[_Node]:
    """Nodes on one side of the end of a fit, outwards, as far as u may lie or until it is not told anyway."""
    nodes: list[_Node] = []
    at, likeliest, step = centre, centre.log_density, 0.0
    far = ASKED * GAIN * float(believed_std(problem)[element])
    while len(nodes) < NODES and patience.left > 0 and at.log_density > likeliest - NEGLIGIBLE:
        if abs(at.u - centre.u) > far:
            break
        step = max(FARTHER * step, ASKED * at.std)
        to = at.u + sign * step
        if ELEMENTS[element] in POSITIVE:
            to = max(to, 0.5 * at.u)
        patience.left -= 1
        found = _held(problem, at, element, to)
        if found is None or sign * (found.u - at.u) <= 0.0:
            break
        nodes.append(found)
        fell = centre.log_density - found.log_density
        if at is centre and abs(fell - 0.5 * ASKED**2) < OFF * 0.5 * ASKED**2:
            break
        at, likeliest = found, max(likeliest, found.log_density)
    return nodes


def _held(problem: Problem, at: _Node, element: int, to: float) -> _Node | None:
    """Everything fitted anew with u held elsewhere; None where the model cannot be followed there."""
    held = replace(problem, pin=Pin(element, to, HELD * at.std))
    ahead = moved_by(problem, at.evaluation, (to - at.u) * at.along)
    for point in (ahead, at.evaluation.point):
        try:
            found, _ = solve(held, point, iterations=STEPS, tolerance=SETTLED)
            return _node(problem, _released(held, found), element)
        except (CannotBeFollowed, np.linalg.LinAlgError):
            continue
    return None


def _released(problem: Problem, found: Evaluation) -> Evaluation:
    """The same evaluation without what the pin adds."""
    assert problem.pin is not None
    row = np.zeros(found.gradient.size)
    row[:INERTIAL], miss = pinned(problem, problem.pin, found.point.theta)
    return replace(
        found,
        cost=found.cost - 0.5 * miss**2,
        information=found.information - np.outer(row, row),
        prior_information=found.prior_information - row[: found.prior_information.size] ** 2,
        gradient=found.gradient - row * miss,
    )


def _node(problem: Problem, evaluation: Evaluation, element: int, root: Array | None = None) -> _Node:
    """The place of an evaluation. root: root_of_inverse of its information, where it is there."""
    theta = evaluation.point.theta
    map_ = problem.bench.parameters.elements_jacobian(theta)
    root = root_of_inverse(evaluation.information) if root is None else root
    aside = root[:, :INERTIAL] @ map_[element]
    std = float(np.linalg.norm(aside))
    # With the part along ``aside`` taken out of the root, u is held
    rest = root[:, :INERTIAL] @ map_.T
    rest -= np.outer(aside, aside @ rest) / std**2
    volume = float(np.sum(np.log(np.diag(root))))
    elements = problem.bench.parameters.elements(theta)
    density = -evaluation.cost + volume - float(np.log(std))
    along = np.asarray(root.T @ aside) / std**2
    return _Node(evaluation, float(elements[element]), std, along, density, elements, rest.T @ rest)


def _raised(problem: Problem, estimate: InertialEstimate, nodes: list[_Node]) -> InertialEstimate:
    """The estimate with its covariance raised to what the nodes show, and without what is then vague."""
    u = np.array([node.u for node in nodes])
    log = np.array([node.log_density for node in nodes])
    share = np.exp(log - np.max(log)) * _widths(u)
    share /= np.sum(share)
    away = [node.elements - estimate.values for node in nodes]
    moments = [node.covariance + np.outer(x, x) for node, x in zip(nodes, away, strict=True)]
    moment = np.tensordot(share, np.array(moments), axes=1)
    covariance = estimate.covariance + _positive(moment - estimate.covariance)
    std = np.sqrt(np.diag(covariance))
    vague = {n for n, s, b in zip(ELEMENTS, std, believed_std(problem), strict=True) if not s < GAIN * b}
    lost = with_products({*estimate.unobservable, *vague})
    return replace(estimate, covariance=covariance, unobservable=lost)


def _widths(u: Array) -> Array:
    """Weights of the trapezoidal rule."""
    gaps = np.diff(u)
    return np.asarray(0.5 * (np.concatenate([gaps, [0.0]]) + np.concatenate([[0.0], gaps])))


def _positive(matrix: Array) -> Array:
    """What a symmetric matrix adds to a covariance: where it takes away, nothing."""
    scale = np.sqrt(np.maximum(np.abs(np.diag(matrix)), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(root @ root.T)
