"""The tolerance that the inertia about the vertical rests on, told where it is most of its doubt.

A body that is only watched tells of its inertia by a frequency. On alike threads w^2 = m g r R / (h J): the
swing tells J / (r R) and no more, and hinges that sit a centimetre elsewhere make another body of it. Where
the tolerance is so wide that nothing is told of the inertia any more, the ratio is told, and what makes an
inertia of it.
"""

from __future__ import annotations

import numpy as np

from rig_identification.estimate.alike_threads import AlikeThreads, alike_threads
from rig_identification.estimate.observability import GAIN, root_of_inverse
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.sources import prior_name
from rig_identification.quantity import plain_figure, with_interval
from rig_identification.result import ELEMENTS, InertialEstimate, TextbookAnswer, UncertaintySource

#: Share of the variance from which one tolerance is told: more than all else together.
MOST = 0.5
#: m, to which a tape measures where a hinge is.
TAPE = 0.001
#: What each tolerance is called, and what would tell it from the inertia.
WORDS = {
    "tolerance.hinge_position": (
        "where the hinges are",
        "Measure the distances between the hinges more closely",
    ),
    "tolerance.cable_length": (
        "how long the cables are",
        "Measure the cables between their hinges more closely",
    ),
    "tolerance.level": ("the level of the ceiling points", "Level the ceiling points"),
    "tolerance.gyroscope_scale": ("the gyroscope's scale", "Turn the gyroscope by a known angle"),
    "ground scale": ("the mass", "Weigh the body closer"),
}


def tie_of(
    estimate: InertialEstimate,
    problem: Problem,
    evaluation: Evaluation,
    textbook: tuple[TextbookAnswer, ...],
) -> str | None:
    """What is told of a number of the description that Jzz rests on, or is hidden by; None: of none.

    problem, evaluation: the fit that the estimate comes from. textbook: what a formula makes of the swing.
    Where distances that are hardly known are all that the formula leaves open, the formula tells the tie,
    whatever a fit that may bend the rig so far makes of it.
    """
    threads = alike_threads(problem.bench.rig)
    if threads is not None and textbook:
        answer = textbook[0]
        distances = answer.shares["distances"]
        if distances > GAIN * answer.value and distances**2 > MOST * answer.std**2:
            alone = float(np.sqrt(answer.std**2 - distances**2))
            return hidden_note("tolerance.hinge_position", alone, threads, answer)
    if "Jzz" not in estimate.unobservable:
        return tied_note(estimate)
    hidden = hidden_by(problem, evaluation)
    return None if hidden is None else hidden_note(*hidden, threads, textbook[0] if textbook else None)


def hidden_by(problem: Problem, evaluation: Evaluation) -> tuple[str, float] | None:
    """The tolerance that alone keeps Jzz from being determined, and its std (kg m2) without that doubt.

    Each tolerance is taken away by holding its numbers where they are fitted; the one that leaves least is
    meant. None where Jzz would stay undetermined.
    """
    parameters, zz = problem.bench.parameters, ELEMENTS.index("Jzz")
    theta = evaluation.point.theta
    row = parameters.elements_jacobian(theta)[zz]
    size = abs(float(parameters.elements(theta)[zz]))
    names = [prior_name(p)[0] for p in parameters.free]
    left = {}
    for name in sorted(set(names) & set(WORDS)):
        kept = np.ones(evaluation.information.shape[0], dtype=bool)
        kept[INERTIAL : INERTIAL + len(names)] = [other != name for other in names]
        root = root_of_inverse(evaluation.information[np.ix_(kept, kept)])
        left[name] = float(np.linalg.norm(root[:, :INERTIAL] @ row))
    if not left:
        return None
    name = min(left, key=lambda n: left[n])
    return (name, left[name]) if left[name] < GAIN * size else None


def hidden_note(
    name: str, alone: float, threads: AlikeThreads | None, textbook: TextbookAnswer | None
) -> str:
    """A sentence on a tolerance that hides Jzz: what is tied, by which factor, and what breaks the tie.

    name, alone: as :func:`hidden_by` has them. threads, textbook: the rig as alike threads and what their
    formula makes of the swing; None where it is no such rig.
    """
    what, advice = WORDS[name]
    if name == "ground scale":
        # What hangs on the rig turns by its own weight: no other body tells this one's
        return (
            f"Jzz is tied to {what}: with that known it would have a standard deviation of "
            f"{plain_figure(alone, 2)} kg m². {advice}."
        )
    others = "hang a body of known inertia on the same rig as well, or fix one to this body in a second run"
    if name != "tolerance.hinge_position" or threads is None or textbook is None:
        return (
            f"Jzz is tied to {what}: with that known it would have a standard deviation of "
            f"{plain_figure(alone, 2)} kg m². {advice}, or {others}: the ratio of both needs no such number."
        )
    # Two hinges are told by their distance, more by the circle that they lie on
    product, between = (4.0, "the distance") if threads.count == 2 else (1.0, "the radius of the circle")
    product *= threads.product
    shares = textbook.shares
    inside = float(np.sqrt(shares["period"] ** 2 + shares["mass"] ** 2 + shares["length"] ** 2))
    share = shares["distances"] / textbook.value
    tape = TAPE * share / threads.hinge
    return (
        f"Jzz is tied to where the hinges are. A swing tells Jzz / (d D) and no more, d {between} of the "
        f"hinges on the body and D at the ceiling: "
        f"{with_interval(textbook.value / product, inside / product, 'kg')}. As described, d D is "
        f"{plain_figure(product)} m² to within {plain_figure(100.0 * share, 2)} % (one standard deviation), "
        f"and Jzz {plain_figure(textbook.value)} kg m² to within as much: one per cent more in d and in D is "
        f"two per cent more in Jzz. What breaks the tie: {advice[0].lower()}{advice[1:]} (each hinge to a "
        f"millimetre: d D to within {plain_figure(100.0 * tape, 2)} %); hang the body a second time with all "
        f"hinges moved out by one measured length; or {others}: the ratio of both needs no distance."
    )


def tied_note(estimate: InertialEstimate) -> str | None:
    """A sentence on the tolerance that Jzz rests on; None where none is most of its doubt.

    estimate: with the sources of its covariance.
    """
    zz = ELEMENTS.index("Jzz")
    whole = float(estimate.covariance[zz, zz])
    known = [source for source in estimate.sources if source.name in WORDS]
    if "Jzz" in estimate.unobservable or not known or not whole > 0.0:
        return None

    def variance(source: UncertaintySource) -> float:
        return float(source.covariance[zz, zz])

    most = max(known, key=variance)
    share = variance(most) / whole
    if share < MOST:
        return None
    what, advice = WORDS[most.name]
    of_value = np.sqrt(variance(most)) / abs(float(estimate.values[zz]))
    other = (
        ", or hang a body of known inertia on the same rig as well: the ratio of both needs no such number"
    )
    return (
        f"Jzz rests on {what}, as described: within the tolerance it may be "
        f"{plain_figure(196.0 * float(of_value), 2)} % larger or smaller with the same swing, which is "
        f"{plain_figure(100.0 * share, 2)} % of its variance. {advice}"
        f"{'' if most.name == 'ground scale' else other}."
    )
