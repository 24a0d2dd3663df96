"""Whether a number that is told of a body is as sure as the end of a fit says, where it may lie far off.

A short recording of a body that hardly turns holds combinations of its inertia, the rig's numbers and the
start far tighter than each of them. Where such a valley bends, the covariance at the one place at which a fit
ends (Laplace) is that of a straight valley: it may be a tenth of what is open, and the fit may creep to its
end nats above the bottom. So each number u that would be told is asked of the cost itself: it is held
elsewhere, and all else is fitted anew. Two things say how likely the place is that comes out:

    c(u)                                            the least cost (profile likelihood)
    c(u) + log |I(u)| / 2 + log(g' I(u)^-1 g) / 2   with how much room there is about it, g = du/dtheta

The second is the marginal density of u by Laplace's method over all but u (Tierney and Kadane, Journal of the
American Statistical Association 81, 1986). It depends on the coordinates of the body, the first does not.
Where a valley is straight both rise by d = z^2 / 2 at z standard deviations from the end of the fit.
Elsewhere the smaller rise d counts. The covariance C of the ten numbers is raised until the body that was
found there, off by x, lies where its likelihood says, within sqrt(2 d) standard deviations:

    C + b x x',    b = 1 / (2 d) - 1 / (x' C^-1 x) > 0.

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
from rig_identification.model.definite import definite
from rig_identification.result import ELEMENTS, InertialEstimate

Array = NDArray[np.float64]

#: Stds at which a number is asked, and part of what the cost should rise by there that it may be off by: its
#: std is then right within a sixth.
ASKED, OFF = 2.0, 0.25
#: Change of the body by ASKED stds within which valleys are straight, in stds of the weak prior: of a moment
#: of inertia a tenth.
STRAIGHT = 0.1
#: Places on each side at most, factor from one step to the next, and nats by which one is so unlikely that it
#: is the last.
PLACES, FARTHER, NEGLIGIBLE = 5, 1.5, 3.0
#: Nats of a place one std away: what is likelier lies no nearer.
ONE_STD = 0.5
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

    def rises(self, centre: _Node) -> tuple[float, float]:
        """Nats by which cost and marginal density say that this place is less likely than ``centre``."""
        cost = self.evaluation.cost - centre.evaluation.cost
        return cost, centre.log_density - self.log_density


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


def valley_of(problem: Problem, evaluation: Evaluation, *, lower: bool = True) -> Valley | None:
    """What :func:`along_valleys` says; None where nothing is asked, or no information can be inverted."""
    if not to_be_asked(problem, evaluation):
        return None
    try:
        return along_valleys(problem, evaluation, lower=lower)
    except np.linalg.LinAlgError:
        return None


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
        nodes, raised = [centre], estimate
        for sign in (-1.0, 1.0):
            side = _one_side(problem, centre, element, sign, patience)
            nodes, raised = [*nodes, *side], _raised(problem, raised, centre, side)
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
    """Places on one side, outwards, as far as u may lie or until it is not told anyway."""
    nodes: list[_Node] = []
    at, step = centre, 0.0
    far = ASKED * GAIN * float(believed_std(problem)[element])
    while len(nodes) < PLACES and patience.left > 0 and abs(at.u - centre.u) < far:
        step = max(FARTHER * step, ASKED * at.std)
        to = at.u + sign * step
        if ELEMENTS[element] in POSITIVE:
            to = max(to, 0.5 * at.u)
        patience.left -= 1
        found = _held(problem, at, element, to)
        if found is None or sign * (found.u - at.u) <= 0.0:
            break
        nodes.append(found)
        rises = found.rises(centre)
        straight = at is centre and all(abs(r - 0.5 * ASKED**2) < OFF * 0.5 * ASKED**2 for r in rises)
        if straight or min(rises) > NEGLIGIBLE:
            break
        at = found
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
    volume = float(np.sum(np.log(np.diag(root))))
    elements = problem.bench.parameters.elements(theta)
    density = -evaluation.cost + volume - float(np.log(std))
    along = np.asarray(root.T @ aside) / std**2
    return _Node(evaluation, float(elements[element]), std, along, density, elements)


def _raised(
    problem: Problem, estimate: InertialEstimate, centre: _Node, nodes: list[_Node]
) -> InertialEstimate:
    """The estimate with a covariance that holds the places found, and without what is then vague."""
    covariance = estimate.covariance
    for node in nodes:
        away = node.elements - centre.elements
        likely = max(ONE_STD, min(node.rises(centre)))
        beyond = 0.5 / likely - 1.0 / _squared_stds(covariance, away)
        covariance = covariance + max(0.0, beyond) * np.outer(away, away)
    std = np.sqrt(np.diag(covariance))
    vague = {n for n, s, b in zip(ELEMENTS, std, believed_std(problem), strict=True) if not s < GAIN * b}
    lost = with_products({*estimate.unobservable, *vague})
    return replace(estimate, covariance=covariance, unobservable=lost)


def _squared_stds(covariance: Array, away: Array) -> float:
    """x' C^-1 x."""
    scale = np.sqrt(np.diag(covariance))
    x = away / scale
    return float(x @ np.linalg.solve(definite(covariance / np.outer(scale, scale)), x))
