"""Physics that the ideal model leaves out: one entry for each file of model/effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import INERTIAL, Parameter, ParameterSet
from rig_identification.estimate.solve import Evaluation, Point, Problem
from rig_identification.mismatch.candidate import Candidate, Told, added
from rig_identification.mismatch.own_effects import own_hypotheses
from rig_identification.mismatch.tethers import tethers
from rig_identification.model import layout
from rig_identification.model.body import (
    can_exist,
    elements_from_linear,
    linear_from_log_cholesky,
    log_cholesky_from_linear,
    point_inertia,
    six_elements,
)
from rig_identification.model.effects import place
from rig_identification.model.motion import CREEP_RATE
from rig_identification.rig import Rig

#: Std of the logarithm of the rate at which dry hinges creep: a factor of three to either side.
CREEP_SPREAD = 1.1
#: ... and of the share in which hinges resist being twisted, about that of ball joints.
TWIST_SPREAD = 0.5
#: m: a cable's torsional stiffness, as a share of the weight that it helps to carry. A steel rope of a
#: centimetre, two metres long, has some 5 N m/rad, a rod of that size 40: parts in a thousand of 10 kN.
TWISTED = 0.005
#: rad between how the body hangs and how it was held when the cables were clamped: it may lean by so much.
CLAMPED = 0.1
#: ... and no body is held further askew than this.
ASKEW = 3.0 * CLAMPED
#: rad/s: angular momentum of what spins on a body over its own inertia. A rotor of 10 kg and 0.1 m radius at
#: 3000 rpm has 16 N m s, on a car of 1000 kg and 2 m that is 0.004.
SPINNING = 0.02
#: kg/m: what hangs a body is what is at hand, and strong enough many times over, however light the body is. A
#: wire rope of 16 mm weighs 1 kg/m, a chain of 13 mm 3.8 kg/m.
HEAVY_CABLE = 1.0


def left_out_physics(rig: Rig, parameters: ParameterSet, mass: float) -> list[Candidate]:
    """Every effect on the motion, with priors scaled to this rig and body.

    mass: kg, roughly. A prior's std is what such rigs can plausibly show: a tenth of
    critical damping, friction of a dry bearing of a centimetre's radius, a body's frontal
    area, percents of its mass.
    """
    n = len(rig.cables)
    block = layout.effects_offset(n)
    size = float(np.max(extent(rig)))
    out = [
        *_hinges(rig, mass, block),
        Candidate(
            "air_drag",
            (added("air.drag_area", "m^2", 3.0 * size**2, block + place.DRAG_AREA),),
            "The air resists with the square of speed: a drag area of {value}.",
            "Keep speeds low, or keep the drag in the model.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="drag_area",
        ),
        Candidate(
            "air_added_mass",
            (added("air.added_mass", "kg", 0.02 * mass, block + place.ADDED_MASS),),
            "Air that moves with the body adds {value} to its inertia but not to its weight.",
            "Motion alone cannot tell entrained air from inertia: it shows against scale and statics.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="added_mass",
            everywhere=True,
        ),
        _spinning_part(mass * size**2, block),
        _cable_mass(rig, block),
        *_cable_torsion(mass * rig.gravity, block),
        *tethers(rig, mass),
        *own_hypotheses(rig, mass, block),
    ]
    if rig.exciter is not None:
        out.append(
            Candidate(
                "exciter_rotor",
                (added("exciter.rotor_mass", "kg", 0.03 * mass, block + place.ROTOR_MASS),),
                "The exciter's moving mass of {value} rides on the body, unweighed.",
                "Weigh the motor with its unbalance and add it to the body.",
                {"channel": "exciter", "axis": None},
                positive=1,
                name_in_result="rotor_mass",
                settle=_less_the_rotor,
                everywhere=True,
            )
        )
    if parameters.model.physics[block + place.GYROSCOPIC_SHARE] != 0.0:
        out.append(_gyroscopic_term(block, float(parameters.model.physics[block + place.GYROSCOPIC_SHARE])))
    return out


def _hinges(rig: Rig, mass: float, block: int) -> list[Candidate]:
    """Hinges that damp, and hinges that rub: of all cables alike, and of one cable alone."""
    n = len(rig.cables)
    length = float(np.mean([c.length for c in rig.cables]))
    damping = 0.1 * mass * length * np.sqrt(rig.gravity * length) / (2 * n)
    friction = 0.003 * mass * rig.gravity / n
    creep = replace(added("hinge.creep", "rad/s", CREEP_SPREAD, block + place.CREEP, CREEP_RATE), ratio=True)
    twist = added("hinge.twist", "1", TWIST_SPREAD, block + place.HINGE_TWIST, 1.0)
    shared = (damping, block + place.DAMPING), (friction, block + place.FRICTION)
    out = _hinges_of("hinge", None, *shared, creep, twist)
    for i, cable in enumerate(rig.cables):
        o, own = layout.cable_offset(i), f"{cable.name}.hinge"
        entries = (n * damping, o + layout.HINGE_DAMPING), (n * friction, o + layout.HINGE_FRICTION)
        out += _hinges_of(own, cable.name, *entries, creep, twist)
    return out


def _hinges_of(
    name: str,
    channel: str | None,
    damping: tuple[float, int],
    friction: tuple[float, int],
    creep: Parameter,
    twist: Parameter,
) -> list[Candidate]:
    """Both of some cables. damping, friction: how much is plausible, and its entry in the physics."""
    viscous = added(f"{name}.damping", "N*m*s/rad", *damping)
    rubbing = added(f"{name}.friction", "N*m", *friction)

    def damps(found: Estimates) -> Told:
        return {
            "damping": (*found.of(viscous.name), "N*m*s/rad"),
            "twist_share": (*found.of(twist.name), "1"),
        }

    def told(found: Estimates) -> Told:
        return {
            "torque": (*found.of(rubbing.name), "N*m"),
            "creep_rate": (*found.of(creep.name), "rad/s"),
            "twist_share": (*found.of(twist.name), "1"),
        }

    whose = "The cables' hinges" if channel is None else "The hinges of {channel} alone"
    return [
        Candidate(
            "hinge_damping",
            (viscous, twist),
            f"{whose} damp the motion: each puts {{value}} against the rate at which it turns.",
            "Use knife edges or ball joints, or keep the damping in the model.",
            {"channel": channel, "axis": None},
            positive=1,
            tell=damps,
        ),
        Candidate(
            "hinge_friction",
            (rubbing, creep, twist),
            f"{whose} rub: each holds against turning with {{value}}.",
            "Grease or replace the hinges; dry friction spoils small motions most.",
            {"channel": channel, "axis": None},
            positive=1,
            tell=told,
        ),
    ]


def _spinning_part(inertia: float, block: int) -> Candidate:
    """Something that spins on the body: its angular momentum. inertia: kg m^2, of such a body."""
    spins = tuple(
        added(f"spin.{a}", "N*m*s", SPINNING * inertia, block + place.SPIN + i) for i, a in enumerate("xyz")
    )

    def told(found: Estimates) -> Told:
        each: Told = {f"angular_momentum_{q.name[-1]}": (*found.of(q.name), q.unit) for q in spins}
        return {"angular_momentum": max(each.values(), key=lambda one: abs(one[0])), **each}

    return Candidate(
        "unknown",
        spins,
        "Something spins on the body, a motor's rotor or a flywheel: its angular momentum is {value} along "
        "one of the body's axes.",
        "Stop it, or keep its angular momentum in the model.",
        {"channel": None, "axis": None, "law": "spinning part"},
        tell=told,
    )


def _cable_torsion(weight: float, block: int) -> list[Candidate]:
    """Cables that resist being twisted: untwisted at rest, or clamped with the body held otherwise.

    weight: N. Most of what cables do so does not show; three numbers more, which they may not need, hide it.
    Nor do these stand for a moment at rest by themselves, as a hose's pull has.
    """
    stiff = TWISTED * weight
    stiffness = added("cable.torsion", "N*m/rad", stiff, block + place.TORSION)
    twists = tuple(
        added(f"cable.twisted_{axis}", "N*m", CLAMPED * stiff, block + place.TWISTED + i)
        for i, axis in enumerate("xyz")
    )

    def told(found: Estimates) -> Told:
        names = {"torsion_stiffness": stiffness}
        names |= {f"twist_{q.name[-1]}": q for q in twists if q.name in found.values}
        return {name: (*found.of(q.name), q.unit) for name, q in names.items()}

    askew = (
        ". Clamped with the body held otherwise than it hangs, they are twisted at rest, each by its share "
        "of {told[twist_x]}, {told[twist_y]} and {told[twist_z]} about the world's axes"
    )
    return [
        Candidate(
            "unknown",
            (stiffness, *more),
            f"The cables resist being twisted: each turns the body back by {{value}} about itself{hung}.",
            "Hang the cables on swivels; what twists them looks like less inertia at any one frequency.",
            {"channel": None, "axis": None, "law": "torsion of the cables", **state},
            positive=1,
            tell=told,
            everywhere=True,
            per_amount=ASKEW if more else 0.0,
        )
        for more, state, hung in (((), {}, ""), (twists, {"state": "twisted at rest"}, askew))
    ]


def _cable_mass(rig: Rig, block: int) -> Candidate:
    """What all cables weigh; where the lab has weighed them, that they weigh something else."""
    known = rig.cable_linear_density
    return Candidate(
        "cable_mass",
        (added("cable.linear_density", "kg/m", HEAVY_CABLE, block + place.LINEAR_DENSITY, known or 0.0),),
        "The cables weigh {value}.",
        "Weigh a metre of the cable and enter it as cable_linear_density.",
        {"channel": None, "axis": None},
        positive=1 if known is None else 0,
        name_in_result="linear_density",
        everywhere=known is None,
    )


def _less_the_rotor(problem: Problem, point: Point, evaluation: Evaluation) -> Point:
    """The body without the rotor that a fit without one holds in it: together they move as that fit does."""
    _ = evaluation
    parameters = problem.bench.parameters
    values = parameters.named(point.theta)
    mass, at = values["exciter.rotor_mass"], layout.EXCITER_POSITION
    mount = parameters.physics(point.theta)[at : at + 3]
    rotor = np.array([mass, *(mass * mount), *six_elements(point_inertia(mass, mount))])
    alone = linear_from_log_cholesky(point.theta[:INERTIAL]) - rotor
    if not can_exist(elements_from_linear(alone)):
        return point
    return replace(point, theta=np.concatenate([log_cholesky_from_linear(alone), point.theta[INERTIAL:]]))


def _gyroscopic_term(block: int, lacking: float) -> Candidate:
    """The gyroscopic moment, where the ideal model lacks a share of it: in nature none is missing."""
    share = added("gyroscopic_share", "1", 1.0, block + place.GYROSCOPIC_SHARE, lacking)

    def told(found: Estimates) -> Told:
        return {"share": (*found.following(lambda lacking: 1.0 - lacking, share.name), "1")}

    return Candidate(
        "gyroscopic_term",
        (share,),
        "The body's own rotation turns its angular momentum: {value} of the moment w x (J w) acts.",
        "Keep the gyroscopic term in the equations.",
        {"channel": None, "axis": None},
        tell=told,
    )
