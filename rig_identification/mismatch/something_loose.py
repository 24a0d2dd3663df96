"""Something loose, told by its blows where they stand out, and else by all of its wrench."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Point, Problem
from rig_identification.mismatch.findings import written
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.knocks import Knocks, Line, knocking
from rig_identification.mismatch.loose import FARTHEST, LIKELY, Along, Gain, Loose, likeliest
from rig_identification.mismatch.measured import measured
from rig_identification.mismatch.opened import with_reference
from rig_identification.mismatch.rider_places import spread_of
from rig_identification.mismatch.riders import middle_of
from rig_identification.mismatch.ringing import without_ringing
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import mass_of
from rig_identification.quantity import with_interval
from rig_identification.result import Finding

Array = NDArray[np.float64]

#: Std of a travel that blows were timed by, and of a mass that they tell, as a share of each: blows that come
#: some milliseconds early or late in the scan make a part look lighter, and its way longer or shorter.
TIMED, WEIGHED = 0.5, 1.0
#: Nats by which a loose part has to be likelier than all else, and by which held-out runs have to confirm it,
#: or by which the times and sizes of its blows are likelier than chance.
AHEAD, CONFIRMED = 30.0, 10.0
#: Angle (rad) from a body axis from which on a line is told by its direction.
ASLANT = 0.1


def loose_finding(fitted: Fitted, before: float | None, *, scan: bool = True) -> Finding | None:
    """What is told of a loose part beside a fit that leaves something; None: there is none that convinces.

    fitted: whole runs, each from rest. before: held-out error of the ideal model. scan: whether it is looked
    for by all of its wrench as well, which takes some ten seconds more.
    """
    problem = with_reference(fitted.problem, fitted.rest)
    mass = mass_of(problem, fitted.evaluation)
    runs, holdouts = fitted.problem.runs, fitted.holdout_runs
    seen = measured(problem, fitted.evaluation.point, mass)
    if seen is None:
        return None
    middle, held = middle_of(problem.bench.rig), _held_out(fitted, problem, mass, holdouts)
    knocks = _convincing(seen, held, mass)
    if knocks is None:
        # Blows may be told best by what does not ring with them
        calm, calm_held = (tuple(map(without_ringing, of)) for of in (runs, holdouts))
        if any(a is not b for a, b in zip((*calm, *calm_held), (*runs, *holdouts), strict=True)):
            quiet = replace(problem, runs=calm)
            calm_seen = measured(quiet, fitted.evaluation.point, mass)
            knocks = _convincing(calm_seen, _held_out(fitted, quiet, mass, calm_held), mass)
    if knocks is not None:
        return _told_by_blows(knocks, middle, before)
    if not scan:
        return None
    along = Along(*seen, mass)
    part, gain = likeliest(along, middle, spread_of(problem))
    likely = gain.nats > AHEAD and any(part.leaves_its_stop(run.motion) for run in seen[1].runs)
    again = Along(*held, mass, fixed=True).gain(part) if likely and held is not None else None
    if again is None or again.nats < CONFIRMED:
        return None
    rivals = screen(*seen, catalogue(problem), mass)
    if rivals and gain.nats < rivals[0].gain + AHEAD:
        return None
    between = any(part.to_either_side(run.motion) for run in seen[1].runs)
    return _told(part, between, gain, again, before)


#: A problem about its measured motion (measured.py); None where that cannot be followed.
Measured = tuple[Problem, Evaluation] | None


def _convincing(seen: Measured, held: Measured, mass: float) -> Knocks | None:
    """What knocks in fitted and held-out runs, where its blows' times convince. mass: kg, of the body."""
    knocks = None if seen is None or held is None else knocking(seen, held)
    if knocks is None or knocks.confirmed <= 0.0 or knocks.timed <= CONFIRMED:
        return None
    return knocks if knocks.mass < FARTHEST * LIKELY * mass else None


def _held_out(fitted: Fitted, problem: Problem, mass: float, runs: tuple[Run, ...]) -> Measured:
    """Held-out ``runs`` about their measured motion; None where there is none that can be followed."""
    if not fitted.holdouts:
        return None
    point = fitted.evaluation.point
    held = replace(problem, runs=runs, rests=())
    starts = tuple(run.motion.state(0) for run in fitted.holdouts)
    return measured(held, Point(point.theta, starts, ()), mass)


def _told_by_blows(knocks: Knocks, middle: Array, before: float | None) -> Finding:
    """The finding in words and numbers. middle: (3,) m, about where on its line the part may be."""
    line = knocks.line
    at = line.at + (middle @ line.along) * line.along
    quantities = {"mass": (knocks.mass, knocks.std, "kg")}
    stops = "one stop"
    if knocks.travel is not None:
        quantities["travel"] = knocks.travel, knocks.travel_std, "m"
        stops = f"its stops {1e3 * knocks.travel:.0f} mm to either side"
    across = " and ".join(f"{a} = {v:.2f} m" for a, v in zip(AXES, line.at, strict=True) if a != line.axis)
    text = (
        f"Something slides along {_direction(line)} and knocks at {stops}: {knocks.blows} blows of one line "
        f"of action, through {across}, by a part of {with_interval(knocks.mass, knocks.std, 'kg')}. Each "
        "comes when and as hard as a part would that the one before left at a stop "
        f"({knocks.timed:.0f} nats, of which {knocks.confirmed:.0f} from blows that nothing was fitted to). "
        "The blows themselves are not followed to the noise. Find it by ear, and fix it or take it out."
    )
    where: dict[str, object] = {"channel": None, "axis": line.axis, "position": [float(v) for v in at]}
    where["direction"] = [float(v) for v in line.along]
    return Finding("loose_mass", where, written(quantities), _evidence(knocks.gain, before), text)


def _direction(line: Line) -> str:
    """A line's direction in words: a body axis where it is one."""
    if np.max(np.abs(line.along)) > np.cos(ASLANT):
        return line.axis
    return "(" + ", ".join(f"{v:.2f}" for v in line.along) + ") of the body"


def _told(part: Loose, between: bool, gain: Gain, again: Gain, before: float | None) -> Finding:
    """The finding in words and numbers.

    between: it hits both stops. again: the gain in held-out runs, which tell the mass once more.
    """
    std = max(float(np.hypot(gain.std, gain.mass - again.mass)), WEIGHED * gain.mass)
    quantities = {"mass": (gain.mass, std, "kg")}
    stops = "a stop"
    if between:
        quantities["travel"] = part.travel, TIMED * part.travel, "m"
        stops = f"its stops {1e3 * part.travel:.0f} mm to either side"
    told = f"{with_interval(gain.mass, std, 'kg')} of it or more (blows timed a little off look lighter)"
    text = (
        f"Something slides along {part.axis} and hits {stops}: "
        f"{told}. Nothing else of the catalogue takes as much of the missing wrench away, and where "
        f"nothing was fitted it does so too ({gain.nats:.0f} and {again.nats:.0f} nats). The blows "
        "themselves are not followed to the noise. Find it by ear, and fix it or take it out."
    )
    where: dict[str, object] = {"channel": None, "axis": part.axis, "position": [float(v) for v in part.at]}
    return Finding("loose_mass", where, written(quantities), _evidence(gain.nats, before), text)


def _evidence(gain: float, before: float | None) -> dict[str, float | None]:
    return {"log_likelihood_gain": gain, "holdout_error_before": before, "holdout_error_after": None}
