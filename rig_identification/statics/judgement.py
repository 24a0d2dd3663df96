"""Whether an adjusted static state is an answer: misfit, cables that push, open elements, stability."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc

from rig_identification.statics.adjustment import Adjusted
from rig_identification.statics.balance import balance, is_stable
from rig_identification.statics.equilibrium import hanging_mass
from rig_identification.statics.static_model import StaticModel, StaticState
from rig_identification.statics.static_solution import StaticPose

IMPROBABLE = 1e-6  # chance of a larger misfit below which readings and description disagree


def misfit(model: StaticModel, adjusted: Adjusted[StaticState]) -> tuple[float, int]:
    """Chi squared and degrees of freedom of all but the vague beliefs.

    A belief counts as a degree of freedom by as much as the data, not itself, settle it: one
    less its leverage.
    """
    if not model.anchored:
        return adjusted.chi_squared, adjusted.degrees_of_freedom
    residual, slope = model.anchor(adjusted.state)
    leverage = np.einsum("ri,ij,rj->r", slope, adjusted.covariance, slope)
    freedom = adjusted.degrees_of_freedom - float(np.sum(1.0 - leverage))
    return adjusted.chi_squared - float(residual @ residual), max(0, round(freedom))


def judge(
    model: StaticModel,
    adjusted: Adjusted[StaticState],
    poses: tuple[StaticPose, ...],
    unknown: tuple[str, ...],
    chi_squared: float,
    freedom: int,
) -> tuple[str, str]:
    """Status and statement of a :class:`StaticSolution`."""
    cables = [cable.name for cable in model.rig.cables]
    if adjusted.constraint_error > 1e-7:
        return "inconsistent", "The cables cannot be brought to balance with these readings."
    if freedom > 0 and float(chdtrc(freedom, chi_squared)) < IMPROBABLE:
        settled = "" if adjusted.converged else " (the adjustment did not settle)"
        return "inconsistent", (
            f"Readings and rig description do not agree: chi squared {chi_squared:.3g} "
            f"with {freedom} degrees of freedom{settled}."
        )
    for pose in poses:
        pushing = [
            name for name, t, s in zip(cables, pose.tension, pose.tension_std, strict=True) if t < -3.0 * s
        ]
        if pushing:
            return "slack", f"{pose.name}: {', '.join(pushing)} would have to push; it must hang slack."
    if unknown:
        redundant = max(pose.undetermined_tensions for pose in poses)
        why = f"; {redundant} combination(s) of tensions stay open without load cells" if redundant else ""
        return "undetermined", f"The recordings do not determine {', '.join(unknown)}{why}."
    if not _stable(model, adjusted.state):
        return "slack", "The pose found is balanced but would not stay: it is no equilibrium that hangs."
    return "determined", "The centre of mass is determined."


def _stable(model: StaticModel, state: StaticState) -> bool:
    suspension = model.believed(state).suspension
    for k, observation in enumerate(model.observations):
        _, arm = hanging_mass(state.mass, state.center_of_mass, observation.dummy)
        at = balance(suspension, arm, state.position[k], state.attitude[k], state.tension[k])
        if not is_stable(at, model.cables):
            return False
    return True
