"""Cables that stretch from the first guess on: rigs that more cables hold than it takes.

Where six cables hold what three would, geometry does not say how they share the load. Inextensible ones
would share it by lengths that no tape measures: a tenth of a millimetre decides which of them carries
anything. Real ones share it by how far each of them stretches,

    T_i = EA (l_i / L_i - 1),    half a millimetre in 2.8 m at EA = 1.5 MN being 270 N,

and so the tensions at rest tell the stiffness, with lengths and hinges in doubt by their tolerances. Which
of the two models is right of such a rig is asked of rest alone, which takes a fraction of a second; of
recordings without rest, of the means of their runs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import INERTIAL, Parameter
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.rest_evidence import RestEvidence, coarsened, prepare_rest
from rig_identification.estimate.solve import Evaluation, Point, Problem, solve
from rig_identification.model import layout
from rig_identification.model.equilibrium import design_pose, settle
from rig_identification.model.motion import RigModel, redundant
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Frequency (Hz) at which a body bounces on cables of the usual stiffness, and their damping ratio.
BOUNCE, DAMPING = 20.0, 0.03
#: Stiffnesses, in the usual one, from which a fit to rest starts: they span what is free of it.
STIFFNESSES = (0.1, 1.0, 10.0)
#: ... and of rubber cords, which are asked where no stiffness of rope explains rest.
RUBBER = 0.01
#: Nats by which cables that stretch explain rest better, from which they do: of a rig with rigid cables
#: chance brings two more numbers as much once in e^10 sessions (half a chi-square of two).
GAINED = 10.0
#: Mean square of what rest leaves below which no other stiffness is tried: so near the noise valleys are one.
EXPLAINED = 2.0
#: Share of its weak prior's std within which rest moves the body's height: hanging straight says little.
HEIGHT = 0.15

STIFFNESS, TIME_CONSTANT = "cable.axial_stiffness", "cable.axial_damping"


def usual_stiffness(rig: Rig, mass: float) -> float:
    """EA, N, of cables on which a body of ``mass`` kg bounces at BOUNCE."""
    length = float(np.mean([c.length for c in rig.cables]))
    return mass * (2.0 * np.pi * BOUNCE) ** 2 * length / len(rig.cables)


def stretching(
    rig: Rig, model: RigModel, mass: float, *, rubber: bool = False
) -> tuple[RigModel, tuple[Parameter, ...]]:
    """The model with cables that stretch, all alike; its parameters are their EA and their time constant.

    rubber: of cords that the weight stretches by a tenth, and not of rope, wire or webbing.
    """
    entries = [layout.cable_offset(i) for i in range(model.cables)]

    def shared(
        name: str, unit: str, nominal: float, std: float, entry: int, bounded: bool = False
    ) -> Parameter:
        first, *others = (o + entry for o in entries)
        return Parameter(name, unit, nominal, std, "physics", first, bounded, tuple(others), ratio=True)

    elastic = replace(
        model,
        modes=np.where(model.can_slacken, layout.ELASTIC, layout.ELASTIC_ROD).astype(np.int64),
        can_slacken=np.zeros(model.cables, dtype=np.bool_),
    )
    damping = 2.0 * DAMPING / (2.0 * np.pi * BOUNCE)
    # Rubber, within three std: from twice its length under the weight to a tenth of what is usual
    softest, stiffest = mass * rig.gravity / model.cables, 0.1 * usual_stiffness(rig, mass)
    cords = float(np.sqrt(softest * stiffest)), float(np.log(stiffest / softest)) / 6.0
    rope = 0.5 * usual_stiffness(rig, mass), 1.2
    return elastic, (
        # Within three std: from 0.014 times what is usual, webbing on which a car sinks by decimetres, to
        # eighteen times, beyond which nothing tells it from rigid and each step takes minutes
        shared(STIFFNESS, "N", *(cords if rubber else rope), layout.AXIAL_STIFFNESS, bounded=True),
        shared(TIME_CONSTANT, "s", damping, 1.0, layout.AXIAL_DAMPING),
    )


@dataclass(frozen=True)
class Stretched:
    """A problem whose cables stretch from the first guess on."""

    problem: Problem
    theta: Array  # (p,) fitted to rest, where there is any
    gain: float | None  # nats by which rest is explained better than by inextensible cables; None: not known


def where_they_stretch(problem: Problem, theta: Array, *, asked: bool = False) -> Stretched | None:
    """The problem with cables that stretch, where more than needed hold the body and rest asks for it.

    theta (p,): of a first guess. asked: rest is asked in any case. None where inextensible cables do.
    """
    if not (asked or redundant(problem.bench.rig)):
        return None
    soft = with_stretch(problem, theta)
    rests = problem.rests or _means_of_runs(problem)
    if soft is None or not any(c.quantity == "tension" for rest in rests for c in rest.channels):
        # Which cable carries what no other device feels
        return None
    rigid, elastic = _at_rest(problem, theta, rests), _softest(soft, rests, STIFFNESSES)
    if elastic is None or _square(elastic) > EXPLAINED:
        cords = with_stretch(problem, theta, rubber=True)
        other = None if cords is None else _softest(cords, rests, (RUBBER,))
        if cords is not None and other is not None and (elastic is None or other.cost < elastic.cost):
            soft, elastic = cords, other
    if elastic is None:
        return None
    gain = None if rigid is None else rigid.cost - elastic.cost
    if gain is not None and not gain > GAINED:
        return None
    return replace(soft, theta=elastic.point.theta, gain=gain)


def with_stretch(problem: Problem, theta: Array, *, rubber: bool = False) -> Stretched | None:
    """The problem with cables that stretch by a usual stiffness; None where something stretches already."""
    parameters = problem.bench.parameters
    if not np.all(parameters.model.modes == layout.RIGID):
        return None
    mass = float(parameters.elements(theta)[0])
    model, own = stretching(problem.bench.rig, parameters.model, mass, rubber=rubber)
    wide = replace(parameters, model=model).having(own)
    soft = replace(problem, bench=replace(problem.bench, parameters=wide))
    return Stretched(soft, wide.converted(theta, parameters), None)


def _means_of_runs(problem: Problem) -> tuple[RestEvidence, ...]:
    """What the means of the runs say of rest: roughly, for a body that swings pulls a little more."""
    names = {run.recording.name: run.recording for run in problem.runs}
    rests = (prepare_rest(problem.bench.rig, recording) for recording in names.values())
    return tuple(coarsened(rest) for rest in rests if rest.channels)


def _softest(
    soft: Stretched, rests: tuple[RestEvidence, ...], shares: tuple[float, ...]
) -> Evaluation | None:
    """The best fit to rest of all stiffnesses that are tried first; None where there is none."""
    parameters = soft.problem.bench.parameters
    index = parameters.index_of(STIFFNESS)
    own = parameters.free[index - INERTIAL]
    usual = usual_stiffness(soft.problem.bench.rig, float(parameters.elements(soft.theta)[0]))
    best: Evaluation | None = None
    for share in shares:
        theta = soft.theta.copy()
        theta[index] = own.position(share * usual)
        found = _at_rest(soft.problem, theta, rests)
        if found is not None and (best is None or found.cost < best.cost):
            best = found
        if best is not None and _square(best) < EXPLAINED:
            break
    return best


def _square(evaluation: Evaluation) -> float:
    """Mean square of what rest leaves."""
    return float(np.mean(np.concatenate([rest.residual for rest in evaluation.rests]) ** 2))


def _at_rest(problem: Problem, theta: Array, rests: tuple[RestEvidence, ...]) -> Evaluation | None:
    """A fit to rest alone; None where the body finds none near where it falls to."""
    model = model_at(problem.bench.parameters, theta)
    rest = settle(model, design_pose(model))
    if not rest.is_finite:
        return None
    weak = problem.weak.copy()
    weak[9] *= HEIGHT
    still = replace(problem, runs=(), rests=rests, weak=weak)
    try:
        return solve(still, Point(theta, (), (rest,) * len(rests)), tolerance=1e-2)[0]
    except FloatingPointError:
        return None
