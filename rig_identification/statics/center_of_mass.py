"""Chapter 2 of the thesis: the centre of mass of a body from how it hangs, bare and with a dummy.

The thesis picks three of the four moment equations of its two experiments and solves them with
the poses one after the other. Here everything stands in one adjustment
(:mod:`static_model`, :mod:`adjustment`): all four moments, tensions where they are measured,
and the tolerances of the rig, so that the covariance is that of all of them together.

What the equations tell: with the attitude from two inclinations, each recording gives one
vertical line in the body on which its combined centre of mass lies. Bare alone leaves the
height along that line open; the dummy tilts the body, and two lines meet in one point. A rig
whose attitude does not change with the load (parallel cables of a trapeze) never tells the
height. Without load cells the tensions follow from forces and the moment about the vertical,
four equations: with more than four cables, or parallel ones, tensions, and with them the
centre of mass, stay open until they are measured.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.model.so3 import skew
from rig_identification.rig import Rig
from rig_identification.statics.adjustment import Adjusted, adjust
from rig_identification.statics.balance import balance, undetermined_tensions
from rig_identification.statics.equilibrium import hanging_mass
from rig_identification.statics.judgement import judge, misfit
from rig_identification.statics.observation import StaticObservation, mount, up_in_body
from rig_identification.statics.poses import HangingPose, poses_with_known_inclination, poses_with_known_mass
from rig_identification.statics.static_model import StaticModel, StaticState
from rig_identification.statics.static_solution import StaticPose, StaticSolution

Array = NDArray[np.float64]

AXES = ("cx", "cy", "cz")
FITS = ("determined", "undetermined")
VAGUE = 0.25  # of the hinges' span, the weight or the mass: known less well than this is not known
RIVAL = 25.0  # chi squared by which a second solution may be worse and still be one


def solve_center_of_mass(rig: Rig, *observations: StaticObservation) -> StaticSolution:
    """Find the centre of mass (body and carrying frame together) from static observations.

    The first is usually bare and the second carries a dummy; one alone or more are taken
    too. Tensions count where they are measured. Without ``rig.mass`` the mass is found as
    well if tensions tell it; a missing ``rig.mass_std`` means an exact mass. No initial guess
    is needed. Raises ``InputError`` only for no observation at all.
    """
    if not observations:
        raise InputError("static solution: no observation given; pass the bare recording at least")
    model = StaticModel(rig, observations)
    candidates = [_candidates(model, observation) for observation in observations]
    for observation, found in zip(observations, candidates, strict=True):
        if not found:
            return _nothing(f"{observation.name}: no pose has these inclinations and cable lengths.")
    solved = [_solve(model, chosen) for chosen in product(*candidates)]
    order = sorted(solved, key=lambda s: (s.status == "slack", s.chi_squared))
    best = order[0]
    rivals = tuple(other for other in order[1:] if _is_rival(best, other))
    return _ambiguous(best, rivals) if rivals else best


def _is_rival(best: StaticSolution, other: StaticSolution) -> bool:
    """Whether another solution fits as well and differs in an element that both determine."""
    if best.status not in FITS or other.status not in FITS or other.chi_squared > best.chi_squared + RIVAL:
        return False
    apart = np.abs(other.center_of_mass - best.center_of_mass)
    return bool(np.any(apart > 3.0 * np.hypot(best.std, other.std) + 1e-6))


def _candidates(model: StaticModel, observation: StaticObservation) -> list[HangingPose]:
    """Poses to start from, those in which every cable pulls before the others, four at most."""
    measured = np.all(np.isfinite(observation.inclination))
    angles = observation.inclination if measured else np.zeros(2)
    tolerance = model.rig.tolerance
    noise = float(np.max(observation.inclination_std)) if measured else 0.1
    doubt = tolerance["cable_length"] + 2.0 * tolerance["hinge_position"]
    doubt += model.span * (noise + tolerance["inclinometer_orientation"] + tolerance["level"])
    up = up_in_body(angles, mount(model.rig))
    poses = poses_with_known_inclination(model.nominal, up, 1e-6 + 10.0 * doubt)
    taut = [pose for pose in poses if pose.taut]
    if taut:
        return sorted(taut, key=lambda pose: pose.misfit)[:4]
    # Nearly parallel or redundant cables: what little noise there is decides the tensions that
    # balance exactly, so start from the heading that an evenly loaded body takes as well.
    middle = model.nominal.body.mean(axis=0)
    even = [pose for pose in poses_with_known_mass(model.nominal, middle) if pose.taut and pose.stable]
    pulling = [pose for pose in poses if np.sum(pose.tension) > 0.0]
    return even[:1] + sorted(pulling, key=lambda pose: pose.misfit)[:1]


def _solve(model: StaticModel, chosen: tuple[HangingPose, ...]) -> StaticSolution:
    """Adjust with the vague beliefs of an anchored model, then without where nothing leans on them."""
    anchored = StaticModel(model.rig, model.observations, anchored=True)
    model, free = anchored, model
    adjusted = _adjust(model, _start(model, chosen))
    std = np.sqrt(np.diag(adjusted.covariance))
    tensions = np.concatenate([std[model.tension_columns(k)] for k in range(len(chosen))])
    if np.all(std[:3] < VAGUE * model.span) and np.all(tensions < VAGUE):
        model = free
        adjusted = _adjust(model, adjusted.state)
    return _solution(model, adjusted)


def _adjust(model: StaticModel, start: StaticState) -> Adjusted[StaticState]:
    # Metres, radians and weights: a belief may move by any number of its tolerances.
    longest = np.where(np.arange(model.size) < model.first_belief, 0.3, np.inf)
    return adjust(start, model.residuals, model.constraints, model.move, longest)


def _solution(model: StaticModel, adjusted: Adjusted[StaticState]) -> StaticSolution:
    covariance = adjusted.covariance
    center_covariance = covariance[:3, :3].copy()
    unknown = np.sqrt(np.diag(center_covariance)) > VAGUE * model.span
    center = np.where(unknown, np.nan, adjusted.state.center_of_mass)
    center_covariance[unknown, :] = center_covariance[:, unknown] = 0.0
    center_covariance[unknown, unknown] = np.inf
    names = tuple(name for name, lost in zip(AXES, unknown, strict=True) if lost)
    poses = tuple(_pose(model, adjusted, k) for k in range(len(model.observations)))
    chi_squared, freedom = misfit(model, adjusted)
    status, statement = judge(model, adjusted, poses, names, chi_squared, freedom)
    mass_std = float(np.sqrt(covariance[3, 3])) + float(np.abs(adjusted.open_directions[3]).sum())
    mass_known = mass_std < VAGUE
    return StaticSolution(
        status=status,
        statement=statement,
        center_of_mass=center,
        covariance=center_covariance,
        mass=adjusted.state.mass if mass_known else float("nan"),
        mass_std=adjusted.state.mass * mass_std if mass_known else float("inf"),
        undetermined=names + (() if mass_known else ("m",)),
        poses=poses,
        chi_squared=chi_squared,
        degrees_of_freedom=freedom,
    )


def _start(model: StaticModel, chosen: tuple[HangingPose, ...]) -> StaticState:
    """Poses and tensions of the search; the centre from the moments, linear in it, least squares."""
    mass = model.rig.mass or _mass_from_tensions(model) or 1000.0
    middle = model.nominal.body.mean(axis=0)
    rows, sides, tensions = [], [], []
    for pose, observation in zip(chosen, model.observations, strict=True):
        total, arm = hanging_mass(mass, middle, observation.dummy)
        tension = _first_tension(model, observation, pose, total)
        tensions.append(tension)
        at = balance(model.nominal, arm, pose.position, pose.attitude, tension)
        rows.append((skew(np.array([0.0, 0.0, 1.0])) @ pose.attitude)[:2] * (mass / total))
        sides.append(-at.residual[-3:-1])
    step = np.linalg.lstsq(np.vstack(rows), np.concatenate(sides), rcond=1e-4)[0]
    return StaticState(
        center_of_mass=middle + step,
        mass=mass,
        position=np.array([pose.position for pose in chosen]),
        attitude=np.array([pose.attitude for pose in chosen]),
        tension=np.array(tensions),
        beliefs=np.zeros(len(model.tolerance)),
    )


def _first_tension(model: StaticModel, seen: StaticObservation, pose: HangingPose, total: float) -> Array:
    """(n,) weights: measured where they are, else balanced, else shared evenly."""
    if np.all(np.isfinite(seen.tension)):
        return np.asarray(seen.tension / (total * model.rig.gravity))
    return pose.tension if pose.taut else np.full(model.cables, 1.0 / model.cables)


def _mass_from_tensions(model: StaticModel) -> float | None:
    for observation in model.observations:
        if np.all(np.isfinite(observation.tension)):
            extra = 0.0 if observation.dummy is None else observation.dummy.mass
            return max(float(np.sum(observation.tension)) / model.rig.gravity - extra, 1e-3)
    return None


def _pose(model: StaticModel, adjusted: Adjusted[StaticState], k: int) -> StaticPose:
    state, columns = adjusted.state, model.tension_columns(k)
    extra = 0.0 if model.observations[k].dummy is None else model.observations[k].dummy.mass  # type: ignore[union-attr]
    weight = (state.mass + extra) * model.rig.gravity
    at = balance(
        model.believed(state).suspension, np.zeros(3), state.position[k], state.attitude[k], state.tension[k]
    )
    std = np.sqrt(np.diag(adjusted.covariance)[columns])
    return StaticPose(
        name=model.observations[k].name,
        position=state.position[k],
        orientation=Rotation.from_matrix(state.attitude[k]).as_quat(),
        tension=np.where(std > VAGUE, np.nan, weight * state.tension[k]),
        tension_std=np.where(std > VAGUE, np.inf, weight * std),
        undetermined_tensions=undetermined_tensions(at, model.cables),
    )


def _ambiguous(best: StaticSolution, rivals: tuple[StaticSolution, ...]) -> StaticSolution:
    statement = f"{1 + len(rivals)} solutions fit the readings; a measured tension may decide."
    return replace(best, status="ambiguous", statement=statement, alternatives=rivals)


def _nothing(statement: str) -> StaticSolution:
    unknown = np.full(3, np.nan)
    return StaticSolution(
        "no_pose", statement, unknown, np.diag(np.full(3, np.inf)), float("nan"), float("inf"), (*AXES, "m")
    )
