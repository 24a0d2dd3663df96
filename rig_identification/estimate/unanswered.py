"""The answer to a session of which the model can follow nothing: what is known without it, and why."""

from __future__ import annotations

import numpy as np

from rig_identification.estimate.observability import believed_std
from rig_identification.estimate.solve import CannotBeFollowed
from rig_identification.estimate.without_frame import vehicle_alone
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS, Identification, InertialEstimate, Mismatch

NOT_FOLLOWED = (
    "The model of the described rig follows none of the recordings ({names}): it finds no pose at rest, or "
    "no motion that stays within bounds. Nothing but the weighed mass is known of the body. Check the "
    "cables' lengths and hinge points, the mass, and the units of the recorded values."
)


def unanswered(session: Session, why: CannotBeFollowed) -> Identification:
    """Verdict ``unexplained``; every element undetermined but the mass where a scale tells it."""
    problem = why.problem
    values = problem.bench.parameters.elements(why.theta)
    std = believed_std(problem)
    lost: tuple[str, ...] = ELEMENTS
    if problem.mass is not None:
        values[0], std[0] = problem.mass
        lost = ELEMENTS[1:]
    total = InertialEstimate(values, np.diag(std**2), lost)
    frame = session.rig.frame
    return Identification(
        total=total,
        without_frame=vehicle_alone(total, frame),
        mismatch=Mismatch("unexplained", NOT_FOLLOWED.format(names=", ".join(why.names))),
        parameters=(),
        channels=(),
        holdout_error=None,
        training_error=None,
        converged=False,
    )
