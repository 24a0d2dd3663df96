"""What holds the rig up gives way: cables that stretch, a ceiling that yields.

Both are looked for by what does not yield yet and is there in the linearised model only: the derivative in
its compliance at zero is exact. A ceiling moves all upper hinges. Of cables that stretch each moves its own,
along itself, by L/EA of its tension: that shares the load among them otherwise, and lets the body turn about
axes that no ceiling turns it about.

Steel cables let a body bounce at tens of hertz, far above what shakes it. What they stretch by then follows
their tension at once, and the bounce itself needs not be followed: each hinge follows as a ceiling of its own
does that is held at TAUT_FREQUENCY, which costs no shorter step. Softer ones are elastic in the model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.growing import shows
from rig_identification.estimate.parameters import AXES, Parameter
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Evaluation, Point, Problem
from rig_identification.estimate.stretching import (
    BOUNCE,
    DAMPING,
    STIFFNESS,
    TIME_CONSTANT,
    stretching,
    usual_stiffness,
)
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import RigModel, State, on_cables
from rig_identification.model.substeps import hanging
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Frequency (Hz) of the ceiling where a fit starts; its damping ratio is that of the cables' stretching.
CEILING_FREQUENCY = 10.0
#: Damping ratio of a probe: it starts unloaded, and what that costs is over after a twentieth of a second.
PROBE_DAMPING = 1.0

#: Frequency (Hz) at which a taut cable's stretch follows its tension, and the damping ratio: at 2 Hz by 2 %
#: too much and 6 ms late. It is what the step of every fit resolves.
TAUT_FREQUENCY, TAUT_DAMPING = 15.0, 0.3
#: Bounce (Hz) of a body above which nothing but a ring tells cables that are elastic in the model from these:
#: each step is then a tenth of a fit's.
TAUTEST = 30.0
#: What taut cables have of 1/EA.
TAUT = "cable.compliance"
#: Parts of the usual stiffness at which cables that stretch are begun: webbing, rope, wire.
STRETCHES = (0.03, 0.3, 3.0)


def gives_way(model: RigModel) -> bool:
    """Whether something in the model swings or stretches already."""
    return model.internal > 0 or not np.all(model.modes == layout.RIGID)


def stretches(model: RigModel) -> bool:
    """Whether cables stretch in the model, or a ceiling yields, which first order hardly tells from that."""
    kinds = [
        model.physics[place.internal_block(model.cables, k) + layout.KIND] for k in range(model.internal)
    ]
    return layout.CEILING in kinds or not np.all(model.modes == layout.RIGID)


def largest_compliance(rig: Rig, mass: float) -> float:
    """m/N: a support that sinks by a centimetre under the body shows without any tool."""
    return 0.01 / (mass * rig.gravity)


def _compliance_prior(rig: Rig, mass: float) -> float:
    """m/N: five millimetres under the body's weight."""
    return 0.005 / (mass * rig.gravity)


def _block(along: Array, damping: float, frequency: float, hinge: int = 0) -> Array:
    """Block of a ceiling. along (3,): world; hinge: see layout.py."""
    block = np.zeros((1, layout.INTERNAL_SIZE))
    block[0, layout.KIND], block[0, layout.HINGE] = layout.CEILING, hinge
    block[0, layout.AXIS : layout.AXIS + 3] = along
    block[0, layout.FREQUENCY], block[0, layout.DAMPING_RATIO] = frequency, damping
    return block


def ceiling_candidate(
    rig: Rig,
    model: RigModel,
    mass: float,
    axis: int,
    *,
    probe: bool = False,
    frequency: float = CEILING_FREQUENCY,
) -> Candidate:
    """A ceiling that yields along one axis of the world; as a probe its compliance alone is free.

    frequency: Hz, of the ceiling by itself, where a fit starts.
    """
    a = AXES[axis]

    def build(model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        o = place.internal_block(model.cables, model.internal)
        compliance = Parameter(
            f"ceiling.compliance.{a}",
            "m/N",
            0.0,
            _compliance_prior(rig, mass),
            "physics",
            o + layout.COMPLIANCE,
            bounded=False,
        )
        names = (("frequency", "Hz", frequency, 0.5), ("damping_ratio", "1", DAMPING, 1.0))
        more = [
            Parameter(
                f"ceiling.{name}.{a}", unit, start, std, "physics", o + entry, bounded=False, ratio=True
            )
            for (name, unit, start, std), entry in zip(
                names, (layout.FREQUENCY, layout.DAMPING_RATIO), strict=True
            )
        ]
        block = _block(np.eye(3)[axis], PROBE_DAMPING if probe else DAMPING, frequency)
        return model.with_internal(block), (compliance,) if probe else (compliance, *more)

    def told(found: Estimates) -> Told:
        compliance, frequency = f"ceiling.compliance.{a}", f"ceiling.frequency.{a}"
        # A ring tells stiffness per moving mass: errors of both go along one line
        mass = found.following(lambda c, f: 1.0 / (c * (2.0 * np.pi * f) ** 2), compliance, frequency)
        return {
            "stiffness": (*found.following(lambda c: 1.0 / c, compliance), "N/m"),
            "mass": (*mass, "kg"),
            "damping_ratio": (*found.of(f"ceiling.damping_ratio.{a}"), "1"),
        }

    return Candidate(
        "ceiling_compliance",
        build(model)[1],
        f"The ceiling yields along {a}: its stiffness is {{value}}.",
        "Hang the rig from a stiffer beam, or keep the ceiling in the model.",
        {"channel": "ceiling", "axis": a},
        positive=1,
        tell=told,
        build=build,
    )


def yielding_like(rig: Rig, model: RigModel, compliance: float) -> float:
    """EA, N, of cables side by side that yield as a ceiling of so much compliance (m/N) does."""
    length = float(np.mean([c.length for c in rig.cables]))
    return length / (compliance * model.cables)


def stiffnesses(rig: Rig, mass: float) -> list[float]:
    """(3,) EA, N, at which a fit of cables that stretch is begun: none finds its way from one to the next."""
    return [share * usual_stiffness(rig, mass) for share in STRETCHES]


def cable_elasticity(rig: Rig, model: RigModel, mass: float) -> Candidate:
    """Cables that stretch, all alike."""
    n = model.cables
    length = float(np.mean([c.length for c in rig.cables]))

    def build(model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        return stretching(rig, model, mass)

    def ratio(EA: float, tau: float) -> float:
        return float(0.5 * tau * np.sqrt(n * EA / length / mass))

    def told(found: Estimates) -> Told:
        return {
            "axial_stiffness": (*found.of(STIFFNESS), "N"),
            "damping_ratio": (*found.following(ratio, STIFFNESS, TIME_CONSTANT), "1"),
        }

    return Candidate(
        "cable_elasticity",
        build(model)[1],
        "The cables stretch: their axial stiffness EA is {value}.",
        "Keep the stretch in the model; no steel rope is stiff enough to leave it out.",
        {"channel": None, "axis": None},
        tell=told,
        build=build,
        settle=stretched,
    )


def taut_cables(rig: Rig, model: RigModel, mass: float) -> list[Candidate]:
    """Cables that stretch, all alike and so little that their stretch follows their tension; none twice."""
    if stretches(model):
        return []
    along = hanging(
        *(np.array([getattr(c, a) for c in rig.cables]) for a in ("ceiling_point", "body_point", "length"))
    )

    def build(model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        first, entries = model.internal, []
        for i, cable in enumerate(rig.cables):
            entries.append((place.internal_block(model.cables, first + i) + layout.COMPLIANCE, cable.length))
            model = model.with_internal(_block(along[i], TAUT_DAMPING, TAUT_FREQUENCY, i + 1))
        own = Parameter(
            TAUT,
            "1/N",
            0.0,
            1.0 / usual_stiffness(rig, mass),
            "physics",
            -1,
            bounded=False,
            shifts=tuple(entries),
        )
        return model, (own,)

    def told(found: Estimates) -> Told:
        return {"axial_stiffness": (*found.following(lambda e: 1.0 / max(e, 1e-15), TAUT), "N")}

    def elastic(problem: Problem, evaluation: Evaluation) -> list[tuple[Candidate, dict[str, float]]]:
        here = problem.bench.parameters.named(evaluation.point.theta)[TAUT]
        left = problem.discrepancy is not None or shows(evaluation)
        if here * usual_stiffness(rig, mass) < (BOUNCE / TAUTEST) ** 2 or not left:
            return []
        return [(soft, {STIFFNESS: 1.0 / here})]

    soft, own = cable_elasticity(rig, model, mass), build(model)[1]
    return [
        replace(soft, parameters=own, positive=1, tell=told, build=build, settle=None, closer=elastic),
    ]


def stretched(problem: Problem, point: Point, evaluation: Evaluation) -> Point:
    """The start states lowered by what the tensions of the inextensible fit stretch the cables."""
    model = model_at(problem.bench.parameters, point.theta)
    n = model.cables

    def lowered(state: State, tension: Array) -> State:
        physics = model.physics.copy()
        for i in range(n):
            o = layout.cable_offset(i)
            strain = max(tension[i], 0.0) / physics[o + layout.AXIAL_STIFFNESS]
            physics[o + layout.LENGTH] *= 1.0 + strain
        rigid = replace(model.with_physics(physics), modes=np.full(n, layout.RIGID, dtype=np.int64))
        return on_cables(rigid, state)

    starts = tuple(
        lowered(start, run.motion.outputs[0, layout.OUT_TENSION :])
        for start, run in zip(point.starts, evaluation.runs, strict=True)
    )
    guesses = tuple(
        lowered(guess, rest.rest.tension)
        for guess, rest in zip(point.rest_guesses, evaluation.rests, strict=True)
    )
    return replace(point, starts=starts, rest_guesses=guesses)
